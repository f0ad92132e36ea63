"""A guess that is shown as a walk is not accepted, and a walk that is nearer than it is."""

import numpy as np
import pytest
from synthetic_walk import MODEL, perfect_walk, sharp_filter, synthetic_record, walks_of

from gaitval.configuration import RecordSettings
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.metrics.acceptance import (
    Baselines,
    against_guesses,
    known_to,
    lights,
    time_steps,
)
from gaitval.metrics.baselines import GROUPS, others_line
from gaitval.metrics.comparator import compared_with
from gaitval.metrics.origin import everything
from gaitval.metrics.results import HeldOutError, HeldOutErrors
from gaitval.metrics.validation import validate
from gaitval.metrics.verdicts import failed_limits, limit_verdicts, sentence
from gaitval.subjects.subject_file import builtin_subjects, load_subject

WALKED = synthetic_record()
SUBJECT = load_subject("S05")
RECORD = SUBJECT.record()
OTHERS = builtin_subjects()
CONFIGURATION = sharp_filter(cycles=20, start_phases=(0.0,))
TRUE = recorded_curves(RECORD)
CURVES = {"angle_rmse", "moment_rmse", "force_rmse"}


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
    return [row for row in metrics.tolerances if row.role == "acceptance" and row.measure in CURVES]


def between(share):
    """Curves that are `share` as far from the record as the line through others."""
    line = others_line(SUBJECT, OTHERS).curves
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
def test_a_guess_that_is_shown_as_a_walk_is_not_accepted(monkeypatch, use):
    metrics = validated(monkeypatch, between(1.0), use=use)
    rows = decided(metrics)
    assert len(rows) == 30
    assert not any(row.passed for row in rows)
    assert not any(row.reached for row in rows)
    assert not any(row.guess_passes for row in rows)
    assert metrics.summary.refused >= 30
    assert metrics.summary.guess_judged == 35
    assert "All" not in sentence(metrics)
    assert "believe" not in {light.light for *_, light in metrics.lights.items()}
    # without the rule most of them are within their limits
    assert sum(bool(row.guess_within) for row in rows) > 0


def test_a_walk_that_is_nearer_than_every_guess_is_accepted(monkeypatch):
    metrics = validated(monkeypatch, TRUE)
    assert all(row.passed and row.failed_by == [] for row in decided(metrics))
    assert all(row.guess.skill == 1.0 for row in decided(metrics))
    assert {light.light for *_, light in metrics.lights.items()} == {"believe"}


def test_a_walk_told_angles_alone_whose_medial_force_is_worse_than_a_guess_is_not_accepted(
    monkeypatch,
):
    line, true = between(1.0).forces["medial_l"], TRUE.forces["medial_l"]
    worse = changed("forces", medial_l=true + 1.5 * (line - true))
    metrics = validated(monkeypatch, worse, use="kinematics")
    (row,) = [each for each in decided(metrics) if not each.passed]
    assert (row.target, row.failed_by, row.state) == ("medial_l", ["guess"], "failed")
    assert row.guess.skill <= -0.5
    assert row.value <= row.tolerance, "the limit alone is kept"
    assert metrics.lights.forces["medial_l"].light == "do not"
    (limit,) = [e for e in limit_verdicts(metrics, "acceptance") if e.first.id == "force-medial"]
    assert (limit.state, limit.guess) == ("failed", (0, 2))
    assert "medial force" in limit.reason_text()
    assert sentence(metrics)[0].isdigit()


def test_a_group_is_judged_on_its_side_and_each_curve_has_its_own_light(monkeypatch):
    seen = validated(monkeypatch, TRUE).lights.angles
    # the one whose guess is within the limit itself
    guess, name = min(
        (seen[f"{each}_r"].guess_error, each) for each in GROUPS["sagittal angles"][1]
    )
    off = TRUE.angles[f"{name}_r"] + np.deg2rad(1.01 * guess)
    metrics = validated(monkeypatch, changed("angles", **{f"{name}_r": off}))
    assert [row for row in decided(metrics) if not row.passed] == [], "its group is nearer"
    light = metrics.lights.angles[f"{name}_r"]
    assert (light.light, light.reason) == ("with care", "guess nearer")
    assert metrics.lights.angles[f"{name}_l"].light == "believe"


def test_an_informed_guess_knows_no_more_than_the_walk(monkeypatch):
    """The person's other trials stand against walks that are predicted from them."""
    name = SUBJECT.trials[0].name
    for use, holdout, told in (
        *(("all", "", ()), ("kinematics", "", ())),
        *(("all", name, ("angles", "moments", "forces")), ("kinematics", name, ("angles",))),
    ):
        settings = RecordSettings(use=use, holdout=holdout)
        configuration = CONFIGURATION.model_copy(update={"record": settings})
        of = compared_with(SUBJECT, SUBJECT.record(), OTHERS, MODEL, configuration).baselines
        best = {group: of.best(kind, names, "left") for group, (kind, names) in GROUPS.items()}
        assert {GROUPS[group][0] for group, guess in best.items() if guess.own} == set(told)


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
    assert (row.target, row.passed) == ("knee_angle_r", False)
    assert row.known == pytest.approx(np.rad2deg(1e-4), rel=1e-5)
    (of,) = [each for each in metrics.known_to if each.group == "sagittal angles"]
    assert of.record is None, "five of the six curves are not known"
    wide = SUBJECT.model_copy(update={"uncertainty": {"angle_knee_angle_r": 1.0}})
    assert not any(r.failed_by == ["record"] for r in decided(validated(monkeypatch, close, wide)))


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
    of = Baselines(metrics.predictions, (), everything("recorded"))
    best = of.best("forces", ("vertical",), "right").rmse.forces["vertical_r"]

    def state(error, scatter):
        errors = metrics.walk.errors.model_copy(deep=True)
        errors.forces["vertical_r"] = errors.forces["vertical_r"].model_copy(update={"rmse": error})
        walks = error + scatter * np.linspace(-1.0, 1.0, 8)
        repeated = {("force_rmse", "vertical_r"): list(walks)}
        return against_guesses(errors, repeated, of)["vertical force", "right"].state

    assert state(0.5 * best, 0.01 * best) == "passed"
    assert state(1.05 * best, 0.1 * best) == "not shown"
    assert state(1.05 * best, 0.001 * best) == "failed"
    assert state(best, 0.1 * best) == "not shown", "as near as the guess is not nearer"


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
    of = Baselines([], (), everything("predicted"))

    def light(mean):
        group = HeldOutError(group="vertical force", unit="% BW", mean=mean, sd=None)
        held_out = HeldOutErrors(trials=3, people=1, own=True, groups=[group])
        found = lights(errors, [], {}, of, None, held_out)
        assert found.forces["forward_r"].reason == "not recorded"
        return found.forces["vertical_r"]

    assert (light(1.01 * far).light, light(1.01 * far).reason) == ("with care", "not recorded")
    assert (light(0.99 * far).light, light(0.99 * far).reason) == ("do not", "held out")
