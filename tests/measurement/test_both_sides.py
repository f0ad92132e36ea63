"""What is wrong on both sides alike, or only in standing, is said; sound people have no warning."""

from types import SimpleNamespace

import numpy as np
import pytest
from known_walk import known_walk

from gaitval.coordinates import COORDINATES
from gaitval.measurement.balance import GroundWrenches, _plate_effects, newton
from gaitval.measurement.both_sides import (
    FORWARD,
    FORWARD_BY,
    KNEE_SHARE,
    LEG,
    NEARER,
    TILT,
    TILT_SD,
    low_knees,
    low_knees_warnings,
    low_spines,
    low_spines_warnings,
    standing_warnings,
    taped_longer,
    taped_warnings,
)
from gaitval.measurement.estimate import causes
from gaitval.mocap.recording import Recording

SPINE, SHANK = 0.98, 0.42
NAMES = {f"{side}.{name}": f"{side}{name}" for side in "RL" for name in ("ASIS", "Knee", "Ankle")}


def legs(up, skin=0.003):
    """A walk whose knees' markers are `up` m too high, and the landmarks in standing."""
    angle = np.radians(np.linspace(3.0, 65.0, 200))
    positions = np.zeros((200, len(COORDINATES)))
    for side in "rl":
        positions[:, COORDINATES.index(f"knee_angle_{side}")] = angle
    noise = np.random.default_rng(2).normal(0.0, skin, 200)
    apart = SHANK + up + (NEARER - up if skin else 0.0) * (1.0 - np.cos(angle)) + noise
    markers = np.zeros((200, 4, 3))
    markers[:, [0, 2], 2] = apart[:, None]
    recording = Recording("w", "project", ("RKnee", "RAnkle", "LKnee", "LAnkle"), markers, 100.0)
    kinematics = SimpleNamespace(positions=positions, converged=np.ones(200, dtype=bool))
    points = {f"{side}.ASIS": [0.1, 0.0, SPINE] for side in "RL"}
    points |= {f"{side}.Knee": [0.0, 0.0, KNEE_SHARE * SPINE + up] for side in "RL"}
    return [SimpleNamespace(recording=recording, kinematics=kinematics)], points


@pytest.mark.parametrize(
    ("up", "word"), [(0.0, ""), (0.012, ""), (-0.012, ""), (0.028, "high"), (-0.028, "low")]
)
def test_both_knees_too_low_or_high(up, word):
    found = low_knees(*_with_landmarks(legs(up)))
    assert found.value == pytest.approx(-up, abs=0.003)
    said = [str(each) for each in low_knees_warnings(found, NAMES)]
    assert [f"28 mm too {word}" in each for each in said] == [True] * bool(word)
    assert all("RKnee and LKnee" in each for each in said)


def test_simulated_markers_have_no_skin_and_say_nothing():
    assert low_knees(*_with_landmarks(legs(0.0, skin=0.0))) is None


def _with_landmarks(made):
    walks, points = made
    return walks, NAMES, points


@pytest.mark.parametrize(
    ("low", "tape", "said"),
    [(0.0, None, False), (0.0, 0.0, False), (0.028, None, False), (0.052, None, True),
     (0.028, 0.028, True), (0.028, 0.0, False), (0.0, -0.07, False)],
)  # fmt: skip
def test_both_front_spines_too_low(low, tape, said):
    """By hips and tilt alone from 48 mm on, with the legs' lengths from 24; a tape that measured
    somebody else is not asked.
    """
    tilt = TILT + low / 0.15
    chosen = SimpleNamespace(hip_forward=FORWARD + FORWARD_BY * low, pelvic_tilt=tilt)
    points = {f"{side}.ASIS": [0.15, 0.1, SPINE] for side in "RL"}
    points |= {"Sacrum": [0.0, 0.1, SPINE]}
    points |= {f"{side}.Ankle": [0.15, 0.1, 0.08] for side in "RL"}
    leg = None if tape is None else SPINE - 0.08 + LEG + tape
    found = low_spines(SimpleNamespace(chosen=chosen), points, (leg, leg))
    flags = [*low_spines_warnings(found, NAMES, tilt)]
    assert [each.where for each in flags] == ["RASIS and LASIS"] * said
    if said:
        assert found.value == pytest.approx(low, abs=0.002)
    of_tape = [*taped_warnings(taped_longer(points, (leg, leg)))]
    assert [each.value for each in of_tape] == pytest.approx(
        [0.061] if tape is not None and abs(tape) > 0.06 else [], abs=1e-3
    )
    assert all("62 mm shorter" in str(each) for each in of_tape)


