"""Correction of the reference: the change itself, the search, and what it does to a stored walk."""

import re
import shutil
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize
from simulation_fixtures import changed

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.apps.regression.baseline import walk_again
from gaitval.configuration import load_configuration
from gaitval.correction.correct import (
    CorrectedWalk,
    beside_reference,
    correct,
    prior_sd,
    target,
)
from gaitval.correction.search import effective_number, harm, search
from gaitval.correction.slopes import SLOPES, Slopes, places, shared_slopes
from gaitval.correction.walked import ACCURACY, Walked, accuracy_of, fitted
from gaitval.gait.cycle_curves import JOINT_ANGLES, PELVIS_ANGLES, recorded_curves
from gaitval.metrics.comparison import low_pass_of, rms, simulated_curves
from gaitval.metrics.curve_results import by_kind
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.reference_curves import reference_curves
from gaitval.metrics.results import Endurance
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_together
from gaitval.policy.storage import load_policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.study.stage import Observer
from gaitval.study.stored_policy import general_walker
from gaitval.walk.reference.adjustment import JOINTS, Adjustment, adjusted

BASELINE = Path(__file__).parents[2] / "reports" / "S05" / "baseline"


# ---- The change. ----


@pytest.mark.parametrize(("side", "other"), [("r", 1), ("l", 0)])
def test_hip_flexion_of_one_side_takes_that_foot_forward_alone(task, side, other):
    numbers = np.zeros((len(JOINTS), 1))
    numbers[JOINTS.index(f"hip_flexion_{side}")] = np.deg2rad(1.0)
    moved = adjusted(task.reference, task.model, Adjustment(numbers, 0.0))
    change = moved.end_effectors - task.reference.end_effectors
    assert (change[:, 1 - other, 0] > 0.005).all()
    np.testing.assert_allclose(change[:, other], 0.0, atol=1e-12)


# ---- What is to be made small. ----


KNEE = accuracy_of("angles", "knee_angle_r")


def walked(deviations, left_out: float = 0.5) -> Walked:
    """A walk whose knee is off by the size of its deviations."""
    size = float(np.linalg.norm(deviations))
    rmse = {("angles", "knee_angle_r"): KNEE * size, ("angles", "pelvis_list_r"): left_out}
    return Walked(np.asarray(deviations, dtype=float), rmse)


def test_the_error_is_of_the_fitted_curves_over_their_accuracy():
    rmse = {
        ("angles", "knee_angle_r"): KNEE,
        ("forces", "vertical_l"): 2.0 * accuracy_of("forces", "vertical_l"),
        ("angles", "pelvis_tilt_r"): 9.0,
        ("angles", "pelvis_tilt_l"): 1.0,
    }
    found = Walked(np.zeros(1), rmse)
    assert found.error() == pytest.approx(np.sqrt((1.0 + 4.0) / 2.0))
    assert found.left_out() == pytest.approx(np.sqrt(41.0))


def test_a_walk_is_compared_with_its_reference_and_no_record(quick, walker):
    """Errors are those of the mean curves; the deviations weigh each by its accuracy."""
    policy, mu = walker
    none = Adjustment(np.zeros((len(JOINTS), 1)), 0.0)
    [found] = beside_reference(WalkingEnvironment(quick), [CorrectedWalk(policy, mu, none, 0.0)])
    group = WalkingGroup([quick] * 8)
    [rollout] = record_together(group, policy, mu=mu, start_phases=[0.0], cycles=13)
    configuration = quick.configuration
    curves = simulated_curves(
        rollout,
        find_cycles(rollout, configuration).first(8),
        mass=quick.model.mass,
        filters=low_pass_of(quick.record, configuration.validation.filter_frequency),
    )
    wanted = reference_curves(quick.reference, quick.model.mass, quick.record.left_phase)
    off = 100.0 * (curves.forces["vertical_l"].mean(axis=0) - wanted.forces["vertical_l"])
    assert found.rmse["forces", "vertical_l"] == pytest.approx(rms(off))
    names = {f"{name}_{side}" for name in PELVIS_ANGLES for side in "rl"}
    assert {curve for kind, curve in found.rmse if not fitted(kind, curve)} == names
    weighed = sum(
        (value / accuracy_of(*key)) ** 2 for key, value in found.rmse.items() if fitted(*key)
    )
    assert found.deviations @ found.deviations == pytest.approx(12 * weighed)


