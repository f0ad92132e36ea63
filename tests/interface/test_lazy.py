"""`import gaitval` is cheap, and its public names are where they are said to be."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

import gaitval

HEAVY = {"numpy", "pandas", "scipy", "torch", "numba", "dartpy", "pydantic", "matplotlib"}


def test_import_loads_no_library():
    code = "import sys, json; import gaitval; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in json.loads(done.stdout)}
    assert not loaded & HEAVY


def test_the_stub_has_the_same_names():
    stub = Path(gaitval.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    found = {
        (alias.asname, str(node.module))
        for node in ast.walk(ast.parse(stub))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert found == {(name, f"gaitval.interface.{home}") for name, home in gaitval._HOMES.items()}


def test_no_public_name_is_that_of_a_folder_or_file():
    """A sub-package that is imported becomes an attribute of the same name."""
    folder = Path(gaitval.__file__).parent
    assert not set(gaitval.__all__) & {path.stem for path in folder.iterdir()}


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(AttributeError, match="load_subject"):
        _ = gaitval.load_subjects  # type: ignore[attr-defined]
