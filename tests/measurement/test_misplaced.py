"""What is wrong on both sides alike, or only in standing, is said; sound people have no warning."""

from types import SimpleNamespace

import numpy as np
import pytest
from known_walk import known_walk

from gaitval.coordinates import COORDINATES
from gaitval.mocap.recording import Recording
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.session.measurement.misplaced import (
    MOVED,
    knee_forward,
    knee_warnings,
    moved_warnings,
    standing_warnings,
)

SHANK = 0.42
NAMES = {f"{side}.{name}": f"{side}{name}" for side in "RL" for name in ("ASIS", "Knee", "Ankle")}


def legs():
    """A walk in which both knees bend alike, and skin moves the markers by 3 mm."""
    angle = np.radians(np.linspace(3.0, 65.0, 200))
    positions = np.zeros((200, len(COORDINATES)))
    for side in "rl":
        positions[:, COORDINATES.index(f"knee_angle_{side}")] = angle
    markers = np.zeros((200, 4, 3))
    markers[:, [0, 2], 2] = SHANK + np.random.default_rng(2).normal(0.0, 0.003, (200, 1))
    recording = Recording("w", "project", ("RKnee", "RAnkle", "LKnee", "LAnkle"), markers, 100.0)
    kinematics = SimpleNamespace(positions=positions, converged=np.ones(200, dtype=bool))
    return [SimpleNamespace(recording=recording, kinematics=kinematics)]


def walked():
    """The known walk, and as a trial in which every frame is known."""
    walk = known_walk()
    kinematics = SimpleNamespace(
        positions=walk.positions, converged=np.ones(len(walk.positions), dtype=bool)
    )
    recording = SimpleNamespace(marker_rate=150.0)
    return walk, SimpleNamespace(kinematics=kinematics, belt=0.0, recording=recording)


@pytest.mark.parametrize(
    ("bent", "turned", "where"),
    [(0.0, 0.0, []), (6.0, 8.0, []), (16.0, 0.0, ["knees in standing"]),
     (0.0, 28.0, ["feet in standing"]), (0.0, -28.0, ["feet in standing"])],
)  # fmt: skip
def test_a_standing_pose_unlike_the_walk(bent, turned, where):
    walk, trial = walked()
    standing = np.zeros(len(COORDINATES))
    least = np.mean([
        np.percentile(walk.positions[:, COORDINATES.index(f"knee_angle_{side}")], 2.0)
        for side in "rl"
    ])  # fmt: skip
    for side in "rl":
        standing[COORDINATES.index(f"knee_angle_{side}")] = least + np.radians(bent)
    standing[COORDINATES.index("hip_rotation_r")] = np.radians(turned)
    found = [*standing_warnings(walk.model, standing, [trial])]
    assert [each.where for each in found] == where, [str(each) for each in found]
    if where == ["feet in standing"]:
        side = "right" if turned < 0.0 else "left"
        assert f"the {side} foot is turned out" in str(found[0])


@pytest.mark.parametrize("aslant", [-40.0, 20.0, 40.0])
def test_who_stands_aslant_turns_no_foot_out(aslant):
    """Both feet turn with the pelvis."""
    walk, trial = walked()
    standing = np.zeros(len(COORDINATES))
    standing[COORDINATES.index("pelvis_rz")] = np.radians(aslant)
    for side in "rl":
        at = COORDINATES.index(f"knee_angle_{side}")
        standing[at] = np.percentile(walk.positions[:, at], 2.0)
    assert [*standing_warnings(walk.model, standing, [trial])] == []


def test_one_knee_bent_in_standing():
    walk, trial = walked()
    standing = np.zeros(len(COORDINATES))
    standing[COORDINATES.index("knee_angle_r")] = np.radians(18.0)
    (flag,) = standing_warnings(walk.model, standing, [trial])
    assert "bent by 18° in standing" in str(flag)


OF = {"ASIS": "pelvis", "Knee": "thigh", "Ankle": "shank", "Heel": "foot", "MT5": "foot"}


