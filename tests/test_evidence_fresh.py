"""Every row of evidence is of today's code, and says which commit and which command made it."""

import re
from pathlib import Path

import pytest

from evidence import registry, sources, stale
from evidence import rows as evidence
from evidence.stale import pieces

ROOT = Path(__file__).parents[1]
ROWS = [
    (path, row)
    for folder in (evidence.FOLDER, stale.PAST)
    for path in sorted(folder.glob("*.csv"))
    for row in evidence.read(path)
]
SCRIPTS = sorted(
    path.relative_to(ROOT).as_posix()
    for folder in ("evidence", "experiments", "tests/robustness")
    for path in (ROOT / folder).rglob("*.py")
    if re.search(r"^MEASURES\b.*= ", path.read_text(encoding="utf-8"), re.MULTILINE)
)


def test_no_row_is_older_than_its_code():
    try:
        found = stale.stale()
    except stale.NoHistory:
        pytest.skip("this copy of the project has no .git, and so no sources of before")
    assert not found, "\n".join(
        [
            "Measure these rows again by their commands, or, where that takes hours, move them by "
            "`python -m evidence stale --retire`:",
            *(f"{each.topic}: {each.what}: {each.reason}" for each in found),
        ]
    )


def test_a_row_names_its_commit_its_day_and_a_command_of_the_project():
    for path in sorted(evidence.FOLDER.rglob("*.csv")):
        header = path.read_text(encoding="utf-8").splitlines()[0]
        assert header == "what,value,unit,relation,goal,must,n,command,commit,date", path
    for path, row in ROWS:
        about = f"{path}: {row['what']}"
        assert re.fullmatch(r"[0-9a-f]{9}", row["commit"]), f"{about}: of files of no commit"
        assert re.fullmatch(r"20\d\d-\d\d-\d\d", row["date"]), about
        assert registry.source_of(row["command"]), f"{about}: not the project's command"
        assert row["command"] == evidence.portable(row["command"]), f"{about}: a machine's path"


@pytest.mark.parametrize("script", SCRIPTS)
def test_what_a_script_declares_is_there(script):
    assert not sources.named_but_missing(script)


def test_no_row_is_measured_twice_or_both_now_and_once():
    now = {(path.stem, row["what"]) for path, row in ROWS}
    assert len(now) == len(ROWS)


SCRIPT = "/".join(("scripts", "one.py"))
COMMAND = f"python {SCRIPT} --to /some/where"
BEFORE = '''
"""A module."""
LIMIT = 3

def walk(steps):
    """Walk."""
    for step in range(steps):  # forward
        go(step)
    return steps

class Walker:
    def fall(self):
        return LIMIT
'''


def changed(after: str) -> int:
    then, now = pieces(BEFORE), pieces(after)
    return sum(
        stale._differences(then.get(place, []), now.get(place, [])) for place in {*then, *now}
    )


def test_comments_docstrings_imports_and_layout_are_no_change():
    after = BEFORE.replace("# forward", "").replace("A module", "Another").replace(
        "go(step)", "\n        go(\n            step\n        )"
    )  # fmt: skip
    assert changed("import os\n" + after) == 0


@pytest.mark.parametrize(
    ("old", "new", "count"),
    [
        ("LIMIT = 3", "LIMIT = 4", 1),
        ("range(steps)", "range(1, steps)", 1),
        ("go(step)", "go(-step)", 1),
        ("return steps", "stop()\n    return steps", 1),
        ("def walk(steps)", "def walk(steps, way)", 1),
        ("return LIMIT", "return 1", 1),
    ],
)
def test_a_statement_that_changed_counts_once(old, new, count):
    assert changed(BEFORE.replace(old, new)) == count


def test_the_order_of_statements_counts():
    assert pieces("def f():\n    a()\n    b()") != pieces("def f():\n    b()\n    a()")


