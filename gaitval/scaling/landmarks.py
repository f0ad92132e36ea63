"""Anatomical landmarks of a standing person: which exist, which are needed, and what is wrong.

Axes REP-103 (x forward, y left, z up), metres, floor at z = 0. `joint_centres` says what replaces a
landmark without a marker.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import TypedDict

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import ScalingError
from gaitval.units import ANKLE_WIDTH, ELBOW_WIDTH, KNEE_WIDTH, REACH, from_middle, looks_like

Place = Sequence[float] | Array

LANDMARKS = ("ASIS", "PSIS", "Knee", "Knee.Medial", "Ankle", "Ankle.Medial", "Heel", "MT1", "MT5")
"""Landmarks on each side from which the legs are measured: spines of the pelvis, lateral and medial
femoral epicondyles and malleoli, heel, first and fifth metatarsal heads."""

LANDMARK_NAMES = (
    *(f"{side}.{name}" for side in "RL" for name in LANDMARKS),
    "Sacrum",
    *("R.Crest", "L.Crest"),
    *(
        f"{side}.{name}"
        for side in "RL"
        for name in (
            *("Thigh", "Shank", "Knee.Axis", "MT2", "Toe", "Acromion", "Elbow", "Elbow.Medial"),
            *("Wrist", "Wrist.Radial", "Wrist.Ulnar"),
        )
    ),
)
"""All landmarks that a marker can be on. Thigh and Shank are the wand markers of Plug-in Gait,
which lie in the frontal plane of the segment; Knee.Axis is the end of an alignment device on the
knee's axis; the crests replace an ASIS without a marker (`markers.spines`); Toe is any marker
beyond the metatarsal heads, Wrist a single marker on the wrist."""

WIDTHS = {"knee_width": KNEE_WIDTH, "ankle_width": ANKLE_WIDTH, "elbow_width": ELBOW_WIDTH}
"""Across the epicondyles and malleoli."""

Width = float | tuple[float, float] | None
"""Width of a joint, m: of both sides, of the right and the left side, or not known."""


class Widths(TypedDict, total=False):
    """Widths of the joints, and by which regression hips are found (`hip_regression`), as keyword
    arguments.
    """

    knee_width: Width
    ankle_width: Width
    elbow_width: Width
    hip_regression: str


def width_of(width: Width, side: str) -> float | None:
    """The width of one side, "R" or "L"."""
    return width["RL".index(side)] if isinstance(width, tuple) else width


def unit_vector(vector: Array) -> Array:
    """A vector (3,) scaled to length 1."""
    return np.asarray(vector / np.linalg.norm(vector))


def _fail(problem: str, names: Iterable[str], advice: str) -> None:
    listed = ", ".join(names)
    if listed:
        raise ScalingError(f"{problem}: {listed}. {advice}")


def check_widths(*given: Width) -> None:
    """Refuse widths of knee, ankle and elbow (m, in this order) that no person has."""
    problems = []
    widths = [
        (name, quantity, width_of(width, side))
        for (name, quantity), width in zip(WIDTHS.items(), given, strict=True)
        for side in ("RL" if isinstance(width, tuple) else "R")
    ]
    for name, quantity, width in widths:
        if width is not None and not quantity.fits(width):
            problems.append(
                f"{_option(name)} {width:g} (plausible: {quantity.low:g} to {quantity.high:g} m)"
            )
    _fail("implausible width of a joint", problems, "Measure it across the bones, in metres.")


def _option(name: str) -> str:
    """The command-line option of a width."""
    return f"--{name.replace('_', '-')}"


def landmarks_of(
    markers: Mapping[str, Place], knee_width: Width, ankle_width: Width
) -> dict[str, Array]:
    """The landmarks that have a marker in `markers`, (3,) m each; refuses a trial that lacks a
    required one. `knee_width` and `ankle_width` (m) replace the medial markers of a joint.
    """
    needed = _needed(markers, knee_width, ankle_width)
    missing = [name for name in needed if name not in markers]
    without_medial = [name for name in missing if not name.endswith(".Medial")]
    _fail(
        "markers missing from the standing pose",
        missing,
        (
            "The leg's joint centres cannot be found without them; use a standing trial (--static) "
            "with all of: " + ", ".join(needed) + "."
            if without_medial
            else "Medial markers are often taken off for the walk: give the standing trial that "
            "has them (--static), or the width of the joint, across the bones, in metres: "
            + " and ".join(
                _option(f"{joint.lower()}_width")
                for joint in ("Knee", "Ankle")
                if any(joint in name for name in missing)
            )
            + " of gaitval import."
        ),
    )
    used = [*needed, *(n for n in LANDMARK_NAMES if n in markers and n not in needed)]
    _fail(
        "markers that are not three numbers",
        [name for name in used if np.shape(markers[name]) != (3,)],
        "A marker is x, y, z in metres.",
    )
    points = {name: np.asarray(markers[name], dtype=np.float64) for name in used}
    _fail(
        "markers without a finite position (gaps in the standing trial)",
        [name for name in needed if not np.isfinite(points[name]).all()],
        "Use a frame in which every marker was seen.",
    )
    points = {name: point for name, point in points.items() if np.isfinite(point).all()}
    away = from_middle(np.array(list(points.values())))
    _fail(
        f"markers more than {REACH.high:g} m from the middle of the person",
        [name for name, distance in zip(points, away, strict=True) if distance > REACH.high],
        f"Correct their places, or the unit{looks_like(2.0 * float(np.median(away)))}.",
    )
    return points


def _needed(markers: Mapping[str, Place], knee_width: Width, ankle_width: Width) -> list[str]:
    """Landmarks that nothing else can replace."""
    needed = [f"{side}.{name}" for side in "RL" for name in LANDMARKS]
    replaced: set[str] = set()
    if "Sacrum" in markers:
        replaced.update(n for n in ("R.PSIS", "L.PSIS") if n not in markers)
    for side in "RL":
        if knee_width is not None:
            replaced.add(f"{side}.Knee.Medial")
        if ankle_width is not None:
            replaced.add(f"{side}.Ankle.Medial")
        first, second, fifth = (f"{side}.{name}" for name in ("MT1", "MT2", "MT5"))
        if fifth in markers or second in markers:
            replaced.add(first)
        if second in markers and (first not in markers or not {"R.MT5", "L.MT5"} & set(markers)):
            replaced.add(fifth)
    return [name for name in needed if name in markers or name not in replaced]


def check_upright(points: Mapping[str, Array]) -> None:
    """Refuse a person who is not upright along z: `points`, (3,) m by landmark."""
    chain = ("ASIS", "Knee", "Ankle")
    problems = [
        f"{side}.{lower} ({points[f'{side}.{lower}'][2]:.3f} m) not below "
        f"{side}.{upper} ({points[f'{side}.{upper}'][2]:.3f} m)"
        for side in "RL"
        for upper, lower in pairwise(chain)
        if points[f"{side}.{lower}"][2] >= points[f"{side}.{upper}"][2]
    ]
    _fail(
        "the standing trial is not upright",
        problems,
        "z must point up (axes x forward, y left, z up); check the conversion of the axes.",
    )


def middle_psis(points: Mapping[str, Array]) -> Array:
    """Middle of the PSIS of `points`, or the sacrum marker, (3,) m."""
    if "R.PSIS" in points and "L.PSIS" in points:
        return np.asarray((points["R.PSIS"] + points["L.PSIS"]) / 2)
    return points["Sacrum"]


def heading_of(points: Mapping[str, Array]) -> Array:
    """Rotation (3, 3) about z that takes x to where the pelvis of `points` faces."""
    forward = points["R.ASIS"] + points["L.ASIS"]
    if "R.PSIS" in points and "L.PSIS" in points:
        forward = forward - points["R.PSIS"] - points["L.PSIS"]
    else:
        forward = forward - 2 * points["Sacrum"]
    x = unit_vector(np.array([forward[0], forward[1], 0.0]))
    z = np.array([0.0, 0.0, 1.0])
    return np.column_stack([x, np.cross(z, x), z])


def check_sides(points: Mapping[str, Array]) -> None:
    """Refuse swapped sides of `points`, in axes in which the person faces x."""
    # Hands may be folded.
    paired = [name[2:] for name in LANDMARK_NAMES if name[:2] == "R." and "Wrist" not in name]
    _fail(
        "left and right markers look swapped (the left one is on the right)",
        [
            name
            for name in paired
            if {f"R.{name}", f"L.{name}"} <= points.keys()
            and points[f"L.{name}"][1] <= points[f"R.{name}"][1]
        ],
        "y must point to the left of the person (forward is from the PSIS to the ASIS); check "
        "the conversion of the axes and the names of the markers.",
    )
    swapped = [
        f"{side}.{medial} and {side}.{lateral}"
        for side, sign in (("R", 1.0), ("L", -1.0))
        for lateral, medial in (("Knee", "Knee.Medial"), ("Ankle", "Ankle.Medial"), ("MT5", "MT1"))
        if {f"{side}.{medial}", f"{side}.{lateral}"} <= points.keys()
        and sign * (points[f"{side}.{medial}"][1] - points[f"{side}.{lateral}"][1]) <= 0
    ]
    _fail(
        "medial and lateral markers look swapped",
        swapped,
        "Knee, Ankle and MT5 are the lateral ones; check the names of the markers.",
    )
    _fail(
        "the heel is in front of the toes",
        [
            f"{side}.Heel and {side}.{toe}"
            for side in "RL"
            for toe in [next(n for n in ("MT1", "MT5", "MT2") if f"{side}.{n}" in points)]
            if points[f"{side}.Heel"][0] >= points[f"{side}.{toe}"][0]
        ],
        "Check the names of the markers.",
    )