def test_the_target_lies_between_the_reference_and_the_record(quick, walker):
    curves = [target(quick, share) for share in (0.0, 0.3, 1.0)]
    reference = reference_curves(quick.reference, quick.model.mass, quick.record.left_phase)
    recorded = by_kind(recorded_curves(quick.record))
    for kind, name in (("angles", "knee_angle_r"), ("moments", "hip_flexion_l"),
                       ("forces", "medial_l")):  # fmt: skip
        first, between, last = (each[kind][name] for each in curves)
        np.testing.assert_array_equal(first, by_kind(reference)[kind][name])
        np.testing.assert_allclose(last, recorded[kind][name])
        np.testing.assert_allclose(between, 0.7 * first + 0.3 * last)
    # what shows harm is compared with the reference alone
    assert not fitted("angles", "pelvis_tilt_r")
    np.testing.assert_array_equal(
        curves[2]["angles"]["pelvis_tilt_r"], by_kind(reference)["angles"]["pelvis_tilt_r"]
    )
    none = CorrectedWalk(*walker, Adjustment(np.zeros((len(JOINTS), 1)), 0.0), 0.0)
    there, near = (
        beside_reference(WalkingEnvironment(quick), [none], share)[0].rmse["forces", "medial_l"]
        for share in (0.0, 1.0)
    )
    assert there != near


def test_a_walk_that_falls_says_nothing(quick, walker):
    policy, mu = walker
    numbers = np.zeros((len(JOINTS), 1))
    numbers[JOINTS.index("lumbar_extension"), 0] = np.deg2rad(-40.0)
    cases = [
        CorrectedWalk(policy, mu, Adjustment(each, 0.0), 0.0)
        for each in (0.0 * numbers, numbers, numbers)
    ]
    found = beside_reference(WalkingEnvironment(quick), cases)
    assert [each is None for each in found] == [False, True, True]


# ---- The search. ----


def unknown(unknowns: int = 5, curves: int = 40) -> Slopes:
    """Nothing is known of the slopes but their size."""
    return Slopes(np.zeros((curves, unknowns)), 1e4 * np.eye(unknowns))


def searched(one, *, known: Slopes | None = None, steps: int = 30, allowed=lambda _: True):
    return search(
        lambda points: [one(each) for each in points],
        known or unknown(),
        steps=steps,
        allowed=allowed,
    )


def linear(unknowns: int = 5, seed: int = 0):
    """Deviations that answer linearly; the least objective under the prior, and where it is."""
    random = np.random.default_rng(seed)
    slopes = random.normal(0, 0.5, (40, unknowns))
    offset = slopes @ random.choice([-0.6, 0.6], unknowns) + random.normal(0, 0.1, 40)
    best = np.linalg.solve(slopes.T @ slopes + np.eye(unknowns), -slopes.T @ offset)
    return (lambda point: walked(offset + slopes @ point)), best, slopes


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_search_finds_the_least_error_under_the_prior(seed):
    """In a step where the slopes are known."""
    one, best, slopes = linear(seed=seed)
    found = searched(one, known=Slopes(slopes, 1e-12 * np.eye(5)), steps=1)
    np.testing.assert_allclose(found.point, best, atol=1e-6)
    assert found.errors[-1] == pytest.approx(one(best).error())
    hat = slopes @ np.linalg.solve(slopes.T @ slopes + np.eye(5), slopes.T)
    assert found.effective_number == pytest.approx(np.trace(hat))


def test_numbers_that_the_walk_does_not_answer_to_are_not_free():
    slopes = np.zeros((40, 5))
    slopes[0, 0], slopes[1, 1] = 100.0, 1.0
    assert effective_number(slopes) == pytest.approx(1.5, abs=1e-3)


def test_slopes_that_are_not_known_are_learned_from_the_walks():
    """Beginning with those of somebody who answers otherwise."""
    one, best, slopes = linear()
    other = slopes + np.random.default_rng(1).normal(0, 0.2, slopes.shape)
    objective = lambda x: one(x).deviations @ one(x).deviations + x @ x  # noqa: E731
    known = Slopes(other, 40 * 0.2**2 * np.eye(5))
    first = searched(one, known=known, steps=1)
    found = searched(one, known=known)
    assert objective(found.point) < 1.02 * objective(best) < objective(first.point)


