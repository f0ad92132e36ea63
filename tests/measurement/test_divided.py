"""A plate under both feet is divided: the parts add up, and are those of two plates."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_recording import BELTS, LANDMARKS, SPEED, walk

from gaitval._internal.io.artefacts import read_json
from gaitval.configuration import ProcessingSettings, load_configuration
from gaitval.coordinates import SIDES
from gaitval.datasets.sample import copy_sample
from gaitval.errors import RecordError
from gaitval.gait.divided import DIVIDED, _parts, _share, divided
from gaitval.gait.filters import low_pass
from gaitval.gait.foot_forces import _moment
from gaitval.importing.importing import import_files
from gaitval.mocap.force_plates import plate_axes
from gaitval.mocap.pressed_plates import plate_under
from gaitval.mocap.recording import Recording
from gaitval.session import trial
from gaitval.session.request import ImportOptions

PHASES = np.arange(200) / 200
SAGITTAL = ("hip_flexion", "knee_angle", "ankle_angle")


def as_one(recording: Recording) -> Recording:
    """A `recording`, zeroed and in the project's axes, whose plates are one."""
    plates = recording.plates
    corners = np.concatenate([plate.corners for plate in plates])
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y, z = np.stack([low, high], axis=1)
    # Clockwise from above, so that its third axis points down, as plates have it.
    around = np.array(
        [[x[1], y[0], z[0]], [x[0], y[0], z[0]], [x[0], y[1], z[0]], [x[1], y[1], z[0]]]
    )
    assert plate_axes(around)[2, 2] < 0.0
    force = sum((plate.force for plate in plates), np.zeros_like(plates[0].force))
    moment = sum((_moment(plate) for plate in plates), np.zeros_like(force))
    return replace(recording, plates=(plate_under("1", around, force, moment),))


def errors(right: Any, found: Any) -> dict[str, float]:
    """Root mean squares over a cycle, worse side, of two records: forces % of body weight, and the
    mean of the sagittal moments Nm/kg.
    """
    differences = [
        found.ground_reaction(s, PHASES) - right.ground_reaction(s, PHASES) for s in SIDES
    ]
    forces = 100.0 * np.sqrt(np.mean(np.square(differences), axis=1)).max(axis=0)
    moments = [
        np.sqrt(np.mean((found.moments[name](PHASES) - right.moments[name](PHASES)) ** 2))
        for side in "rl"
        for name in (f"{joint}_{side}" for joint in SAGITTAL)
    ]
    values = (*forces, np.mean(moments))
    return dict(
        zip(("forward", "sideways", "vertical", "moments"), map(float, values), strict=True)
    )


def test_the_parts_add_up_and_their_forces_meet_with_the_sums():
    rng = np.random.default_rng(1)
    wrench = rng.normal(0.0, 50.0, (30, 6))
    wrench[:, 2] += 700.0
    level = 0.1  # m, of the plate above the origin
    at = np.stack([-wrench[:, 4], wrench[:, 3]], axis=1) + level * wrench[:, :2]
    at /= wrench[:, 2:3]
    behind, ahead = at - np.array([0.3, 0.1]), at + np.array([0.2, -0.1])
    arms = [np.column_stack([each, np.full(30, level)]) for each in (behind, ahead)]
    share, height = np.linspace(0.0, 1.0, 30), 1.2
    parts = _parts(wrench, at, arms, share, height, 1)
    np.testing.assert_allclose(parts.sum(axis=1), wrench, atol=1e-9)
    np.testing.assert_allclose(parts[:, 0, 2], share * wrench[:, 2])
    # The lines of the sum's force and of that in front are at one place at this height.
    meet = at + height * wrench[:, :2] / wrench[:, 2:3]
    there = ahead[1:] + height * parts[1:, 0, :2] / parts[1:, 0, 2:3]
    np.testing.assert_allclose(there, meet[1:], atol=1e-9)
    assert not parts[0, 0, :3].any()


def test_the_load_goes_over_once():
    found = _share(np.array([-0.1, 0.1, 0.05, 0.3, 0.25, 0.6]), np.full(6, 0.5), 0.02)
    assert (np.diff(found) >= 0.0).all()
    assert (found[0], found[-1]) == (0.0, 1.0)
    assert found[1] == pytest.approx(0.15)  # between 0.2 and 0.1
    assert np.isfinite(_share(np.array([0.0, 0.1]), np.zeros(2), 0.02)).all()


def both_belts(up: float = 0.0):
    """A walk on a split belt: the recording, where each foot stands, where both, and the wrench of
    each belt (T, 2, 6), all raised by `up`, m.
    """
    recording = walk(belt=SPEED, plates=BELTS)
    higher = np.array([0.0, 0.0, up])
    each = np.stack(
        [
            np.hstack([plate.force, plate.moment + np.cross(higher, plate.force)])
            for plate in recording.plates
        ],
        axis=1,
    )
    stance = each[:, :, 2] > 20.0
    raised = recording.with_markers(recording.names, recording.markers + higher)
    return raised, stance, stance.all(axis=1), each


