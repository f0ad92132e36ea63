"""The RO-Crate: every file is described, with its hash; what is changed or lost is found."""

import json
from pathlib import Path

import pytest

from gaitval.errors import ArtefactError
from gaitval_export.crate import FILE, check_crate
from gaitval_export.formats import FORMATS, export_to
from gaitval_export.walked import Walked


@pytest.fixture
def crate(walked: Walked, tmp_path: Path) -> Path:
    export_to("bundle", tmp_path / "crate", walked)
    return tmp_path / "crate"


def test_it_describes_itself_and_every_file(walked: Walked, crate: Path) -> None:
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
        assert by_id[name]["contentSize"] == str((crate / name).stat().st_size)
    record = by_id[root["citation"]["@id"]]
    assert record["creditText"] == walked.stored.subject.citation
    assert record["license"] == walked.stored.subject.licence
    assert not check_crate(crate)


def test_what_was_changed_or_lost_is_found(crate: Path) -> None:
    (crate / "mujoco" / "person.xml").write_text("<mujoco/>")
    (crate / "c3d" / "walk.c3d").unlink()
    wrong = check_crate(crate)
    assert len(wrong) == 2
    assert any("person.xml: its content" in each for each in wrong)
    assert any("walk.c3d: is missing" in each for each in wrong)
    (crate / FILE).write_text("{}")
    with pytest.raises(ArtefactError, match="no @graph"):
        check_crate(crate)
