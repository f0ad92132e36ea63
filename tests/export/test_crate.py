"""The RO-Crate: every file is described, with its size and hash."""

import hashlib
import json
from pathlib import Path

import pytest

from gaitval.apps.export.crate import FILE
from gaitval.apps.export.formats import FORMATS, export_to
from gaitval.apps.export.walked import ExportedWalk


@pytest.fixture
def crate(walked: ExportedWalk, tmp_path: Path) -> Path:
    export_to("bundle", tmp_path / "crate", walked)
    return tmp_path / "crate"


def test_it_describes_itself_and_every_file(walked: ExportedWalk, crate: Path) -> None:
    found = json.loads((crate / FILE).read_text(encoding="utf-8"))
    assert found["@context"] == "https://w3id.org/ro/crate/1.1/context"
    by_id = {entity["@id"]: entity for entity in found["@graph"]}
    assert len(by_id) == len(found["@graph"])
    assert by_id[FILE]["about"] == {"@id": "./"}
    assert by_id[FILE]["conformsTo"] == {"@id": "https://w3id.org/ro/crate/1.1"}
    root = by_id["./"]
    assert {"name", "description", "datePublished", "license", "citation"} <= set(root)
    parts = [each["@id"] for each in root["hasPart"]]
    assert {part.rstrip("/") for part in parts} == {*FORMATS, "accuracy"}
    described = {each["@id"] for part in parts for each in by_id[part]["hasPart"]}
    there = {path.relative_to(crate).as_posix() for path in crate.rglob("*") if path.is_file()}
    assert described == there - {FILE}
    for name in described:
        content = (crate / name).read_bytes()
        assert by_id[name]["contentSize"] == str(len(content))
        assert by_id[name]["sha256"] == hashlib.sha256(content).hexdigest()
    record = by_id[root["citation"]["@id"]]
    assert record["creditText"] == walked.stored.subject.citation
    assert record["license"] == walked.stored.subject.licence
