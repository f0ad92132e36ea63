"""The lengths of a body: what scaling builds the model from, and how they are stored.

Metres and radians. A standing trial gives them (`joint_centres.measure`), a tape measure
(`tape.measure_by_tape`), or a fit to standing and walking (`with_fitted_lengths`).
"""

from collections.abc import Callable, Mapping
from dataclasses import field, fields, replace
from typing import Annotated, Any, Final

import numpy as np
from pydantic import ConfigDict, Field, PlainSerializer, PlainValidator, TypeAdapter
from pydantic.dataclasses import dataclass

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ScalingError

BALL_TO_FOOT_LENGTH = 0.74
"""Heel to first metatarsal head, divided by heel to toe tip: mean ball-of-foot length 194.8 mm over
mean foot length 263.0 mm of the 6,068 men and women of ANSUR II (Gordon et al. 2014)."""

_FITTED: Final = (
    *("hip_half_width", "shoulder_half_width", "hip_forward", "hip_up"),
    *("lumbar_forward", "lumbar_up", "shoulder_up"),
)
_CONFIGURATION: Final = ConfigDict(extra="forbid", allow_inf_nan=False)


def _points(*shape: int) -> Callable[[Any], Array]:
    def array(value: Any) -> Array:
        found = np.asarray(value, dtype=np.float64)
        if found.shape != shape or not np.isfinite(found).all():
            raise ValueError
        return found

    return array


_Serial: Final = PlainSerializer(lambda array: array.tolist())
Mass = Annotated[float, Field(gt=0.0)] | None
"""kg, or None where de Leva's share of the body's mass is taken."""


@dataclass(frozen=True, config=_CONFIGURATION)
class Limbs:
    """Leg and arm of one side: lengths m, masses kg. Points are in the foot's frame: origin at the
    ankle joint, sole level, x from the heel to the middle of the metatarsal heads, and y towards
    the midline of the body for both legs, so that left and right are comparable.

    Attributes
    ----------
    thigh, shank : distances between joint centres.
    ankle_height : ankle joint above the floor.
    heel : (3,) rearmost point of the heel, below the marker.
    metatarsals : (2, 3) markers on the first and fifth metatarsal heads.
    foot : heel to toe tip, or None for that of the heel and the metatarsal heads.
    upper_arm, forearm : distances between joint centres; None if not measured (then de Leva's
        means).
    thigh_mass, shank_mass, foot_mass, upper_arm_mass, forearm_mass, hand_mass : None if not known.
    """

    thigh: float
    shank: float
    ankle_height: float
    heel: Annotated[Array, PlainValidator(_points(3)), _Serial]
    metatarsals: Annotated[Array, PlainValidator(_points(2, 3)), _Serial]
    foot: float | None = None
    upper_arm: float | None = None
    forearm: float | None = None
    thigh_mass: Mass = None
    shank_mass: Mass = None
    foot_mass: Mass = None
    upper_arm_mass: Mass = None
    forearm_mass: Mass = None
    hand_mass: Mass = None

    @property
    def foot_length(self) -> float:
        """Heel to toe tip, m: as measured, else from the heel to the first metatarsal head."""
        if self.foot is not None:
            return self.foot
        return float(self.metatarsals[0, 0] - self.heel[0]) / BALL_TO_FOOT_LENGTH

    def length(self, segment: str) -> float | None:
        """Length of a segment by its name in the scaling table, m; None where not measured."""
        if segment == "foot":
            return self.foot_length
        length: float | None = getattr(self, LENGTH_FIELDS[segment], None)
        return length

    def mean_with(self, other: "Limbs") -> "Limbs":
        """Leg and arm with the mean of this side's and the other side's lengths and masses."""
        means: dict[str, Any] = {
            name: None if value is None else (value + getattr(other, name)) / 2
            for name, value in vars(self).items()
            if name in LIMB_FIELDS
        }
        return Limbs(**means | {"foot": (self.foot_length + other.foot_length) / 2})


LENGTH_FIELDS: Final = {
    **{name: name.replace(" ", "_") for name in ("thigh", "shank", "ankle height", "upper arm")},
    **{"foot": "heel", "forearm": "forearm", "hand": "hand"},
}
"""Rows of the scaling table -> the field of `Limbs` that they are measured by; a hand has none."""
LIMB_FIELDS: Final = tuple(each.name for each in fields(Limbs))
UNLIKE_LEGS: Final = 1.05
"""Of thigh, shank and foot alike, from which on one leg is longer than the other: a misplaced
marker changes one or two of them. In twelve children (McGill) they differ by 1.9, 2.1 and 2.2 %
(SD), and all three in one direction by 0.7 % at most."""
HEADS: Final = ("first_metatarsal", "fifth_metatarsal")
"""How the rows of `Limbs.metatarsals` are called in a file."""


