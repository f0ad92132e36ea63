"""Two imports do not write into one folder, nor an import into the folder of a run."""

from pathlib import Path

import pytest
from made_up_session import SHORT, made_up_session

from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError
from gaitval.folder_lock import locked
from gaitval.importing.importing import import_files


def test_a_folder_in_which_another_works_is_refused(tmp_path: Path) -> None:
    request = made_up_session(tmp_path, noise=0.0, **SHORT).request
    out = tmp_path / "out"
    with locked(out):
        before = sorted(out.rglob("*"))
        with pytest.raises(ArtefactError, match=r"another gaitval .* is running in this folder"):
            import_files(request, out, configuration=load_configuration())
        assert sorted(out.rglob("*")) == before
