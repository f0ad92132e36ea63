"""Which walk `gaitval report FOLDER` writes the pages of."""

from pathlib import Path

import pytest

from gaitval.cli.study import _walk_in
from gaitval.errors import ArtefactError


@pytest.mark.parametrize("place", [".", "baseline", "at-0.95"])
def test_a_run_a_baseline_and_a_prediction_are_found_in_their_folder(
    tmp_path: Path, place: str
) -> None:
    (tmp_path / place).mkdir(exist_ok=True)
    (tmp_path / place / "metrics.json").touch()
    assert _walk_in(tmp_path) == tmp_path / place


def test_of_several_predictions_one_has_to_be_given(tmp_path: Path) -> None:
    for name in ("at-0.9", "at-1.2"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "metrics.json").touch()
    with pytest.raises(ArtefactError, match=r"at-0\.9, .*at-1\.2\. Give one"):
        _walk_in(tmp_path)


def test_a_folder_without_a_walk_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="no walk is in this folder"):
        _walk_in(tmp_path)
