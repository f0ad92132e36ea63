"""The command that measures what a release is held to: what it runs, skips and writes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from claims import Claim, Given, __main__, changes, registry, rows
from claims.recordings.public import public_file

ROOT = Path(__file__).parents[2]


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Run measurements that are made up, by name, into a file of their own; who was measured."""
    seen: list[str] = []
    commits = {"now": "abc123456"}
    monkeypatch.setattr(rows, "path_of", lambda: tmp_path / "0.9.0.csv")
    monkeypatch.setattr(
        rows,
        "source_of",
        lambda stored=(): rows.Source(commits["now"], "2026-11-29", rows.machine()),
    )

    def run(*, again: bool = False, **functions):
        class Made:
            about = ""

            def __init__(self, name, function, *folders):
                self.name, self.function, self.folders = name, function, folders

            def load(self):
                def measure(given):
                    seen.append(self.name)
                    return self.function(given)

                return measure, registry.Needs(self.folders, ())

        made = [Made(name, *(each if isinstance(each, tuple) else (each,)))
                for name, each in functions.items()]  # fmt: skip
        monkeypatch.setattr(registry, "chosen", lambda names: made)
        given = Given(data=tmp_path / "nothing", public=tmp_path, work=tmp_path / "work")
        failed = __main__.run((), given, again=again)
        return failed, rows.read(tmp_path / "0.9.0.csv")

    return run, seen, commits


def broken(_: Given) -> Claim:
    raise ZeroDivisionError("nobody walked")


def test_a_row_says_what_was_measured_of_which_code_when_and_where(measured) -> None:
    run, _, _ = measured
    failed, (row,) = run(one=lambda _: Claim("angles, RMSE", 1.0420941, "deg", 60))
    assert failed == 0
    assert tuple(row) == rows.COLUMNS
    assert (row["what"], row["value"], row["unit"], row["n"]) == (
        *("angles, RMSE", "1.04209", "deg", "60"),
    )  # fmt: skip
    assert (row["version"], row["commit"], row["by"]) == ("0.9.0", "abc123456", "one")
    assert "Python" in row["machine"]


def test_what_this_commit_is_measured_for_is_not_measured_again(measured) -> None:
    run, seen, commits = measured
    of = {"one": lambda _: Claim("a", 1.0, "1", 1), "two": lambda _: Claim("b", 2.0, "1", 1)}
    run(one=of["one"])
    _, found = run(**of)
    assert seen == ["one", "two"]
    assert [row["what"] for row in found] == ["a", "b"]
    run(again=True, one=of["one"])
    commits["now"] = "def123456"
    run(one=of["one"])
    commits["now"] = "def123456+"  # what that holds is not known
    run(one=of["one"])
    run(one=of["one"])
    assert seen == ["one", "two", "one", "one", "one", "one"]


def test_what_fails_or_lacks_something_does_not_end_the_others(measured, capsys) -> None:
    run, seen, _ = measured

    def good(_: Given) -> list[Claim]:
        return [Claim("b", 2.0, "1", 1)]

    failed, found = run(bad=broken, far=(good, "data"), last=good)
    assert failed == 1
    assert seen == ["bad", "last"]
    assert [row["by"] for row in found] == ["last"]
    printed = capsys.readouterr()
    assert "bad: FAILED" in printed.out
    assert "nobody walked" in printed.err
    assert "far: not measured, there is no --data" in printed.out


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no checkout of git")
def test_what_is_read_from_stored_results_is_of_their_commit_and_day() -> None:
    stored = "reports/S05/baseline/metrics.json"
    found = rows.source_of((stored,))
    commit, day = rows.git("log", "-1", "--format=%h %cs", "--abbrev=9", "--", stored).split()
    assert (found.commit.rstrip("+"), found.date, found.machine) == (commit, day, "")
    assert rows.source_of().machine


def test_a_claim_that_a_measurement_no_longer_makes_goes(measured) -> None:
    run, _, commits = measured
    run(one=lambda _: [Claim("a", 1.0, "1", 1), Claim("b", 1.0, "1", 1)],
        two=lambda _: Claim("c", 1.0, "1", 1))  # fmt: skip
    commits["now"] = "def123456"
    _, found = run(one=lambda _: [Claim("a", 3.0, "1", 1)])
    assert {row["what"]: row["value"] for row in found} == {"a": "3", "c": "1"}


def row(what: str, value: float, version: str = "0.3.0", by: str = "speed.study") -> dict[str, str]:
    return dict.fromkeys(rows.COLUMNS, "") | {
        **{"what": what, "value": str(value), "unit": "s", "n": "3", "by": by, "version": version},
    }


