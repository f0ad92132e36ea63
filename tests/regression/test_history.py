"""A history keeps every check whole, whoever else writes, and refuses what is not one."""

import json
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from gaitval.apps.regression import history
from gaitval.apps.regression.history import Check, CheckedFigure
from gaitval.apps.regression.regression import Row
from gaitval.errors import ArtefactError

FIGURE = CheckedFigure("angle_rmse", "knee_angle_r", "deg", 0.97, 0.95, 0.3, "lower")
CHECK = Check(
    *("check", "a" * 40, "2026-11-01T10:00:00+00:00", "2026-11-02T10:00:00+00:00"),
    *("a machine", "S05", (FIGURE, replace(FIGURE, target="knee_angle_l", value=None))),
)

EPOCH = "1970-01-01T00:00:00+00:00"

ADDER = """
import sys
from dataclasses import replace
from pathlib import Path
from gaitval.apps.regression import history
from gaitval.apps.regression.history import Check, CheckedFigure
figures = tuple(
    CheckedFigure("angle_rmse", f"curve {n}", "deg", 1.0, 1.0, 0.3, "lower") for n in range(50)
)
for number in range(10):
    check = Check("check", f"{sys.argv[2]}-{number}", None, "2026-11-02T10:00:00+00:00", "m", "S05",
                  figures)
    assert history.add(Path(sys.argv[1]), check)
"""


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    path = tmp_path / "accuracy.db"
    assert history.add(path, CHECK)
    return path


def test_what_is_added_is_read_again(kept: Path) -> None:
    assert history.read(kept) == [CHECK]


def test_the_same_check_is_kept_once(kept: Path) -> None:
    assert not history.add(kept, CHECK)
    assert history.read(kept) == [CHECK]


def test_checks_stand_in_the_order_of_their_commits(kept: Path) -> None:
    """An old commit that is checked later stands before; times count as times, not as text."""
    before = replace(CHECK, revision="b" * 40, revised="2026-10-31T10:00:00.5+00:00")
    after = replace(CHECK, revision="c" * 40, revised="2026-11-01T09:30:00-05:00")
    unknown = replace(CHECK, revision="unknown", revised=None, time="2026-12-01T10:00:00+00:00")
    for check in (unknown, after, before):
        history.add(kept, check)
    assert history.read(kept) == [before, CHECK, after, unknown]


@pytest.mark.slow
def test_processes_write_side_by_side(tmp_path: Path) -> None:
    """Six processes, ten checks each, from the first moment on: nothing is lost or half there."""
    path = tmp_path / "new" / "accuracy.db"
    running = [
        subprocess.Popen([sys.executable, "-c", ADDER, path, str(n)], stderr=subprocess.PIPE)
        for n in range(6)
    ]
    for process in running:
        _, text = process.communicate(timeout=300)
        assert process.returncode == 0, text.decode()
    checks = history.read(path)
    assert len({check.revision for check in checks}) == 60
    assert {len(check.figures) for check in checks} == {50}


def test_an_interrupted_check_leaves_nothing(kept: Path) -> None:
    wrong = replace(CHECK, revision="d", figures=(FIGURE, FIGURE))  # the second one is refused
    with pytest.raises(ArtefactError, match="UNIQUE"):
        history.add(kept, wrong)
    assert history.read(kept) == [CHECK]


