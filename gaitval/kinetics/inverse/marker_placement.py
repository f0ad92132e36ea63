"""Place a standing person's markers on the segments of their body model.

The model is put into the pose that best fits the standing landmarks and joint centres (least
squares, equal weights); each marker then gets its measured position, in the frame of its segment.
The model is mirror-symmetric but the person is not: both sides keep their own marker positions.

The neutral pelvis has the plane of the ASIS and PSIS level (`scaling.scaling`), so in natural
standing the pelvis is tilted forward and the hips are flexed by the same angle. What no landmark
shows stays neutral: toes in line with the foot, trunk upright, arms hanging.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Unpack

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.errors import ScalingError
from gaitval.kinetics.inverse.inverse_kinematics import InverseKinematics, inverse_kinematics
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.scaling.joint_centres import SURFACE, arms_hang, locate, pelvis_frame
from gaitval.scaling.landmarks import Place, Widths
from gaitval.scaling.marker_set import MarkerSet
from gaitval.scaling.measurements import Limbs, Measurements

CHECKLIST: Final = "OpenSim, Simulation with OpenSim - Best Practices"
"""Where the limits of `placement_checks` come from."""


@dataclass(frozen=True)
class PlacementLimits:
    """How far markers may be from where a model has them."""

    largest_distance: float = 0.02
    largest_rms: float = 0.01
    """m, distance of a landmark or joint centre in standing from its place in the model."""
    largest_ankle_angle: float = 5.0
    largest_hip_angle: float = 10.0
    """Degrees from the neutral pose, in standing."""
    given_weight: float = 100.0
    """Of a joint centre that is given, beside a landmark."""
    elbow_half_width: float = 0.045
    """m, distance of the marker on the lateral epicondyle of the elbow from the joint centre if the
    medial side has no marker: half of 70 mm, plus 10 mm for the marker itself."""


PLACEMENT: Final = PlacementLimits()


_UP: Final = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class PlacementCheck:
    """A value, its published limit and the source of the limit.

    Attributes
    ----------
    name : what was measured.
    value, limit : in `unit`; the value may not exceed the limit.
    unit : "m" or "deg".
    source : of the limit.
    """

    name: str
    value: float
    limit: float
    unit: str
    source: str

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        return self.value <= self.limit


@dataclass(frozen=True)
class MarkerPlacement:
    """Markers on a model and the pose in which they were placed.

    Attributes
    ----------
    markers : in the order of the marker set; those not seen in standing are left out.
    standing : (31,) pose in the standing trial, rad and m.
    distances : m, of each landmark and joint centre by landmarks from its place in the model, where
        all weigh alike.
    moved : names of the markers that moved with raised arms: their measured position differs from
        that in the model in the pose `standing`.
    checks : the published limits; none stops the import.
    """

    markers: tuple[ModelMarker, ...]
    standing: Array
    distances: Mapping[str, float]
    moved: tuple[str, ...]
    checks: tuple[PlacementCheck, ...]


def place_markers(
    model: BodyModel,
    measured: Measurements,
    standing: Mapping[str, Place],
    marker_set: MarkerSet,
    *,
    centres: Mapping[str, Array] | None = None,
    **widths: Unpack[Widths],
) -> MarkerPlacement:
    """Find the standing pose of a model and place all markers on it.

    Parameters
    ----------
    model : scaled with `measured`.
    measured : lengths of the body; used here for the shape of its feet and arms.
    standing : (3,) m, position of each marker of the set in standing (a mean over frames),
        project axes, floor at z = 0; a marker that was not seen is left out or NaN.
    marker_set : which segment each marker is on, and which landmark.
    centres, widths : m, as for `joint_centres.measure`.

    Raises
    ------
    ScalingError : as `joint_centres.measure`; left and right are swapped in markers without a
        landmark.
    """
    seen = {
        name: np.asarray(place, dtype=np.float64)
        for name, place in standing.items()
        if np.isfinite(place).all()
    }
    landmarks = marker_set.on_landmarks(seen)
    points = locate(landmarks, centres=centres, **widths)
    _check_sides(marker_set, seen, points)
    raised = not arms_hang(points)
    if raised:
        shifts = _to_the_shoulders(model, measured, points)
        points |= {
            name: points[name] + shifts[name[0]]
            for name in points
            if name[2:] in ("Elbow", "Elbow.Centre", "Wrist.Centre")
        }
    anatomy = _anatomy(model, measured, points)
    given = frozenset(centres or ())
    if all(".Hip." in name for name in given):
        given = frozenset()  # hips alone are held by the spines
    own = points | {name: at for name, at in locate(landmarks, **widths).items() if name in given}
    alike, frames = _pose(model, _anatomy(model, measured, own), own)
    fit, frames = _pose(model, _about_knees(model, anatomy, points, given, frames), points)
    markers, moved = [], []
    for name, definition in marker_set.markers.items():
        if name not in seen:
            continue
        segment, place = definition.segment, seen[name]
        frame = frames[SEGMENTS.index(segment)]
        if raised and segment.startswith(("upper_arm", "forearm")):
            place = place + shifts[segment[-1].upper()]
            moved.append(name)
        # From the world into the segment, Rᵀ (p − o), with vectors as rows.
        position = (place - frame[:3, 3]) @ frame[:3, :3]
        # Raised arms lift the acromion, so it is put above the model's own shoulder.
        if raised and segment == "torso" and (definition.landmark or "").endswith(".Acromion"):
            shoulder = model[f"upper_arm_{str(definition.landmark)[0].lower()}"].joint_position
            position = shoulder + 2 * SURFACE.acromion_to_shoulder * abs(shoulder[1]) * _UP
            moved.append(name)
        markers.append(ModelMarker(name, segment, position, definition.weight))
    distances = dict(zip(alike.names, alike.marker_errors[0].tolist(), strict=True))
    return MarkerPlacement(
        markers=tuple(markers),
        standing=fit.positions[0],
        distances=distances,
        moved=tuple(moved),
        checks=placement_checks(fit.positions[0], measured.pelvic_tilt, distances),
    )


def placement_checks(
    standing: Array, pelvic_tilt: float, distances: Mapping[str, float]
) -> tuple[PlacementCheck, ...]:
    """The published limits of a placement: distances of the landmarks first, then ankle and hip of
    the right and of the left leg.

    `standing` (31,) is the pose, rad, `distances` are m, of landmarks from their places in the
    model. Hip flexion is measured from `pelvic_tilt`, rad, because our neutral pelvis is level at
    the ASIS and PSIS but the published limit refers to the posture.
    """
    worst = max(distances, key=lambda name: distances[name])
    rms = float(np.sqrt(np.mean(np.square(list(distances.values())))))
    rows = [
        (
            f"largest distance of a landmark ({worst})",
            distances[worst],
            PLACEMENT.largest_distance,
            "m",
        ),
        ("RMS distance of the landmarks", rms, PLACEMENT.largest_rms, "m"),
    ]
    for side in ("right", "left"):
        ankle, hip = (
            np.degrees(standing[COORDINATES.index(f"{name}_{side[0]}")])
            for name in ("ankle_angle", "hip_flexion")
        )
        bent = float(abs(hip - np.degrees(pelvic_tilt)))
        rows += [
            (
                f"{side} ankle angle in standing", float(abs(ankle)),
                PLACEMENT.largest_ankle_angle, "deg",
            ),
            (f"{side} hip flexion in standing, from the standing pelvis", bent,
             PLACEMENT.largest_hip_angle, "deg"),
        ]  # fmt: skip
    return tuple(PlacementCheck(*row, CHECKLIST) for row in rows)


def _check_sides(
    marker_set: MarkerSet, seen: Mapping[str, Array], points: Mapping[str, Array]
) -> None:
    """Check that left markers are to the left of their right counterparts; `measure` checks the
    landmarks, and arms may cross.
    """
    left = _pelvis(points)[:, 1]
    swapped = [
        name[1:].lstrip(".")
        for name, definition in marker_set.markers.items()
        for other in [f"L{name[1:]}"]
        if name.startswith("R") and {name, other} <= seen.keys() and "arm" not in definition.segment
        if (seen[other] - seen[name]) @ left <= 0
    ]
    if swapped:
        raise ScalingError(
            "left and right markers look swapped in the standing trial (the left one is on the "
            f"right): {', '.join(swapped)}. Check the names of the markers."
        )


def _pelvis(points: Mapping[str, Array]) -> Array:
    return pelvis_frame(points["R.ASIS"], points["L.ASIS"], points["Mid.PSIS"])


def _middle_hip(points: Mapping[str, Array]) -> Array:
    return np.asarray((points["R.Hip.Centre"] + points["L.Hip.Centre"]) / 2)


def _pose(
    model: BodyModel, anatomy: Sequence[ModelMarker], points: Mapping[str, Array]
) -> tuple[InverseKinematics, Array]:
    """The pose that fits landmarks of the model to `points`, and its segments, (14, 4, 4)."""
    fixed = {f"mtp_angle_{side}": 0.0 for side in "rl"}
    if not any(marker.segment.startswith(("torso", "upper_arm")) for marker in anatomy):
        # With a pelvis tilted forward by this angle, as much lumbar extension keeps the trunk
        # upright.
        upright = float(np.arcsin(-_pelvis(points)[2, 0]))
        fixed |= {"lumbar_extension": upright, "lumbar_bending": 0.0, "lumbar_rotation": 0.0}
    places = np.array([[points[marker.name] for marker in anatomy]])
    fit = inverse_kinematics(model, anatomy, places, fixed=fixed)
    return fit, segment_frames(model, fit.positions)[0]


def _to_the_shoulders(
    model: BodyModel, measured: Measurements, points: Mapping[str, Array]
) -> dict[str, Array]:
    """Vectors from the shoulders of raised arms to those of the model, for each side, (3,) m."""
    # Without the arms, whose raised shoulders would lift the trunk.
    anatomy = _anatomy(model, measured, points)
    _, frames = _pose(model, [m for m in anatomy if "arm" not in m.segment], points)
    return {
        side: frames[SEGMENTS.index(f"upper_arm_{side.lower()}"), :3, 3]
        - points[f"{side}.Shoulder.Centre"]
        for side in "RL"
    }


def _anatomy(
    model: BodyModel, measured: Measurements, points: Mapping[str, Array]
) -> list[ModelMarker]:
    """Positions of the landmarks and joint centres in the model."""
    frame, hips = _pelvis(points), _middle_hip(points)
    places = {
        name: ("pelvis", (points[name] - hips) @ frame)
        for name in ("R.ASIS", "L.ASIS", "R.PSIS", "L.PSIS", "Sacrum")
        if name in points
    }
    for limbs, side, sign in zip(measured.modelled.values(), "RL", (1.0, -1.0), strict=True):
        heads, heel = limbs.metatarsals, limbs.heel - [SURFACE.marker_offset, 0.0, 0.0]
        end = side.lower()
        # y is to the left, so +y is towards the midline on the right side.
        medial = np.array([0.0, sign, 0.0])
        mirror = np.array([1.0, sign, 1.0])
        knee = model[f"shank_{end}"].joint_position
        half = float(np.linalg.norm(points[f"{side}.Knee"] - points[f"{side}.Knee.Centre"]))
        places |= {
            f"{side}.Hip.Centre": (f"thigh_{end}", np.zeros(3)),
            f"{side}.Knee.Centre": (f"shank_{end}", np.zeros(3)),
            f"{side}.Knee": (f"thigh_{end}", knee - half * medial),
            f"{side}.Ankle.Centre": (f"foot_{end}", np.zeros(3)),
            f"{side}.Heel": (f"foot_{end}", mirror * heel),
            f"{side}.MT1": (f"foot_{end}", mirror * heads[0]),
            f"{side}.MT5": (f"foot_{end}", mirror * heads[1]),
        }
        if f"{side}.Shoulder.Centre" in points:
            places |= _arm(model, limbs, points, side, medial)
    return [
        ModelMarker(name, segment, np.asarray(place)) for name, (segment, place) in places.items()
    ]


def _about_knees(
    model: BodyModel,
    anatomy: Sequence[ModelMarker],
    points: Mapping[str, Array],
    given: Collection[str],
    frames: Array,
) -> list[ModelMarker]:
    """The `anatomy` whose lateral markers of the knees are where `points` show them beside the
    centre and an axis as in `frames` (14, 4, 4): they hold the axis, and do not pull at the centre.
    Centres that are `given` weigh most.

    A shank is not turned against its thigh in the model, so a foot that points outwards turns both;
    beside a lateral marker on the axis the centre is then pulled along (9 mm in OpenCap's Subject4,
    whose tibiae are turned by 18 degrees).
    """
    changed = {name: replace(_of(anatomy, name), weight=PLACEMENT.given_weight) for name in given}
    for side in "RL":
        name, centre = f"{side}.Knee", points[f"{side}.Knee.Centre"]
        up = points[f"{side}.Hip.Centre"] - centre
        up /= np.linalg.norm(up)
        left = frames[SEGMENTS.index(f"thigh_{side.lower()}"), :3, 1]
        left = left - (left @ up) * up
        left /= np.linalg.norm(left)
        away = (points[name] - centre) @ np.column_stack([np.cross(left, up), left, up])
        knee = model[f"shank_{side.lower()}"].joint_position
        weight = PLACEMENT.given_weight if f"{name}.Centre" in given else 1.0
        changed[name] = replace(_of(anatomy, name), position=knee + away, weight=weight)
    return [changed.get(each.name, each) for each in anatomy]


def _of(anatomy: Sequence[ModelMarker], name: str) -> ModelMarker:
    return next(each for each in anatomy if each.name == name)


def _arm(
    model: BodyModel, limbs: Limbs, points: Mapping[str, Array], side: str, medial: Array
) -> dict[str, tuple[str, Array]]:
    """As `_anatomy`, for one arm whose shoulder is known."""
    end = side.lower()
    centre, lateral, wrist = (f"{side}.{n}" for n in ("Elbow.Centre", "Elbow", "Wrist.Centre"))
    places = {f"{side}.Shoulder.Centre": _shoulder(model, points, side)}
    if lateral not in points:
        return places
    half = PLACEMENT.elbow_half_width
    if centre in points:
        places[centre] = (f"forearm_{end}", np.zeros(3))
        half = float(np.linalg.norm(points[lateral] - points[centre]))
    elbow = model[f"forearm_{end}"].joint_position
    places[lateral] = (f"upper_arm_{end}", elbow - half * medial)
    if wrist in points:
        length = (
            limbs.forearm
            if limbs.forearm is not None
            else np.linalg.norm(points[wrist] - points.get(centre, points[lateral]))
        )
        places[wrist] = (f"forearm_{end}", np.array([0.0, 0.0, -float(length)]))
    return places


def _shoulder(model: BodyModel, points: Mapping[str, Array], side: str) -> tuple[str, Array]:
    """Position of the shoulder joint in the model; with raised arms, as moved by the shoulder
    girdle.
    """
    if arms_hang(points):
        return f"upper_arm_{side.lower()}", np.zeros(3)
    right, left = points["R.Shoulder.Centre"], points["L.Shoulder.Centre"]
    lumbar = _middle_hip(points) + _pelvis(points) @ model["torso"].joint_position
    half = float(np.linalg.norm(left - right)) / 2
    up = float(np.linalg.norm((left + right) / 2 - lumbar))
    return "torso", np.array([0.0, -half if side == "R" else half, up])