def test_a_walk_teaches_the_slopes_along_its_step_alone():
    """With little noise the step would have been predicted; at a right angle nothing is known."""
    known = Slopes(np.zeros((3, 4)), 1e6 * np.eye(4))
    learned = known.learned(np.array([[0.0, 2.0, 0.0, 0.0]]), np.array([[2.0, -4.0, 6.0]]))
    np.testing.assert_allclose(learned.mean[:, 1], [1.0, -2.0, 3.0], rtol=1e-3)
    assert not learned.mean[:, [0, 2, 3]].any()
    assert learned.covariance[1, 1] == pytest.approx(SLOPES.noise / 4.0, rel=1e-3)
    np.testing.assert_allclose(np.diag(learned.covariance)[[0, 2, 3]], 1e6)


def test_walks_at_once_teach_what_they_teach_one_after_another():
    random = np.random.default_rng(2)
    root = random.standard_normal((4, 4))
    known = Slopes(random.standard_normal((3, 4)), 100.0 * root @ root.T)
    steps, changes = random.standard_normal((5, 4)), random.standard_normal((5, 3))
    one = known
    for step, change in zip(steps, changes, strict=True):
        one = one.learned(step[None], change[None])
    together = known.learned(steps, changes)
    np.testing.assert_allclose(together.mean, one.mean, atol=1e-10)
    np.testing.assert_allclose(together.covariance, one.covariance, atol=1e-8)


def test_an_answer_that_bends_is_followed():
    """The walk answers less and less, as a walk does."""
    one, _, slopes = linear()

    def bent(point):
        return one(np.tanh(1.5 * point) / 1.5)

    found = searched(bent, known=Slopes(slopes, 40.0 * np.eye(5)))
    objective = lambda x: bent(x).deviations @ bent(x).deviations + x @ x  # noqa: E731
    best = minimize(objective, np.zeros(5), tol=1e-12)
    assert objective(found.point) < 1.05 * best.fun
    assert list(found.errors) == sorted(found.errors, reverse=True)


def test_points_that_are_not_allowed_are_never_walked_at():
    one, best, slopes = linear()
    limit = 0.5 * np.abs(best).max()
    tried = []

    def walk(point):
        tried.append(point)
        return one(point)

    known = Slopes(slopes, np.eye(5))
    found = searched(walk, known=known, allowed=lambda each: np.abs(each).max() <= limit)
    assert 0.0 < np.abs(found.point).max() <= limit
    assert max(np.abs(each).max() for each in tried) <= limit


def test_walks_that_fall_are_left_out():
    """Long steps fall: the short ones still make it better."""
    one, best, slopes = linear()
    far = 0.6 * np.linalg.norm(best)
    found = searched(
        lambda point: None if np.linalg.norm(point) > far else one(point),
        known=Slopes(slopes, np.eye(5)),
    )
    assert found.errors[-1] < 0.98 * found.errors[0]
    assert 0.0 < np.linalg.norm(found.point) <= far


@pytest.mark.parametrize(
    "answer", [lambda one, x: None if x.any() else one(x), lambda one, x: one(-x)],
    ids=["every step falls", "every step makes it worse"],
)  # fmt: skip
def test_a_walk_that_no_step_makes_better_is_left_as_it_was(answer):
    one, _, slopes = linear()
    found = searched(lambda point: answer(one, point), known=Slopes(slopes, 1e-9 * np.eye(5)))
    assert not found.point.any()
    assert found.errors == (one(np.zeros(5)).error(),)


def test_a_walker_that_falls_is_not_corrected():
    found = searched(lambda _: None)
    assert not found.point.any()
    assert found.errors == ()


# ---- What other people's walks say of the slopes. ----


def test_fewer_harmonics_are_the_first_of_those_that_are_stored():
    """Of each joint mean, cosines, sines; the last is the height."""
    found = places(2, 13)
    assert found[:5].tolist() == [0, 1, 2, 13, 14]
    assert found[5:7].tolist() == [25, 26]
    assert found[-1] == 13 * 25
    assert len(found) == 13 * 5 + 1
    few, all_ = shared_slopes(0.4, 2, 13, 101), shared_slopes(0.4, 12, 13, 101)
    np.testing.assert_array_equal(few.mean, all_.mean[:, found])
    np.testing.assert_array_equal(few.covariance, all_.covariance[np.ix_(found, found)])


