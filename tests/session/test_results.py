"""`import.json` is typed: it comes back as it was, and what is wrong is refused by its place."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from pydantic import ValidationError

from gaitval._internal.io.artefacts import read_json
from gaitval.configuration import ProcessingSettings
from gaitval.session.importing.results import GaitResult, ImportResult

SCHEMA = Path(__file__).parents[2] / "gaitval/session/importing/import.schema.json"

Json = Any

GAIT = {name: [1.0, None] for name in GaitResult.model_fields}
ERRORS = {"rms": 0.01, "largest": 0.03, "worst": "R.Toe", "by_marker": {"R.Toe": 0.02, "Hat": None}}
LENGTH = {"prior": 0.41, "prior_sd": 0.01, "fitted": 0.42, "standard_error": 0.007}
LIMIT = {"limit": 2.0, "unit": "cm", "passed": True, "value": 1.1}
TRIAL = {
    "trial": "walk.c3d",
    "belt_speed_m_s": 0.0,
    "marker_errors_m": {"joint fit": ERRORS},
    "anchoring": {
        f"{name}_{when}": 0.1
        for name in ("sliding", "largest", "marker_rms")
        for when in ("before", "after")
    },
    "frames_not_converged": 0,
    "gait": {"right": GAIT, "left": GAIT},
    "findings": ["offset: plate 1"],
    "residuals": {},
}
RECORD = {
    "schema_version": 2,
    "versions": {"gaitval": "0.1.0"},
    "inputs": [{"role": "trial", "name": "walk.c3d", "sha256": "0f" * 32, "size": 12}],
    "person": {"identifier": "P1", "sex": "F", "mass_kg": 61.5, "height_m": 1.68},
    "processing": ProcessingSettings().model_dump(mode="json"),
    "marker_set": "wbds",
    "axes": "forward=+x up=+z",
    "decisions": [["read", "walk.c3d: 28 markers"]],
    "lengths_m": [LENGTH | {"name": "thigh", "at_bound": False}],
    "measurements": {"thigh_right": 0.42, "heel_right": [-0.08, 0.0, -0.05], "sources": {"a": "b"}},
    "model": "ab" * 32,
    "weight_ratio": None,
    "walking_speed_m_s": 1.2,
    "verdicts": [LIMIT | {"id": "ik-marker-rms", "target": "walk.c3d"}],
    "placement": [LIMIT | {"name": "knee axis", "source": "convention"}],
    "trials": [TRIAL],
}
"""What an import of one trial without plates writes."""


@pytest.fixture
def record() -> Json:
    return json.loads(json.dumps(RECORD))


def test_a_record_comes_back_as_it_was(record: Json) -> None:
    found = ImportResult.model_validate(record)
    assert found.as_dict() == record
    assert found.trials[0].consistent is None
    assert found.trials[0].gait.right.cadence == [1.0, None]


def test_the_earlier_key_of_warnings_is_read(record: Json) -> None:
    warning = {"trial": "walk.c3d", "check": "c", "where": "w", "value": None, "limit": 1.0,
               "unit": "1", "message": "m"}  # fmt: skip
    earlier = record | {"schema_version": 1, "doubts": [warning]}
    assert ImportResult.model_validate(earlier).as_dict() == record | {"warnings": [warning]}


def test_what_older_files_say_of_marker_pairs_is_read(record: Json) -> None:
    record["factors"] = {"thigh": 0.95}
    record["trials"][0]["marker_errors_m"]["marker pairs"] = ERRORS
    assert ImportResult.model_validate(record).as_dict() == record


def test_the_published_schema_takes_a_record(record: Json) -> None:
    jsonschema.Draft202012Validator(read_json(SCHEMA)).validate(record)


DAMAGE: dict[str, Callable[[Json], Any]] = {
    "at trials/0/gait/left/cadence": lambda r: r["trials"][0]["gait"]["left"].update(cadence=[1.0]),
    "at model": lambda r: r.update(model="none"),
    "at person/mass_kg": lambda r: r["person"].update(mass_kg="61.5"),
    "at inputs/0/colour": lambda r: r["inputs"][0].update(colour="red"),
    "at weight_ratio": lambda r: r.update(weight_ratio=float("nan")),
    "at schema_version": lambda r: r.pop("schema_version"),
    "at trials": lambda r: r.update(trials=[]),
}


@pytest.mark.parametrize("place", DAMAGE)
def test_what_is_wrong_is_refused_by_its_place(record: Json, place: str) -> None:
    DAMAGE[place](record)
    with pytest.raises(ValidationError) as refused:
        ImportResult.model_validate(record)
    assert "at " + "/".join(map(str, refused.value.errors()[0]["loc"])) == place
