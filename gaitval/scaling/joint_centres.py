"""Joint centres and segment lengths from the markers of a standing trial.

Axes REP-103 (x forward, y left, z up), metres, floor at z = 0. Points are named by anatomical
landmark (`LANDMARK_NAMES`); a marker set says which marker is on which landmark. The markers of the
WBDS dataset have the landmarks' names.

Landmarks that a marker set lacks are found as follows.

| lacking | found from | after |
|---|---|---|
| PSIS | a marker on the sacrum between them | Kadaba et al. (1990) |
| medial knee, ankle | width, lateral marker, wand in the plane of the axis | Davis et al. (1991) |
| first metatarsal head | heel and fifth head, mean shape of 20 feet | `foot_shape.FOOT_SHAPE` |
| first and fifth head | heel and second head, mean shape of 20 feet | `foot_shape.FOOT_SHAPE` |
| the same, marker on the midfoot | its direction, height of the hips | `foot_shape.MIDFOOT` |
| shoulder joint | acromion, 17 % of the distance between the acromia below it | Rab et al. (2002) |
| medial elbow | width, lateral marker, axis perpendicular to the arm | geometry |
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Unpack

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.scaling.hip_regressions import HARRINGTON, TITLES, PelvisSize, hip_centre
from gaitval.scaling.landmarks import (
    Place,
    Width,
    Widths,
    check_sides,
    check_upright,
    check_widths,
    heading_of,
    landmarks_of,
    middle_psis,
    unit_vector,
    width_of,
)
from gaitval.scaling.measurements import Limbs, Measurements


@dataclass(frozen=True)
class SurfaceMarkers:
    """How markers on the skin lie about the joints."""

    marker_offset: float = 0.010
    """Assumed distance of a marker's centre from the skin, m."""
    acromion_to_shoulder: float = 0.17
    """Distance of the shoulder joint below the acromion, divided by the distance between the
    acromia (Rab et al. 2002, Gait Posture 15:113-119). In the model of Rajagopal et al. (2016) it
    is 0.16."""
    largest_elevation: float = 45.0
    """Elevation of the upper arm, degrees, up to which the acromia show where the shoulders are;
    above it the shoulder girdle moves up and in."""


SURFACE: Final = SurfaceMarkers()


FUNCTIONAL = "functional (Ehrig 2006)"
"""How hip centres were found that `scaling.functional` gives."""


def pelvis_frame(right_asis: Array, left_asis: Array, middle_psis: Array) -> Array:
    """Axes of the pelvis as columns (x forward, y left, z up), shape (3, 3), from its landmarks
    (3,) m.

    y is along `right_asis` and `left_asis`, x in the plane of these and `middle_psis` (ISB, Wu et
    al. 2002).
    """
    y = unit_vector(left_asis - right_asis)
    forward = (right_asis + left_asis) / 2 - middle_psis
    z = unit_vector(np.cross(forward, y))
    return np.column_stack([np.cross(y, z), y, z])


def locate(
    markers: Mapping[str, Place],
    *,
    centres: Mapping[str, Array] | None = None,
    **widths: Unpack[Widths],
) -> dict[str, Array]:
    """Landmarks and joint centres of a standing person, (3,) m, in the axes of the `markers`: the
    landmarks (metatarsals without a marker are estimated), `Mid.PSIS` and `R.` and `L.`
    `Hip.Centre`, `Knee.Centre`, `Ankle.Centre` and, where markers show them, `Shoulder.Centre`,
    `Elbow.Centre`, `Wrist.Centre`.

    `centres` (3,) m in these axes are hips, knees and ankles ("R.Hip.Centre") that are known
    otherwise (`scaling.functional`, `scaling.given_centres`). Markers and `widths` are as for
    `measure`, as which it raises ScalingError.
    """
    heading, points = _standing(markers, centres, **widths)
    return {name: heading @ point for name, point in points.items()}