def carried(**moved):
    """The known walk with markers on its landmarks, some moved (m) on their segments, by name."""
    walk = known_walk()
    positions = walk.positions[:120]
    frames = segment_frames(walk.model, positions)
    markers, paths = [], []
    for side in "RL":
        for part, segment in OF.items():
            on = segment if segment == "pelvis" else f"{segment}_{side.lower()}"
            place = np.array([0.05, -0.05 if side == "R" else 0.05, -0.02])
            markers.append(ModelMarker(f"{side}.{part}", on, place))
            frame = frames[:, SEGMENTS.index(on)]
            at = place + moved.get(f"{side}_{part}", np.zeros(3))
            paths.append(frame[:, :3, :3] @ at + frame[:, :3, 3])
    names = tuple(marker.name for marker in markers)
    recording = Recording("walk", "project", names, np.stack(paths, axis=1), 100.0)
    kinematics = SimpleNamespace(positions=positions, converged=np.ones(len(positions), dtype=bool))
    trial = SimpleNamespace(name="walk", recording=recording, kinematics=kinematics)
    landmarks = {name: name for name in names}
    return [*moved_warnings(walk.model, markers, [trial], landmarks)]


@pytest.mark.parametrize("part", [*OF])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_marker_beside_its_place_in_the_walk(part, axis):
    limit = MOVED[part][axis]
    (found,) = carried(**{f"R_{part}": 1.5 * limit * np.eye(3)[axis]})
    assert found.where == f"R.{part} and L.{part}"
    assert found.value == pytest.approx(1.5 * limit)
    assert ("forward", "inward", "up")[axis] in found.message  # the right's left is inwards
    assert not carried(**{f"R_{part}": 0.7 * limit * np.eye(3)[axis]})


def test_skin_that_moves_both_sides_alike_is_no_moved_marker():
    outward = {"R_Knee": np.array([0.01, -0.02, 0.01]), "L_Knee": np.array([0.01, 0.02, 0.01])}
    assert not carried(**outward)


def one_knee(grows=0.0, fitted=0.0, bent=0.0, medial=False):
    """A walk in which the right knee's marker parts from the ankle's by `grows` times the sine of
    the flexion, is moved forward by the fit by `fitted`, m, and stands `bent` more, rad.
    """
    walks = legs()
    recording = walks[0].recording
    angle = walks[0].kinematics.positions[:, COORDINATES.index("knee_angle_r")]
    recording.markers[:, 0, 2] += grows * np.sin(angle)
    standing = np.zeros(len(COORDINATES))
    standing[COORDINATES.index("knee_angle_r")] = bent

    def placed(at):
        return [ModelMarker("RKnee", "shank_r", np.array([at, 0.0, 0.0])),
                ModelMarker("LKnee", "shank_l", np.zeros(3))]  # fmt: skip

    body = SimpleNamespace(
        markers=placed(fitted), placement=SimpleNamespace(markers=placed(0.0), standing=standing)
    )
    points = {"R.Knee.Medial": [0.0, 0.0, 0.5]} if medial else {}
    return knee_forward(body, walks, NAMES, points)


def test_one_knees_marker_is_too_far_forward_by_the_sum_of_what_shows_it():
    grown, fitted = one_knee(grows=0.02), one_knee(fitted=0.01)
    assert grown.value == pytest.approx(0.47 * 0.02, abs=1e-4)
    assert fitted.value == pytest.approx(0.016, abs=1e-4)
    both = one_knee(grows=0.02, fitted=0.01, bent=np.radians(5.0))
    assert both.value == pytest.approx(0.47 * 0.02 + 0.016 + 0.062 * np.radians(5.0), abs=1e-4)
    assert both.limit == pytest.approx(0.0099)
    half = one_knee(grows=0.02, fitted=0.01, bent=np.radians(5.0), medial=True)
    assert half.value == pytest.approx(both.value / 0.7)
    (flag,) = knee_warnings(both, NAMES)
    assert "LKnee is some 31 mm too far back, or RKnee too far forward" in flag.message
    assert not [*knee_warnings(grown, NAMES)]


def test_who_stands_with_one_knee_bent_has_no_marker_beside_the_knee():
    """Most of the sum is the standing pose then, or it says the opposite of the walk."""
    assert one_knee(grows=0.005, bent=np.radians(15.0)) is None
    assert one_knee(grows=-0.02, bent=np.radians(15.0)) is None
