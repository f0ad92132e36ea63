"""What an import knows of files in its folder, and what is given by hand, which comes first."""

from types import SimpleNamespace

import pytest

from gaitval.apps.judge import beside_import
from gaitval.apps.judge.beside_import import OfImport, with_import
from gaitval.apps.judge.request import JudgeRequest
from gaitval.errors import ArtefactError


def trial(belt, rms, largest):
    errors = SimpleNamespace(rms=rms, largest=largest)
    return SimpleNamespace(belt_speed_m_s=belt, marker_errors_m={"joint fit": errors})


@pytest.fixture
def folder(tmp_path, monkeypatch):
    person = SimpleNamespace(identifier="anna", mass_kg=64.95, height_m=1.53)
    trials = [trial(1.1473, 0.001, 0.003), trial(0.0, 0.002, 0.004)]
    found = SimpleNamespace(person=person, trials=trials)
    monkeypatch.setattr(beside_import.ImportResult, "read", lambda *_, **__: found)
    (tmp_path / "import.json").write_text("{}")
    return tmp_path


def test_who_was_imported_is_known(folder):
    request = JudgeRequest(folder / "model.osim", ik=folder / "trial1_ik.mot")
    known, found = with_import(request, "anna")
    assert (known.mass, known.height, known.belt) == (64.95, 1.53, 1.1473)
    assert found == OfImport(1.1473, 0.001, 0.003)
    other = JudgeRequest(folder / "model.osim", ik=folder / "trial2_ik.mot")
    assert with_import(other, "anna")[1] == OfImport(0.0, 0.002, 0.004)


def test_what_is_given_comes_first(folder):
    request = JudgeRequest(
        folder / "model.osim", ik=folder / "trial1_ik.mot", height=1.6, belt=0.0, mass=70.0
    )
    known, _ = with_import(request, "anna")
    assert (known.mass, known.height, known.belt) == (70.0, 1.6, 0.0)


def test_a_motion_from_elsewhere_has_no_belt_of_the_import(folder, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("other") / "trial1_ik.mot"
    known, found = with_import(JudgeRequest(folder / "model.osim", ik=elsewhere), "anna")
    assert (known.height, known.belt, found) == (1.53, None, OfImport())


def test_somebody_elses_model_is_nobody_of_the_import(folder):
    request = JudgeRequest(folder / "model.osim", ik=folder / "trial1_ik.mot")
    assert with_import(request, "ben") == (request, None)
    (folder / "import.json").unlink()
    assert with_import(request, "anna") == (request, None)


def test_a_damaged_import_is_refused_with_the_way_on(tmp_path):
    (tmp_path / "import.json").write_text('{"schema_version": 1}')
    with pytest.raises(ArtefactError, match=r"import\.json.*--belt") as refused:
        with_import(JudgeRequest(tmp_path / "model.osim"), "anna")
    assert refused.value.exit_code == 2