def measure(
    markers: Mapping[str, Place],
    *,
    centres: Mapping[str, Array] | None = None,
    centres_source: str = FUNCTIONAL,
    **widths: Unpack[Widths],
) -> Measurements:
    """Joint centres, segment lengths and pelvic tilt of a standing person.

    The position of each landmark in `markers` is (3,) m, x forward, y left, z up, floor at z = 0;
    the person may stand anywhere and face anywhere, and other names than `LANDMARK_NAMES` are
    ignored. `centres` are as for `locate`, and `centres_source` says whose they are; `widths`
    across the epicondyles and malleoli, `knee_width`, `ankle_width` and `elbow_width`, m, are for a
    side without a medial marker.

    Raises ScalingError if markers are missing, not finite, in millimetres, upside down or swapped,
    or a width is missing or implausible; all problems of a kind are listed.
    """
    _, points = _standing(markers, centres, **widths)
    asis = points["R.ASIS"], points["L.ASIS"]
    frame = pelvis_frame(*asis, points["Mid.PSIS"])
    hips = {"R": points["R.Hip.Centre"], "L": points["L.Hip.Centre"]}
    right, left = (_arm(points, side) for side in "RL")
    one_sided: dict[str, Side] = {
        **{name: "right" for name in right if name not in left},
        **{name: "left" for name in left if name not in right},
    }
    return Measurements(
        right=_limbs(points, hips["R"], "R", left | right),
        left=_limbs(points, hips["L"], "L", right | left),
        hip_half_width=float((hips["L"] - hips["R"]) @ frame[:, 1]) / 2,
        hip_height=float(hips["R"][2] + hips["L"][2]) / 2,
        # Tilted forward, the pelvis' x axis points below the horizontal.
        pelvic_tilt=float(np.arcsin(-frame[2, 0])),
        one_sided=one_sided,
        **_shoulders(points),
        sources=_sources(
            markers,
            points,
            known=dict.fromkeys(centres or (), centres_source),
            hip=TITLES[widths.get("hip_regression", HARRINGTON)],
        ),
    )


def arms_hang(points: Mapping[str, Array]) -> bool:
    """Whether both arms hang to within `SURFACE.largest_elevation`, as far as `points` of `locate`
    show.
    """
    for side in "RL":
        shoulder = points.get(f"{side}.Shoulder.Centre")
        elbow = points.get(f"{side}.Elbow.Centre", points.get(f"{side}.Elbow"))
        if shoulder is not None and elbow is not None:
            down = -unit_vector(elbow - shoulder)[2]
            if down < np.cos(np.radians(SURFACE.largest_elevation)):
                return False
    return True


def _standing(
    markers: Mapping[str, Place],
    centres: Mapping[str, Array] | None,
    knee_width: Width = None,
    ankle_width: Width = None,
    elbow_width: Width = None,
    hip_regression: str = HARRINGTON,
) -> tuple[Array, dict[str, Array]]:
    """The person's axes, (3, 3) with x (facing), y and z as columns, and all landmarks and joint
    centres in these axes.
    """
    check_widths(knee_width, ankle_width, elbow_width)
    points = landmarks_of(markers, knee_width, ankle_width)
    check_upright(points)
    heading = heading_of(points)
    points = {name: heading.T @ point for name, point in points.items()}
    check_sides(points)
    points["Mid.PSIS"] = middle_psis(points)

    asis = points["R.ASIS"], points["L.ASIS"]
    middle_asis = (asis[0] + asis[1]) / 2
    frame = pelvis_frame(*asis, points["Mid.PSIS"])
    right_hip = hip_centre(hip_regression, _pelvis_size(points, ankle_width))
    mirror = np.array([1.0, -1.0, 1.0])
    points["R.Hip.Centre"] = middle_asis + frame @ right_hip
    points["L.Hip.Centre"] = middle_asis + frame @ (mirror * right_hip)
    known = {name: heading.T @ centre for name, centre in (centres or {}).items()}
    points |= {name: at for name, at in known.items() if name.endswith(".Hip.Centre")}
    if not {"R.MT1", "R.MT5", "L.MT1", "L.MT5"} <= points.keys():
        from gaitval.scaling.foot_shape import metatarsals

        points.update(metatarsals(points))
    for side in "RL":
        for joint, above, wand, width in (
            ("Knee", "Hip.Centre", "Thigh", knee_width),
            ("Ankle", "Knee.Centre", "Shank", ankle_width),
        ):
            name = f"{side}.{joint}.Centre"
            points[name] = (
                known[name]
                if name in known
                else _hinge(points, side, joint, above, wand, width_of(width, side))
            )
    points.update(_arm_centres(points, elbow_width))
    return heading, points


