"""The faults of `tests/robustness/mutants.py`: where they are, and that the tests of a module see
them."""

import ast
import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import mutants
import pytest

ROOT = Path(__file__).parents[2]

TEXT = """
LIMIT: int = 3  # a constant

def close(a: float, b: float = 1.0) -> bool:
    'Ten'
    assert not a, f"{a + b}"
    return abs(a - b) < LIMIT and a is not None

@njit
def fast(a):
    return a + 1
"""


def changes(text: str) -> set[tuple[str, str]]:
    return {(each.before, each.after) for each in mutants.mutants_of(text, "gaitval.gait.a")}


def test_signs_limits_and_numbers_are_changed_and_texts_and_types_are_not():
    plain = TEXT.replace("@njit", "")
    expected = {("3", "4"), ("1.0", "2.0"), ("not ", ""), ("-", "+"), ("<", "<=")}
    expected |= {("and", "or"), ("is not", "is"), ("+", "-"), ("1", "2")}
    assert changes(plain) == expected


def test_what_numba_compiles_and_its_constants_are_left_out():
    assert {("+", "-"), ("3", "4")} & changes(TEXT) == set()
    assert ("<", "<=") in changes(TEXT)


def test_a_mutant_is_one_change_that_can_be_read():
    for mutant in mutants.mutants_of(TEXT, "gaitval.gait.a"):
        text = mutant.of(TEXT)
        assert text != TEXT
        ast.parse(text)


@pytest.mark.slow
def test_there_are_mutants_of_all_four_folders_and_tests_of_each():
    found = mutants.drawn(400, 43)
    assert found == mutants.drawn(400, 43)
    assert {each.module.split(".")[1] for each in found} == set(mutants.FOLDERS)
    for each in found:
        assert all(Path(test).is_file() for test in mutants.tests_of(each.module)), each


@pytest.mark.slow
def test_every_fault_of_the_list_can_be_planted_and_has_tests():
    found = mutants.planted()
    assert len(found) >= 55
    for each in found:
        ast.parse(each.of(mutants.path_of(each.module).read_text(encoding="utf-8")))
    for module in {each.module for each in found}:
        assert mutants.importing(module), module


@pytest.mark.slow
def test_a_mutant_is_killed_by_the_tests_of_its_module(tmp_path):
    module = "gaitval.metrics.round_errors"
    path = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    found = next(
        each
        for each in mutants.mutants_of(path.read_text(encoding="utf-8"), module)
        if (each.before, each.after) == ("is", "is not")
    )
    log, new = tmp_path / "log.jsonl", tmp_path / "new.jsonl"
    log.write_text(json.dumps({**asdict(found), "killed": False}) + "\n")
    script = ROOT / "tests" / "robustness" / "mutants.py"
    subprocess.run([sys.executable, script, "--again", log, "--log", new], check=True, cwd=ROOT)
    (tried,) = mutants.logged(new)
    assert (tried["killed"], tried["code"]) == (True, 1)
