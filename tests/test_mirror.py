"""Every module of the package is tested where a reader looks for its test: in the file of the same
path, or in those that `tested_by.toml` names."""

import ast
import tomllib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE, TESTS = ROOT / "gaitval", ROOT / "tests"
TABLE = tomllib.loads((TESTS / "tested_by.toml").read_text(encoding="utf-8"))


@cache
def imported(path: Path) -> frozenset[str]:
    """Names that a file imports, wherever it does."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{each.name}" for each in node.names)}
    return frozenset(found)


@cache
def started(path: Path) -> frozenset[str]:
    """Modules that a file of the package starts as a process, by their name in a text."""
    if PACKAGE not in path.parents:
        return frozenset()
    text = path.read_text(encoding="utf-8")
    return frozenset(
        name
        for name, other in MODULES.items()
        if f'"{name}"' in text or (other.parent == path.parent and f'"{other.name}"' in text)
    )


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


MODULES = {
    module_of(path): path
    for path in sorted(PACKAGE.rglob("*.py"))
    if path.name not in ("__init__.py", "__main__.py")
}


SOURCES = MODULES | {
    ".".join(path.relative_to(ROOT / "extras").with_suffix("").parts): path
    for path in sorted((ROOT / "extras").rglob("[!_]*.py"))
}
"""With those of the wings, through which a test may reach a module."""


def own_test(path: Path) -> Path:
    """Where the test of a module is, if it has one."""
    inside = path.relative_to(PACKAGE)
    return TESTS / inside.parent / f"test_{inside.name}"


def steps_to(test: Path, module: str) -> int | None:
    """How many imports a test is away from a module; None if it does not reach it."""
    seen: set[str] = set()
    at, steps = {test}, 1
    while at:
        names = set().union(*map(imported, at))
        if module in names or any(module in started(path) for path in at):
            return steps
        reached = {name for name in names if name in SOURCES} - seen
        seen |= reached
        at = {SOURCES[name] for name in reached}
        steps += 1
    return None


def test_every_module_has_its_test_or_a_line_that_names_it():
    without = {name for name, path in MODULES.items() if not own_test(path).is_file()}
    assert without - TABLE.keys() == set(), "write its test, or say in tested_by.toml which it has"
    assert TABLE.keys() - without == set(), "no such module, or it has a test of its own"


def test_the_tests_that_are_named_reach_the_module():
    """The command line is reached by its application, which loads a command by name; the public
    functions by `import gaitval`, which loads them by name."""
    for module, tests in TABLE.items():
        assert tests, module
        for test in tests:
            path = ROOT / test
            assert path.is_file(), (module, test)
            names = imported(path)
            known = module.startswith("gaitval.cli") and "gaitval.cli" in " ".join(names)
            known |= module.startswith("gaitval.interface") and "gaitval" in names
            assert known or steps_to(path, module) is not None, (module, test)
