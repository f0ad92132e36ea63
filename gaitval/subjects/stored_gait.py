"""The mean gait of a subject's file: the curves of both sides, or of the one that was recorded."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Annotated, Final, Self

import numpy as np
from pydantic import Field, Strict, ValidationInfo, field_validator, model_validator

from gaitval.coordinates import SIDES, Side, opposite
from gaitval.gait.mean_curves import TOLERANCES
from gaitval.gait.record import (
    ANGLE_NAMES,
    MOMENT_NAMES,
    REQUIRED_ANGLES,
    REQUIRED_MOMENTS,
    FiniteNumber,
    FittedCurve,
    Force,
    MeanSteps,
    Mirrored,
    OneSide,
    PeriodicCurve,
    StoredPart,
    fit_periodic,
)

_ACROSS: Final = (1.0, -1.0, 1.0)
"""What a mirror does to a force forward, left, up."""


def keys_problems(seen: Iterable[str], known: Sequence[str]) -> list[str]:
    """One sentence for every key of `seen` that is not `known`, with the nearest match."""
    problems = []
    for key in seen:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            problems.append(f"{key}: unknown key" + (f", did you mean {near[0]}?" if near else "."))
    return problems


def _complete(
    seen: Iterable[str], known: Sequence[str], required: Sequence[str], without: Side | None
) -> None:
    """Refuse unknown, missing and contradictory curves; `without` is a side not recorded."""
    seen = list(seen)
    problems = keys_problems(seen, known)
    suffix = "" if without is None else f"_{without[0]}"
    missing = [key for key in required if key not in seen and not (suffix and key.endswith(suffix))]
    if missing:
        problems.append(f"missing: {', '.join(missing)}.")
    both = [key for key in seen if suffix and key.endswith(suffix)]
    if both:
        problems.append(f"{', '.join(both)}: there, but `not_recorded` names the {without} side.")
    if problems:
        raise ValueError(" ".join(problems))


class Forces(StoredPart):
    """Ground reaction of the feet; None of one that was not recorded."""

    right: Force | None = None
    left: Force | None = None

    def of(self, side: Side) -> Force | None:
        """That of one foot."""
        return self.right if side == "right" else self.left


class Gait(StoredPart):
    """Mean gait curves in the convention of `GaitRecord`."""

    samples: Annotated[int, Strict(), Field(gt=0, le=10**9)]
    """Samples of a gait cycle in the source, first and last included."""
    not_recorded: OneSide = Field(default_factory=dict)
    """The side of which no trial shows a whole cycle that counts, of the angles and of moments and
    forces. It has no curves here; `origin` of the subject calls them expected."""
    mirrored: Mirrored = Field(default_factory=dict)
    angles: dict[str, FittedCurve]
    moments: dict[str, FittedCurve] = Field(default_factory=dict)
    forces: Forces | None = None
    """Moments and forces are both there, or neither: not everybody has force plates."""
    total_force: Force | None = None
    """On both feet together, over the right side's cycle: what the motion of the centre of mass
    needs, by markers alone. None if that is not known."""
    steps: MeanSteps | None = None
    """None if they were not measured, or not on both sides."""

    @field_validator("angles", "moments")
    @classmethod
    def _curves_complete(
        cls, curves: dict[str, FittedCurve], info: ValidationInfo
    ) -> dict[str, FittedCurve]:
        not_recorded = info.data.get("not_recorded", {})
        if info.field_name == "angles":
            _complete(curves, ANGLE_NAMES, REQUIRED_ANGLES, not_recorded.get("angles"))
        elif curves:
            _complete(curves, MOMENT_NAMES, REQUIRED_MOMENTS, not_recorded.get("kinetics"))
        return curves

    @field_validator("forces")
    @classmethod
    def _forces_complete(cls, forces: Forces | None, info: ValidationInfo) -> Forces | None:
        if forces is not None:
            without = info.data.get("not_recorded", {}).get("kinetics")
            there = [side for side in SIDES if forces.of(side) is not None]
            wanted = [side for side in SIDES if side != without]
            _complete(there, SIDES, wanted, None)
            if there != wanted:
                raise ValueError(f"{without}: there, but `not_recorded` names the {without} side.")
        return forces

    @model_validator(mode="after")
    def _both_or_none(self) -> Self:
        if bool(self.moments) != (self.forces is not None):
            there, missing = ("moments", "forces") if self.moments else ("forces", "moments")
            raise ValueError(
                f"there are {there}, but no {missing}. Give both, or leave both out; the walk's "
                "are then predicted."
            )
        unseen = self.not_recorded.get("angles")
        if unseen is not None and self.moments and self.not_recorded.get("kinetics") != unseen:
            raise ValueError(
                f"not_recorded: without angles of the {unseen} side its moments are not known "
                f'either. Write not_recorded = {{ angles = "{unseen}", kinetics = "{unseen}" }}.'
            )
        return self

    def has_curves_of(self, other: "Gait") -> bool:
        """Whether `other` has the same joint angles to a hundredth of a degree."""
        phase = np.arange(100) / 100
        own, others = self.angles_of_both(), other.angles_of_both()
        return all(
            np.abs(own[name](phase) - others[name](phase)).max() < np.radians(0.01)
            for name in REQUIRED_ANGLES
        )

    def angles_of_both(self) -> dict[str, PeriodicCurve]:
        """The angles, rad; those of a side not recorded are the other side's (`GaitRecord`'s signs
        are the same on both sides).
        """
        return _of_both(self.angles, self.not_recorded.get("angles"))

    def moments_of_both(self) -> dict[str, PeriodicCurve]:
        """The moments, Nm/kg, likewise."""
        return _of_both(self.moments, self.not_recorded.get("kinetics"))

    def forces_of_both(
        self, stance: Mapping[Side, float]
    ) -> dict[Side, tuple[PeriodicCurve, PeriodicCurve, PeriodicCurve]]:
        """The ground reaction of both feet, body weights; that of a side not recorded is the other
        side's, mirrored, over that side's own stance fraction in `stance`.
        """
        found = {}
        for side in SIDES:
            force = None if self.forces is None else self.forces.of(side)
            if force is not None:
                found[side] = (force.forward.periodic(), force.left.periodic(), force.up.periodic())
        for hidden in [side for side in SIDES if side not in found]:
            shown = opposite(hidden)
            forward, left, up = (
                stretched(curve, sign, stance[shown], stance[hidden])
                for curve, sign in zip(found[shown], _ACROSS, strict=True)
            )
            found[hidden] = (forward, left, up)
        return {side: found[side] for side in SIDES}


def _of_both(curves: Mapping[str, FittedCurve], hidden: Side | None) -> dict[str, PeriodicCurve]:
    found = {name: curve.periodic() for name, curve in curves.items()}
    if hidden is None:
        return found
    return found | {f"{name[:-2]}_{hidden[0]}": curve for name, curve in found.items()}


class StanceFraction(StoredPart):
    """Fraction of each side's own cycle on the ground; None of a side that was not recorded."""

    right: FiniteNumber | None = None
    left: FiniteNumber | None = None
    mirrored: Side | None = None
    """The side whose value is the other side's, as its curves are (`Gait.mirrored`)."""

    @model_validator(mode="after")
    def _one_at_least(self) -> Self:
        if self.right is None and self.left is None:
            raise ValueError("right, left: missing. Add them.")
        return self

    def of(self, side: Side) -> float | None:
        """That of one side."""
        return self.right if side == "right" else self.left

    def of_both(self) -> dict[Side, float]:
        """Of both sides; that of a side not recorded is the other side's."""
        known = [value for value in (self.right, self.left) if value is not None]
        right = known[0] if self.right is None else self.right
        left = known[0] if self.left is None else self.left
        return {"right": right, "left": left}


@cache
def stretched(curve: PeriodicCurve, sign: float, shown: float, hidden: float) -> PeriodicCurve:
    """A `curve` of stance over the fraction `shown`, times a `sign`, over the fraction `hidden`."""
    if abs(shown - hidden) < 1e-9:
        return PeriodicCurve(
            sign * curve.mean,
            tuple(sign * value for value in curve.cosine),
            tuple(sign * value for value in curve.sine),
        )
    # As `mean_curves.fit_force` fits a force: in stance, and at the next heel strike.
    rows = np.append(np.arange(int(hidden * 100) + 1), 100) / 100
    values = sign * curve(np.where(rows < 1.0, rows * shown / hidden, 0.0))
    return fit_periodic(rows, values, TOLERANCES.force_tolerance)[0]