@pytest.mark.parametrize("side", ["r", "l"])
def test_an_angle_follows_its_own_change(side):
    """Signs, units and order of the stored slopes, on both sides: the mean of the knee's angle
    follows that of its reference, degree by degree or less, and the other knee's hardly.
    """
    slopes = shared_slopes(0.4, 12, 13, 101).mean.reshape(26, 101, -1)
    curves = [*RECORDED_ORDER]
    unknown = 25 * JOINTS.index(f"knee_angle_{side}")
    other = "l" if side == "r" else "r"
    weight = np.sqrt(12 / 101) / accuracy_of("angles", f"knee_angle_{side}")
    own, its = (
        np.deg2rad(slopes[curves.index(f"knee_angle_{each}"), :, unknown].mean() / weight)
        for each in (side, other)
    )
    assert 0.5 < own < 1.0
    assert abs(its) < 0.3 * own


def test_other_units_are_other_numbers_for_the_same():
    known = shared_slopes(0.4, 2, 13, 101)
    units = prior_sd(2)
    scaled, change = known.scaled(units), np.random.default_rng(0).standard_normal(len(units))
    np.testing.assert_allclose(scaled.mean @ change, known.mean @ (units * change))
    np.testing.assert_allclose(
        change @ scaled.covariance @ change,
        (units * change) @ known.covariance @ (units * change),
    )


def test_above_the_fourth_harmonic_the_prior_is_of_equal_acceleration():
    sd = prior_sd(12)
    assert len(sd) == 13 * 25 + 1
    mean, cosines, sines = sd[0], sd[1:13], sd[13:25]
    np.testing.assert_array_equal(cosines, sines)
    np.testing.assert_allclose(cosines[:4], mean)
    np.testing.assert_allclose(cosines[3:] * np.arange(4, 13) ** 2, 16 * mean)
    assert sd[-1] == 0.003


def test_the_line_on_speed_is_not_read_beyond_the_speeds_of_those_people():
    slow, slower, fast, faster = (
        shared_slopes(speed, 1, 13, 101).mean for speed in (0.12, 0.01, 0.7, 3.0)
    )
    assert not np.array_equal(slow, fast)
    np.testing.assert_array_equal(fast, faster)
    assert np.abs(slow - slower).max() < 0.1 * np.abs(slow - fast).max()


def test_the_stored_covariance_is_one():
    covariance = shared_slopes(0.4, 12, 13, 101).covariance
    np.testing.assert_array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() > 0.0


def test_the_stored_slopes_are_of_the_policy_that_ships_and_of_todays_weights():
    about = read_json(BASELINE.parents[1] / "general" / "shared_slopes.json")
    policy = general_walker(load_configuration().environment)
    assert about["policy"] == policy.key
    assert about["accuracy"] == {kind: dict(values) for kind, values in ACCURACY.items()}
    assert about["curves"][:12] == [f"angles/{name}" for name in RECORDED_ORDER]


RECORDED_ORDER = [f"{name}_{side}" for side in "rl" for name in JOINT_ANGLES]


# ---- Whether it is used. ----


@pytest.mark.parametrize(
    ("after", "other", "reason"),
    [
        (walked([0.5]), walked([0.6]), None),
        (walked([0.5], left_out=0.7), walked([0.6], left_out=0.75), None),
        (walked([0.5], left_out=0.8), walked([0.6]), "pelvis's angles.*0.30 degrees worse.*0.25"),
        (walked([0.5]), walked([0.6], left_out=0.9), "pelvis's angles.*0.35 degrees worse"),
        (walked([0.5]), walked([1.2]), "gets no better"),
        (walked([0.5]), None, "fell"),
        (None, walked([0.6]), "fell"),
    ],
)
def test_it_is_refused_where_it_does_harm(after, other, reason):
    found = harm(walked([1.0]), after, walked([1.1], left_out=0.55), other)
    assert found is None if reason is None else re.search(reason, found)


# ---- How much of it is used. ----


ANSWER = np.random.default_rng(3).standard_normal((20, 14))
"""Of 20 deviations to 13 angles and the height, in 1/30 rad and 1/30 m."""
KNOWN = Slopes(
    30.0 * (ANSWER + 0.5 * np.random.default_rng(4).standard_normal((20, 14))),
    20 * (30.0 * 0.5) ** 2 * np.eye(14),
)
"""Those of somebody who answers otherwise."""


