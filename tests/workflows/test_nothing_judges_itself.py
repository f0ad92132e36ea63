"""Only what was recorded judges a walk, in every output that compares one.

A prediction passed all limits against itself once. Here the same mistake is made again, with three
other sides that nobody recorded, and every output must be without verdict, goal and skill.
"""

import csv

import pytest
import unrecorded_verdicts
from html_page import without_figures
from report_run import build_run
from synthetic_walk import perfect_walk
from unrecorded_verdicts import CASES, PREDICTED_SPEED, judged_in

import gaitval as gv
from gaitval._internal.io.artefacts import read_json
from gaitval._internal.io.text_tables import with_unit
from gaitval.configuration import RecordSettings
from gaitval.metrics import verdict_rows
from gaitval.metrics.baselines import GROUPS
from gaitval.metrics.origin import measure_origin, record_origins
from gaitval.metrics.other_trials import beyond, prediction_errors
from gaitval.metrics.results import metrics_from, read_metrics
from gaitval.subjects.subject_file import builtin_subjects, load_subject
from gaitval.walk.simulation.simulated_walk import SimulatedWalk

OUTPUTS = ("metrics.json", "report", "terminal", "Python", "cohort", "compare", "check")


@pytest.fixture(
    scope="module",
    # that of mirrored curves in CI: of an absent side, some are judged and some are not, too
    params=[
        pytest.param(case, marks=pytest.mark.slow if case == "mirrored" else ()) for case in CASES
    ],
)
def run(request, tmp_path_factory):
    """A run whose walk is compared with what nobody recorded."""
    folder = tmp_path_factory.mktemp(request.param)
    build_run(folder, not_recorded=request.param)
    with pytest.MonkeyPatch.context() as patch:  # figures carry no verdict
        without_figures(patch)
        return request.param, folder, judged_in(folder)


@pytest.mark.parametrize("output", OUTPUTS)
def test_no_output_judges_by_what_was_not_recorded(run, output):
    _, _, found = run
    assert tuple(found) == OUTPUTS
    assert found[output] == []


def test_the_values_stay_with_their_origin(run):
    case, folder, _ = run
    metrics = read_json(folder / "metrics.json")
    metrics_from(metrics, "here")
    left = [row for row in metrics["measures"] if row["target"] == "ankle_angle_l"]
    moment = next(row for row in left if row["measure"] == "moment_rmse")
    assert moment["origin"] == ("expected" if case == "absent" else case)
    assert moment["value"] > 0.0
    assert {row["origin"] for row in metrics["measures"] if row["measure"] == "falls"} == {None}


def test_what_needs_no_record_is_still_judged(run):
    _, folder, _ = run
    judged = {row["id"] for row in read_json(folder / "metrics.json")["tolerances"]}
    assert judged >= {"falls", "consecutive-cycles", "push-survival", "force-ringing", "step-width"}


def test_the_side_that_was_recorded_is_judged(run):
    case, folder, _ = run
    judged = {(row["measure"], row["target"]) for row in
              read_json(folder / "metrics.json")["tolerances"]}  # fmt: skip
    assert (("angle_rmse", "knee_angle_r") in judged) == (case != "predicted")
    assert (("moment_rmse", "knee_angle_r") in judged) == (case in ("mirrored", "absent"))
    assert ("moment_rmse", "knee_angle_l") not in judged


@pytest.mark.slow
def test_what_nobody_recorded_is_called_predicted_in_every_file(run):
    """The curves of the statistics have a band each, and no column or key says that they were
    recorded.
    """
    case, folder, _ = run
    tables = {path.stem: path.read_text().splitlines() for path in folder.glob("figures/*.csv")}
    names = {name for rows in tables.values() for name in rows[0].split(",")}
    metrics = read_metrics(folder)
    rows = metrics.walk.spatiotemporal
    if case != "predicted":
        assert any("_record_" in name for name in names)
        assert metrics.predicted is None
        assert all(row.predicted is None for row in rows)
        return
    assert not [name for name in names if "record" in name]
    assert "moments_knee_angle_r_predicted_nm_kg" in names
    assert all(row.recorded is None for row in rows)
    assert rows[0].wanted == pytest.approx(PREDICTED_SPEED * load_subject("S05").walking_speed_m_s)
    numbers = list(csv.DictReader(tables["prediction"]))
    assert len(numbers) == 101
    for kind, name, curve in metrics.predicted.curves.items():
        width = metrics.predicted.band.half_width.of(kind)[name]
        unit = metrics.units.of(kind)
        for end, sign in (("band_low", -1.0), ("predicted", 0.0), ("band_high", 1.0)):
            found = [float(row[with_unit(f"{kind}_{name}_{end}", unit)]) for row in numbers]
            wanted = [c + sign * w for c, w in zip(curve, width, strict=True)]
            assert found == pytest.approx(wanted, rel=1e-4, abs=1e-6)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "The predicted curves" in page
    assert "90 of 100 people" in page
    # an earlier file called it recorded, and is still read
    earlier = read_json(folder / "metrics.json")
    for row in earlier["walks"][metrics.final]["spatiotemporal"]:
        row["recorded"] = row.pop("predicted", None)
    earlier.pop("predicted")
    assert metrics_from(earlier, "here").walk.spatiotemporal[0].wanted == rows[0].wanted


