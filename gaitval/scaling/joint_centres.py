"""Joint centres and segment lengths from the markers of a standing trial.

Axes REP-103 (x forward, y left, z up), metres, floor at z = 0. Points go by anatomical landmark
(`LANDMARK_NAMES`), which a marker set gives its markers; the markers of the WBDS dataset are
named after them.

What a marker set lacks is found as follows.

| lacking | found from | after |
|---|---|---|
| PSIS | a marker on the sacrum between them | Kadaba et al. (1990) |
| medial knee, ankle | width, lateral marker, wand in the plane of the axis | Davis et al. (1991) |
| first metatarsal head | heel and fifth head, mean shape of 20 feet | `FOOT_SHAPE` |
| first and fifth head | heel and second head, mean shape of 20 feet | `FOOT_SHAPE` |
| shoulder joint | acromion, 17 % of the distance between the acromia below it | Rab et al. (2002) |
| medial elbow | width, lateral marker, axis perpendicular to the arm | geometry |
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import ScalingError
from gaitval.scaling.measurements import Leg, Measurements

Place = Sequence[float] | Array

LANDMARKS = (
    "ASIS",
    "PSIS",
    "Knee",
    "Knee.Medial",
    "Ankle",
    "Ankle.Medial",
    "Heel",
    "MT1",
    "MT5",
)
"""Landmarks of each side from which the legs are measured: spines of the pelvis, lateral and
medial femoral epicondyles and malleoli, heel, first and fifth metatarsal heads."""

LANDMARK_NAMES = (
    *(f"{side}.{name}" for side in "RL" for name in LANDMARKS),
    "Sacrum",
    *(
        f"{side}.{name}"
        for side in "RL"
        for name in (
            *("Thigh", "Shank", "MT2", "Toe", "Acromion", "Elbow", "Elbow.Medial"),
            *("Wrist", "Wrist.Radial", "Wrist.Ulnar"),
        )
    ),
)
"""All landmarks that a marker can be on. Thigh and Shank are the wand markers of Plug-in Gait,
which lie in the frontal plane of the segment; Toe is any marker beyond the metatarsal heads, and
Wrist a single marker on the wrist."""

LARGEST_COORDINATE = 20.0
"""A standing person is within this of the origin of the laboratory, m; beyond it the
markers are in millimetres."""

MARKER_OFFSET = 0.010
"""Assumed distance of a marker's centre from the skin, m."""

ACROMION_TO_SHOULDER = 0.17
"""Shoulder joint below the acromion, over the distance between the acromia (Rab et al. 2002,
Gait Posture 15:113-119). In the model of Rajagopal et al. (2016) it is 0.16."""

LARGEST_ELEVATION = 45.0
"""Elevation of the upper arm, degrees, up to which the acromia show where the shoulders are;
above it the girdle moves upwards and inwards."""

FOOT_SHAPE = {
    ("MT1", "MT5"): (1.0324, 0.4835, 0.0610),
    ("MT1", "MT2"): (1.0033, 0.1487, 0.0220),
    ("MT5", "MT2"): (0.8528, -0.2548, -0.0323),
}
"""A metatarsal head from the heel and another head: along the line from the heel marker to the
other one, to the medial side of it, and above the other one, in lengths of that line in the plane
of the floor. Means of the 20 feet of the ten built-in subjects (WBDS); 1 SD of the length is
3.5, 1.4 and 2.8 %, of the direction 1.5, 0.8 and 1.3 degrees."""

WIDTHS = {
    "knee_width": (0.06, 0.17),
    "ankle_width": (0.04, 0.12),
    "elbow_width": (0.04, 0.12),
}
"""Plausible widths across the epicondyles and malleoli, m."""


def hip_joint_centre(pelvic_width: float, pelvic_depth: float) -> Array:
    """Right hip joint centre from the middle of the ASIS, m, in the pelvis axes (x forward,
    y left, z up), shape (3,); mirror y for the left one.

    Parameters
    ----------
    pelvic_width : distance between the ASIS, m.
    pelvic_depth : distance between the middle of the ASIS and of the PSIS, m.

    Notes
    -----
    Harrington et al. (2007) J Biomech 40:595-602, the regressions on one variable, in mm:
    x = -0.24 PD - 9.9, up = -0.30 PW - 10.9, lateral = 0.33 PW + 7.3.
    """
    return np.array(
        [
            -0.24 * pelvic_depth - 0.0099,
            -(0.33 * pelvic_width + 0.0073),
            -0.30 * pelvic_width - 0.0109,
        ]
    )


