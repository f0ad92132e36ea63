"""The command that measures what a release is held to: what it runs, skips and writes."""

import sys
from pathlib import Path
from types import ModuleType

import pytest

import claims
from claims import Claim, Given, __main__, measured, public_file


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Run measurements that are made up, of a topic that is all there is."""
    given = Given(data=tmp_path / "nothing", public=tmp_path, work=tmp_path / "work")

    def run(*names: str, **functions):
        topic = ModuleType("claims.made_up")
        vars(topic).update(functions)
        monkeypatch.setitem(sys.modules, "claims.made_up", topic)
        monkeypatch.setattr(__main__, "TOPICS", ("made_up",))
        store = tmp_path / "claims.csv"
        return __main__.run(names, given, store), __main__.read(store)

    return run


@measured()
def good(_: Given) -> Claim:
    return Claim("angles, RMSE", 1.0420941, "deg", 60)


@measured()
def broken(_: Given) -> Claim:
    raise ZeroDivisionError("nobody walked")


def test_a_row_says_what_was_measured_of_which_code_and_when(made) -> None:
    failed, (row,) = made(one=good)
    assert failed == 0
    assert tuple(row) == __main__.COLUMNS
    expected = ("angles, RMSE", "1.04209", "deg", "60", "made_up.one")
    assert tuple(row[name] for name in ("what", "value", "unit", "n", "by")) == expected
    assert row["commit"] == claims.commit()


def test_what_fails_or_lacks_something_does_not_end_the_others(made, capsys) -> None:
    @measured("data")
    def far(_: Given) -> Claim:
        return Claim("b", 2.0, "1", 1)

    @measured()
    def reads(given: Given) -> Claim:
        public_file("owner+name/walks/one.c3d", given.public)
        return Claim("never", 1.0, "1", 1)

    failed, found = made(bad=broken, far=far, reads=reads, last=good)
    assert failed == 1
    assert [row["by"] for row in found] == ["made_up.last"]
    printed = capsys.readouterr()
    assert "made_up.bad: FAILED" in printed.out
    assert "nobody walked" in printed.err
    assert "made_up.far: not measured, there is no folder" in printed.out
    assert "https://github.com/owner/name" in printed.out


def test_every_measurement_can_be_loaded_and_its_topic_is_documented() -> None:
    found = __main__.measurements()
    assert {name.partition(".")[0] for name in found} == set(claims.TOPICS)
    page = (claims.ROOT / "claims" / "README.md").read_text(encoding="utf-8")
    assert all(f"| `{topic}` |" in page for topic in claims.TOPICS)
    lengths = sum(len(each.read_text().splitlines()) for each in
                  (claims.ROOT / "claims").glob("*.py"))  # fmt: skip
    assert lengths <= 2500
