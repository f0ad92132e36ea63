"""A guess that is shown as a walk is not accepted, and a walk that is nearer than it is."""

import numpy as np
import pytest
from synthetic_walk import MODEL, perfect_walk, sharp_filter, synthetic_record, walks_of

from gaitval.configuration import RecordSettings
from gaitval.constants import GRAVITY
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.metrics.acceptance import (
    Baselines,
    accepted,
    known_to,
    lights,
    skill_measures,
    time_steps,
)
from gaitval.metrics.baselines import GROUPS, others_line
from gaitval.metrics.comparator import compared_with
from gaitval.metrics.curve_results import KINDS, OF_SKILL
from gaitval.metrics.origin import everything
from gaitval.metrics.results import HeldOutError, HeldOutErrors
from gaitval.metrics.tolerances import evaluate
from gaitval.metrics.validation import validate
from gaitval.metrics.verdict_rows import spread_of
from gaitval.metrics.verdicts import failed_limits, limit_verdicts, sentence
from gaitval.subjects.subject_file import builtin_subjects, load_subject

WALKED = synthetic_record()
SUBJECT = load_subject("S05")
RECORD = SUBJECT.record()
OTHERS = builtin_subjects()
CONFIGURATION = sharp_filter(cycles=20, start_phases=(0.0,))
TRUE = recorded_curves(RECORD)
LINE = others_line(SUBJECT, OTHERS).curves


def validated(monkeypatch, curves, subject=SUBJECT, **settings):
    """Metrics of a walk that has the `curves` (101,), whatever it walked."""
    walked = Curves(
        **{
            kind: {name: np.tile(curve, (20, 1)) for name, curve in getattr(curves, kind).items()}
            for kind in ("angles", "moments", "forces")
        }
    )
    monkeypatch.setattr("gaitval.metrics.validation.simulated_curves", lambda *_, **__: walked)
    configuration = CONFIGURATION.model_copy(update={"record": RecordSettings(**settings)})
    walks = walks_of([perfect_walk(WALKED, cycles=24, start_phase=0.0)], configuration)
    return validate(subject, RECORD, MODEL, walks, None, configuration, others=OTHERS)


def changed(kind, **new):
    """The true curves, and `new` ones of a kind."""
    values = {name: dict(getattr(TRUE, name)) for name in ("angles", "moments", "forces")}
    values[kind] |= new
    return Curves(**values)


def decided(metrics):
    """The rows that decide on curves: whether each is nearer than the best prediction."""
    return [row for row in metrics.tolerances if row.measure in OF_SKILL]


def between(share):
    """Curves that are `share` as far from the record as the line through others."""
    line = LINE
    return Curves(
        **{
            kind: {
                name: true + share * (getattr(line, kind)[name] - true)
                for name, true in getattr(TRUE, kind).items()
            }
            for kind in ("angles", "moments", "forces")
        }
    )


@pytest.mark.parametrize("use", ["all", "kinematics"])
def test_a_prediction_that_is_shown_as_a_walk_is_not_accepted(monkeypatch, use):
    metrics = validated(monkeypatch, between(1.0), use=use)
    rows = decided(metrics)
    assert len(rows) == 32, "18 angles, 8 moments, 6 forces"
    assert not any(row.passed for row in rows)
    assert all(row.value <= 0.0 for row in rows)
    assert (metrics.summary.curves, metrics.summary.nearer) == (32, 0)
    assert "Nearer than the best prediction without a model: 0 of 32 curves" in sentence(metrics)
    assert "believe" not in {light.light for *_, light in metrics.lights.items()}
    assert {light.reason for *_, light in metrics.lights.items()} <= {"guess", "limit"}


def test_a_walk_that_is_nearer_than_every_prediction_is_accepted(monkeypatch):
    metrics = validated(monkeypatch, TRUE)
    assert all(row.passed and row.failed_by == [] for row in decided(metrics))
    assert all(row.value == 1.0 for row in decided(metrics))
    assert {light.light for *_, light in metrics.lights.items()} == {"believe"}
    assert metrics.summary.nearer == metrics.summary.curves == 32