def _pelvis_size(points: Mapping[str, Array], ankle_width: Width) -> PelvisSize:
    """What the regressions of the hip centre go by."""
    asis = {side: points[f"{side}.ASIS"] for side in "RL"}
    # The medial malleolus; without a marker on it the width puts it beside the lateral one.
    legs = []
    for side, spine in asis.items():
        lateral = points[f"{side}.Ankle"]
        width = width_of(ankle_width, side) or 0.0
        inwards = np.array([0.0, width if side == "R" else -width, 0.0])
        legs.append(np.linalg.norm(points.get(f"{side}.Ankle.Medial", lateral + inwards) - spine))
    return PelvisSize(
        width=float(np.linalg.norm(asis["L"] - asis["R"])),
        depth=float(np.linalg.norm((asis["R"] + asis["L"]) / 2 - points["Mid.PSIS"])),
        leg=float(np.mean(legs)),
    )


def _hinge(
    points: Mapping[str, Array], side: str, joint: str, above: str, wand: str, width: float | None
) -> Array:
    """Joint centre: midway between the medial and lateral markers, or from the joint's width."""
    lateral = points[f"{side}.{joint}"]
    medial = points.get(f"{side}.{joint}.Medial")
    if medial is not None:
        return np.asarray((lateral + medial) / 2)
    from gaitval.scaling.joint_width import hinge_centre

    assert width is not None  # `_needed` has required it.
    return hinge_centre(points, side, joint, above, wand, width / 2 + SURFACE.marker_offset)


def _wrists(side: str) -> tuple[str, ...]:
    return f"{side}.Wrist", f"{side}.Wrist.Radial", f"{side}.Wrist.Ulnar"


def _arm_centres(points: Mapping[str, Array], elbow_width: Width) -> dict[str, Array]:
    """Shoulder, elbow and wrist joint centres as far as markers show them."""
    found: dict[str, Array] = {}
    if not {"R.Acromion", "L.Acromion"} <= points.keys():
        return found
    across = float(np.linalg.norm(points["L.Acromion"] - points["R.Acromion"]))
    down = np.array([0.0, 0.0, -SURFACE.acromion_to_shoulder * across])
    for side in "RL":
        shoulder = found[f"{side}.Shoulder.Centre"] = points[f"{side}.Acromion"] + down
        ends = [points[name] for name in _wrists(side) if name in points]
        wrist = np.mean(ends, axis=0) if ends else None
        if wrist is not None:
            found[f"{side}.Wrist.Centre"] = wrist
        elbow, medial = points.get(f"{side}.Elbow"), points.get(f"{side}.Elbow.Medial")
        width = width_of(elbow_width, side)
        if elbow is not None and medial is not None:
            found[f"{side}.Elbow.Centre"] = (elbow + medial) / 2
        elif elbow is not None and wrist is not None and width is not None:
            from gaitval.scaling.joint_width import elbow_centre

            found[f"{side}.Elbow.Centre"] = elbow_centre(
                shoulder, elbow, wrist, width / 2 + SURFACE.marker_offset, side
            )
    return found


def _arm(points: Mapping[str, Array], side: str) -> dict[str, float]:
    """The arm's fields of `Limbs`, as far as markers show them."""
    found = {}
    for name, ends in (("upper_arm", ("Shoulder", "Elbow")), ("forearm", ("Elbow", "Wrist"))):
        proximal, distal = (f"{side}.{end}.Centre" for end in ends)
        if proximal in points and distal in points:
            found[name] = float(np.linalg.norm(points[proximal] - points[distal]))
    return found


