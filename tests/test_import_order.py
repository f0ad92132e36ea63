"""Imports go one way: a folder imports only from those below it, and no module in a circle."""

import subprocess
import sys

from architecture import ORDER, PACKAGE, ROOT, folder_of, imports

EXCEPTIONS: dict[tuple[str, str], str] = {
    # (importer, imported): why it must be
    ("gaitval.__main__", "gaitval.cli"): "`python -m gaitval` is the command",
}


def test_every_folder_has_its_place():
    folders = {path.parent.relative_to(PACKAGE).parts[0] for path in PACKAGE.glob("*/*.py")}
    assert folders == set(ORDER) - {"ground"}


def test_a_folder_imports_only_from_those_below_it():
    upward = [
        f"{each.importer}, line {each.line}, imports {each.imported}"
        for each in imports()
        if ORDER.index(folder_of(each.imported)) < ORDER.index(folder_of(each.importer))
        and (each.importer, each.imported) not in EXCEPTIONS
    ]
    assert not upward, "\n".join(upward)


def test_exceptions_are_needed():
    assert EXCEPTIONS.keys() <= {(each.importer, each.imported) for each in imports()}


def test_no_circle():
    """Modules are taken away that import from none of those left, until none is left."""
    left: dict[str, set[str]] = {}
    for each in imports():
        if each.imported != "gaitval":  # only for `__version__`, which is there from the start
            left.setdefault(each.importer, set()).add(each.imported)
            left.setdefault(each.imported, set())
    while left:
        free = {module for module, imported in left.items() if not imported & left.keys()}
        assert free, f"these import each other in a circle: {', '.join(sorted(left))}"
        left = {module: imported for module, imported in left.items() if module not in free}


def test_the_picture_is_current():
    done = subprocess.run(
        [sys.executable, "scripts/architecture.py", "--check"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
