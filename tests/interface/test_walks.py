"""A stored policy walks from Python as it was validated, and is compared as it was."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from momentum import momentum_residual
from threadpoolctl import threadpool_info, threadpool_limits
from unrecorded_verdicts import expected

import gaitval as gv
from gaitval.errors import ConfigurationError, PolicyError, RecordError, SubjectError
from gaitval.interface import walks
from gaitval.metrics.walk_comparison import Comparison
from gaitval.study.stored_policy import StoredPolicy
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference import dynamic_fit
from gaitval.walk.simulation.simulated_walk import SimulatedWalk
from gaitval.walk.simulation.walker import WalkingTask


def test_only_what_acts_on_a_walker_changes_its_momentum(walk: SimulatedWalk):
    """Newton's second law over windows of a second: 0.05 % of the body's weight."""
    residual = momentum_residual(walk, walk.mass_kg)
    assert residual is not None
    assert residual < 0.05


def test_a_policy_is_stored_whole(policy: StoredPolicy, tmp_path: Path):
    policy.save(tmp_path)
    again = StoredPolicy.load(tmp_path)
    np.testing.assert_array_equal(again.identified, policy.identified)
    assert repr(again) == repr(policy)
    (tmp_path / "correction.json").unlink()
    with pytest.raises(PolicyError, match=r"correction\.json"):
        gv.load_policy(tmp_path)


def test_a_name_that_no_file_can_have_is_no_subject() -> None:
    with pytest.raises(SubjectError, match="no such subject"):
        gv.load_policy("a" * 5000)


def test_references_are_fitted_and_walked_with_one_thread_of_linear_algebra(
    policy: StoredPolicy, monkeypatch: pytest.MonkeyPatch
):
    """More round sums differently, and a walk of 20 gait cycles was 2 cm elsewhere by it."""
    threads = []

    def counted(done: Callable[..., object]) -> Callable[..., object]:
        def counting(*given: object, **named: object) -> object:
            blas = [each for each in threadpool_info() if each["user_api"] == "blas"]
            threads.append({each["num_threads"] for each in blas})
            return done(*given, **named)

        return counting

    monkeypatch.setattr(dynamic_fit, "fitted", counted(dynamic_fit.fitted))
    monkeypatch.setattr(walks, "record_rollout", counted(walks.record_rollout))
    with threadpool_limits(2, "blas"):
        gv.reference_motion(policy.subject)
        gv.rollout(StoredPolicy.load(policy.folder), cycles=0.1)
        StoredPolicy.load(policy.folder).task  # noqa: B018  fitted, and not walked
    assert len(threads) >= 4  # one more where the walker has another body than the scaled one
    assert threads == [{1}] * len(threads)


def test_the_reference_motion_of_a_policy_is_built_once(
    policy: StoredPolicy, walk: SimulatedWalk, monkeypatch: pytest.MonkeyPatch
):
    """And a second walk is the same as the first."""

    def refuse(*_: object) -> None:
        raise AssertionError("the walking task was built again")

    gv.rollout(policy, cycles=1, body="nominal")
    monkeypatch.setattr(WalkingTask, "of", refuse)
    np.testing.assert_array_equal(gv.rollout(policy, cycles=6).positions, walk.positions)
    nominal = gv.rollout(policy, cycles=1, body="nominal")
    np.testing.assert_array_equal(nominal.mu, policy.nominal)


def test_a_walk_is_kept_as_it_was(walk: SimulatedWalk, tmp_path: Path):
    assert "did not fall" in repr(walk)
    walk.save(tmp_path / "walk.npz")
    again = SimulatedWalk.load(tmp_path / "walk.npz")
    np.testing.assert_array_equal(again.positions, walk.positions)
    assert (again.walker, again.mass_kg) == ("S05", walk.mass_kg)


def test_a_walk_against_the_record_and_itself(walk: SimulatedWalk, tmp_path: Path):
    against = gv.compare(walk, gv.load_subject(5))
    assert "the record of S05" in repr(against)
    assert against.rmse("knee_angle_l") < gv.limits().tolerance[0].value
    assert set(against.to_frame().source) == {"walk of S05", "the record of S05"}
    against.save(tmp_path / "comparison.npz")
    assert repr(Comparison.load(tmp_path / "comparison.npz")) == repr(against)
    itself = gv.compare(walk, walk)
    assert max(itself.rmse(name) for name in itself.names) == 0.0


@pytest.mark.slow  # four dynamic fits
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"policy": "S05"}, "policy is 'S05', of type str. Give what load_policy"),
        ({"cycles": 0}, "cycles is 0. Give gait cycles, more than 0"),
        ({"cycles": float("nan")}, "cycles is nan"),
        ({"cycles": "6"}, "cycles is '6'"),
        ({"start_phase": 50}, "start_phase is 50. Give a phase of the right gait cycle, 0 to 1"),
        ({"start_phase": None}, "start_phase is None"),
        ({"body": "foo"}, "body is 'foo'. Give nominal or identified"),
        ({"push": 5}, "push is 5, of type int. Give .phase in gait cycles, N, rad left"),
        ({"push": (0.5, 300.0)}, "push has 2 values"),
        ({"push": (0.5, float("nan"), 0.0)}, r"push\[1\] is nan. Give a force from 0"),
        ({"push": (2.0, 300.0, 0.0)}, r"push\[0\] is 2.0. Give a phase within the walk, 0 to 1"),
    ],
)  # fmt: skip
def test_what_cannot_be_walked_is_refused(policy: StoredPolicy, arguments: dict, message: str):
    with pytest.raises(ConfigurationError, match=message):
        gv.rollout(**({"policy": policy, "cycles": 1} | arguments))


def test_what_cannot_be_compared_is_refused(walk: SimulatedWalk):
    with pytest.raises(ConfigurationError, match=r"against is 'S05', of type str. Give load_sub"):
        gv.compare(walk, "S05")
    with pytest.raises(ConfigurationError, match="walk is None"):
        gv.compare(None, walk)
    with pytest.raises(ConfigurationError, match=r"configuration is \{\}, of type dict"):
        gv.compare(walk, walk, configuration={})
    with pytest.raises(RecordError, match=r"no curve 'knee_angle'. There are .*knee_angle_r"):
        gv.compare(walk, walk).rmse("knee_angle")


@pytest.mark.slow  # two further fits
def test_without_plates_a_policy_walks_after_the_estimate(policy: StoredPolicy):
    """As does one whose run was not to know the kinetics; both had walked after recorded ones."""
    person, configuration = expected(policy.subject, policy.configuration)
    unknown = replace(policy, subject=person, configuration=configuration).task
    record = policy.configuration.record.model_copy(update={"use": "kinematics"})
    without_kinetics = replace(
        policy, configuration=policy.configuration.model_copy(update={"record": record})
    ).task
    np.testing.assert_array_equal(without_kinetics.reference.positions, unknown.reference.positions)
    assert (
        np.abs(policy.task.reference.positions - without_kinetics.reference.positions).max() > 0.01
    )
    moments = [each.record.moments["hip_flexion_r"] for each in (policy.task, without_kinetics)]
    assert moments[0] == policy.subject.record().moments["hip_flexion_r"]
    assert moments[1] != moments[0]


def test_the_policy_of_a_file_is_of_its_own_content(tmp_path):
    path = tmp_path / "same.toml"
    path.write_text(load_subject("S05").to_toml())
    assert gv.load_policy(path).subject.mass_kg == load_subject("S05").mass_kg
    path = tmp_path / "heavy.toml"
    path.write_text(load_subject("S05").model_copy(update={"mass_kg": 80.0}).to_toml())
    with pytest.raises(PolicyError, match=r"heavy\.toml: .* S05, .*other values\. Run `gaitval"):
        gv.load_policy(path)


def test_a_folder_that_is_called_as_a_subject_is_not_taken_for_it(tmp_path, monkeypatch):
    (tmp_path / "5").mkdir()
    monkeypatch.chdir(tmp_path)
    assert gv.load_policy(5).subject.identifier == "S05"
    assert gv.load_policy("5").subject.identifier == "S05"
    for folder in (Path("5"), "./5"):
        with pytest.raises(PolicyError):
            gv.load_policy(folder)


@pytest.mark.parametrize(
    ("call", "seen"),
    [
        (lambda: gv.read_recording(5), "path is 5, of type int"),
        (lambda: gv.change(1, "after"), "before is 1, of type int"),
        (lambda: gv.write_report(None), "folder is None, of type NoneType"),
        (lambda: gv.run_study(5, out=3), "out is 3, of type int"),
    ],
)
def test_what_is_no_path_is_named(call, seen):
    with pytest.raises(ConfigurationError, match=seen):
        call()