def test_the_height_of_a_plate_is_no_matter():
    levels = (0.0, 0.4)
    (plain, high) = (
        divided(recording, LANDMARKS, stance, both, each.sum(axis=1), up, ProcessingSettings())
        for up in levels
        for recording, stance, both, each in [both_belts(up)]
    )
    assert len(plain) == len(high) > 4
    for (here, low), (there, up) in zip(plain, high, strict=True):
        assert here == there
        np.testing.assert_allclose(up[..., :3], low[..., :3], atol=1e-6)
        lever = np.cross([0.0, 0.0, levels[1]], low[..., :3])
        np.testing.assert_allclose(up[..., 3:] - lever, low[..., 3:], atol=1e-6)


def test_feet_that_roll_as_supposed_get_what_is_theirs():
    """Behind to the toes late, in front from the heel early, as the module says."""
    recording, stance, both, each = both_belts()
    processing = ProcessingSettings()
    whole = each.sum(axis=1)
    given = divided(recording, LANDMARKS, stance, both, whole, 0.0, processing)
    length = 0.175  # m, from the heel's marker to the middle of the metatarsals'
    smooth = low_pass(
        whole, rate=recording.force_rate, cutoff_hz=processing.force_cutoff_hz,
        order=processing.filter_order,
    )  # fmt: skip
    for during, _ in given:
        behind = int(stance[during.start, 1])
        frames = np.arange(during.start, during.stop) / recording.force_rate
        at = {
            (side, place): np.stack(
                [
                    np.interp(frames, recording.time, recording.marker(name)[:, axis])
                    for axis in (0, 1)
                ],
                axis=1,
            )
            for side in (0, 1)
            for place, name in (
                ("heel", f"{'RL'[side]}.Heel"), ("one", f"{'RL'[side]}.MT1"),
                ("five", f"{'RL'[side]}.MT5"),
            )
        }  # fmt: skip
        toe = 0.5 * (at[behind, "one"] + at[behind, "five"])
        heel = at[1 - behind, "heel"]
        pressure = np.stack([-smooth[during, 4], smooth[during, 3]], axis=1) / smooth[during, 2:3]
        time = np.linspace(0.0, 1.0, len(frames))
        # along x: from where each stands alone to the toes, and from the heel on
        rear = toe[:, 0] + (1.0 - time**DIVIDED.late) * (pressure[0] - toe[0])[0]
        rear += time**DIVIDED.late * DIVIDED.toes * length
        early = time ** (1.0 / DIVIDED.late)
        front = (
            heel[:, 0]
            + early * (pressure[-1] - heel[-1])[0]
            + (1.0 - early) * DIVIDED.heel * length
        )
        share = np.linspace(0.0, 1.0, len(frames))
        # a pressure that goes over evenly between these two
        made = whole.copy()
        made[during] = smooth[during]
        wanted = (1.0 - share) * rear + share * front
        made[during, 4] = -wanted * made[during, 2]
        (part,) = [
            p for d, p in divided(recording, LANDMARKS, stance, both, made, 0.0, processing)
            if d == during
        ]  # fmt: skip
        middle = slice(8, -8)
        found = (part[:, 1 - behind, 2] / part[:, :, 2].sum(axis=1))[middle]
        np.testing.assert_allclose(found, share[middle], atol=0.05)


@pytest.mark.slow  # three imports
def test_of_one_plate_each_foot_has_what_its_own_plate_measured(tmp_path: Path, monkeypatch):
    copy_sample(tmp_path / "sample")
    about = read_json(tmp_path / "sample" / "truth.json")
    options = ImportOptions(
        static=tmp_path / "sample" / "standing.c3d",
        trials=(tmp_path / "sample" / "walking.c3d",),
        mass=about["mass_kg"],
        height=about["height_m"],
        sex=about["sex"],
    )

    def imported(options, out):
        return import_files(options, tmp_path / out, configuration=load_configuration())

    own = imported(options, "own")
    zeroed = trial.zero_plates

    def made_one(recording, **given):
        recording, findings = zeroed(recording, **given)
        return as_one(recording), findings

    monkeypatch.setattr(trial, "zero_plates", made_one)
    with pytest.raises(RecordError, match=r"both feet on this plate.*--plate 1=both") as refused:
        imported(options, "plain")
    assert refused.value.goes_on == ("--plate 1=both", "--kinematics-only")
    found = imported(options.model_copy(update={"plate": (("1", "both"),)}), "divided")
    (walk,) = found.found.trials
    for side in SIDES:
        assert sum(not cycle.reasons for cycle in walk.cycles[side]) >= 2
    wrong = errors(own.subject.record(), found.subject.record())
    assert wrong["vertical"] < 3.0
    assert wrong["forward"] < 2.0
    assert wrong["sideways"] < 1.5
    assert wrong["moments"] < 0.08