@dataclass(frozen=True, config=_CONFIGURATION)
class Measurements:
    """The lengths of a body, from a standing trial, a fit to trials or a tape measure.

    Attributes
    ----------
    right, left : legs and arms, as measured.
    hip_half_width : hip joint centre to the midline, m.
    hip_height : middle of the hip joint centres above the floor, m.
    pelvic_tilt : forward tilt of the plane of the ASIS and PSIS in standing, rad.
    shoulder_half_width : shoulder joint centre to the midline, m, or None.
    shoulder_height : middle of the shoulder joint centres above that of the hips, m, or None.
    hip_forward, hip_up : offset of the hips from where the landmarks put them in the pelvis, m, in
        the pelvis' axes; None for zero. Only a fit to movement can find it.
    lumbar_forward, lumbar_up : position of the lumbar joint relative to where the landmarks put the
        middle of the hips, m, in the pelvis' axes, or None (then above it in standing, after de
        Leva).
    shoulder_up : shoulder joints above the lumbar joint in the trunk, m, or None; overrides
        `shoulder_height`.
    sources : what was measured (a row of the scaling table) -> how, if not by "markers".
    one_sided : fields of `Limbs` that were measured on this side only; the other side has the same.
    symmetric : both sides of the model are the mean of right and left (`scaling.symmetric`).
    """

    right: Limbs
    left: Limbs
    hip_half_width: float
    hip_height: float
    pelvic_tilt: float
    shoulder_half_width: float | None = None
    shoulder_height: float | None = None
    hip_forward: float | None = None
    hip_up: float | None = None
    lumbar_forward: float | None = None
    lumbar_up: float | None = None
    shoulder_up: float | None = None
    sources: Mapping[str, str] = field(default_factory=dict)
    one_sided: Mapping[str, Side] = field(default_factory=dict)
    symmetric: bool = True

    @property
    def modelled(self) -> dict[Side, Limbs]:
        """Legs and arms of the model: the mean of both sides, or each side's own."""
        if self.symmetric:
            return dict.fromkeys(SIDES, self.right.mean_with(self.left))
        return {"right": self.right, "left": self.left}

    @property
    def longer_leg(self) -> float:
        """By what the right thigh, shank and foot are all longer than the left ones, as a factor;
        below 1 if they are shorter, 1 if they are not alike in that.
        """
        right, left = self.right, self.left
        ratios = (
            right.thigh / left.thigh,
            right.shank / left.shank,
            right.foot_length / left.foot_length,
        )
        return float(max(min(ratios), 1.0) * min(max(ratios), 1.0))

    @property
    def legs_differ(self) -> bool:
        """Whether one leg is longer than the other in every length."""
        return not 1.0 / UNLIKE_LEGS <= self.longer_leg <= UNLIKE_LEGS

    @property
    def masses_differ(self) -> bool:
        """Whether a segment's mass is given, and is not the same on both sides."""
        names = [name for name in LIMB_FIELDS if name.endswith("_mass")]
        return any(getattr(self.right, name) != getattr(self.left, name) for name in names)

    def to_dict(self) -> dict[str, object]:
        """Numbers, lists of numbers and texts for TOML, m, kg and rad; what was not measured is
        left out. `stored_measurements.measurements_from` reads them back.
        """
        stored: dict[str, object] = {}
        shared: dict[str, Any] = ADAPTER.dump_python(
            self, exclude={"one_sided", "symmetric"}, exclude_none=True
        )
        for side in SIDES:
            for name, value in shared.pop(side).items():
                if self.one_sided.get(name, side) != side:
                    continue
                if name == "metatarsals":
                    stored |= {f"{h}_{side}": at for h, at in zip(HEADS, value, strict=True)}
                else:
                    stored[f"{name}_{side}"] = value
        sources: Mapping[str, str] = shared.pop("sources")
        return stored | shared | ({"sources": dict(sources)} if sources else {})


ADAPTER: Final = TypeAdapter(Measurements)


def with_fitted_lengths(
    measured: Measurements, fitted: Mapping[str, float], source: str = "fitted to the trials"
) -> Measurements:
    """The measurements with the lengths that a fit found; a symmetric body has them on both sides.

    `build_body` of the result gives the joints of the fitted model; its trunk fills the stature
    above the fitted hips.

    Parameters
    ----------
    measured : what the fit started from.
    fitted : m, means of both sides; any of thigh, shank, upper_arm, hip_half_width,
        shoulder_half_width, and the fields `hip_forward` to `shoulder_up` of `Measurements`
        (`kinetics.inverse.segment_lengths.LENGTH_SD`).
    source : how they were found, for the scaling table.

    Raises
    ------
    ScalingError : a length has another name.
    """
    sides = {"thigh", "shank", "upper_arm"}
    unknown = [name for name in fitted if name not in sides and name not in _FITTED]
    if unknown:
        raise ScalingError(
            f"lengths that cannot be fitted: {', '.join(unknown)}. The known ones are "
            f"{', '.join(sorted({*sides, *_FITTED}))}."
        )
    limbs = {name: float(fitted[name]) for name in sorted(sides & fitted.keys())}
    shared: dict[str, Any] = {name: float(fitted[name]) for name in _FITTED if name in fitted}
    # Hips that the fit moved up in the pelvis are higher above the floor in the neutral pose too.
    shared["hip_height"] = measured.hip_height + float(fitted.get("hip_up", 0.0))
    return replace(
        measured,
        right=_fitted(measured, measured.right, limbs),
        left=_fitted(measured, measured.left, limbs),
        sources={**measured.sources, **{name.replace("_", " "): source for name in limbs}},
        **shared,
    )


def _fitted(measured: Measurements, limbs: Limbs, means: Mapping[str, float]) -> Limbs:
    """One side with the mean lengths of both; sides that differ in the model keep their ratio."""
    mean = measured.right.mean_with(measured.left)
    changes: dict[str, Any] = dict(means)
    for name, length in means.items():
        before = getattr(mean, name)
        if not measured.symmetric and before is not None:
            changes[name] = length * (getattr(limbs, name) / before)
    return replace(limbs, **changes)