class LinearPool:
    """In the place of a walker: deviations that follow from the changes, and nothing else."""

    workers = 1

    def __init__(self, *_, **__):
        self.offset = np.random.default_rng(5).standard_normal(20)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def with_task(self, task):
        """The task of long walks."""
        return task

    def each(self, _, cases):
        for case in chain.from_iterable(cases):
            change = np.array([*case.correction.harmonics.ravel(), case.correction.height])
            off = self.offset + 30.0 * ANSWER @ change + 0.01 * case.start_phase
            errors = {("angles", "knee_angle_r"): rms(off), ("angles", "pelvis_tilt_r"): 0.5}
            yield [Walked(off, errors) if abs(off[0]) < 5.0 else None]


class HarmfulPool(LinearPool):
    """The pelvis, which is not fitted, gets worse in proportion to the change; from some start
    phases alone."""

    worse = 0.0
    start_phases = ()

    def each(self, function, cases):
        cases = [list(some) for some in cases]
        walks = super().each(function, cases)
        for case, (walk,) in zip(chain.from_iterable(cases), walks, strict=True):
            harmful = case.start_phase in (HarmfulPool.start_phases or (case.start_phase,))
            change = rms(walk.deviations - self.offset)
            key = ("angles", "pelvis_tilt_r")
            errors = {**walk.rmse, key: walk.rmse[key] + harmful * HarmfulPool.worse * change}
            yield [replace(walk, rmse=errors)]


def test_the_largest_share_of_a_correction_that_does_no_harm_is_used(quick, walker, monkeypatch):
    """Harm that the whole change does and 70 % of it does not; and harm that any share does."""
    monkeypatch.setattr("gaitval.correction.correct.RolloutPool", HarmfulPool)
    monkeypatch.setattr("gaitval.correction.correct.walked_far", lambda *_: ())
    whole = correct(quick, *walker, slopes=KNOWN)
    assert whole.share == 1.0
    assert whole.correction.harmonics.any()
    moved = rms(whole.after.deviations - whole.before.deviations)
    monkeypatch.setattr(HarmfulPool, "worse", 0.25 / (0.85 * moved))
    part = correct(quick, *walker, slopes=KNOWN)
    assert (part.share, part.refused) == (0.7, None)
    np.testing.assert_allclose(part.correction.harmonics, 0.7 * whole.correction.harmonics)
    assert part.after.error() < part.before.error()
    monkeypatch.setattr(HarmfulPool, "worse", 1.0 / moved)
    none = correct(quick, *walker, slopes=KNOWN)
    assert none.share == 0.0
    assert "pelvis" in none.refused
    assert not none.correction.harmonics.any()
    assert none.result().share == 0.0
    # also where only a walk from half a cycle later shows it, which the search has not seen
    (start, *_) = quick.configuration.validation.start_phases
    monkeypatch.setattr(HarmfulPool, "start_phases", ((start + 0.5) % 1.0,))
    assert "pelvis" in correct(quick, *walker, slopes=KNOWN).refused


def test_of_a_correction_with_which_more_long_walks_fall_less_is_used(quick, walker, monkeypatch):
    """Who is moved by more than half of the whole change falls; by any share of it; some anyhow."""
    where = "gaitval.correction.correct."
    monkeypatch.setattr(f"{where}RolloutPool", LinearPool)
    high, anyhow = [np.inf], [0]
    walks = []

    def far(task, policy, mu, phases):
        moved = np.abs(task.reference.positions - quick.reference.positions).max()
        walks.append(moved)
        falls = 2 if moved > high[0] else anyhow[0]
        return tuple(
            Endurance.model_validate(ENDURANCE | {"fell": n < falls}) for n, _ in enumerate(phases)
        )

    monkeypatch.setattr(f"{where}walked_far", far)
    whole = correct(quick, *walker, slopes=KNOWN)
    assert (whole.share, len(walks)) == (1.0, 1)
    assert not any(each.fell for each in whole.starts)
    high[0] = 0.5 * walks[0]
    part = correct(quick, *walker, slopes=KNOWN)
    assert (part.share, part.refused) == (0.4, None)
    np.testing.assert_allclose(part.correction.harmonics, 0.4 * whole.correction.harmonics)
    assert (len(part.starts), any(each.fell for each in part.starts)) == (8, False)
    high[0] = 0.1 * walks[0]
    none = correct(quick, *walker, slopes=KNOWN)
    assert (none.share, none.correction.harmonics.any()) == (0.0, False)
    assert none.refused == "2 of 16 long walks fall with it, 0 without"
    assert (len(none.starts), any(each.fell for each in none.starts)) == (8, False)
    anyhow[0] = 2
    assert correct(quick, *walker, slopes=KNOWN).share == 1.0