def _sql(*lines: str) -> Callable[[Path], None]:
    def damage(path: Path) -> None:
        with sqlite3.connect(path) as database:
            for line in lines:
                database.execute(line)
        database.close()

    return damage


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _overwritten(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[4096 : 4096 + 600] = b"\xff" * 600  # the page of the first table
    path.write_bytes(bytes(data))


def _untyped(path: Path) -> None:
    """The types of a table are taken away, a text stands for a number, the types come back."""
    with sqlite3.connect(path) as database:
        database.execute("PRAGMA writable_schema = ON")
        text = "UPDATE sqlite_master SET sql = replace(sql, ?, ?) WHERE name = 'figures'"
        database.execute(text, (") STRICT", ")"))
    database.close()
    with sqlite3.connect(path) as database:
        database.execute("UPDATE figures SET value = '<b>'")
        database.execute("PRAGMA writable_schema = ON")
        database.execute(text, (")\n)", ")\n) STRICT"))
        tables = dict(database.execute("SELECT name, sql FROM sqlite_master WHERE sql NOT NULL"))
    assert tables == history._TABLES
    database.close()


DAMAGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "text": (lambda path: path.write_text("no database at all\n" * 99), "is no history"),
    "cut": (_cut, "damaged"),
    "overwritten": (_overwritten, "damaged"),
    "another program's": (_sql("PRAGMA application_id = 0"), "another program"),
    "newer": (_sql("PRAGMA user_version = 2"), "version 2"),
    "trigger": (
        _sql("CREATE TRIGGER t AFTER INSERT ON checks BEGIN DELETE FROM figures; END"),
        "tables were changed",
    ),
    "table": (_sql("ALTER TABLE figures ADD COLUMN more TEXT"), "tables were changed"),
    "infinite": (_sql("UPDATE figures SET value = 9e999"), "is not a figure"),
    "untyped": (_untyped, "TEXT value in|is not a figure|damaged"),
    "better": (_sql("UPDATE figures SET better = 'worse'"), "is not a figure"),
    "time": (_sql("UPDATE checks SET time = 'yesterday'"), "at 'yesterday' is none"),
    "kind": (_sql("UPDATE checks SET kind = 'guess'"), "is none"),
    "orphans": (_sql("DELETE FROM checks"), "figures of no check"),
}


@pytest.mark.parametrize("kind", DAMAGES)
def test_what_is_no_history_is_refused_with_a_way_on(kept: Path, kind: str) -> None:
    damage, text = DAMAGES[kind]
    damage(kept)
    before = kept.read_bytes()
    with pytest.raises(ArtefactError, match=text) as refused:
        history.read(kept)
    assert str(kept) in str(refused.value)
    assert "Restore it" in str(refused.value) or "begin another file" in str(refused.value)
    assert kept.read_bytes() == before


def test_nothing_is_added_to_what_is_no_history(kept: Path) -> None:
    kept.write_text("no database at all\n" * 99)
    with pytest.raises(ArtefactError, match="is no history"):
        history.prepare(kept)
    with pytest.raises(ArtefactError, match="is a folder"):
        history.prepare(kept.parent)
    with pytest.raises(ArtefactError, match="no such file"):
        history.read(kept.parent / "none.db")
    with pytest.raises(ArtefactError, match="is not a file"):
        history.read(kept.parent)


