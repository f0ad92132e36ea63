import json
from dataclasses import replace
from importlib import resources

import jsonschema
import numpy as np
import pytest
from synthetic_walk import (
    MODEL,
    SPEED,
    perfect_walk,
    sharp_filter,
    synthetic_record,
    walks_of,
)

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.errors import ArtefactError
from gaitval.metrics.baselines import group_rows
from gaitval.metrics.comparison import low_pass_of, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.results import PushRecovery, SpatiotemporalResult
from gaitval.metrics.validation import StageResults, spatiotemporal_measures, validate
from gaitval.subjects.subject_file import builtin_subjects, load_subject

RECORD = synthetic_record()
SUBJECT = load_subject("S05")
CONFIGURATION = sharp_filter(cycles=20, start_phases=(0.0, 0.5))
NOT_OF_A_MADE_UP_BODY = ("step-length", "step-width", "knee-range")
"""The angles of the record are not those of legs that stand on the ground."""


def _rollouts(cycles: float = 23.0):
    return [perfect_walk(RECORD, cycles=cycles, start_phase=phase) for phase in (0.0, 0.5)]


def _walks(rollouts):
    return walks_of(rollouts, CONFIGURATION)


def _validate(nominal, identified=None, by=None):
    return validate(SUBJECT, RECORD, MODEL, nominal, identified, CONFIGURATION, by).as_dict()


@pytest.fixture(scope="module")
def rollouts():
    return _rollouts()


@pytest.fixture(scope="module")
def walks(rollouts):
    return _walks(rollouts)


@pytest.fixture(scope="module")
def metrics(walks):
    return _validate(walks)


def _verdicts(metrics, tolerance):
    return [row["passed"] for row in metrics["tolerances"] if row["id"] == tolerance]


def _failed(metrics):
    return {
        row["id"]
        for row in metrics["tolerances"]
        if not row["passed"] and row["id"] not in NOT_OF_A_MADE_UP_BODY
    }


def test_a_perfect_walk_passes_every_tolerance_that_its_length_allows(metrics):
    assert _failed(metrics) == {"consecutive-cycles"}
    assert metrics["final"] == "nominal"
    walk = metrics["walks"]["nominal"]
    assert [start["cycles"]["right"] for start in walk["starts"]] == [21, 21]
    assert walk["cycles"] == {"right": 20, "left": 20}
    speed = walk["spatiotemporal"][0]
    assert (speed["name"], speed["mean"], speed["recorded"]) == ("walking_speed", SPEED, SPEED)


def test_the_summary_has_every_error_of_a_perfect_walk(metrics):
    """The hips of a made-up record are the walker's."""
    rows = {(row["kind"], row["curve"]): row for row in metrics["summary"]["errors"]}
    assert len(rows) == 9 + 4 + 3
    for (kind, curve), row in rows.items():
        sides = [metrics["walks"]["nominal"]["errors"][kind][f"{curve}_{s}"]["rmse"] for s in "rl"]
        assert row["corrected"] == pytest.approx(np.mean(sides), rel=1e-4, abs=1e-6)
        assert row["own_hips"] == row["corrected"]
        if kind == "angles":
            assert (row["as_measured"], row["correction"]) == (row["corrected"], 0.0)


def test_only_the_compared_cycles_are_kept_of_a_long_walk(rollouts):
    longer = [perfect_walk(RECORD, cycles=40, start_phase=phase) for phase in (0.0, 0.5)]
    walks = _walks(longer)
    assert walks.compared.phase[-1] == pytest.approx(1 + 20 + 2, abs=0.01)
    assert len(walks.compared.positions) == len(walks.compared.time)
    assert [start.cycles.right for start in walks.starts] == [38, 38]
    ours, theirs = _validate(walks), _validate(_walks(rollouts))
    error = theirs["walks"]["nominal"]["errors"]["moments"]["ankle_angle_r"]["rmse"]
    assert ours["walks"]["nominal"]["errors"]["moments"]["ankle_angle_r"]["rmse"] == pytest.approx(
        error, abs=1e-5
    )


def test_the_schema_is_a_schema_and_the_metrics_follow_it(metrics):
    schema = json.loads(
        resources.files("gaitval.metrics").joinpath("metrics.schema.json").read_text("utf-8")
    )
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(metrics, schema)


def test_equal_walks_give_equal_bytes(metrics, tmp_path):
    again = _validate(_walks(_rollouts()))
    write_json(tmp_path / "a.json", metrics)
    write_json(tmp_path / "b.json", again)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert read_json(tmp_path / "a.json") == metrics


def test_a_fall_is_shown_as_failed(rollouts):
    short = perfect_walk(RECORD, cycles=5.3, start_phase=0.5)
    metrics = _validate(_walks([rollouts[0], replace(short, fell=np.array([1.0]))]))
    assert _verdicts(metrics, "falls") == [False]
    assert metrics["walks"]["nominal"]["starts"][1]["cycles"]["right"] == 3
    assert _failed(metrics) == {"consecutive-cycles", "falls"}