def pelvis_frame(right_asis: Array, left_asis: Array, middle_psis: Array) -> Array:
    """Axes of the pelvis as columns (x forward, y left, z up), shape (3, 3): y along the
    ASIS, x in the plane of the ASIS and the middle of the PSIS (ISB, Wu et al. 2002).
    """
    y = _unit(left_asis - right_asis)
    forward = (right_asis + left_asis) / 2 - middle_psis
    z = _unit(np.cross(forward, y))
    return np.column_stack([np.cross(y, z), y, z])


def chord_centre(proximal: Array, lateral: Array, wand: Array, half_width: float) -> Array:
    """Joint centre from a lateral marker and the half width of the joint, m, shape (3,).

    The centre lies in the plane of the three points, on the other side of the line from
    `proximal` to `lateral` than `wand`, at `half_width` from `lateral`, and sees both at a right
    angle.

    Parameters
    ----------
    proximal : (3,) m, joint centre above.
    lateral : (3,) m, marker on the lateral epicondyle or malleolus.
    wand : (3,) m, any point of the plane of the joint's axis on the lateral side.
    half_width : from the marker's centre to the joint's, m.

    Notes
    -----
    The chord function of Plug-in Gait (Davis et al. 1991, Hum Mov Sci 10:575-587; Kadaba et al.
    1990, J Orthop Res 8:383-392) without its offset angles.
    """
    towards = proximal - lateral
    distance = float(np.linalg.norm(towards))
    along = towards / distance
    aside = (lateral - wand) - ((lateral - wand) @ along) * along
    share = half_width / distance
    return np.asarray(
        lateral + half_width * (share * along + np.sqrt(1.0 - share**2) * _unit(aside))
    )


def locate(
    markers: Mapping[str, Place],
    *,
    knee_width: float | None = None,
    ankle_width: float | None = None,
    elbow_width: float | None = None,
) -> dict[str, Array]:
    """Landmarks and joint centres of a standing person, (3,) m, in the axes of the markers.

    Parameters
    ----------
    markers : position of each landmark, (3,) m; see `measure`.
    knee_width, ankle_width, elbow_width : across the epicondyles and malleoli, m; for a side
        without a medial marker.

    Returns
    -------
    dict : the landmarks, those of the metatarsals found where they were lacking, `Mid.PSIS` and
        `R.` and `L.` `Hip.Centre`, `Knee.Centre`, `Ankle.Centre` and, where markers show them,
        `Shoulder.Centre`, `Elbow.Centre`, `Wrist.Centre`.

    Raises
    ------
    ScalingError : as `measure`.
    """
    heading, points = _standing(markers, knee_width, ankle_width, elbow_width)
    return {name: heading @ point for name, point in points.items()}


def measure(
    markers: Mapping[str, Place],
    *,
    knee_width: float | None = None,
    ankle_width: float | None = None,
    elbow_width: float | None = None,
) -> Measurements:
    """Joint centres, segment lengths and pelvic tilt of a standing person.

    Parameters
    ----------
    markers : position of each landmark, (3,) m, x forward, y left, z up, floor at z = 0. The
        person may stand anywhere and face anywhere. Names other than `LANDMARK_NAMES` are not
        used.
    knee_width, ankle_width, elbow_width : across the epicondyles and malleoli, m; for a side
        without a medial marker.

    Raises
    ------
    ScalingError : markers missing, not finite, in millimetres, upside down or swapped, or a
        width that is missing or not plausible; all problems of a kind are listed.
    """
    _, points = _standing(markers, knee_width, ankle_width, elbow_width)
    asis = points["R.ASIS"], points["L.ASIS"]
    frame = pelvis_frame(*asis, points["Mid.PSIS"])
    right_hip = _right_hip(points)
    hips = {"R": points["R.Hip.Centre"], "L": points["L.Hip.Centre"]}
    widths = {"knee": knee_width, "ankle": ankle_width}
    return Measurements(
        right=_leg(points, hips["R"], "R"),
        left=_leg(points, hips["L"], "L"),
        hip_half_width=float(-right_hip[1]),
        hip_height=float(hips["R"][2] + hips["L"][2]) / 2,
        pelvic_tilt=float(np.arcsin(-frame[2, 0])),
        **_arms(points),
        sources=_sources(markers, widths),
    )


