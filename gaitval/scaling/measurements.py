"""The lengths of a body: what scaling builds the model from, and how they are stored.

Metres and radians. A standing trial gives them (`joint_centres.measure`), a tape measure
(`tape.measure_by_tape`), a mean body scaled by pairs (`scale_factors.scale_by_pairs`), or a fit to
standing and walking (`with_fitted_lengths`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import ScalingError

BALL_TO_FOOT_LENGTH = 0.74
"""Heel to first metatarsal head, divided by heel to toe tip: mean ball-of-foot length 194.8 mm over
mean foot length 263.0 mm of the 6,068 men and women of ANSUR II (Gordon et al. 2014)."""

_FITTED = ("hip_forward", "hip_up", "lumbar_forward", "lumbar_up", "shoulder_up")
_SHARED = (
    *("hip_half_width", "hip_height", "pelvic_tilt", "shoulder_half_width", "shoulder_height"),
    *_FITTED,
)
_ARMS = ("upper_arm", "forearm")
_OPTIONAL = (*_ARMS, "shoulder", *_FITTED)
_STORED: dict[str, tuple[int, ...]] = {
    **{
        f"{name}_{side}": (3,) if name in ("heel", "first_metatarsal", "fifth_metatarsal") else ()
        for side in ("right", "left")
        for name in (
            *("thigh", "shank", "ankle_height", "heel", "first_metatarsal", "fifth_metatarsal"),
            *_ARMS,
        )
    },
    **{name: () for name in _SHARED},
}
"""Keys of `Measurements.to_dict` and the shape of each value."""


@dataclass(frozen=True)
class Leg:
    """Measured lengths of one leg, m. Points are in the foot's frame: origin at the ankle joint,
    sole level, x from the heel to the middle of the metatarsal heads, and y towards the midline of
    the body for both legs, so that left and right are comparable.

    Attributes
    ----------
    thigh, shank : distances between joint centres.
    ankle_height : ankle joint above the floor.
    heel : (3,) rearmost point of the heel, below the marker.
    metatarsals : (2, 3) markers on the first and fifth metatarsal heads.
    """

    thigh: float
    shank: float
    ankle_height: float
    heel: Array
    metatarsals: Array

    @property
    def foot_length(self) -> float:
        """Heel to toe tip, m, from the heel to the first metatarsal head."""
        return float(self.metatarsals[0, 0] - self.heel[0]) / BALL_TO_FOOT_LENGTH


@dataclass(frozen=True)
class Measurements:
    """The lengths of a body, from a standing trial, a fit to trials or a tape measure.

    Attributes
    ----------
    right, left : the legs.
    hip_half_width : hip joint centre to the midline, m.
    hip_height : middle of the hip joint centres above the floor, m.
    pelvic_tilt : forward tilt of the plane of the ASIS and PSIS in standing, rad.
    upper_arm, forearm : right and left length between joint centres, m; None if not measured (then
        de Leva's means).
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
    """

    right: Leg
    left: Leg
    hip_half_width: float
    hip_height: float
    pelvic_tilt: float
    upper_arm: tuple[float, float] | None = None
    forearm: tuple[float, float] | None = None
    shoulder_half_width: float | None = None
    shoulder_height: float | None = None
    hip_forward: float | None = None
    hip_up: float | None = None
    lumbar_forward: float | None = None
    lumbar_up: float | None = None
    shoulder_up: float | None = None
    sources: Mapping[str, str] = field(default_factory=dict)

    def to_dict(self) -> dict[str, object]:
        """Numbers, lists of numbers and texts for TOML, m and rad; what was not measured is left
        out. `from_dict` reads them back.
        """
        stored: dict[str, object] = {}
        for side in ("right", "left"):
            leg = getattr(self, side)
            for name in ("thigh", "shank", "ankle_height"):
                stored[f"{name}_{side}"] = float(getattr(leg, name))
            stored[f"heel_{side}"] = leg.heel.tolist()
            stored[f"first_metatarsal_{side}"] = leg.metatarsals[0].tolist()
            stored[f"fifth_metatarsal_{side}"] = leg.metatarsals[1].tolist()
        for name in _SHARED:
            value = getattr(self, name)
            if value is not None:
                stored[name] = float(value)
        for name in _ARMS:
            pair = getattr(self, name)
            if pair is not None:
                stored[f"{name}_right"], stored[f"{name}_left"] = map(float, pair)
        if self.sources:
            stored["sources"] = dict(self.sources)
        return stored

    @classmethod
    def from_dict(cls, stored: Mapping[str, object]) -> "Measurements":
        """What `to_dict` stored.

        Raises
        ------
        ScalingError : lists every key that is missing, unknown or not of the right shape.
        """
        problems = [f"{key}: unknown" for key in stored if key not in _STORED and key != "sources"]
        values: dict[str, Array] = {}
        for key, shape in _STORED.items():
            if key not in stored:
                if not key.startswith(_OPTIONAL):
                    problems.append(f"{key}: missing")
                continue
            try:
                value = np.asarray(stored[key], dtype=np.float64)
            except (TypeError, ValueError):
                value = np.array(np.nan)
            if value.shape != shape or not np.isfinite(value).all():
                what = "a number" if shape == () else "three numbers"
                problems.append(f"{key} = {stored[key]!r}: must be {what} in m (tilt in rad)")
            values[key] = value
        problems += [
            f"{name}: one side only"
            for name in _ARMS
            if (f"{name}_right" in values) != (f"{name}_left" in values)
        ]
        sources = stored.get("sources", {})
        if not isinstance(sources, Mapping):
            problems.append("sources: must be a table of texts")
            sources = {}
        if problems:
            raise ScalingError(
                "the measurements of the body cannot be used:\n  " + "\n  ".join(problems)
            )
        legs = [
            Leg(
                thigh=float(values[f"thigh_{side}"]),
                shank=float(values[f"shank_{side}"]),
                ankle_height=float(values[f"ankle_height_{side}"]),
                heel=values[f"heel_{side}"],
                metatarsals=np.stack(
                    [values[f"first_metatarsal_{side}"], values[f"fifth_metatarsal_{side}"]]
                ),
            )
            for side in ("right", "left")
        ]
        known = {name: float(value) for name, value in values.items() if value.shape == ()}
        return cls(
            right=legs[0],
            left=legs[1],
            hip_half_width=known["hip_half_width"],
            hip_height=known["hip_height"],
            pelvic_tilt=known["pelvic_tilt"],
            upper_arm=_both_sides(known, "upper_arm"),
            forearm=_both_sides(known, "forearm"),
            shoulder_half_width=known.get("shoulder_half_width"),
            shoulder_height=known.get("shoulder_height"),
            hip_forward=known.get("hip_forward"),
            hip_up=known.get("hip_up"),
            lumbar_forward=known.get("lumbar_forward"),
            lumbar_up=known.get("lumbar_up"),
            shoulder_up=known.get("shoulder_up"),
            sources={str(key): str(text) for key, text in sources.items()},
        )


def with_fitted_lengths(
    measured: Measurements, fitted: Mapping[str, float], source: str = "fitted to the trials"
) -> Measurements:
    """The measurements with the lengths that a fit found, the same on both sides.

    `build_body` of the result gives the joints of the fitted model; its trunk fills the stature
    above the fitted hips.

    Parameters
    ----------
    measured : what the fit began with.
    fitted : m; any of thigh, shank, upper_arm, hip_half_width, shoulder_half_width, and the fields
        `hip_forward` to `shoulder_up` of `Measurements` (`inverse.segment_lengths.LENGTH_SD`).
    source : how they were found, for the scaling table.

    Raises
    ------
    ScalingError : a length has another name.
    """
    sides, arms = {"thigh", "shank"}, {"upper_arm"}
    alone = {"hip_half_width", "shoulder_half_width", *_FITTED}
    unknown = [name for name in fitted if name not in sides | arms | alone]
    if unknown:
        raise ScalingError(
            f"lengths that cannot be fitted: {', '.join(unknown)}. The known ones are "
            f"{', '.join(sorted(sides | arms | alone))}."
        )
    legs: dict[str, Any] = {name: float(fitted[name]) for name in sorted(sides & fitted.keys())}
    shared: dict[str, Any] = {name: float(fitted[name]) for name in sorted(alone & fitted.keys())}
    shared |= {name: (float(fitted[name]),) * 2 for name in sorted(arms & fitted.keys())}
    shared["hip_height"] = measured.hip_height + float(fitted.get("hip_up", 0.0))
    return replace(
        measured,
        right=replace(measured.right, **legs),
        left=replace(measured.left, **legs),
        sources={
            **measured.sources,
            **{n.replace("_", " "): source for n in ("thigh", "shank", "upper_arm") if n in fitted},
        },
        **shared,
    )


def _both_sides(known: Mapping[str, float], name: str) -> tuple[float, float] | None:
    sides = f"{name}_right", f"{name}_left"
    return (known[sides[0]], known[sides[1]]) if sides[0] in known else None