ENDURANCE = {
    "start_phase": 0.0,
    "seconds": 100.0,
    "cycles": {"right": 101, "left": 101},
    "scuffs": {"right": 0, "left": 0},
    "walking_speed": 1.2,
    "engine": "compiled",
}


# ---- A walk. ----


@pytest.fixture(scope="module")
def quick(task):
    return changed(
        task, correction={"steps": 3, "harmonics": 0, "largest": 0.05}, training={"workers": 2}
    )


@pytest.fixture(scope="module")
def walker():
    mu = np.array(read_json(BASELINE / "identification.json")["identified"])
    return load_policy(BASELINE / "policy"), mu


@pytest.mark.slow  # a whole correction
def test_a_stored_policy_walks_nearer_to_its_reference_with_the_means_alone(quick, walker):
    """Three steps with 14 unknowns; the same with one worker, and without a record's kinetics."""
    messages = []
    result = correct(quick, *walker, on_progress=messages.append)
    assert result.refused is None
    # A reference that differs in the tenth digit moves this by a few per cent; 0.964 was seen.
    assert result.errors[-1] < 0.98 * result.errors[0]
    assert result.before.error() == result.errors[0]
    # that of the whole step, or of the share of it that is used
    assert result.errors[-1] <= result.after.error() < result.errors[0]
    assert (result.after.error() == result.errors[-1]) is (result.share == 1.0)
    assert 0.0 < result.correction.largest() <= quick.configuration.correction.largest
    assert 3.0 < result.effective_number < 14.0
    assert messages[-1] == {"steps": len(messages), "total": 3, "error": result.errors[-1]}
    stored = result.result().as_dict()
    assert stored["numbers"] == 14
    knee = next(row for row in stored["curves"] if row["curve"] == "knee_angle_l")
    assert knee["before"] == result.before.rmse["angles", "knee_angle_l"]
    assert knee["after"] == result.after.rmse["angles", "knee_angle_l"]
    again = Adjustment.from_dict(stored, "")
    np.testing.assert_array_equal(again.harmonics, result.correction.harmonics)

    blind = replace(quick.record, moments={}, forces={})
    one_worker = changed(replace(quick, record=blind), training={"workers": 1})
    alone = correct(one_worker, *walker)
    np.testing.assert_array_equal(alone.correction.harmonics, result.correction.harmonics)
    assert alone.errors == result.errors


def test_no_steps_leave_the_reference(quick, walker):
    result = correct(changed(quick, correction={"steps": 0}), *walker)
    assert not result.correction.harmonics.any()
    assert result.correction.height == 0.0
    assert result.after.error() == result.before.error() == result.errors[0]
    assert result.refused is None


@pytest.mark.slow
def test_results_are_walked_with_it_but_the_nominal_body_is_not(tmp_path):
    """A stored walker again, whose right ankle's reference is 2 degrees further up: the walk that
    is judged follows, the one of the nominal body stays what it is."""
    shutil.copytree(BASELINE, tmp_path / "up")
    stored = read_json(BASELINE / "correction.json")
    numbers = np.array(stored["harmonics"])
    numbers[JOINTS.index("ankle_angle_r"), 0] += np.deg2rad(2.0)
    up = stored | Adjustment(numbers, stored["height"]).as_dict()
    write_json(tmp_path / "up" / "correction.json", up)
    plain = walk_again(BASELINE, Observer(), quick=True)
    changed = walk_again(tmp_path / "up", Observer(), quick=True)
    assert changed.walks.nominal == plain.walks.nominal
    ankle, other = (
        np.array(each.walks.identified.curves.angles["ankle_angle_r"].mean)
        for each in (changed, plain)
    )
    # the policy, with an action every 6 ms, answers about half of it
    assert 0.5 < (ankle - other).mean() < 3.0
    np.testing.assert_allclose(changed.correction.harmonics, up["harmonics"], rtol=1e-5)


def test_errors_of_a_walk_weigh_as_they_are_told():
    key = ("angles", "knee_angle_r")
    loose = {**ACCURACY, "angles": {**ACCURACY["angles"], "knee_angle": 3.0}}
    found = Walked(np.zeros(1), {key: 3.0}, loose)
    assert found.error() == pytest.approx(1.0)
    assert Walked(np.zeros(1), {key: 3.0}).error() == pytest.approx(3.0 / KNEE)
