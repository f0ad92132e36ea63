"""A run folder's pages keep the sheets and the convention that were last asked for."""

from pathlib import Path

import pytest

from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.study.stage import Observer, open_run


class Heard(Observer):
    def __init__(self) -> None:
        self.lines: list[str] = []

    def say(self, message: str) -> None:
        self.lines.append(message)


USUAL = {"paper": "a4", "convention": "isb"}


def opened(folder: Path, *settings: str, config: Path | None = None) -> tuple[dict, list[str]]:
    """What `configuration.toml` says of the pages after a command, and what was said."""
    heard = Heard()
    wanted = load_configuration(config, settings=settings)
    with open_run(load_subject("S05"), wanted, folder, heard) as run:
        used = run.configuration.report.model_dump()
    assert load_configuration(folder / "configuration.toml").report.model_dump() == used
    return used, heard.lines


def test_paper_and_convention_stay_until_they_are_asked_anew(tmp_path: Path) -> None:
    assert opened(tmp_path) == (USUAL, [])
    other = {"paper": "letter", "convention": "rajagopal2016"}
    assert opened(tmp_path, "report.convention=rajagopal2016", "report.paper=letter") == (other, [])
    assert opened(tmp_path, "seed=1") == (
        other,
        ["report: paper letter, convention rajagopal2016, as last asked for"],
    )
    assert opened(tmp_path, "report.convention=isb") == (
        {**USUAL, "paper": "letter"},
        ["report: paper letter, as last asked for"],
    )
    config = tmp_path / "mine.toml"
    config.write_text('[report]\npaper = "a4"\n', encoding="utf-8")
    assert opened(tmp_path, config=config) == (USUAL, [])


@pytest.mark.parametrize("stored", ["[report", "report = 3", '[report]\npaper = "a5"', ""])
def test_settings_that_cannot_be_read_are_written_anew(tmp_path: Path, stored: str) -> None:
    (tmp_path / "configuration.toml").write_text(stored, encoding="utf-8")
    assert opened(tmp_path) == (USUAL, [])