def test_only_the_named_definitions_count():
    assert set(pieces(BEFORE, ("walk",))) == {"walk"}


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project of one module, one script and one file of data, in git."""
    (tmp_path / "scripts").mkdir()
    (tmp_path / "code.py").write_text("def f():\n    return 1\n\ndef g():\n    return 1\n")
    (tmp_path / "data.txt").write_text("1")
    (tmp_path / "scripts" / "one.py").write_text(
        'MEASURES = {"few *": {"code": ("code.py",), "allowed": 1, "why": "so"},\n'
        '    "data": {"data": ("data.txt",)}, "f": {"code": ("code.py:f",)},\n'
        '    "stored": {"results": ("data.txt",)}, "all": {"code": ("code.py",)}}\n'
    )
    for module in (evidence, registry, sources, stale):
        monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(evidence, "FOLDER", tmp_path / "evidence")
    monkeypatch.setattr(stale, "PAST", tmp_path / "evidence/past")
    monkeypatch.setattr(evidence, "MEASURED", ("code.py", "scripts", "data.txt"))
    evidence.git("init", "--quiet")
    commit(monkeypatch, "first")
    evidence.write(
        "topic", [row(what) for what in ("few things", "data", "f", "stored", "all")], COMMAND
    )
    yield tmp_path
    forget()  # other tests look at the checkout


def row(what: str) -> evidence.Row:
    return evidence.Row(what, 1.0, "1", "<=", 1, 1, 1)


def commit(monkeypatch, message: str) -> str:
    evidence.git("add", "--all")
    identity = ("-c", "user.name=T", "-c", "user.email=t@t.invalid", "-c", "commit.gpgsign=false")
    evidence.git(*identity, "commit", "--quiet", "-m", message)
    monkeypatch.setattr(evidence, "STARTED", evidence.git("rev-parse", "--short=9", "HEAD"))
    forget()
    return evidence.STARTED


def forget() -> None:
    """What was read of a project and is kept."""
    for cached in (
        registry.measurements,
        sources.declarations,
        stale._why,
        stale._files_of,
        stale._content,
        stale.changed_statements,
        stale._is_before,
    ):
        cached.cache_clear()


def stale_rows() -> set[str]:
    return {each.what for each in stale.stale()}


def test_a_new_row_is_fresh_and_carries_commit_date_and_a_portable_command(project):
    assert stale_rows() == set()
    first = evidence.read(evidence.FOLDER / "topic.csv")[0]
    assert first["commit"] == evidence.STARTED
    assert first["command"] == f"python {SCRIPT} --to PATH"


def test_a_change_makes_those_rows_stale_that_depend_on_it(project, monkeypatch):
    (project / "code.py").write_text("def f():\n    return 1\n\ndef g():\n    return 2\n")
    commit(monkeypatch, "g changed")
    assert stale_rows() == {"all"}
    (project / "code.py").write_text("def f():\n    return 2\n\ndef g():\n    return 2\n")
    commit(monkeypatch, "f too")
    assert stale_rows() == {"all", "few things", "f"}


def test_a_change_of_data_or_of_results_makes_rows_stale(project, monkeypatch):
    (project / "data.txt").write_text("2")
    commit(monkeypatch, "data")
    assert stale_rows() == {"data", "stored"}


def test_a_definition_that_moved_is_no_change(project, monkeypatch):
    (project / "scripts" / "one.py").write_text(
        (project / "scripts" / "one.py").read_text().replace('("code.py",)}}', '("c*.py",)}}')
    )
    commit(monkeypatch, "declared wider")
    (project / "code.py").write_text("def f():\n    return 1\n")
    (project / "clean.py").write_text("def g():\n    return 1\n")
    commit(monkeypatch, "moved")
    assert "all" not in stale_rows()


def test_a_change_that_leaves_the_numbers_does_not_count_and_those_around_it_do(
    project, monkeypatch
):
    first = evidence.STARTED
    (project / "code.py").write_text("def f():\n    return 2 - 1\n\ndef g():\n    return 1\n")
    after = commit(monkeypatch, "f otherwise")
    assert stale_rows() == {"all", "f"}
    equal = stale.Equal(first, after, ("code.py",), "2 - 1 is 1")
    monkeypatch.setattr(stale, "EQUAL", (equal,))
    forget()
    assert stale_rows() == set()
    monkeypatch.setattr(stale, "EQUAL", (equal._replace(code=("other.py",)),))
    forget()
    assert stale_rows() == {"all", "f"}
    monkeypatch.setattr(stale, "EQUAL", (equal,))
    (project / "code.py").write_text("def f():\n    return 2 - 1\n\ndef g():\n    return 3\n")
    commit(monkeypatch, "g changed")
    assert stale_rows() == {"all"}


def test_uncommitted_files_are_marked_and_such_a_row_is_stale(project):
    (project / "code.py").write_text("def f():\n    return 3\n")
    evidence.write("topic", [row("all")], COMMAND)
    marked = evidence.read(evidence.FOLDER / "topic.csv")[-1]
    assert marked["commit"] == evidence.STARTED + "+"
    assert "all" in stale_rows()


def test_a_row_of_stored_results_carries_their_commit(project, monkeypatch):
    first = evidence.STARTED
    commit(monkeypatch, "evidence")
    evidence.write("topic", [row("stored")], COMMAND)
    rows = {each["what"]: each for each in evidence.read(evidence.FOLDER / "topic.csv")}
    assert rows["stored"]["commit"] == first != evidence.STARTED


def test_a_row_that_nothing_is_declared_for_is_refused(project):
    with pytest.raises(SystemExit, match="MEASURES"):
        evidence.write("topic", [row("undeclared")], COMMAND)


def test_retired_rows_stand_among_those_of_the_past_until_they_are_measured_again(
    project, monkeypatch
):
    (project / "data.txt").write_text("2")
    commit(monkeypatch, "data")
    stale.retire(stale.stale())
    assert stale_rows() == set()
    past = stale.PAST / "topic.csv"
    assert {each["what"] for each in evidence.read(past)} == {"data", "stored"}
    evidence.write("topic", [row("data")], COMMAND)
    assert {each["what"] for each in evidence.read(past)} == {"stored"}
    assert stale_rows() == set()


def test_a_moved_file_is_compared_with_what_it_was(project, monkeypatch):
    rows = evidence.FOLDER / "topic.csv"
    (project / "room").mkdir()
    (project / "scripts" / "one.py").rename(project / "room" / "one.py")
    (project / "code.py").rename(project / "room" / "code.py")
    declared = (project / "room" / "one.py").read_text().replace('"code.py', '"room/code.py')
    (project / "room" / "one.py").write_text(declared)
    rows.write_text(rows.read_text().replace(SCRIPT, "room/one.py"))
    commit(monkeypatch, "moved")
    assert stale_rows() == set()
    (project / "room" / "code.py").write_text("def f():\n    return 2\n\ndef g():\n    return 1\n")
    commit(monkeypatch, "f changed")
    assert stale_rows() == {"all", "f"}


def test_comments_of_data_are_no_change(project, monkeypatch):
    (project / "data.txt").rename(project / "data.csv")
    script = project / "scripts" / "one.py"
    script.write_text(script.read_text().replace("data.txt", "data.csv"))
    commit(monkeypatch, "a table")
    evidence.write("topic", [row("data")], COMMAND)
    (project / "data.csv").write_text("# one\n1")
    commit(monkeypatch, "comment")
    assert "data" not in stale_rows()
    (project / "data.csv").write_text("# one\n2")
    commit(monkeypatch, "figure")
    assert "data" in stale_rows()


def test_the_command_of_a_row_is_no_change():
    before = 'def f(a):\n    return evidence.Row("x", a, "1", "<=", 1, 1, n, f"{COMMAND} f")\n'
    after = (
        '@evidence.measurement()\ndef f(a):\n    return evidence.Row("x", a, "1", "<=", 1, 1, n)'
    )
    assert pieces(before) == pieces(after)
    assert pieces(before) != pieces(after.replace("1, 1, n", "1, 1, m"))


def test_a_command_names_the_file_that_it_runs():
    assert registry.source_of("python -m evidence first stale") == "evidence/first.py"
    assert registry.source_of("python -m evidence report bands").endswith("curve_statistics.py")
    assert registry.source_of("python -m experiments.margins measure") == "experiments/margins.py"
    assert registry.source_of("python -m evidence first nothing") is None
    assert registry.source_of("python nothing.py") is None