def arms_hang(points: Mapping[str, Array]) -> bool:
    """Whether both upper arms are within `LARGEST_ELEVATION` of hanging, as far as points show.

    Parameters
    ----------
    points : from `locate`, z up.
    """
    for side in "RL":
        shoulder = points.get(f"{side}.Shoulder.Centre")
        elbow = points.get(f"{side}.Elbow.Centre", points.get(f"{side}.Elbow"))
        if shoulder is not None and elbow is not None:
            down = -_unit(elbow - shoulder)[2]
            if down < np.cos(np.radians(LARGEST_ELEVATION)):
                return False
    return True


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


def _fail(problem: str, names: Iterable[str], advice: str) -> None:
    listed = ", ".join(names)
    if listed:
        raise ScalingError(f"{problem}: {listed}. {advice}")


def _standing(
    markers: Mapping[str, Place],
    knee_width: float | None,
    ankle_width: float | None,
    elbow_width: float | None,
) -> tuple[Array, dict[str, Array]]:
    """Where the person faces, (3, 3) with x, y and z as columns, and all landmarks and joint
    centres in these axes.
    """
    _check_widths(knee_width, ankle_width, elbow_width)
    points = _points(markers, knee_width, ankle_width)
    _check_upright(points)
    heading = _heading(points)
    points = {name: heading.T @ point for name, point in points.items()}
    _check_sides(points)
    points["Mid.PSIS"] = _middle_psis(points)

    asis = points["R.ASIS"], points["L.ASIS"]
    middle_asis = (asis[0] + asis[1]) / 2
    frame = pelvis_frame(*asis, points["Mid.PSIS"])
    right_hip = _right_hip(points)
    mirror = np.array([1.0, -1.0, 1.0])
    points["R.Hip.Centre"] = middle_asis + frame @ right_hip
    points["L.Hip.Centre"] = middle_asis + frame @ (mirror * right_hip)
    for side in "RL":
        points.update(_metatarsals(points, side))
        for joint, above, wand, width in (
            ("Knee", "Hip.Centre", "Thigh", knee_width),
            ("Ankle", "Knee.Centre", "Shank", ankle_width),
        ):
            points[f"{side}.{joint}.Centre"] = _hinge(points, side, joint, above, wand, width)
    points.update(_arm_centres(points, elbow_width))
    return heading, points


def _right_hip(points: Mapping[str, Array]) -> Array:
    asis = points["R.ASIS"], points["L.ASIS"]
    middle_asis = (asis[0] + asis[1]) / 2
    return hip_joint_centre(
        float(np.linalg.norm(asis[1] - asis[0])),
        float(np.linalg.norm(middle_asis - points["Mid.PSIS"])),
    )


def _check_widths(*widths: float | None) -> None:
    problems = []
    for (name, (low, high)), width in zip(WIDTHS.items(), widths, strict=True):
        if width is not None and not low <= width <= high:
            hint = next(
                (
                    f" (this looks like {unit}: give {width * factor:g})"
                    for unit, factor in (("centimetres", 0.01), ("millimetres", 0.001))
                    if low <= width * factor <= high
                ),
                "",
            )
            problems.append(f"{_option(name)} {width:g}, plausible are {low:g} to {high:g} m{hint}")
    _fail("implausible width of a joint", problems, "Measure it across the bones, in metres.")


def _option(name: str) -> str:
    """A width as the command line names it."""
    return f"--{name.replace('_', '-')}"


