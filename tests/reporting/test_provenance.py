"""Every hash on a report is that of a file beside it; date and code are those of the run."""

import hashlib
import json
import re
from pathlib import Path

import pytest
from html_page import Page, both_pages, only_html, without_figures
from report_run import build_run

from gaitval._internal.io.artefacts import write_json
from gaitval.reporting.report import write_report
from gaitval.reporting.run_files import FILES, dates, hashes

STAGES = {
    "scale": {"started": "2026-11-23T02:12:40+00:00", "finished": "2026-11-23T02:12:41+00:00"},
    "push": {"started": "2026-11-23T02:14:28+00:00", "finished": "2026-11-23T02:14:38+00:00"},
    "report": {"started": "2026-11-24T09:00:00+00:00", "finished": "2026-11-24T09:00:09+00:00"},
}


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    build_run(folder)
    (folder / "configuration.toml").write_text('[report]\npaper = "letter"\n', encoding="utf-8")
    write_json(
        folder / "provenance.json",
        {
            "seed": 0,
            "commit": "5" * 40 + "+",
            "stages": {name: {**each, "seconds": 1.0} for name, each in STAGES.items()},
        },
    )
    with pytest.MonkeyPatch.context() as patch:
        only_html(patch)
        without_figures(patch)
        write_report(folder)
    return folder


def test_every_hash_is_what_sha256sum_prints_of_a_file_beside_the_report(run_folder: Path) -> None:
    html = (run_folder / "report-details.html").read_text(encoding="utf-8")
    shown = set(re.findall(r">\s*([0-9a-f]{64})\s*<", html))
    files = {
        hashlib.sha256(path.read_bytes()).hexdigest(): path.relative_to(run_folder).as_posix()
        for path in run_folder.rglob("*")
        if path.is_file()
    }
    assert shown
    assert shown <= files.keys(), shown - files.keys()
    named = {"subject.toml", "configuration.toml", "metrics.json", "push.json", "reference.npz"}
    assert named <= {files[each] for each in shown}


def test_the_date_and_the_commit_are_those_of_the_run_and_not_of_the_page(run_folder: Path) -> None:
    text = Page(both_pages(run_folder)).text
    assert "2026-11-23 02:12 UTC – 2026-11-23 02:14 UTC" in text
    # Figures of the project have days of their own.
    assert "2026-11-24" not in re.sub(
        r"(?:reports|docs)/\S+, (?:\d+ cases, )?\d{4}-\d\d-\d\d", "", text
    )
    assert "5" * 40 + "+" in text


def test_metrics_hold_no_date(run_folder: Path) -> None:
    """Equal runs give equal bytes."""
    metrics = json.loads((run_folder / "metrics.json").read_text(encoding="utf-8"))
    assert set(metrics["provenance"]) == {"versions", "configuration", "subject", "record"}
    assert not any("training.csv" in name or "provenance" in name for name in FILES)


def test_what_was_not_stored_is_not_guessed(tmp_path: Path) -> None:
    assert hashes(tmp_path) == {}
    for nothing in (None, {}, {"stages": {}}, {"stages": {"train": {"seconds": 3.0}}}):
        assert dates(nothing) is None
