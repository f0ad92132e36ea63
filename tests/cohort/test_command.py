"""The command `gaitval cohort`."""

import json

import pytest
from killed_cohort import environment
from typer.testing import CliRunner

from gaitval.apps.cohort import command, engine
from gaitval.apps.cohort.store import Store
from gaitval.apps.cohort.table import read_table
from gaitval.cli import app
from gaitval.terminal import display


@pytest.fixture
def gaitval(monkeypatch):
    """Runs the command with quick studies."""
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    real = engine.run_cohort

    def quick(*arguments, **options):
        return real(*arguments, **options, function="quick_study:work")

    monkeypatch.setattr(engine, "run_cohort", quick)
    monkeypatch.setattr(display.output, "width", 200)

    def run(*arguments):
        return CliRunner().invoke(app, ["cohort", *arguments])

    return run


@pytest.mark.slow
def test_from_a_table_to_a_report_and_again(gaitval, tmp_path):
    table = tmp_path / "table.csv"
    table.write_text("name,subject,seed\nfirst_sleep0,5,0\nsecond_sleep0,5,1\nrefuse,5,2\n")
    out = tmp_path / "out"
    done = gaitval(str(table), "--out", str(out), "--workers", "2")
    assert done.exit_code == 2, done.output
    assert "2 of 3 studies finished" in done.output
    assert "refuse: refused: the record of this one is no record" in done.output
    assert "<h1>Cohort of 2 people: out</h1>" in (out / "cohort.html").read_text()
    assert len(read_table(out / "table.toml")) == 3
    first = Store(str(out / "studies")).finished("first_sleep0")
    table.write_text("name,subject,seed\nfirst_sleep0,5,0\nsecond_sleep0,5,1\n")
    again = gaitval(str(table), "--out", str(out), "--set", "seed=7")
    assert again.exit_code == 0, again.output
    assert Store(str(out / "studies")).finished("first_sleep0") == first, "the row's seed counts"


@pytest.mark.slow
def test_a_fault_has_its_own_exit_code(gaitval, tmp_path):
    (tmp_path / "t.csv").write_text("name,subject\ncrash,5\n")
    done = gaitval(str(tmp_path / "t.csv"), "--out", str(tmp_path / "o"), "--workers", "1")
    assert done.exit_code == 70


def test_the_table_alone(gaitval, tmp_path):
    done = gaitval("--virtual", "3", "--table-only", "--out", str(tmp_path))
    assert done.exit_code == 0
    assert [study.name for study in read_table(tmp_path / "table.toml")] == [
        "V0_000", "V0_001", "V0_002",
    ]  # fmt: skip
    assert not (tmp_path / "studies").exists()


@pytest.mark.parametrize("arguments", [[], ["--trials", "T05", "--virtual", "1"]])
def test_nothing_to_run_is_refused(gaitval, arguments, tmp_path):
    assert gaitval(*arguments, "--out", str(tmp_path)).exit_code == 2


def test_what_a_line_of_progress_says():
    state = engine.CohortState(
        total=10, found=2, done=4, failed=1, workers=2, dashboard="", seconds=60.0,
        outcome={"name": "a", "status": "finished", "reason": "", "seconds": 61.0,
                 "peak_memory": 512e6},
    )  # fmt: skip
    assert command.outcome_line(state) == (
        "a: 1 min 01 s, 512 MB (4 of 10, 1 failed, 2 workers, about 3 min 00 s left)"
    )
    assert json.dumps(state.outcome)


@pytest.mark.parametrize(
    ("found", "refused", "line"),
    [
        (1, 1, "1 of 3 are refused"),
        (2, 0, "2 of 3 studies are finished already"),
        (3, 1, "2 of 3 studies are finished already; 1 of 3 are refused"),
    ],
)
def test_a_refused_study_is_not_a_finished_one(found, refused, line):
    state = engine.CohortState(
        total=3, found=found, done=found, failed=refused, workers=0, dashboard="", seconds=0.0,
        refused=refused,
    )  # fmt: skip
    assert command.outcome_line(state) == line


def test_a_cohort_with_a_study_that_nothing_recorded_judges_is_no_pass(tmp_path):
    """All its limits are kept; but the moments were predicted."""
    from gaitval.apps.cohort.command import _not_judged

    class Stored:
        def summary(self, name):
            verdict = {"one": "", "two": "Not judged, because not recorded: moments (predicted)."}
            return {"verdicts": {"not_judged": verdict[name]}} if name in verdict else None

    assert list(_not_judged(Stored(), ["one", "two", "gone"])) == ["two"]
