"""What an import knows of files in its folder, and what is given by hand, which comes first."""

from types import SimpleNamespace

import pytest

from gaitval.apps.judge import beside_import
from gaitval.apps.judge.beside_import import with_import
from gaitval.apps.judge.request import JudgeRequest
from gaitval.errors import ArtefactError


@pytest.fixture
def folder(tmp_path, monkeypatch):
    person = SimpleNamespace(identifier="anna", mass_kg=64.95, height_m=1.53)
    trials = [SimpleNamespace(belt_speed_m_s=belt) for belt in (1.1473, 0.0)]
    found = SimpleNamespace(person=person, trials=trials)
    monkeypatch.setattr(beside_import.ImportResult, "read", lambda *_, **__: found)
    (tmp_path / "import.json").write_text("{}")
    return tmp_path


@pytest.mark.parametrize(
    ("given", "known"),
    [
        ({"ik": "trial1_ik.mot"}, (64.95, 1.53, 1.1473)),
        ({"ik": "trial2_ik.mot"}, (64.95, 1.53, 0.0)),
        ({"ik": "trial1_ik.mot", "mass": 70.0, "height": 1.6, "belt": 0.0}, (70.0, 1.6, 0.0)),
        ({"ik": "elsewhere/trial1_ik.mot"}, (64.95, 1.53, None)),
    ],
)
def test_who_was_imported_is_known_and_what_is_given_comes_first(folder, given, known):
    found = with_import(
        JudgeRequest(folder / "model.osim", **given | {"ik": folder / given["ik"]}), "anna"
    )
    assert (found.mass, found.height, found.belt) == known


def test_somebody_elses_model_is_nobody_of_the_import(folder):
    request = JudgeRequest(folder / "model.osim", ik=folder / "trial1_ik.mot")
    assert with_import(request, "ben") == request
    (folder / "import.json").unlink()
    assert with_import(request, "anna") == request


def test_a_damaged_import_is_refused_with_the_way_on(tmp_path):
    (tmp_path / "import.json").write_text('{"schema_version": 1}')
    with pytest.raises(ArtefactError, match=r"import\.json.*--belt") as refused:
        with_import(JudgeRequest(tmp_path / "model.osim"), "anna")
    assert refused.value.exit_code == 2
