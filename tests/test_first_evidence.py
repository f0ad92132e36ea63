"""What the rows of `reports/evidence/first.csv` count."""

import argparse
import json
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import evidence
from evidence import first as first_evidence

ROOT = Path(__file__).parents[1]


@pytest.fixture
def run_folder(tmp_path):
    """A run whose metrics.json is that of the stored baseline."""
    shutil.copy(ROOT / "reports/S05/baseline/metrics.json", tmp_path)
    return tmp_path


def test_a_run_like_the_stored_one_has_no_other_verdict(run_folder, capsys):
    row = first_evidence.verdicts(argparse.Namespace(runs=[run_folder]))
    assert row.value == 0
    assert row.n > 100
    assert "the same bytes" in capsys.readouterr().out


def test_a_verdict_that_flipped_is_counted_and_named(run_folder, capsys):
    file = run_folder / "metrics.json"
    metrics = json.loads(file.read_text(encoding="utf-8"))
    flipped = next(row for row in metrics["tolerances"] if row["measure"] == "push_survival")
    flipped["passed"] = not flipped["passed"]
    gone = metrics["tolerances"].pop(0)
    file.write_text(json.dumps(metrics), encoding="utf-8")
    row = first_evidence.verdicts(argparse.Namespace(runs=[run_folder]))
    assert row.value == 2
    told = capsys.readouterr().out
    assert f"{flipped['id']} {flipped['target']}: failed, stored: passed" in told
    assert f"{gone['id']} {gone['target']}: none, stored: passed" in told
    assert "other bytes" in told


def test_tests_that_are_not_there_are_missed():
    here = "tests/test_first_evidence.py"
    assert not first_evidence.missing_tests(f"{here}::test_tests_that_are_not_there_are_missed")
    for wrong in (f"{here}::test_none", "gone/test_none.py::test_a", here, ""):
        assert first_evidence.missing_tests(wrong)


def test_the_table_of_defects_has_those_that_must_be_fixed():
    row = first_evidence.defects(argparse.Namespace())
    assert row.n == 27
    assert row.value <= row.n


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"status": "fixed", "test": "gone/test_none.py::test_a"}, "no such test"),
        ({"status": "fixed", "test": ""}, "none is named"),
        ({"status": "not fixed", "why_not": ""}, "say why not"),
        ({"status": "mended"}, "status"),
        ({"defect": "report 99"}, "has no report 1"),
    ],
)
def test_a_claim_that_nothing_holds_is_refused(tmp_path, monkeypatch, change, told):
    lines = first_evidence.DEFECTS.read_text(encoding="utf-8").splitlines()
    names = lines[0].split(",")
    rows = [{**row, **(change if i == 0 else {})} for i, row in
            enumerate(evidence.read(first_evidence.DEFECTS))]  # fmt: skip
    monkeypatch.setattr(first_evidence, "DEFECTS", tmp_path / "defects.csv")
    text = "\n".join(",".join(f'"{row[name]}"' for name in names) for row in rows)
    first_evidence.DEFECTS.write_text(f"{lines[0]}\n{text}\n", encoding="utf-8")
    with pytest.raises(SystemExit, match=told):
        first_evidence.defects(argparse.Namespace())


def test_the_minutes_are_those_that_pytest_printed(tmp_path):
    log = tmp_path / "log"
    log.write_text("…\n==== 3900 passed, 12 skipped in 301.50s (0:05:01) ====\nSkipped for …\n")
    row = first_evidence.suite(argparse.Namespace(log=log))
    assert (row.value, row.n) == (pytest.approx(5.025), 3900)
    log.write_text("==== 1 failed, 3899 passed in 301.50s (0:05:01) ====\n")
    with pytest.raises(SystemExit, match="fails"):
        first_evidence.suite(argparse.Namespace(log=log))


def test_readmes_lines_are_those_that_it_shows():
    lines, test = first_evidence.lines_of(
        "    gaitval check --baseline S05 --junit a.xml  # in CI\n\nand\n\n"
        "    def test_knee(gaitval_check):\n        gaitval_check('S05')\n"
    )
    assert lines == [["gaitval", "check", "--baseline", "S05", "--junit", "a.xml"]]
    assert test.startswith("def test_knee(gaitval_check):\n    gaitval_check")


def test_comparisons_and_mirrored_sides_are_counted_apart(monkeypatch):
    found = {
        ("predicted", "report"): ["a"],
        ("expected", "check"): [],
        ("mirrored", "report"): ["b"] * 3,
    }
    monkeypatch.setitem(
        sys.modules, "evidence.unrecorded_verdicts", SimpleNamespace(count=lambda _: found)
    )
    given = argparse.Namespace(row="comparisons", runs=[Path("run")])
    row = first_evidence.comparisons(given)
    assert (row.value, row.n) == (1, 2)
    row = first_evidence.mirrored(argparse.Namespace(row="mirrored", runs=[Path("run")]))
    assert (row.value, row.n) == (3, 1)


def test_numbers_that_outputs_judge_differently_are_counted(monkeypatch):
    found = SimpleNamespace(
        differences=("a: passed, b: FAILED",), numbers=20, failed=3, outputs=("a", "b")
    )
    monkeypatch.setitem(
        sys.modules, "evidence.one_number", SimpleNamespace(compared=lambda folder, data: found)
    )
    row = first_evidence.outputs(argparse.Namespace(data=None))
    assert (row.value, row.n) == (1, 20)