def test_a_check_is_of_the_commit_that_is_checked_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def git(*arguments: str) -> str:
        names = ["-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false"]
        return subprocess.run(
            ["git", *names, *arguments], cwd=tmp_path, check=True, capture_output=True, text=True
        ).stdout.strip()

    for name in ("GITHUB_SHA", "CI_COMMIT_SHA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    assert history.current_commit() == ("unknown", None)
    monkeypatch.setenv("GITHUB_SHA", "e" * 40)
    assert history.current_commit() == ("e" * 40, None)
    git("init", "-q")
    (tmp_path / "file").write_text("1")
    git("add", "file")
    monkeypatch.setenv("GIT_COMMITTER_DATE", "2026-11-22T01:00:00+02:00")
    git("commit", "-q", "-m", "first")
    head = git("rev-parse", "HEAD")
    assert history.current_commit() == (head, "2026-11-21T23:00:00+00:00")
    (tmp_path / "file").write_text("2")
    assert history.current_commit()[0] == f"{head}+"
    row = Row("angle_skill", "knee_angle_r", "1", 0.5, 0.4, 0.15, "kept")
    check = history.of_rows([row], "S05")
    assert check.revision == f"{head}+"
    assert check.figures == (
        CheckedFigure("angle_skill", "knee_angle_r", "1", 0.4, 0.5, 0.15, "higher"),
    )


@pytest.fixture
def message(monkeypatch: pytest.MonkeyPatch) -> list[str | None]:
    """What `git show` prints is its first item; how git was asked, the others."""
    lines: list[str | None] = []

    def git(*arguments: str) -> str | None:
        lines.extend(arguments if arguments[0] == "show" else ())
        return lines[0] if arguments[0] == "show" else ""

    for name in ("GITHUB_SHA", "CI_COMMIT_SHA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(history, "_git", git)
    return lines


@pytest.mark.parametrize(
    ("shown", "commit"),
    [
        (f"gpg: Signature made Sun\ngpg: Good signature\n{'a' * 40} 0", ("a" * 40, EPOCH)),
        (f"{'a' * 64} 0", ("a" * 64, EPOCH)),
        (f"{'a' * 40} 999999999999", ("a" * 40, None)),
        (f"{'a' * 40} {'9' * 20}", ("a" * 40, None)),
        ("what is no commit", ("unknown", None)),
        (f"{'a' * 40} yesterday", ("unknown", None)),
        ("", ("unknown", None)),
    ],
)
def test_a_commit_that_git_says_otherwise_is_no_error(
    message: list[str | None], shown: str, commit: history.Commit
) -> None:
    """After minutes of walking the figures would be lost: signatures are checked where a user's
    settings say so, and a date may be anything."""
    message.append(shown)
    assert history.current_commit() == commit
    assert "--no-show-signature" in message


def test_a_check_is_of_the_commit_that_it_began_with(message: list[str | None], kept: Path) -> None:
    message.append("of afterwards")
    history.keep(kept, [], "S05", commit=("b" * 40, EPOCH))
    assert {(each.revision, each.revised) for each in history.read(kept)} == {
        (CHECK.revision, CHECK.revised), ("b" * 40, EPOCH),
    }  # fmt: skip


@pytest.mark.parametrize("name", ["hist.csv", "hist.HTML", "hist.pdf"])
def test_a_history_is_not_named_as_what_is_written_beside_it(tmp_path: Path, name: str) -> None:
    with pytest.raises(ArtefactError, match=r"Name it accuracy\.db"):
        history.prepare(tmp_path / name)
    assert not (tmp_path / name).exists()


@pytest.mark.parametrize("ending", history.OUTPUTS)
def test_a_page_is_not_written_over_its_history(kept: Path, ending: str) -> None:
    named = kept.rename(kept.with_suffix(ending))
    with pytest.raises(ArtefactError, match="over the history itself") as refused:
        history.check_outputs(named, named.parent)
    assert "Rename the file to accuracy.db" in str(refused.value)
    history.check_outputs(named, named.parent / "page")
    for file in (named, named.with_stem("new")):
        with pytest.raises(ArtefactError, match="over the history itself"):
            history.check_outputs(file, file.parent / "page" / "..")


def _benchmarks() -> dict:
    """As pytest-benchmark 5 writes them, less what is not read."""
    return {
        "machine_info": {
            "system": "Linux",
            "machine": "x86_64",
            "cpu": {"brand_raw": "A processor", "count": 2},
        },
        "commit_info": {"id": "f" * 40, "time": "2026-11-20T12:00:00+01:00", "dirty": True},
        "benchmarks": [
            {"fullname": f"b.py::test_{name}", "stats": {"median": 0.25, "rounds": 5, "min": 0.2}}
            for name in "ab"
        ],
        "datetime": "2026-11-21T07:00:00.123456",
        "version": "5.1.0",
    }


def test_times_of_pytest_benchmark_stand_beside(kept: Path, tmp_path: Path) -> None:
    file = tmp_path / "times.json"
    file.write_text(json.dumps(_benchmarks()))
    found = history.read_benchmarks(file)
    assert found.revision == "f" * 40 + "+"
    assert found.revised == "2026-11-20T11:00:00+00:00"
    assert found.machine == "Linux x86_64, A processor x 2"
    assert found.figures[1] == CheckedFigure(
        "benchmark", "b.py::test_b", "s", 0.25, None, None, "lower"
    )
    assert history.add(kept, found)
    assert not history.add(kept, found)
    assert history.read(kept) == [CHECK, found]
    keys = list(history.series_of(history.read(kept)))
    assert keys[0] == ("S05", "angle_rmse", "knee_angle_r", "")
    assert keys[-1] == ("", "benchmark", "b.py::test_b", found.machine)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda v: v.pop("benchmarks"), "does not match the schema of pytest-benchmark"),
        (lambda v: v["benchmarks"][0]["stats"].update(median="fast"), "stats/median"),
        (lambda v: v["benchmarks"][0]["stats"].update(median=-1.0), "stats/median"),
        (lambda v: v["benchmarks"].clear(), "has no benchmark"),
        (lambda v: v["benchmarks"][0].update(fullname="b.py::test_b"), "one benchmark twice"),
        (lambda v: v.update(datetime="yesterday"), "is not a time"),
        (lambda v: v["commit_info"].update(id=7), "commit_info/id"),
    ],
)
def test_other_json_is_refused(tmp_path: Path, change: Callable[[dict], object], text: str) -> None:
    values = _benchmarks()
    change(values)
    file = tmp_path / "times.json"
    file.write_text(json.dumps(values))
    with pytest.raises(ArtefactError, match=text):
        history.read_benchmarks(file)
