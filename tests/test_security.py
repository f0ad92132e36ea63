"""Every promise of SECURITY.md has a test, which is there."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEST = re.compile(r"`(?P<file>tests/[\w/]+\.py)?::(?P<name>[\w:]+)`")
ROWS = [
    [cell.strip() for cell in line.strip("|").split(" | ")]
    for line in (ROOT / "SECURITY.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("| ")
]
PROMISES = [row for row in ROWS if row[-1] not in ("tested by", "no promise")]


def named(cell: str) -> list[tuple[str, str]]:
    """File and test of each that a row names; the file is said once."""
    found, file = [], ""
    for each in TEST.finditer(cell):
        file = each["file"] or file
        found.append((file, each["name"].split("::")[-1]))
    return found


def functions(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {each.name for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)}


def test_the_tables_are_read():
    assert [row[0] for row in ROWS if row[-1] == "tested by"] == ["who", "input", "besides"]
    assert [row[0] for row in ROWS if row[-1] == "no promise"] == [
        "the installed package, its stored policies and baselines"
    ]


@pytest.mark.parametrize("row", PROMISES, ids=[row[0][:40] for row in PROMISES])
def test_a_promise_has_its_tests(row):
    found = named(row[-1])
    assert found, row
    for file, name in found:
        assert name in functions(file), f"{file}::{name}"
