"""The package stays as small, plain and typed as `reports/evidence/house.csv` requires."""

import argparse
import json

import pytest

from evidence import house, read, rows


@pytest.mark.parametrize("measure", [house.types, house.words], ids=lambda each: each.__name__)
def test_what_must_be_is(measure):
    """But for rows whose stored value misses its must: those may not get worse."""
    stored = {row["what"]: float(row["value"]) for row in read(house.CSV)}
    for row in measure(None):
        was = stored[row.what]
        worse = row.value > was if row.relation == "<=" else row.value < was - 1e-9
        assert row.kept or not worse, f"{row.what}: {row.value}"


def test_the_package_does_not_grow_beyond_its_limit():
    (row,) = (each for each in read(house.CSV) if each["what"] == house.LINES)
    assert house.lines_of(house.modules()) <= max(float(row["must"]), float(row["value"]))


def test_what_is_not_documented_is_found(tmp_path):
    code = 'def f(a, bee):\n    """Of `a`."""\n    raise ValueError(\'x\')\n'
    (tmp_path / "one.py").write_text(code)
    (function,) = house.tree_of(tmp_path / "one.py").body
    assert not house.is_documented(function)
    (tmp_path / "two.py").write_text(code.replace("Of `a`.", "Of `a` and `bee`; ValueError: no."))
    (function,) = house.tree_of(tmp_path / "two.py").body
    assert house.is_documented(function)


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """An empty repository that the measurements read instead of the project's."""
    monkeypatch.setattr(rows, "ROOT", tmp_path)
    rows.git("init", "--quiet")
    return tmp_path


def committed(folder, message, **files):
    """The commit of some files, by their paths."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    rows.git("add", "--all")
    who = ("-c", "user.name=T", "-c", "user.email=t@t.invalid", "-c", "commit.gpgsign=false")
    rows.git(*who, "commit", "--quiet", "--allow-empty", "-m", message)
    return rows.git("rev-parse", "HEAD")


def shown(name):
    return f"One\n\nWhy.\n\n{house.TRAILER}: {name}"


def test_files_of_shown_changes_are_counted_without_tests_pages_and_what_is_written(repository):
    names = list(house.SHOWN)
    counted = [f"{place}/one" for place in ("gaitval/contact", "gaitval/languages", "models")]
    others = [f"{place}/one" for place in ("tests", "docs", "evidence")]
    files = dict.fromkeys([*counted, *others, f"{counted[0]}.schema.json"], "")
    committed(repository, shown(names[0]), **files)
    committed(repository, 'Revert "One"\n\nThis reverts commit 1.', **{counted[0]: "two"})
    for name in names[1:]:
        committed(repository, shown(name), **{counted[0]: name})
    found = house.touched(argparse.Namespace())
    assert [row.what for row in found] == [f"files touched by {name}" for name in names]
    assert [row.value for row in found] == [3, 1, 1, 1]


def test_a_history_without_the_changes_says_so_and_gives_no_rows(repository, capsys):
    first, *others = house.SHOWN
    committed(repository, shown(first), **{"one": ""})
    assert house.touched(argparse.Namespace()) == []
    assert f"shows {', '.join(others)}" in capsys.readouterr().out


BASELINE = "reports/S01/baseline/metrics.json"
STORED = {
    "schema_version": 9,
    "provenance": {"versions": {"gaitval": "1"}, "seconds": 3.0},
    "record": {"curve": [1.0, 2.0, None]},
    "measures": [
        {"measure": "falls", "target": "walk", "value": 0},
        {"measure": "epsilon", "target": "walk", "value": 0.5, "passed": True},
    ],
}


@pytest.mark.parametrize(
    ("change", "different"),
    [
        (lambda stored: stored.update(schema_version=10, provenance={"seconds": 4.0}), 0),
        (lambda stored: stored.update(new={"number": 1.0}), 0),
        (lambda stored: stored["measures"].insert(0, {"measure": "a", "target": "b"}), 0),
        (lambda stored: stored["measures"].reverse(), 0),
        (lambda stored: stored["record"]["curve"].reverse(), 1),
        (lambda stored: stored["measures"][1].update(value=0.500001), 1),
        (lambda stored: stored["measures"].pop(), 1),
        (lambda stored: stored["measures"][0].update(value=None), 1),
        (lambda stored: stored.pop("record"), 2),
    ],
)
def test_numbers_of_baselines_that_differ_are_counted(repository, change, different):
    before = committed(repository, "before", **{BASELINE: json.dumps(STORED)})
    now = json.loads(json.dumps(STORED))
    change(now)
    committed(repository, "now", **{BASELINE: json.dumps(now), "one": "1"})
    (row,) = house.numbers(argparse.Namespace(before=before))
    assert (row.value, row.n) == (different, 4)


def test_a_baseline_that_is_gone_has_no_number_left(repository):
    before = committed(repository, "before", **{BASELINE: json.dumps(STORED)})
    (repository / BASELINE).unlink()
    committed(repository, "now", **{"one": ""})
    (row,) = house.numbers(argparse.Namespace(before=before))
    assert (row.value, row.n) == (4, 4)


def test_a_commit_that_is_not_there_is_refused(repository):
    committed(repository, "now", **{BASELINE: json.dumps(STORED)})
    with pytest.raises(SystemExit, match="abcdef0: no commit"):
        house.numbers(argparse.Namespace(before="abcdef0"))
    assert house.numbers(argparse.Namespace(before=None)) == []