@pytest.mark.parametrize(("kind", "name"), [("forces", "medial_l"), ("moments", "knee_angle_r")])
def test_a_curve_is_not_accepted_because_its_group_is(monkeypatch, kind, name):
    line, true = getattr(LINE, kind)[name], getattr(TRUE, kind)[name]
    worse = changed(kind, **{name: true + 1.5 * (line - true)})
    metrics = validated(monkeypatch, worse, use="kinematics")
    (row,) = [each for each in decided(metrics) if not each.passed]
    assert (row.target, row.failed_by, row.state) == (name, ["limit"], "failed")
    assert row.value <= -0.5 + 1e-9
    assert row.guess.walk > row.guess.error
    light = getattr(metrics.lights, kind)[name]
    assert (light.light, light.reason) == ("do not", "guess")
    (failed,) = [each for each in limit_verdicts(metrics, "acceptance") if row in each.rows]
    assert failed.state == "failed"
    assert "not nearer than" in failed.reason_text()
    assert metrics.summary.nearer == metrics.summary.curves - 1


def test_a_prediction_has_the_same_free_hips_as_the_walk():
    """About the point that brings it nearest: no other lever of the vertical force is nearer."""
    place = np.full((2, 2), 0.01)
    free, bound = (
        compared_with(SUBJECT, RECORD, OTHERS, MODEL, CONFIGURATION, each).baselines
        for each in (place, np.zeros((2, 2)))
    )
    for side in "rl":
        for sign, name in ((1.0, "hip_flexion"), (-1.0, "hip_adduction")):
            curve = f"{name}_{side}"
            away = LINE.moments[curve] - TRUE.moments[curve]
            force = GRAVITY * LINE.forces[f"vertical_{side}"]
            levers = np.linspace(-0.05, 0.05, 1001)
            tried = [np.sqrt(np.mean((away + sign * each * force) ** 2)) for each in levers]
            found = free.guesses[0].error("moments", curve)
            assert found == pytest.approx(min(tried), abs=1e-5)
            assert found < bound.guesses[0].error("moments", curve)
    knee = [each.guesses[0].error("moments", "knee_angle_r") for each in (free, bound)]
    assert knee[0] == knee[1]


def test_own_trials_stand_against_a_walk_that_was_given_as_much():
    for use, told in (("all", {"angles", "moments", "forces"}), ("kinematics", {"angles"})):
        configuration = CONFIGURATION.model_copy(update={"record": RecordSettings(use=use)})
        of = compared_with(SUBJECT, RECORD, OTHERS, MODEL, configuration).baselines
        curves = {"angles": "knee_angle_l", "moments": "hip_adduction_l", "forces": "vertical_l"}
        best = {kind: of.best(kind, name)[0] for kind, name in curves.items()}
        assert {kind for kind, guess in best.items() if guess.own} == told


def test_a_trial_at_the_same_speed_measures_again_and_is_no_guess():
    trial = SUBJECT.on_trial(SUBJECT.trials[0].name)
    again = SUBJECT.trials[0].model_copy(update={"walking_speed_m_s": SUBJECT.walking_speed_m_s})
    person = SUBJECT.model_copy(update={"trials": (again,)})
    assert trial.walking_speed_m_s != SUBJECT.walking_speed_m_s
    found = compared_with(person, SUBJECT.record(), OTHERS, MODEL, CONFIGURATION)
    assert not any(guess.own for guess in found.baselines.guesses)