def test_a_walk_that_falls_at_once_is_reported_without_curves(rollouts):
    fallen = [
        replace(perfect_walk(RECORD, cycles=0.3, start_phase=phase), fell=np.array([1.0]))
        for phase in (0.0, 0.5)
    ]
    metrics = _validate(_walks(rollouts[:1]), _walks(fallen))
    identified = metrics["walks"]["identified"]
    assert identified["curves"]["angles"]["knee_angle_r"] == {"mean": None, "sd": None}
    assert identified["errors"]["forces"]["vertical_l"] is None
    assert identified["epsilon"] is None
    assert identified["foot_contact"]["left"]["transient_peak"] is None
    assert metrics["final"] == "identified"
    assert _verdicts(metrics, "sagittal-angles") == [False] * 6
    assert _verdicts(metrics, "stance-fraction") == [False] * 2
    assert metrics["walks"]["nominal"]["epsilon"]["total"] < 0.02


def test_the_tolerances_judge_the_identified_body(rollouts, walks):
    wrong = replace(rollouts[0], positions=rollouts[0].positions + np.deg2rad(8))
    metrics = _validate(_walks([wrong]), walks)
    assert _failed(metrics) == {"consecutive-cycles"}
    assert metrics["walks"]["nominal"]["errors"]["angles"]["knee_angle_r"]["rmse"] == pytest.approx(
        8
    )


def test_pushes_are_judged_phase_by_phase(walks):
    pushes = {
        "seconds": 0.05,
        "cycles": 5.0,
        "resolution": 25.0,
        "ceiling": 1200.0,
        "phases": [0.0, 0.5],
        "directions": [0.0, 90.0, 180.0, -90.0],
        "largest": [[700.0, 300.0, 500.0, 325.0], [400.0, 275.0, 900.0, 1200.0]],
        "force": 300.0,
        "criterion_directions": [0.0, 90.0, -90.0],
        "survived": [[True, True, True], [True, False, True]],
    }
    metrics = _validate(walks, by=StageResults(pushes=PushRecovery.model_validate(pushes)))
    rows = [row for row in metrics["tolerances"] if row["id"] == "push-survival"]
    assert [row["target"] for row in rows] == ["phase 0", "phase 0.5"]
    assert [row["value"] for row in rows] == [100.0, pytest.approx(200 / 3, rel=1e-5)]
    assert [row["passed"] for row in rows] == [True, False]
    assert metrics["push_recovery"] == pushes


def test_walks_of_another_configuration_are_refused(rollouts, walks):
    with pytest.raises(ArtefactError, match=r"start at the phases \[0.5, 0.0\]"):
        _validate(_walks(rollouts[::-1]))
    with pytest.raises(ArtefactError, match="nominal rollouts start at"):
        _validate(_walks(rollouts[:1]))
    with pytest.raises(ArtefactError, match="identified rollouts start at"):
        _validate(_walks(rollouts[:1]), _walks(rollouts[:1]))
    with pytest.raises(ArtefactError, match=r"the compared one at 0\.5"):
        _validate(replace(walks, compared=rollouts[1]))


@pytest.mark.parametrize(
    ("settings", "statuses"),
    [
        ({}, {"fitted", "not compared"}),
        ({"use": "kinematics"}, {"fitted", "partly fitted", "predicted", "not compared"}),
        ({"holdout": "T03"}, {"predicted", "not compared"}),
    ],
)
def test_every_measure_says_whether_it_is_fitted_or_predicted(walks, settings, statuses):
    record = CONFIGURATION.record.model_copy(update=settings)
    configuration = CONFIGURATION.model_copy(update={"record": record})
    found = validate(SUBJECT, RECORD, MODEL, walks, None, configuration).as_dict()
    assert {row["comparison"] for row in found["measures"]} == statuses
    by_measure = {row["measure"]: row["comparison"] for row in found["measures"]}
    if settings.get("use") == "kinematics":
        assert by_measure["angle_rmse"] == by_measure["speed_error"] == "fitted"
        assert by_measure["force_rmse"] == by_measure["stance_fraction_error"] == "predicted"
        assert by_measure["joint_work_error"] == by_measure["epsilon"] == "partly fitted"
        assert found["known"]["forces"] == []
        assert "reference" in found["known"]["angles"]