def test_the_page_says_what_moved_what_is_new_and_what_was_not_measured() -> None:
    old = [row(*each, "0.2.0") for each in (("study", 20.0), ("import", 5.0), ("live", 3.0))]
    new = [row("study", 21.0), row("import", 5.04), row("report", 8.0), old[-1]]
    moved, *topics = changes.page("0.3.0", new, "0.2.0", old).split("\n## ")[1:]
    assert "| study | 20 s | 21 s |" in moved
    assert "import" not in moved
    assert "New: report." in moved
    assert "As measured before, and marked below: 1." in moved
    assert len(topics) == 1
    assert "| import | 5.04 s | 3 |" in topics[0]
    assert "| live (0.2.0) | 3 s | 3 |" in topics[0]
    assert "moved" not in changes.page("0.3.0", new, "", [])


def test_versions_are_in_the_order_of_their_numbers(monkeypatch, tmp_path) -> None:
    for name in ("0.10.0", "0.9.0", "0.9.1"):
        (tmp_path / f"{name}.csv").touch()
    assert changes.versions(tmp_path) == ["0.9.0", "0.9.1", "0.10.0"]


def test_a_measurement_is_of_the_newest_version_in_which_it_was_run(tmp_path) -> None:
    stored = {
        "0.9.0": [row("a", 1.0, "0.9.0"), row("gone", 2.0, "0.9.0"), row("b", 3.0, "0.9.0", "x.y")],
        "0.10.0": [row("a", 4.0, "0.10.0")],
    }
    for version, each in stored.items():
        rows.save(tmp_path / f"{version}.csv", each)
    values = {each["what"]: float(each["value"]) for each in changes.newest(tmp_path)}
    assert values == {"a": 4.0, "b": 3.0}
    assert len(changes.newest(tmp_path, until="0.9.0")) == 3


def test_the_list_of_measurements_needs_none_of_their_libraries() -> None:
    """`--list` reads sources; the page of claims names every topic."""
    code = "import sys; sys.modules['numpy'] = None; from claims.__main__ import main; "
    done = subprocess.run(
        [sys.executable, "-c", f"{code}main(['--list'])"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    listed = [line.split()[0] for line in done.stdout.splitlines()]
    assert "accuracy.baselines" in listed
    page = (ROOT / "claims" / "README.md").read_text(encoding="utf-8")
    for topic in {name.partition(".")[0] for name in listed}:
        assert f"| `{topic}` |" in page, topic


def test_a_claim_that_there_is_not_is_refused_with_the_topics() -> None:
    with pytest.raises(SystemExit, match=r"'nothing'.*accuracy"):
        registry.chosen(["nothing"])


def test_the_measurements_that_workflows_docs_and_code_name_are_there() -> None:
    folders = (".github", "claims", "docs", "experiments", "gaitval", "tests")
    files = [each for folder in folders for each in (ROOT / folder).rglob("*.*")]
    asked = re.compile(r"-m claims((?:\s+[a-z_]+(?:\.[a-z_]+)?(?![\w.]))+)")
    named = {
        name
        for file in files
        if file.suffix in (".md", ".py", ".yml")
        for words in asked.findall(file.read_text(encoding="utf-8"))
        for name in words.split()
        if "." in name
    }
    assert "speed.check" in named
    assert named <= set(registry.measurements())


def test_every_measurement_can_be_loaded_where_its_libraries_are() -> None:
    for each in registry.measurements().values():
        try:
            function, needs = each.load()
        except ImportError:  # opensim, spm1d: development only
            continue
        assert callable(function)
        assert set(needs.folders) <= {"data", "public", "work"}


def test_a_recording_that_is_not_there_is_named_with_where_to_get_it(
    measured, tmp_path, capsys
) -> None:
    run, seen, _ = measured

    def reads(given: Given) -> Claim:
        public_file("data:one.c3d", given.public)
        return Claim("never", 1.0, "1", 1)

    def reads_clone(given: Given) -> Claim:
        (given.public / "here").touch()
        assert public_file("here", given.public) == given.public / "here"
        public_file("owner+name/walks/one.c3d", given.public)
        return Claim("never", 1.0, "1", 1)

    failed, found = run(one=reads, two=reads_clone, three=lambda _: Claim("it goes on", 1, "1", 1))
    said = capsys.readouterr().out
    assert (failed, len(found)) == (0, 1)
    assert seen == ["one", "two", "three"]
    for words in ("one: not measured", "GAITVAL_DATA", str(tmp_path / "owner+name/walks/one.c3d"),
                  "https://github.com/owner/name"):  # fmt: skip
        assert words in said