@pytest.mark.parametrize(("sds", "said"), [(3.2, True), (2.8, False), (-3.2, True)])
def test_a_tilt_that_nobody_has_is_said_whatever_the_tape_says(sds, said):
    """Rear spines on a belt: the legs by the tape are right, and the fit hardly moves the hips."""
    tilt = TILT + sds * TILT_SD
    chosen = SimpleNamespace(hip_forward=FORWARD, pelvic_tilt=tilt)
    points = {f"{side}.ASIS": [0.15, 0.1, SPINE] for side in "RL"}
    points |= {"Sacrum": [0.0, 0.1, SPINE]}
    points |= {f"{side}.Ankle": [0.15, 0.1, 0.08] for side in "RL"}
    leg = SPINE - 0.08 + LEG
    found = low_spines(SimpleNamespace(chosen=chosen), points, (leg, leg))
    flags = [*low_spines_warnings(found, NAMES, tilt)]
    assert len(flags) == said
    assert all(f"tilted by {np.degrees(tilt):.0f}°" in str(each) for each in flags)
    assert all("rear" in str(each) for each in flags)


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


def test_a_moment_of_the_wrong_sign_once_more_is_the_right_one():
    """The effect of size one, of what the mirrored plate shows, is what it shows too much."""
    random = np.random.default_rng(3)
    middle = np.array([0.3, 0.2, 0.0])
    right = random.standard_normal((5, 6))
    right[:, 2] += 700.0
    about = right[:, 3:] - np.cross(middle, right[:, :3])
    mirrored = right.copy()
    mirrored[:, 3:] = about * [-1.0, 1.0, 1.0] + np.cross(middle, right[:, :3])
    force, moment = _plate_effects(mirrored, middle, 700.0)["mirrored moment"]
    assert np.allclose(mirrored - np.hstack([force, moment]), right)


def test_a_plate_that_alone_is_late_shows_what_its_delay_adds():
    """Two plates, the second late by 5 ms: what Newton's law has too much is that of its effect."""
    time, late = np.arange(300) / 100.0, 0.005

    def wrenches(seconds):
        each = []
        for phase, by in ((0.0, 0.0), (np.pi, seconds)):
            up = 350.0 * (1.0 + np.sin(2.0 * np.pi * (time - by) + phase))
            each.append(np.stack([0.1 * up, 0.02 * up, up, 0.1 * up, -0.4 * up, 0.0 * up], axis=1))
        return GroundWrenches(
            feet=np.stack(each, axis=1), on=np.ones((300, 2), bool), valid=np.ones((300, 2), bool),
            plates=np.stack(each), height=0.0, rate=100.0,
        )  # fmt: skip

    plates = SimpleNamespace(plates=[SimpleNamespace(name="1"), SimpleNamespace(name="2")])
    centre, needed = np.tile([0.3, 0.1, 0.9], (300, 1)), np.zeros((300, 6))
    known = centre, needed, plates, [np.zeros(3)] * 2, 700.0
    right, _ = newton(wrenches(0.0), *known)
    wrong, effects = newton(wrenches(late), *known)
    inside = slice(5, -5)
    added = late * effects["plate delay 2"]
    assert np.abs(wrong - right)[inside].max() > 0.01
    assert np.allclose((wrong - right)[inside], added[inside], atol=3e-4)
    both = {cause.name for cause in causes(["gain 1", "gain 2", "plate delay 1", "plate delay 2"])}
    assert {"plate delay 1", "plate delay 2"} <= both
    assert not any("delay" in each.name for each in causes(["gain 1", "plate delay 1"]))
