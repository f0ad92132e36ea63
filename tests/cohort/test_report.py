"""The report of a cohort: its tables, its page, and the whole command."""

import json
import shutil

import pandas as pd
import pytest
from quick_settings import QUICK
from report_run import build_run
from typer.testing import CliRunner

from gaitval.apps.cohort.report import distributions, unjudged, write_report
from gaitval.apps.cohort.run import Outcome
from gaitval.apps.cohort.table import Study
from gaitval.cli import app

NAMES = ("one", "two", "three")


@pytest.fixture(scope="module")
def cohort(tmp_path_factory):
    """Two finished runs and one that was refused, with their report."""
    out = tmp_path_factory.mktemp("cohort")
    (out / "studies" / "one").mkdir(parents=True)
    build_run(out / "studies" / "one")
    shutil.copytree(out / "studies" / "one", out / "studies" / "two")
    studies = [Study(name=name, subject="5") for name in NAMES]
    outcomes = [
        Outcome("two", "finished", seconds=12.0, peak_memory=500_000_000),
        Outcome("three", "refused", "<b>no such subject</b>"),
        Outcome("one", "finished"),
    ]
    write_report(out, studies, outcomes)
    return out, outcomes


def test_the_tables_hold_what_metrics_json_says(cohort):
    out, _ = cohort
    metrics = json.loads((out / "studies" / "one" / "metrics.json").read_text())
    studies = pd.read_csv(out / "studies.csv").set_index("study")
    assert list(studies.index) == list(NAMES)
    assert studies.loc["one", "accepted"] == metrics["summary"]["accepted"]
    assert studies.loc["two", "seconds"] == 12.0
    assert studies.loc["three", "status"] == "refused"
    groups = pd.read_csv(out / "groups.csv").set_index(["study", "group"])
    walk = metrics["walks"][metrics["final"]]["errors"]["forces"]
    vertical = [walk[f"vertical_{side}"]["rmse"] for side in "rl"]
    assert groups.loc[("one", "vertical force"), "rmse"] == pytest.approx(sum(vertical) / 2)


def test_the_page_lists_every_study_and_runs_no_names(cohort):
    out, _ = cohort
    page = (out / "cohort.html").read_text(encoding="utf-8")
    assert "2 of 3 studies finished" in page
    assert "1 study is not finished" in page
    assert 'href="studies/one/report.html"' in page
    assert "<b>no such subject" not in page


def test_what_is_not_judged_is_named(cohort):
    out, outcomes = cohort
    assert unjudged(out, outcomes) == {}


def test_quartiles_are_over_the_studies():
    groups = pd.DataFrame(
        {
            "study": ["a", "b", "c"],
            "group": ["moments"] * 3,
            "unit": ["Nm/kg"] * 3,
            "rmse": [0.1, 0.3, 0.2],
            "skill": [0.5, None, 0.7],
        }
    )
    (row,) = distributions(groups)
    assert (row["count"], row["median"], row["worst"]) == (3, 0.2, 0.3)
    assert (row["low"], row["high"], row["skill"]) == pytest.approx((0.15, 0.25, 0.6))


@pytest.mark.slow
def test_the_whole_command_runs_reports_and_resumes(tmp_path):
    table, settings = tmp_path / "table.csv", dict(each.split("=") for each in QUICK)
    settings["training.samples"] = "auto"
    rows = [["subject", *settings], ["5", *settings.values()], ["99", *[""] * len(settings)]]
    table.write_text("\n".join(map(",".join, rows)), encoding="utf-8")
    words = ["cohort", str(table), "--out", str(tmp_path / "out"), "--workers", "1"]
    first = CliRunner().invoke(app, words)
    assert first.exit_code == 2, first.output
    assert "1 of 2 studies finished" in first.output
    written = [
        tmp_path / "out" / "studies" / "S05" / each for each in ("metrics.json", "push.json")
    ]
    before = [(path.stat().st_mtime_ns, path.read_bytes()) for path in written]
    again = CliRunner().invoke(app, words)
    assert again.exit_code == 2, again.output
    assert [(path.stat().st_mtime_ns, path.read_bytes()) for path in written] == before
