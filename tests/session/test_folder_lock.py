"""Two imports do not write into one folder, nor an import into the folder of a run."""

import re
from pathlib import Path

import pytest
from made_up_session import SHORT, made_up_session
from typer.testing import CliRunner

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.io.folder_lock import locked
from gaitval.cli import app
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError
from gaitval.session.importing.importing import import_files


def test_a_folder_in_which_another_works_is_refused(tmp_path: Path) -> None:
    request = made_up_session(tmp_path, noise=0.0, **SHORT).request
    out = tmp_path / "out"
    with locked(out):
        before = sorted(out.rglob("*"))
        with pytest.raises(ArtefactError, match=r"another gaitval .* is running in this folder"):
            import_files(request, out, configuration=load_configuration())
        assert sorted(out.rglob("*")) == before


@pytest.mark.parametrize("below", ["figures", "rounds/1/policy"])
def test_a_linked_folder_in_a_folder_to_write_to_is_refused_before_the_work(
    tmp_path: Path, below: str
) -> None:
    """An archive may hold one: files of the same names elsewhere would be replaced."""
    elsewhere, folder = tmp_path / "elsewhere", tmp_path / "run"
    elsewhere.mkdir()
    (elsewhere / ".partial-theirs").write_text("x")
    link = folder / below
    link.parent.mkdir(parents=True)
    link.symlink_to(elsewhere)
    refused = pytest.raises(ArtefactError, match=f"{re.escape(str(link))}: is a link to a folder")
    with refused, locked(folder):
        pass
    assert [each.name for each in elsewhere.iterdir()] == [".partial-theirs"]
    link.unlink()
    with locked(folder):
        pass


def test_the_folder_itself_may_be_a_link_and_files_may(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "table.csv").symlink_to(tmp_path / "none")
    (tmp_path / "link").symlink_to(tmp_path / "run")
    with locked(tmp_path / "link"):
        write_text(tmp_path / "link" / "table.csv", "a")
    assert not (tmp_path / "none").exists()
    assert (tmp_path / "run" / "table.csv").read_text() == "a"


IN_FOLDERS = {
    "export": ["export", "5", "--to", "gymnasium", "--out", "OUT"],
    "import": ["import", "OUT/people.toml", "--out", "OUT"],
    "stage": ["stage", "scale", "5", "--out", "OUT"],
}


@pytest.mark.parametrize("name", IN_FOLDERS)
def test_a_command_writes_through_no_link(tmp_path: Path, name: str) -> None:
    elsewhere, out = tmp_path / "elsewhere", tmp_path / "out"
    elsewhere.mkdir()
    out.mkdir()
    for below in ("walker", "P01"):
        (out / below).symlink_to(elsewhere)
    (out / "people.toml").write_text(
        '[[people]]\nname = "P01"\nsex = "F"\ntrials = ["no.c3d"]\n', encoding="utf-8"
    )
    done = CliRunner().invoke(app, [each.replace("OUT", str(out)) for each in IN_FOLDERS[name]])
    assert done.exit_code == 2
    assert "is a link to a folder" in " ".join(done.output.split())
    assert list(elsewhere.iterdir()) == []
