"""Typed results: stored files come back byte for byte, and what is wrong is refused by place."""

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import jsonschema
import pytest

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.errors import ArtefactError
from gaitval.metrics.results import (
    SpatiotemporalResult,
    identification_from,
    metrics_from,
    read_metrics,
)
from gaitval.metrics.validation import _SPATIOTEMPORAL_UNITS
from gaitval.model.parameters import PARAMETERS

ROOT = Path(__file__).parents[2]
BASELINES = sorted(ROOT.glob("reports/S*/baseline"))
SCHEMAS = {
    "metrics": ROOT / "gaitval/metrics/metrics.schema.json",
    "identification": ROOT / "gaitval/identification/identification.schema.json",
}

Json = Any


@pytest.fixture(scope="module")
def stored() -> Json:
    return read_json(ROOT / "reports/S05/baseline/metrics.json")


@pytest.mark.parametrize("baseline", BASELINES, ids=lambda path: path.parent.name)
def test_stored_results_come_back_byte_for_byte(baseline: Path, tmp_path: Path) -> None:
    values = read_json(baseline / "identification.json")
    write_json(tmp_path / "i.json", identification_from(values, "i.json").as_dict())
    assert (tmp_path / "i.json").read_bytes() == (baseline / "identification.json").read_bytes()
    values = read_json(baseline / "metrics.json")
    write_json(tmp_path / "m.json", metrics_from(values, "m.json").as_dict())
    assert (tmp_path / "m.json").read_bytes() == (baseline / "metrics.json").read_bytes()


def test_metrics_go_to_worker_processes() -> None:
    """Which draw their figures; a type that is made on the fly could not."""
    found = read_metrics(ROOT / "reports/S05/baseline/metrics.json")
    assert pickle.loads(pickle.dumps(found)) == found


def test_the_ten_subjects_are_stored() -> None:
    assert len(BASELINES) == 10


def test_the_schemas_are_current() -> None:
    done = subprocess.run(
        [sys.executable, "scripts/schemas.py", "--check"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_the_published_schema_takes_what_is_stored() -> None:
    for name, path in SCHEMAS.items():
        validator = jsonschema.Draft202012Validator(read_json(path))
        values = read_json(BASELINES[0] / f"{name}.json")
        validator.validate(values)


def test_spatiotemporal_parameters_are_those_that_are_measured() -> None:
    names = get_args(SpatiotemporalResult.model_fields["name"].annotation)
    assert names == tuple(_SPATIOTEMPORAL_UNITS)


def _without(key: str) -> Callable[[Json], None]:
    def change(part: Json) -> None:
        del part[key]

    return change


def _with(key: str, value: Json) -> Callable[[Json], None]:
    def change(part: Json) -> None:
        part[key] = value

    return change


DAMAGE = [
    # (what is changed, how, the place that is named)
    ("", _without("final"), "final"),
    ("", _with("more", 1), "more"),
    ("", _with("final", "third"), "final"),
    ("subject", _with("licence", 4), "subject/licence"),
    ("method", _with("cycles", -1), "method/cycles"),
    ("method", _with("cycles", 20.5), "method/cycles"),
    ("method", _with("gravity_m_s2", "9.81"), "method/gravity_m_s2"),
    ("record/curves/angles", _without("knee_angle_r"), "record/curves/angles"),
    ("record/curves/angles", _with("elbow_r", [0.0] * 101), "record/curves/angles"),
    ("record/curves/forces", _with("medial_l", [0.0] * 100), "record/curves/forces/medial_l"),
    ("walks/nominal", _with("mu", [0.0] * 13), "walks/nominal/mu"),
    ("walks/identified/starts/0", _with("fell", 0), "walks/identified/starts/0/fell"),
    ("walks/identified", _with("epsilon", 1.0), "walks/identified/epsilon"),
    ("walks/identified/errors/angles/hip_flexion_r", _with("rmse", True), "hip_flexion_r/rmse"),
    ("measures/0", _with("measure", "mood"), "measures/0/measure"),
    ("tolerances/3", _with("passed", "yes"), "tolerances/3/passed"),
    ("push_recovery", _with("seconds", 0.0), "push_recovery/seconds"),
    ("correction", _without("height"), "correction/height"),
    ("identification", _with("upper", None), "identification/upper"),
    ("provenance", _with("record", "abc"), "provenance/record"),
]


def _damaged(where: str, change: Callable[[Json], None], stored: Json) -> Json:
    damaged = copy.deepcopy(stored)
    part = damaged
    for step in filter(None, where.split("/")):
        part = part[int(step) if step.isdigit() else step]
    change(part)
    return damaged


@pytest.mark.parametrize(("where", "change", "place"), DAMAGE)
def test_damage_is_refused_with_the_place(
    where: str, change: Callable[[Json], None], place: str, stored: Json
) -> None:
    with pytest.raises(
        ArtefactError, match=rf"x\.json: does not match the schema .* at \S*{place}, "
    ):
        metrics_from(_damaged(where, change, stored), "x.json")


@pytest.mark.parametrize(("where", "change", "place"), DAMAGE[::6])
def test_the_published_schema_refuses_what_the_model_refuses(
    where: str, change: Callable[[Json], None], place: str, stored: Json
) -> None:
    validator = jsonschema.Draft202012Validator(read_json(SCHEMAS["metrics"]))
    assert not validator.is_valid(_damaged(where, change, stored)), place


@pytest.mark.parametrize("version", [2, 13, 15])
def test_other_versions_are_refused_with_the_mend(version: int, stored: Json) -> None:
    with pytest.raises(ArtefactError, match=rf"has version {version} .* `gaitval stage validate"):
        metrics_from({**stored, "schema_version": version}, "x.json")


def test_what_is_not_finite_is_no_result(stored: Json) -> None:
    with pytest.raises(ArtefactError, match=r"at record/left_phase, .* finite number"):
        metrics_from({**stored, "record": {**stored["record"], "left_phase": float("nan")}}, "x")
    with pytest.raises(ArtefactError, match="top level"):
        metrics_from([], "x")


# --- identification.json ------------------------------------------------------------------


def test_a_body_is_identified_only_where_something_of_it_was(stored: Json) -> None:
    found = identification_from(stored["identification"], "here")
    none = found.model_copy(update={"verdicts": ["weak"] * len(PARAMETERS)})
    assert none.determined == []
    last = found.model_copy(update={"verdicts": ["weak"] * 13 + ["identified"]})
    assert last.determined == [PARAMETERS[-1]]


@pytest.mark.parametrize(
    ("change", "place"),
    [
        (_without("identified"), "identified"),
        (_with("identified", [1.0]), "identified"),
        (_with("on_bound", [1] * len(PARAMETERS)), "on_bound/0"),
        (_with("rounds", [{"round": 1}]), "rounds/0/epsilon"),
    ],
)
def test_a_damaged_identification_is_refused_with_the_place(
    change: Callable[[Json], None], place: str
) -> None:
    values = read_json(ROOT / "reports/S05/baseline/identification.json")
    change(values)
    with pytest.raises(ArtefactError, match=rf"at {place}, .* run `gaitval stage identify SUBJECT"):
        identification_from(values, "identification.json")
