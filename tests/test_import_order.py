"""Imports go one way: a folder imports only from those below it, and no module in a circle. The
order of the folders is in pyproject.toml, for import-linter."""

import ast
import subprocess
import sys
from pathlib import Path

from importlinter.cli import lint_imports

ROOT = Path(__file__).parents[1]


def test_imports_keep_the_order_and_make_no_circle(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert lint_imports(no_cache=True) == 0  # it prints what is wrong, with the lines


def test_an_import_upward_and_a_circle_are_found(tmp_path, monkeypatch, capsys):
    """In a copy of the rules for a package of two folders."""
    rules = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    rules = rules[rules.index("[tool.importlinter]") : rules.index("[tool.mypy]")]
    rules = rules[: rules.index('name = "Applications do not')].rpartition("[[")[0]
    before, rest = rules.split("layers = [", 1)
    rules = f'{before}layers = ["upper", "lower"]{rest.split("]", 1)[1]}'
    (tmp_path / "pyproject.toml").write_text(rules.replace("gaitval", "small"))
    for folder in ("upper", "lower"):
        (tmp_path / "small" / folder).mkdir(parents=True)
        (tmp_path / "small" / folder / "__init__.py").touch()
    (tmp_path / "small" / "__init__.py").touch()
    (tmp_path / "small" / "lower" / "one.py").write_text("def f():\n    import small.upper\n")
    (tmp_path / "small" / "upper" / "two.py").write_text("import small.upper.three\n")
    (tmp_path / "small" / "upper" / "three.py").write_text("import small.upper.two\n")
    (tmp_path / "small" / "new.py").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    assert lint_imports(no_cache=True) == 1
    message = " ".join(capsys.readouterr().out.split())
    assert "small.lower.one -> small.upper (l.2)" in message
    assert "No cycles are allowed in small.upper" in message
    assert ".two -> .three" in message or ".three -> .two" in message
    assert "small.new" in message  # it has no place in the order


def test_the_picture_is_current():
    done = subprocess.run(
        [sys.executable, "docs/build/architecture.py", "--check"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_nothing_of_ours_is_looked_up_by_a_string():
    """But the names of the Python interface, of which `gaitval/__init__.pyi` has the types."""
    allowed = {"gaitval/__init__.py"}
    found = set()
    for path in (ROOT / "gaitval").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            name = getattr(node, "func", None)
            called = getattr(name, "attr", getattr(name, "id", ""))
            if called in ("import_module", "__import__"):
                found.add(path.relative_to(ROOT).as_posix())
    assert found == allowed