def test_it_must_be_within_what_the_record_is_known_to(monkeypatch):
    close = between(0.5)
    known = SUBJECT.model_copy(
        update={"uncertainty": {"angle_knee_angle_r": 1e-4, "length_x": 1.0}}
    )
    metrics = validated(monkeypatch, close, subject=known)
    (row,) = [each for each in decided(metrics) if "record" in each.failed_by]
    assert metrics.lights.angles["knee_angle_r"].reason == "record"
    assert (row.target, row.passed) == ("knee_angle_r", False)
    assert row.known == pytest.approx(np.rad2deg(1e-4), rel=1e-5)
    (of,) = [each for each in metrics.known_to if each.group == "sagittal angles"]
    assert of.record is None, "five of the six curves are not known"
    wide = SUBJECT.model_copy(update={"uncertainty": {"angle_knee_angle_r": 1.0}})
    assert not any("record" in r.failed_by for r in decided(validated(monkeypatch, close, wide)))


def test_bands_of_an_import_are_in_the_units_and_names_of_the_curves():
    found = known_to({"angle_hip_flexion_l": 0.1, "moment_ankle_angle_r": 0.08,
                      "force_left_r": 0.01, "force_up_l": 0.02, "force_forward_l": 0.03,
                      "length_thigh_right": 0.01})  # fmt: skip
    assert found == pytest.approx(
        {
            ("angles", "hip_flexion_l"): 5.7296,
            ("moments", "ankle_angle_r"): 0.08,
            ("forces", "medial_r"): 1.0,
            ("forces", "vertical_l"): 2.0,
            ("forces", "forward_l"): 3.0,
        },
        rel=1e-4,
    )


def test_worse_by_less_than_walks_differ_is_not_shown_and_not_passed(monkeypatch):
    metrics = validated(monkeypatch, between(1.0))
    of = Baselines(metrics.predictions, KINDS, everything("recorded"))
    _, best = of.best("forces", "vertical_r")

    def state(share, scatter):
        errors = metrics.walk.errors.model_copy(deep=True)
        curve = errors.forces["vertical_r"]
        errors.forces["vertical_r"] = curve.model_copy(update={"rmse": share * best})
        (measure,) = [e for e in skill_measures(errors, of) if e.target == "vertical_r"]
        (row,) = evaluate([measure])
        walks = (1.0 - share + scatter * np.linspace(-1.0, 1.0, 8)).tolist()
        row = row.model_copy(update={"spread": spread_of(row, walks)})
        (found,) = accepted([row], errors, {}, of)
        return found.state

    assert state(0.5, 0.01) == "passed"
    assert state(1.05, 0.1) == "not shown"
    assert state(1.05, 0.001) == "failed"
    assert state(1.0, 0.1) == "not shown", "as near as the prediction is not nearer"


def test_what_nobody_read_in_full_is_in_the_list_but_not_among_what_failed(monkeypatch):
    far = between(5.0)
    metrics = validated(monkeypatch, far)
    unread = [each for each in limit_verdicts(metrics) if each.first.status == "unread"]
    assert any(not each.passed for each in unread)
    assert all(each.first.verified for each in failed_limits(metrics))


def test_every_group_of_curves_has_a_known_time_step():
    assert set(time_steps()) == set(GROUPS)
    assert all(change > 0.0 for change in time_steps().values())


def test_a_walk_that_leaves_its_prediction_by_more_than_predictions_err_is_not_to_be_believed(
    monkeypatch,
):
    metrics = validated(monkeypatch, between(0.5))
    errors = metrics.walk.errors
    far = errors.forces["vertical_r"].rmse
    of = Baselines([], KINDS, everything("predicted"))

    def light(mean):
        group = HeldOutError(group="vertical force", unit="% BW", mean=mean, sd=None)
        held_out = HeldOutErrors(trials=3, people=1, own=True, groups=[group])
        found = lights(errors, [], {}, of, None, held_out)
        assert found.forces["forward_r"].reason == "not recorded"
        return found.forces["vertical_r"]

    assert (light(1.01 * far).light, light(1.01 * far).reason) == ("with care", "not recorded")
    assert (light(0.99 * far).light, light(0.99 * far).reason) == ("do not", "held out")