def _shoulders(points: Mapping[str, Array]) -> dict[str, Any]:
    """The shoulders' fields of `Measurements`, as far as markers show them."""
    if "R.Shoulder.Centre" not in points or not arms_hang(points):
        return {}
    right, left = points["R.Shoulder.Centre"], points["L.Shoulder.Centre"]
    hips = (points["R.Hip.Centre"] + points["L.Hip.Centre"]) / 2
    return {
        "shoulder_half_width": float(np.linalg.norm(left - right)) / 2,
        "shoulder_height": float(np.linalg.norm((left + right) / 2 - hips)),
    }


def _sources(
    markers: Mapping[str, Place],
    points: Mapping[str, Array],
    *,
    known: Mapping[str, str],
    hip: str,
) -> dict[str, str]:
    """How the rows of the scaling table were measured, if not by a marker on each landmark; `known`
    says whose a centre is that was given.
    """
    sources = {}
    of = {name[2:-7]: source for name, source in known.items()}  # of R.Hip.Centre: Hip
    hip = of.get("Hip", f"after {hip}")
    if hip != f"after {TITLES[HARRINGTON]}":
        sources["thigh"] = sources["hips"] = f"markers, hip {hip}"
    chord = [
        joint
        for joint in ("Knee", "Ankle")
        if joint not in of and any(f"{side}.{joint}.Medial" not in markers for side in "RL")
    ]
    if chord:
        text = f"markers, {' and '.join(chord).lower()} by width (Davis 1991)"
        sources["shank"] = text
        if "Knee" in chord:
            whose = hip.partition(" (")[0]
            sources["thigh"] = f"markers, hip {whose}, {chord[0].lower()} by width"
        if "Ankle" in chord:
            sources["ankle height"] = "markers, ankle by width (Davis 1991)"
    if "Knee" in of:
        sources["thigh"] = f"hip {hip}, knee {of['Knee']}"
    if "Ankle" in of:
        sources["shank"] = f"knee {of.get('Knee', 'by markers')}, ankle {of['Ankle']}"
        sources["ankle height"] = f"ankle {of['Ankle']}"
    seen_on = {name[2:] for name in markers}
    if "MT1" not in seen_on:
        other = "fifth" if "MT5" in seen_on else "second"
        sources["foot"] = f"markers, first metatarsal head from the {other}, ball ratio"
        from gaitval.scaling.foot_shape import MIDFOOT_SOURCE, on_midfoot

        seen = {name: at for name, at in points.items() if name in markers or "Hip" in name}
        if on_midfoot(seen):
            sources["foot"] = MIDFOOT_SOURCE
    return sources


def _limbs(points: Mapping[str, Array], hip: Array, side: str, arm: Mapping[str, float]) -> Limbs:
    knee = points[f"{side}.Knee.Centre"]
    ankle = points[f"{side}.Ankle.Centre"]
    heel = points[f"{side}.Heel"]
    metatarsals = np.stack([points[f"{side}.MT1"], points[f"{side}.MT5"]])
    along = metatarsals.mean(axis=0) - heel
    x = unit_vector(np.array([along[0], along[1], 0.0]))
    z = np.array([0.0, 0.0, 1.0])
    # Left-handed for the left foot: both feet are described as right ones.
    medial = np.cross(z, x) * (1.0 if side == "R" else -1.0)
    frame = np.column_stack([x, medial, z])
    skin = np.array([SURFACE.marker_offset, 0.0, 0.0])
    return Limbs(
        thigh=float(np.linalg.norm(hip - knee)),
        shank=float(np.linalg.norm(knee - ankle)),
        ankle_height=float(ankle[2]),
        heel=(heel - ankle) @ frame + skin,
        metatarsals=(metatarsals - ankle) @ frame,
        **arm,
    )