def _points(
    markers: Mapping[str, Place], knee_width: float | None, ankle_width: float | None
) -> dict[str, Array]:
    needed = _needed(markers, knee_width, ankle_width)
    missing = [name for name in needed if name not in markers]
    without_medial = [name for name in missing if not name.endswith(".Medial")]
    _fail(
        "markers missing from the standing trial",
        missing,
        (
            "The leg's joint centres cannot be found without them; use a trial with all of: "
            + ", ".join(needed)
            + "."
            if without_medial
            else "Without the medial markers give the width of the joint, across the bones, in "
            "metres: "
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
    _fail(
        f"markers more than {LARGEST_COORDINATE:g} m from the laboratory's origin",
        [name for name, p in points.items() if np.abs(p).max() > LARGEST_COORDINATE],
        "They look like millimetres: divide by 1000.",
    )
    return points


def _needed(
    markers: Mapping[str, Place], knee_width: float | None, ankle_width: float | None
) -> list[str]:
    """Landmarks without which nothing else can take their place."""
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
        if second in markers and first not in markers:
            replaced.add(fifth)
    return [name for name in needed if name in markers or name not in replaced]


def _check_upright(points: Mapping[str, Array]) -> None:
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


def _middle_psis(points: Mapping[str, Array]) -> Array:
    if "R.PSIS" in points and "L.PSIS" in points:
        return np.asarray((points["R.PSIS"] + points["L.PSIS"]) / 2)
    return points["Sacrum"]


def _heading(points: Mapping[str, Array]) -> Array:
    """Rotation about z whose x is where the pelvis faces, columns as axes, shape (3, 3)."""
    forward = points["R.ASIS"] + points["L.ASIS"]
    if "R.PSIS" in points and "L.PSIS" in points:
        forward = forward - points["R.PSIS"] - points["L.PSIS"]
    else:
        forward = forward - 2 * points["Sacrum"]
    x = _unit(np.array([forward[0], forward[1], 0.0]))
    z = np.array([0.0, 0.0, 1.0])
    return np.column_stack([x, np.cross(z, x), z])


def _check_sides(points: Mapping[str, Array]) -> None:
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
        "y must point to the left of the person, forward being from the PSIS to the ASIS; "
        "check the conversion of the axes and the names of the markers.",
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


def _metatarsals(points: Mapping[str, Array], side: str) -> dict[str, Array]:
    """The first and fifth metatarsal heads, from `FOOT_SHAPE` where they have no marker."""
    heel = points[f"{side}.Heel"]
    found = {}
    for head, others in (("MT1", ("MT5", "MT2")), ("MT5", ("MT2",))):
        if f"{side}.{head}" in points:
            continue
        other = next(name for name in others if f"{side}.{name}" in points)
        along = points[f"{side}.{other}"] - heel
        length = float(np.hypot(along[0], along[1]))
        x = np.array([along[0], along[1], 0.0])
        medial = np.array([-along[1], along[0], 0.0]) * (1.0 if side == "R" else -1.0)
        forward, inward, up = FOOT_SHAPE[head, other]
        found[f"{side}.{head}"] = (
            heel + forward * x + inward * medial + np.array([0.0, 0.0, along[2] + up * length])
        )
    return found


def _hinge(
    points: Mapping[str, Array], side: str, joint: str, above: str, wand: str, width: float | None
) -> Array:
    """Joint centre: midway between the medial and the lateral marker, or by its width."""
    lateral = points[f"{side}.{joint}"]
    medial = points.get(f"{side}.{joint}.Medial")
    if medial is not None:
        return np.asarray((lateral + medial) / 2)
    assert width is not None  # `_needed` has asked for it.
    proximal = points[f"{side}.{above}"]
    inwards = np.array([0.0, 1.0 if side == "R" else -1.0, 0.0])
    # Without a wand the axis is taken across the pelvis.
    place = points.get(f"{side}.{wand}", lateral - 0.1 * inwards)
    centre = chord_centre(proximal, lateral, place, width / 2 + MARKER_OFFSET)
    if _unit(centre - lateral) @ inwards < 0.5:
        raise ScalingError(
            f"the wand marker {side}.{wand} does not lie to the side of the {joint.lower()}: the "
            f"axis of the joint would point more than 60 degrees away from the midline. Place it "
            "in the frontal plane of the segment, or use a medial marker."
        )
    return centre


def _arm_centres(points: Mapping[str, Array], elbow_width: float | None) -> dict[str, Array]:
    """Shoulder, elbow and wrist joint centres as far as markers show them."""
    found: dict[str, Array] = {}
    if not {"R.Acromion", "L.Acromion"} <= points.keys():
        return found
    across = float(np.linalg.norm(points["L.Acromion"] - points["R.Acromion"]))
    down = np.array([0.0, 0.0, -ACROMION_TO_SHOULDER * across])
    for side in "RL":
        shoulder = found[f"{side}.Shoulder.Centre"] = points[f"{side}.Acromion"] + down
        ends = [
            points[name]
            for name in (f"{side}.Wrist", f"{side}.Wrist.Radial", f"{side}.Wrist.Ulnar")
            if name in points
        ]
        wrist = np.mean(ends, axis=0) if ends else None
        if wrist is not None:
            found[f"{side}.Wrist.Centre"] = wrist
        elbow, medial = points.get(f"{side}.Elbow"), points.get(f"{side}.Elbow.Medial")
        if elbow is not None and medial is not None:
            found[f"{side}.Elbow.Centre"] = (elbow + medial) / 2
        elif elbow is not None and wrist is not None and elbow_width is not None:
            found[f"{side}.Elbow.Centre"] = _elbow(
                shoulder, elbow, wrist, elbow_width / 2 + MARKER_OFFSET, side
            )
    return found


def _elbow(shoulder: Array, lateral: Array, wrist: Array, half_width: float, side: str) -> Array:
    """Elbow joint centre, (3,) m: at `half_width` (m) from the lateral marker, on an axis that is
    perpendicular to upper arm and forearm, so that the elbow is flexed and not extended.

    With u from the marker to the centre, u·u = h², u·(shoulder - marker) = h² and
    u·(wrist - marker) = h².
    """
    first, second = shoulder - lateral, wrist - lateral
    sides = np.stack([first, second])
    in_plane = sides.T @ np.linalg.solve(sides @ sides.T, np.full(2, half_width**2))
    depth = float(np.sqrt(max(half_width**2 - float(in_plane @ in_plane), 0.0)))
    out_of_plane = depth * _unit(np.cross(first, second))
    centre = np.asarray(lateral + in_plane + out_of_plane)
    bend = np.cross(centre - shoulder, wrist - centre) @ (lateral - centre)
    if bend * (1.0 if side == "R" else -1.0) < 0:  # extended: the other of the two solutions
        return np.asarray(centre - 2 * out_of_plane)
    return centre


def _arms(points: Mapping[str, Array]) -> dict[str, Any]:
    """The optional fields of `Measurements`."""

    def both(proximal: str, distal: str) -> tuple[float, float] | None:
        names = [(f"{side}.{proximal}.Centre", f"{side}.{distal}.Centre") for side in "RL"]
        if any(name not in points for pair in names for name in pair):
            return None
        right, left = (float(np.linalg.norm(points[a] - points[b])) for a, b in names)
        return right, left

    measured: dict[str, Any] = {
        "upper_arm": both("Shoulder", "Elbow"),
        "forearm": both("Elbow", "Wrist"),
    }
    if "R.Shoulder.Centre" in points and arms_hang(points):
        right, left = points["R.Shoulder.Centre"], points["L.Shoulder.Centre"]
        hips = (points["R.Hip.Centre"] + points["L.Hip.Centre"]) / 2
        measured["shoulder_half_width"] = float(np.linalg.norm(left - right)) / 2
        measured["shoulder_height"] = float(np.linalg.norm((left + right) / 2 - hips))
    return measured


def _sources(markers: Mapping[str, Place], widths: Mapping[str, float | None]) -> dict[str, str]:
    """How the rows of the scaling table were measured, where not by a marker on each landmark."""
    sources = {}
    chord = [
        joint
        for joint in ("Knee", "Ankle")
        if any(f"{side}.{joint}.Medial" not in markers for side in "RL")
    ]
    if chord:
        text = f"markers, {' and '.join(chord).lower()} by width (Davis 1991)"
        sources["shank"] = text
        if "Knee" in chord:
            sources["thigh"] = f"markers, hip after Harrington, {chord[0].lower()} by width"
        if "Ankle" in chord:
            sources["ankle height"] = "markers, ankle by width (Davis 1991)"
    known = {name[2:] for name in markers}
    if "MT1" not in known:
        other = "fifth" if "MT5" in known else "second"
        sources["foot"] = f"markers, first metatarsal head from the {other}, ball ratio"
    return sources


def _leg(points: Mapping[str, Array], hip: Array, side: str) -> Leg:
    knee = points[f"{side}.Knee.Centre"]
    ankle = points[f"{side}.Ankle.Centre"]
    heel = points[f"{side}.Heel"]
    metatarsals = np.stack([points[f"{side}.MT1"], points[f"{side}.MT5"]])
    along = metatarsals.mean(axis=0) - heel
    x = _unit(np.array([along[0], along[1], 0.0]))
    z = np.array([0.0, 0.0, 1.0])
    medial = np.cross(z, x) * (1.0 if side == "R" else -1.0)
    frame = np.column_stack([x, medial, z])
    skin = np.array([MARKER_OFFSET, 0.0, 0.0])
    return Leg(
        thigh=float(np.linalg.norm(hip - knee)),
        shank=float(np.linalg.norm(knee - ankle)),
        ankle_height=float(ankle[2]),
        heel=(heel - ankle) @ frame + skin,
        metatarsals=(metatarsals - ankle) @ frame,
    )