def test_nothing_is_judged_by_kinetics_that_were_not_recorded(walks):
    gait = SUBJECT.gait.model_copy(update={"moments": {}, "forces": None})
    further = tuple(trial.model_copy(update={"gait": gait}) for trial in SUBJECT.trials)
    person = SUBJECT.model_copy(update={"gait": gait, "plates": None, "trials": further})
    found = validate(person, RECORD, MODEL, walks, None, CONFIGURATION).as_dict()
    assert found["recorded"] == ["angles", "timing"]
    origins = {row["measure"]: row["origin"] for row in found["measures"]}
    judged = {row["measure"] for row in found["tolerances"]}
    assert "angle_rmse" in judged
    unrecorded = {"moment_rmse", "force_rmse", "epsilon", "stance_fraction_error"}
    assert not unrecorded & judged
    assert {origins[name] for name in unrecorded} == {"expected"}
    assert origins["angle_rmse"] == "recorded"
    assert origins["falls"] is None


def test_a_group_that_a_prediction_does_not_have_has_no_error_of_it(walks):
    """Trials without forces, where this one has them, are an opponent in angles only."""
    gait = SUBJECT.gait.model_copy(update={"moments": {}, "forces": None})
    further = tuple(trial.model_copy(update={"gait": gait}) for trial in SUBJECT.trials)
    person = SUBJECT.model_copy(update={"trials": further})
    found = validate(person, RECORD, MODEL, walks, None, CONFIGURATION, others=builtin_subjects())
    rows = {row.group: row for row in group_rows(found)}
    copied = "nearest trial copied"
    assert rows["sagittal angles"].guesses[copied] > 0.0
    assert rows["moments"].guesses[copied] is rows["moments"].skills()[copied] is None
    assert rows["moments"].guesses["line through others"] > 0.0


def test_a_trial_that_the_prediction_knew_is_not_called_held_out(walks):
    """Of a person with two trials at one speed: fitted to one, the other is unseen; predicted from
    the other, it is what was known.
    """
    trial = SUBJECT.trials[0].model_copy(update={"walking_speed_m_s": SUBJECT.walking_speed_m_s})
    person = SUBJECT.model_copy(update={"trials": (trial,)})
    for holdout, unseen in (("", [trial.name]), (SUBJECT.trial, [])):
        record = CONFIGURATION.record.model_copy(update={"holdout": holdout})
        configuration = CONFIGURATION.model_copy(update={"record": record})
        found = validate(person, RECORD, MODEL, walks, None, configuration)
        assert [row.trial for row in found.unseen] == unseen


def test_the_spread_of_cycles_is_that_of_a_sample():
    """n - 1: of ten cycles the other one is 5 % smaller."""
    walk = perfect_walk(RECORD, cycles=14.0)
    random = np.random.default_rng(1)
    positions = walk.positions.copy()
    positions[:, 6:] += 0.02 * random.normal(size=(len(positions), 25)).cumsum(axis=0) * 0.01
    walk = replace(walk, positions=positions)
    configuration = sharp_filter(cycles=10, start_phases=(0.0,))
    found = validate(
        SUBJECT, RECORD, MODEL, walks_of([walk], configuration), None, configuration
    ).as_dict()["walks"]["nominal"]
    cycles = find_cycles(walk, configuration).first(10)
    filters = low_pass_of(RECORD, configuration.validation.filter_frequency)
    curves = simulated_curves(walk, cycles, mass=MODEL.mass, filters=filters)
    knee = np.degrees(curves.angles["knee_angle_r"])
    assert len(knee) == 10
    stored = found["curves"]["angles"]["knee_angle_r"]
    np.testing.assert_allclose(stored["mean"], knee.mean(axis=0), rtol=1e-5)
    np.testing.assert_allclose(stored["sd"], np.std(knee, axis=0, ddof=1), rtol=1e-4)
    assert min(stored["sd"]) > 0.0


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_sizes_of_the_errors_of_timing(side, sign):
    """5 % too fast, 2 % of the stride's time, a stance longer by 3 % of the cycle, 2 cm."""
    off = {
        "walking_speed": (1.2, 0.06, "m/s"),
        "stride_time_right": (1.1, 0.022, "s"),
        f"stance_fraction_{side}": (0.62, 0.03, "1"),
        f"step_length_{side}": (0.66, 0.02, "m"),
    }
    rows = [
        SpatiotemporalResult(
            name=name, unit=unit, mean=recorded + sign * error, sd=None, recorded=recorded
        )
        for name, (recorded, error, unit) in off.items()
    ]
    other = {"right": "left", "left": "right"}[side]
    rows += [
        SpatiotemporalResult(name=name, unit="1", mean=None, sd=None, recorded=0.6)
        for name in (f"stance_fraction_{other}", f"step_length_{other}")
    ]
    found = {(each.measure, each.target): each.value for each in spatiotemporal_measures(rows)}
    assert found == {
        ("speed_error", "walk"): pytest.approx(5.0),
        ("stride_time_error", "walk"): pytest.approx(2.0),
        ("stance_fraction_error", side): pytest.approx(3.0),
        ("stance_fraction_error", other): None,
        ("step_length_error", side): pytest.approx(2.0),
        ("step_length_error", other): None,
    }