def test_the_mistake_is_found_in_every_output_where_it_is_made(tmp_path, monkeypatch):
    """Verdicts on everything, as before: the count must not be 0."""
    monkeypatch.setattr(verdict_rows, "is_judged", lambda origin: True)
    without_figures(monkeypatch)
    build_run(tmp_path, not_recorded="expected")
    metrics = read_json(tmp_path / "metrics.json")
    before = unrecorded_verdicts.unjudgeable(metrics)
    assert before
    # what is forbidden is what an honest file does not have, so the titles are taken from one
    titles = {title for title, _, _ in before if "moment" in title.lower()}
    monkeypatch.setattr(unrecorded_verdicts, "never_judged", lambda _: titles)
    found = judged_in(tmp_path)
    # Python's overview has only what decides, and no limit on moments does
    assert all(found[output] for output in ("metrics.json", "report", "terminal"))


def test_python_says_which_curves_are_no_record():
    person, _ = CASES["mirrored"](load_subject("S05"), None)
    person = gv.load_subject("S05").model_copy(update={"gait": person.gait})
    walk = perfect_walk(person.record(), cycles=6.0)
    shown = SimulatedWalk(**vars(walk), walker="S05", mass_kg=person.mass_kg)
    found = gv.compare(shown, person)
    origins = dict(zip(found.names, found.origins, strict=True))
    assert origins["knee_angle_r"] == "recorded"
    assert origins["knee_angle_l"] == origins["knee_angle moment_l"] == "mirrored"
    assert "distance, not an error" in found.title()
    assert "left: mirrored" in set(found.overview()["not_recorded"])
    assert set(gv.compare(shown, shown).origins) == {None}


def test_origins_follow_the_worst_part():
    person, _ = CASES["mirrored"](load_subject("S05"), None)
    origins = record_origins(person, RecordSettings())
    assert measure_origin("loading_peak_error", "right", origins) == "recorded"
    assert measure_origin("loading_peak_error", "left", origins) == "mirrored"
    assert measure_origin("centre_of_mass_rmse", "up", origins) == "mirrored"
    assert measure_origin("epsilon", "walk", origins) == "mirrored"
    assert measure_origin("speed_error", "walk", origins) == "recorded"
    assert measure_origin("power_burst_error", "K2_l", origins) == "mirrored"
    # "left" is an axis here, and both feet have a part in it
    assert measure_origin("centre_of_mass_rmse", "left", origins) == "mirrored"
    predicted = record_origins(person, RecordSettings(speed=1.0))
    assert measure_origin("speed_error", "walk", predicted) == "predicted"
    held_out = record_origins(load_subject("S05"), RecordSettings(holdout="T03"))
    assert set(held_out["moments"].values()) == {"recorded"}


def test_the_error_of_predictions_is_that_of_held_out_trials():
    """Of the person's own trials; of other people's where the person has too few."""
    people = builtin_subjects()
    several = next(each for each in people if len(each.trials) > 1)
    own = prediction_errors(several, RecordSettings(speed=1.0), people)
    assert (own.trials, own.people, own.own) == (1 + len(several.trials), 1, True)
    alone = several.model_copy(update={"trials": ()})
    others = prediction_errors(alone, RecordSettings(speed=1.0), people)
    with_two = [each for each in people if each.trials]
    assert others.own is False
    assert others.people == len(with_two)
    # alone at 1.12 m/s, 1 m/s is slower than all that is known
    least = beyond(1.0, [alone.walking_speed_m_s])
    slower = {
        # two trials are one difference
        each.identifier if len(each.trials) == 1 else (each.identifier, name)
        for each in with_two
        for name in (each.trial, *(trial.name for trial in each.trials))
        if beyond(
            each.on_trial(name).walking_speed_m_s,
            [trial.walking_speed_m_s for trial in each.on_trial(name).trials],
        )
        >= least
    }
    assert others.trials == len(slower) < sum(1 + len(each.trials) for each in with_two)
    for found in (own, others):
        assert [row.group for row in found.groups] == list(GROUPS)
        assert all(row.mean > 0.0 and row.sd > 0.0 for row in found.groups)
