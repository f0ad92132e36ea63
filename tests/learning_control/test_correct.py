"""Correction of the reference: the change itself, the search, and what it does to a stored walk."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize
from simulation_fixtures import changed
from synthetic_walk import MODEL, perfect_walk, sharp_filter, synthetic_record, walks_of

from gaitval.artefacts import read_json, write_json
from gaitval.coordinates import COORDINATES
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ArtefactError
from gaitval.learning_control.correct import correct, error, search
from gaitval.metrics.tolerances import aim
from gaitval.metrics.validation import deviations, validate
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames
from gaitval.policy.storage import load_policy
from gaitval.reference.adjustment import JOINTS, Adjustment, adjusted
from gaitval.study.baseline import walk_again
from gaitval.study.stage import Observer

BASELINE = Path(__file__).parents[2] / "reports" / "S05" / "baseline"
ACCEPTED = {"angle_rmse", "moment_rmse", "force_rmse"}
ACCEPTED |= {"speed_error", "stance_fraction_error", "step_length_error"}


def some_correction(harmonics: int = 3, seed: int = 0) -> Adjustment:
    random = np.random.default_rng(seed)
    return Adjustment(0.01 * random.standard_normal((len(JOINTS), 1 + 2 * harmonics)), 0.004)


# ---- The change. ----


def test_the_first_numbers_are_the_mean_then_cosines_then_sines():
    numbers = np.zeros((len(JOINTS), 5))
    numbers[2] = [0.1, 0.02, 0.0, 0.0, 0.003]
    phase = np.array([0.0, 0.125, 0.25, 0.8])
    change, _ = Adjustment(numbers, 0.0).angles(phase)
    expected = 0.1 + 0.02 * np.cos(2 * np.pi * phase) + 0.003 * np.sin(4 * np.pi * phase)
    np.testing.assert_allclose(change[:, 2], expected)
    assert not np.delete(change, 2, axis=1).any()


def test_the_slope_is_the_derivative_of_the_change():
    correction, phase, step = some_correction(), np.linspace(0.0, 1.0, 11), 1e-6
    after, before = (correction.angles(phase + sign * step)[0] for sign in (1, -1))
    np.testing.assert_allclose(
        correction.angles(phase)[1], (after - before) / (2 * step), rtol=1e-6, atol=1e-8
    )


def test_the_reference_moves_as_asked_and_all_that_follows_from_it(task):
    correction, reference = some_correction(), task.reference
    moved = adjusted(reference, task.model, correction)
    columns = [COORDINATES.index(name) for name in JOINTS]
    np.testing.assert_allclose(
        moved.positions[:, columns] - reference.positions[:, columns],
        correction.angles(reference.phase)[0],
        atol=1e-12,
    )
    height = COORDINATES.index("pelvis_tz")
    np.testing.assert_allclose(moved.positions[:, height] - reference.positions[:, height], 0.004)
    others = [i for i in range(31) if i not in (*columns, height)]
    np.testing.assert_array_equal(moved.positions[:, others], reference.positions[:, others])
    # Velocities are the rates of the positions: central differences over the cycle.
    time = reference.phase[1] * reference.stride_time
    for column in columns:
        angle = moved.positions[:, column]
        rate = (np.roll(angle, -1) - np.roll(angle, 1)) / (2 * time)
        np.testing.assert_allclose(moved.velocities[:, column], rate, atol=5e-3)
    frames = segment_frames(task.model, moved.positions)
    np.testing.assert_allclose(
        moved.end_effectors[:, 1], frames[:, SEGMENTS.index("foot_l"), :3, 3]
    )
    for name in ("moments", "ground_reaction"):
        np.testing.assert_array_equal(getattr(moved, name), getattr(reference, name))


@pytest.mark.parametrize(("side", "other"), [("r", 1), ("l", 0)])
def test_hip_flexion_of_one_side_takes_that_foot_forward_alone(task, side, other):
    numbers = np.zeros((len(JOINTS), 1))
    numbers[JOINTS.index(f"hip_flexion_{side}")] = np.deg2rad(1.0)
    moved = adjusted(task.reference, task.model, Adjustment(numbers, 0.0))
    change = moved.end_effectors - task.reference.end_effectors
    assert (change[:, 1 - other, 0] > 0.005).all()
    np.testing.assert_allclose(change[:, other], 0.0, atol=1e-12)


def test_no_change_is_none(task):
    same = adjusted(task.reference, task.model, Adjustment(np.zeros((len(JOINTS), 7)), 0.0))
    np.testing.assert_array_equal(same.positions, task.reference.positions)
    np.testing.assert_allclose(same.centre_of_mass, task.reference.centre_of_mass, atol=1e-12)


def test_it_is_stored_and_read_again():
    correction = some_correction()
    again = Adjustment.from_dict(correction.as_dict(), "here")
    np.testing.assert_array_equal(again.harmonics, correction.harmonics)
    assert again.height == correction.height


@pytest.mark.parametrize(
    "damage",
    [
        {"joints": list(JOINTS[::-1])},
        {"joints": None},
        {"height": None},
        {"height": float("nan")},
        {"harmonics": "much"},
        {"harmonics": [1.0, 2.0]},
        {"harmonics": [[0.0] * 7] * 8},
        {"harmonics": [[0.0] * 6] * len(JOINTS)},
        {"harmonics": [[float("inf")] * 7] * len(JOINTS)},
    ],
)
def test_a_damaged_correction_is_refused_and_named(damage):
    with pytest.raises(ArtefactError, match=r"correction\.json: not a correction.*gaitval correct"):
        Adjustment.from_dict(some_correction().as_dict() | damage, "correction.json")


# ---- What is to be made small. ----


def test_deviations_are_the_measures_over_their_goals():
    """Of a walk that is off in everything: the norms are what `validate` measures, over the goal
    or, for the speed, the limit."""
    record, configuration = synthetic_record(), sharp_filter(cycles=20, start_phases=(0.0,))
    walk = perfect_walk(record, cycles=23.0)
    off = replace(
        walk,
        positions=walk.positions + 0.02 * np.sin(40.0 * walk.time)[:, None],
        moments=1.1 * walk.moments + 3.0,
        ground_reaction=0.97 * walk.ground_reaction,
        time=1.01 * walk.time,
    )
    found = deviations(off, record, MODEL, configuration)
    metrics = validate(
        load_subject("S05"), record, MODEL, walks_of([off], configuration), None, configuration
    )
    measured = {
        (row["measure"], row["target"]): row["value"]
        for row in metrics["measures"]
        if aim(row["measure"], row["target"]) is not None and row["measure"] in ACCEPTED
    }
    assert set(found) == set(measured)
    assert len(found) == 33
    for key, value in measured.items():
        assert np.linalg.norm(found[key]) * aim(*key) == pytest.approx(value, rel=1e-4, abs=1e-9)
    assert aim("angle_rmse", "knee_angle_l") == 2.0
    assert aim("speed_error", "walk") == 5.0
    assert aim("angle_rmse", "subtalar_angle_r") is None


def test_a_walk_that_fell_or_is_too_short_has_no_deviations():
    record, configuration = synthetic_record(), sharp_filter(cycles=20, start_phases=(0.0,))
    walk = perfect_walk(record, cycles=23.0)
    fell = replace(walk, fell=np.array([1.0]))
    assert deviations(fell, record, MODEL, configuration) is None
    assert deviations(perfect_walk(record, cycles=1.5), record, MODEL, configuration) is None


def test_the_error_is_1_with_all_at_their_goals_and_looks_at_the_worst():
    ones = {("a", "x"): np.array([0.6, 0.8]), ("b", "y"): np.array([-1.0])}
    assert error(ones) == pytest.approx(1.0)
    even = {("a", "x"): np.array([1.0]), ("b", "y"): np.array([1.0])}
    uneven = {("a", "x"): np.array([1.4]), ("b", "y"): np.array([0.1])}
    assert error(uneven) > error(even)  # though its sum of squares is less


# ---- The search. ----


def linear(unknowns: int = 5, seed: int = 0):
    """Deviations of four groups that answer linearly, and the least error that there is; most of
    them can be taken away."""
    random = np.random.default_rng(seed)
    slopes = random.normal(0, 0.5, (40, unknowns))
    offset = slopes @ random.choice([-0.6, 0.6], unknowns) + random.normal(0, 0.1, 40)

    def one(point):
        value = offset + slopes @ point
        return {(f"group {i}", "x"): value[10 * i : 10 * i + 10] for i in range(4)}

    best = minimize(lambda point: error(one(point)), np.zeros(unknowns), tol=1e-12).fun
    return one, best


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_search_finds_the_least_error(seed):
    one, best = linear(seed=seed)
    point, errors = search(
        lambda points: [one(each) for each in points], 5, rounds=8, allowed=lambda _: True
    )
    assert errors[0] > 3.0 * best
    assert errors[-1] == pytest.approx(best, rel=2e-3)
    assert errors == sorted(errors, reverse=True)
    assert error(one(point)) == errors[-1]


def test_points_that_are_not_allowed_are_never_walked_at():
    one, best = linear()

    def allowed(point):
        return np.abs(point).max() <= 0.15

    walked = []

    def walk(points):
        walked.extend(points)
        return [one(each) for each in points]

    point, errors = search(walk, 5, rounds=4, allowed=allowed)
    assert best < errors[-1] < errors[0]
    assert allowed(point)
    probes = 0.4 + 0.15
    assert max(np.abs(each).max() for each in walked) <= probes + 1e-12


def test_walks_that_fall_are_left_out():
    """Two unknowns cannot be probed, and long steps fall: the rest is still made better."""
    one, best = linear()

    def walk(points):
        fallen = [abs(each[1]) > 0.3 or abs(each[3]) > 0.3 for each in points]
        return [None if down else one(each) for each, down in zip(points, fallen, strict=True)]

    point, errors = search(walk, 5, rounds=4, allowed=lambda _: True)
    assert best < errors[-1] < 0.98 * errors[0]
    assert not point[[1, 3]].any()


def test_a_walker_that_falls_is_not_corrected():
    point, errors = search(lambda points: [None] * len(points), 5, rounds=4, allowed=lambda _: True)
    assert not point.any()
    assert errors == []


def test_it_ends_when_nothing_helps():
    told = []
    _, errors = search(
        lambda points: [{("a", "x"): np.array([1.0])} for _ in points],
        5,
        rounds=4,
        allowed=lambda _: True,
        on_round=lambda number, found: told.append((number, found)),
    )
    assert errors == [1.0, 1.0]
    assert told == [(1, 1.0)]


# ---- A walk. ----


@pytest.fixture(scope="module")
def quick(task):
    return changed(
        task,
        validation={"cycles": 8},
        correction={"rounds": 1, "harmonics": 0},
        training={"workers": 2},
    )


@pytest.fixture(scope="module")
def walker():
    mu = np.array(read_json(BASELINE / "identification.json")["identified"])
    return load_policy(BASELINE / "policy"), mu


def test_a_stored_policy_walks_better_with_the_means_alone_corrected(quick, walker):
    """One round with 14 unknowns; it takes what helps from both starts, within the largest."""
    told = []
    result = correct(quick, *walker, on_progress=told.append)
    assert result.errors[-1] < 0.99 * result.errors[0]
    assert error(result.before) == result.errors[0]
    assert error(result.after) == result.errors[-1]
    assert 0.0 < result.correction.largest() <= quick.configuration.correction.largest
    assert told == [{"rounds": 1, "total": 1, "error": result.errors[-1]}]
    stored = result.as_dict()
    assert len(stored["measures"]) == len(result.before)
    ankle = next(row for row in stored["measures"] if row["target"] == "ankle_angle_l")
    assert ankle["before"] == pytest.approx(
        2.0 * np.linalg.norm(result.before["angle_rmse", "ankle_angle_l"])
    )
    again = Adjustment.from_dict(stored, "")
    np.testing.assert_array_equal(again.harmonics, result.correction.harmonics)

    one_worker = changed(quick, training={"workers": 1})
    alone = correct(one_worker, *walker)
    np.testing.assert_array_equal(alone.correction.harmonics, result.correction.harmonics)
    assert alone.errors == result.errors


def test_no_rounds_leave_the_reference(quick, walker):
    result = correct(changed(quick, correction={"rounds": 0}), *walker)
    assert not result.correction.harmonics.any()
    assert result.correction.height == 0.0
    assert error(result.before) == error(result.after) == result.errors[0]


def test_results_are_walked_with_it_but_the_nominal_body_is_not(tmp_path):
    """A stored walker again, whose right ankle's reference is 2 degrees up: the walk that is judged
    follows, the one of the nominal body stays what it is."""
    shutil.copytree(BASELINE, tmp_path / "up")
    stored = read_json(BASELINE / "correction.json")
    numbers = np.zeros_like(stored["harmonics"])
    numbers[JOINTS.index("ankle_angle_r"), 0] = np.deg2rad(2.0)
    up = stored | Adjustment(numbers, 0.0).as_dict()
    write_json(tmp_path / "up" / "correction.json", up)
    plain = walk_again(BASELINE, Observer(), quick=True)
    changed = walk_again(tmp_path / "up", Observer(), quick=True)
    assert changed["walks"]["nominal"] == plain["walks"]["nominal"]
    ankle, other = (
        np.array(each["walks"]["identified"]["curves"]["angles"]["ankle_angle_r"]["mean"])
        for each in (changed, plain)
    )
    assert 1.0 < (ankle - other).mean() < 3.0
    np.testing.assert_allclose(changed["correction"]["harmonics"], up["harmonics"], rtol=1e-5)
