import copy
import json
from dataclasses import replace
from importlib import resources

import jsonschema
import numpy as np
import pytest
from synthetic_walk import MASS, SPEED, perfect_walk, sharp_filter, synthetic_record

from gaitval.artefacts import read_json, write_json
from gaitval.data.subject import load_subject
from gaitval.errors import ArtefactError, ToleranceError
from gaitval.metrics.validation import check_metrics, validate

RECORD = synthetic_record()
SUBJECT = load_subject("S05")
CONFIGURATION = sharp_filter(cycles=20, start_phases=(0.0, 0.5))


def _walks(cycles: float = 23.0):
    return [perfect_walk(RECORD, cycles=cycles, start_phase=phase) for phase in (0.0, 0.5)]


@pytest.fixture(scope="module")
def walks():
    return _walks()


@pytest.fixture(scope="module")
def metrics(walks):
    return validate(SUBJECT, RECORD, MASS, walks, [], CONFIGURATION)


def _verdicts(metrics, tolerance):
    return [row["passed"] for row in metrics["tolerances"] if row["id"] == tolerance]


def test_a_perfect_walk_passes_every_tolerance(metrics):
    assert all(row["passed"] for row in metrics["tolerances"])
    assert metrics["summary"]["refused"] == 0
    assert metrics["final"] == "nominal"
    assert [start["cycles"]["right"] for start in metrics["walks"]["nominal"]["starts"]] == [20, 20]
    speed = metrics["walks"]["nominal"]["spatiotemporal"][0]
    assert (speed["name"], speed["mean"], speed["recorded"]) == ("walking_speed", SPEED, SPEED)


def test_the_schema_is_a_schema_and_the_metrics_follow_it(metrics):
    schema = json.loads(
        resources.files("gaitval.metrics").joinpath("metrics.schema.json").read_text("utf-8")
    )
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(metrics, schema)


def test_equal_walks_give_equal_bytes(metrics, tmp_path):
    again = validate(SUBJECT, RECORD, MASS, _walks(), [], CONFIGURATION)
    write_json(tmp_path / "a.json", metrics)
    write_json(tmp_path / "b.json", again)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert read_json(tmp_path / "a.json") == metrics


def test_a_stored_walk_gives_the_same_to_six_digits(walks, tmp_path):
    walks[0].save(tmp_path / "walk.npz")
    stored = type(walks[0]).load(tmp_path / "walk.npz")
    ours = validate(SUBJECT, RECORD, MASS, [stored, walks[1]], [], CONFIGURATION)
    theirs = validate(SUBJECT, RECORD, MASS, walks, [], CONFIGURATION)
    np.testing.assert_allclose(
        ours["walks"]["nominal"]["curves"]["angles"]["knee_angle_r"]["mean"],
        theirs["walks"]["nominal"]["curves"]["angles"]["knee_angle_r"]["mean"],
        atol=1e-4,
    )


def test_a_fall_is_shown_as_failed(walks):
    short = perfect_walk(RECORD, cycles=5.3, start_phase=0.5)
    fallen = [walks[0], replace(short, fell=np.array([1.0]))]
    metrics = validate(SUBJECT, RECORD, MASS, fallen, [], CONFIGURATION)
    assert _verdicts(metrics, "falls") == [False]
    assert _verdicts(metrics, "consecutive-cycles") == [True, False]
    assert metrics["summary"]["refused"] == 2


def test_a_walk_that_falls_at_once_is_reported_without_curves(walks):
    fallen = [
        replace(perfect_walk(RECORD, cycles=0.3, start_phase=phase), fell=np.array([1.0]))
        for phase in (0.0, 0.5)
    ]
    metrics = validate(SUBJECT, RECORD, MASS, walks, fallen, CONFIGURATION)
    identified = metrics["walks"]["identified"]
    assert identified["curves"]["angles"]["knee_angle_r"] == {"mean": None, "sd": None}
    assert identified["errors"]["forces"]["vertical_l"] is None
    assert identified["epsilon"] is None
    assert metrics["final"] == "identified"
    assert _verdicts(metrics, "sagittal-angles") == [False] * 6
    assert metrics["walks"]["nominal"]["epsilon"]["total"] < 0.02


def test_the_tolerances_judge_the_identified_body(walks):
    wrong = [replace(walk, positions=walk.positions + np.deg2rad(8)) for walk in walks]
    metrics = validate(SUBJECT, RECORD, MASS, wrong, walks, CONFIGURATION)
    assert metrics["summary"]["refused"] == 0
    assert metrics["walks"]["nominal"]["errors"]["angles"]["knee_angle_r"]["rmse"] == pytest.approx(
        8
    )


@pytest.mark.parametrize("column", range(6))
def test_any_load_on_the_pelvis_is_an_error(walks, column):
    load = walks[1].root_force.copy()
    load[777, column] = 1e-12
    with pytest.raises(ToleranceError, match="held up by its feet"):
        validate(
            SUBJECT, RECORD, MASS, [walks[0], replace(walks[1], root_force=load)], [], CONFIGURATION
        )


def test_walks_of_another_configuration_are_refused(walks):
    with pytest.raises(ArtefactError, match=r"start at the phases \[0.5, 0.0\]"):
        validate(SUBJECT, RECORD, MASS, walks[::-1], [], CONFIGURATION)
    with pytest.raises(ArtefactError, match="nominal walks start at"):
        validate(SUBJECT, RECORD, MASS, [], [], CONFIGURATION)


def test_damaged_metrics_are_refused_with_the_place(metrics):
    damaged = copy.deepcopy(metrics)
    damaged["walks"]["nominal"]["starts"][1]["fell"] = "no"
    with pytest.raises(ArtefactError, match=r"stored\.json: .* at walks/nominal/starts/1/fell"):
        check_metrics(damaged, "stored.json")
    with pytest.raises(ArtefactError, match="top level"):
        check_metrics([], "stored.json")
