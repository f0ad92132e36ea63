"""Small faults, planted one at a time in `metrics`, `gait`, `inverse` and `reference`: do the tests
of the module itself fail?

    python tests/robustness/mutants.py --mutants 400 --seed 43 --log FILE     # goes on from it
    python tests/robustness/mutants.py --again FILE --log NEW                # survivors, once more
    python tests/robustness/mutants.py --planted --log FILE                  # those of planted.toml

A mutant is one change of the syntax tree: an arithmetic sign, a comparison or its limit, `and` for
`or`, `not` and minus left out, a number plus one, True for False. They are drawn from all that
there are. No file is changed: the tests run in a fork of this process, in which the module is
imported with its mutant. They are the file of
the same path, else those that import the module. Tests that reach the changed line run first, the
quick ones before the others; a line that none reaches is not tried, for no test can notice. They
may take `TIMES` the processor time that they take without a mutant; then, as when they fail, the
mutant is killed.

A fault of `planted.toml` may be anywhere in the package, and is larger than a mutant.
The tests that import its module belong to it as well.

Left out are texts, annotations, the flags `frozen` and `strict`, which only forbid what no code
does, functions that numba compiles, and the constants of their modules: its cache would take them
as they were.
"""

import argparse
import ast
import builtins
import contextlib
import hashlib
import importlib.abc
import importlib.util
import io
import json
import os
import pickle
import random
import re
import resource
import signal
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.machinery import ModuleSpec
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import pytest
from hypothesis import Phase, settings

ROOT: Final = Path(__file__).resolve().parents[2]
FOLDERS: Final = ("metrics", "gait", "inverse", "reference")
PLANTED: Final = ROOT / "tests" / "robustness" / "planted.toml"
TIMES: Final = 4.0
LEAST_SECONDS: Final = 20.0
LONGEST: Final = 1800.0
"""s of the clock, for a machine that is busy with something else."""
LOADED: Final = (
    *("numpy", "scipy.interpolate", "scipy.optimize", "scipy.signal", "scipy.stats", "pandas"),
    *("scipy.spatial.transform", "numba", "pydantic", "pytest", "hypothesis", "ezc3d", "cma"),
    *("gymnasium", "dartpy", "numba.np.arrayobj", "numba.cpython.randomimpl", "safetensors"),
)
"""Libraries that are imported once, before the forks."""
WIDE: Final = ("tests/gait/test_events.py", "tests/inverse/test_model_fit.py")
"""Tests that load most of what others load from libraries."""
OPTIONS: Final = (
    *("-q", "-m", "not slow", "-p", "no:cacheprovider", "-p", "no:randomly", "-n", "0"),
    *("--tb=no", "--assert=plain"),
)
"""What pytest would say of a failure takes longer than the tests."""
NOTED: Final = "order.pickle"
REACHED: Final = "_reached_by_a_test"
SWAPPED: Final[dict[type[ast.AST], tuple[str, str]]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.Pow: ("**", "*"), ast.FloorDiv: ("//", "/"), ast.Mod: ("%", "//"), ast.MatMult: ("@", "*"),
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"), ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"),
}  # fmt: skip
Json = dict[str, Any]


@dataclass(frozen=True)
class Mutant:
    """One change of a module: `before` at an offset of its text becomes `after`."""

    module: str
    line: int
    offset: int
    before: str
    after: str

    def of(self, text: str) -> str:
        """The module's text with the change."""
        end = self.offset + len(self.before)
        assert text[self.offset : end] == self.before
        return text[: self.offset] + self.after + text[end:]


def mutants_of(text: str, module: str) -> Iterator[Mutant]:
    """All mutants of a module."""
    tree = ast.parse(text)
    starts = [0]
    for line in text.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    data = text.encode()

    def place(line: int, column: int) -> int:
        return len(data[: starts[line - 1] + column].decode())

    def begin(node: ast.expr) -> int:
        return place(node.lineno, node.col_offset)

    def end(node: ast.expr) -> int:
        return place(node.end_lineno or 0, node.end_col_offset or 0)

    left_out = set(_left_out(tree))
    for node in ast.walk(tree):
        if node in left_out:
            continue
        pairs: list[tuple[int, int, ast.AST]] = []
        match node:
            case ast.BinOp(left=left, op=op, right=right):
                pairs = [(end(left), begin(right), op)]
            case ast.Compare(left=left, ops=ops, comparators=several):
                sides = [left, *several]
                pairs = [(end(sides[i]), begin(sides[i + 1]), op) for i, op in enumerate(ops)]
            case ast.BoolOp(op=op, values=values):
                pairs = [(end(a), begin(b), op) for a, b in pairwise(values)]
            case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
                before = text[begin(node) : begin(operand)]
                if "\n" not in before and "(" not in before:
                    yield Mutant(module, node.lineno, begin(node), before, "")
            case ast.Constant(value=bool() | int() | float() as value):
                other = str(not value) if isinstance(value, bool) else repr(value + 1)
                before = text[begin(node) : end(node)]
                yield Mutant(module, node.lineno, begin(node), before, other)
        for first, last, op in pairs:
            if type(op) in SWAPPED:
                sign, other = SWAPPED[type(op)]
                at = text.find(sign, first, last)
                if at >= 0 and "#" not in text[first:last]:
                    yield Mutant(module, text.count("\n", 0, at) + 1, at, sign, other)


def _left_out(tree: ast.Module) -> Iterator[ast.AST]:
    """Nodes that are not mutated."""
    compiled = [node for node in tree.body if _is_compiled(node)]
    for node in compiled:
        yield from ast.walk(node)
    for node in tree.body if compiled else ():
        if isinstance(node, ast.Assign | ast.AnnAssign):
            yield from ast.walk(node)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            arguments = [*node.args.args, *node.args.kwonlyargs, *node.args.posonlyargs]
            for each in (node.returns, *(argument.annotation for argument in arguments)):
                if each is not None:
                    yield from ast.walk(each)
        elif isinstance(node, ast.AnnAssign):
            yield from ast.walk(node.annotation)
        elif (
            isinstance(node, ast.JoinedStr)
            or (isinstance(node, ast.keyword) and node.arg in ("frozen", "strict"))
            or (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test))
        ):
            yield from ast.walk(node)


def _is_compiled(node: ast.AST) -> bool:
    if not isinstance(node, ast.FunctionDef):
        return False
    names = [ast.unparse(each) for each in node.decorator_list]
    return any("compiled" in name or "jit" in name for name in names)


def all_mutants() -> list[Mutant]:
    """Those of the four folders."""
    found: list[Mutant] = []
    for folder in FOLDERS:
        for path in sorted((ROOT / "gaitval" / folder).glob("*.py")):
            module = f"gaitval.{folder}.{path.stem}"
            if path.stem != "__init__":
                found += mutants_of(path.read_text(encoding="utf-8"), module)
    return found


def planted() -> list[Mutant]:
    """The faults of `planted.toml`.

    Raises
    ------
    SystemExit : a text is not in its file, or not only once: the code has changed since.
    """
    found = []
    for fault in tomllib.loads(PLANTED.read_text(encoding="utf-8"))["fault"]:
        parts = Path(fault["file"]).with_suffix("").parts
        text = (ROOT / fault["file"]).read_text(encoding="utf-8")
        if text.count(fault["old"]) != 1:
            raise SystemExit(f"{PLANTED.name}: {fault['name']}: not once in {fault['file']}")
        at = text.index(fault["old"])
        line = text.count("\n", 0, at) + 1
        found.append(Mutant(".".join(parts), line, at, fault["old"], fault["new"]))
    return found


def path_of(module: str) -> Path:
    """The file of a module of the package."""
    return ROOT.joinpath(*module.split(".")).with_suffix(".py")


@cache
def _texts() -> dict[Path, str]:
    """Of all files of tests."""
    tests = sorted((ROOT / "tests").rglob("test_*.py"))
    return {path: path.read_text(encoding="utf-8") for path in tests}


def importing(module: str) -> list[str]:
    """Files of tests that belong to a module, and that import it, the short ones first."""
    base, _, name = module.rpartition(".")
    wanted = re.compile(
        rf"(from|import) {re.escape(module)}\b|from {re.escape(base)} import [^\n]*\b{name}\b"
    )
    found = _texts()
    users = [path for path, text in found.items() if wanted.search(text)]
    users.sort(key=lambda path: (path.stem != f"test_{name}", len(found[path])))
    if not users:  # it is reached through another module of its folder
        users = sorted(ROOT.joinpath("tests", *module.split(".")[1:-1]).glob("test_*.py"))
    return list(dict.fromkeys([*own_test(module), *map(str, users)]))


def own_test(module: str) -> list[str]:
    """The file of tests that is named after a module, if there is one."""
    path = (ROOT / "tests").joinpath(*module.split(".")[1:])
    own = path.with_name(f"test_{path.name}.py")
    return [str(own)] if own.exists() else []


def tests_of(module: str) -> list[str]:
    """Files of the tests of a module: its own, else all that import it."""
    return own_test(module) or importing(module)


class _Mutated(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module from another text than that of its file."""

    def __init__(self, module: str, tree: ast.Module) -> None:
        self.module, self.tree = module, tree
        self.path = str(path_of(module))

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Of this module alone."""
        if name != self.module:
            return None
        return importlib.util.spec_from_file_location(name, self.path, loader=self)

    def create_module(self, spec: ModuleSpec) -> None:
        """As usual."""

    def exec_module(self, module: ModuleType) -> None:
        """Run the text."""
        exec(compile(self.tree, self.path, "exec"), module.__dict__)


def tried(
    mutant: Mutant | None, tests: Sequence[str], seconds: float, order: "Order | None" = None
) -> tuple[int, float, Any]:
    """Run tests with a mutant in a fork of this process.

    Parameters
    ----------
    order : in which they run, from the run without a mutant; there it is filled, and returned.

    Returns
    -------
    tuple
        pytest's exit code, or minus the signal that ended it; the processor time, s; the order.
    """
    with tempfile.TemporaryDirectory() as scratch:
        child = os.fork()
        if not child:
            os.setsid()
            _run_tests(mutant, tests, seconds, Path(scratch), order)
        limit = time.monotonic() + LONGEST
        while True:
            pid, status, used = os.wait4(child, os.WNOHANG)
            if pid:
                break
            if time.monotonic() > limit:
                os.killpg(child, signal.SIGKILL)
            time.sleep(0.02)
        noted = Path(scratch) / NOTED
        if noted.exists():
            order = pickle.loads(noted.read_bytes())
    return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime, order


def _in_compiled(mutant: Mutant) -> bool:
    tree = _tree(mutant.module)
    return any(
        node.lineno <= mutant.line <= (node.end_lineno or 0)
        for node in tree.body
        if _is_compiled(node)
    )


class Order:
    """How long each test of a module takes and what it reaches of it, so that those that reach a
    line can run first, the quick ones before the others.

    Attributes
    ----------
    seconds : processor time of each test, with its fixtures.
    lines : first lines of the module's statements that each test runs.
    task : the walking task of the tests, if they need it and the module cannot change it.
    """

    def __init__(self, module: str) -> None:
        self.module = module
        self.seconds: dict[str, float] = {}
        self.lines: dict[str, set[int]] = {}
        self.task: bytes | None = None

    def reach(self, mutant: Mutant) -> bool:
        """Whether a test ever runs the statement of a mutant, as far as this process saw; what is
        outside functions runs when the module is imported.
        """
        lines, tree = lines_of(mutant), _tree(self.module)
        inside = any(
            node.body[0].lineno <= mutant.line <= (node.end_lineno or 0)
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef)
        )
        return not inside or not all(each.isdisjoint(lines) for each in self.lines.values())


def _tree(module: str) -> ast.Module:
    return ast.parse(path_of(module).read_text(encoding="utf-8"))


class _Reaching(ast.NodeTransformer):
    """Adds a call before each statement of a function that is not compiled: `REACHED(line)`."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Of a function, and of those in it."""
        if _is_compiled(node):
            return node
        for each in ast.walk(node):
            for name in ("body", "orelse", "finalbody"):
                block = getattr(each, name, None)
                if isinstance(block, list) and block and isinstance(block[0], ast.stmt):
                    setattr(each, name, [one for stmt in block for one in (_call(stmt), stmt)])
        if ast.get_docstring(node, clean=False) is None and len(node.body) > 1:
            text = node.body[1]
            if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                node.body[:2] = [text, node.body[0]]  # a docstring stays the first
        return node


def _call(stmt: ast.stmt) -> ast.stmt:
    call = ast.parse(f"{REACHED}({stmt.lineno})").body[0]
    return ast.copy_location(call, stmt)


class _Alone:
    """Starts no server of worker processes before the tests, and for tests of `metrics`, on which
    the walking task does not depend, makes that once: both take longer than most tests.
    """

    order: Order

    @pytest.hookimpl(tryfirst=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[Any], request: pytest.FixtureRequest
    ) -> object:
        """Of `tests/conftest.py`."""
        made = None
        if fixturedef.argname == "task" and self.order.task is not None:
            made = pickle.loads(self.order.task)
        elif fixturedef.argname != "_server_of_workers":
            return None
        fixturedef.cached_result = (made, fixturedef.cache_key(request), None)  # type: ignore[arg-type]
        return True


class _Noted(_Alone):
    """Notes into an `Order`."""

    def __init__(self, order: Order) -> None:
        self.order, self.now = order, set[int]()
        setattr(builtins, REACHED, lambda line: self.now.add(line))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[Any]:
        """A test."""
        self.now = self.order.lines.setdefault(item.nodeid, set())
        begin = time.process_time()
        found = yield
        self.order.seconds[item.nodeid] = time.process_time() - begin
        return found


class _Sorted(_Alone):
    """Runs tests by an `Order`."""

    def __init__(self, order: Order, lines: Collection[int]) -> None:
        self.order, self.lines = order, lines

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """After all others."""
        order = self.order

        def place(item: pytest.Item) -> tuple[bool, float]:
            reached = order.lines.get(item.nodeid, set())
            return reached.isdisjoint(self.lines), order.seconds.get(item.nodeid, 0.0)

        items.sort(key=place)


def _run_tests(
    mutant: Mutant | None, tests: Sequence[str], seconds: float, scratch: Path, order: Order | None
) -> None:
    """In the fork: never returns."""
    code, plugins = 3, list[object]()
    try:
        with tempfile.TemporaryFile() as message:
            os.dup2(message.fileno(), 1)
            os.dup2(message.fileno(), 2)
        if mutant is not None and _in_compiled(mutant):
            os.environ["XDG_CACHE_HOME"] = str(scratch)  # else numba takes what it compiled before
            seconds = LONGEST
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
        if mutant is not None:
            text = mutant.of(path_of(mutant.module).read_text(encoding="utf-8"))
            sys.meta_path.insert(0, _Mutated(mutant.module, ast.parse(text)))
        elif order is not None:
            tree = ast.fix_missing_locations(_Reaching().visit(_tree(order.module)))
            sys.meta_path.insert(0, _Mutated(order.module, tree))
        if order is not None:
            plugins = [_Noted(order) if mutant is None else _Sorted(order, lines_of(mutant))]
        if mutant is not None:  # the first example that fails is enough
            phases = (Phase.explicit, Phase.generate)
            settings.register_profile("mutant", phases=phases, database=None)
            settings.load_profile("mutant")
        base = scratch / "base"
        code = int(pytest.main([*OPTIONS, "-x", f"--basetemp={base}", *tests], plugins=plugins))
        if order is not None and mutant is None:
            task = base / "task.pickle"
            if task.exists() and ".metrics." in order.module:
                order.task = task.read_bytes()
            (scratch / NOTED).write_bytes(pickle.dumps(order))
    except BaseException:
        code = 3
    finally:
        os._exit(code)


def lines_of(mutant: Mutant) -> range:
    """Lines of the statement that a mutant changes, of a compound one those before its body."""
    found = range(mutant.line, mutant.line + 1)
    for node in ast.walk(_tree(mutant.module)):
        if isinstance(node, ast.stmt) and node.lineno <= mutant.line <= (node.end_lineno or 0):
            inside = getattr(node, "body", None)
            last = inside[0].lineno - 1 if inside else node.end_lineno or node.lineno
            if mutant.line <= last:
                found = range(node.lineno, last + 1)
    return found


def warmed() -> None:
    """Load what tests load from libraries, before the forks; of the project nothing is kept."""
    for name in LOADED:
        importlib.import_module(name)
    os.chdir(ROOT)
    paths = (ROOT, ROOT / "tests" / "support", ROOT / "tests")
    sys.path[:0] = map(str, paths)
    with contextlib.redirect_stdout(io.StringIO()):
        pytest.main([*OPTIONS, "--collect-only", *(str(ROOT / each) for each in WIDE)])
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None) or ""
        ours = name.partition(".")[0].startswith("gaitval") or Path(file).is_relative_to(ROOT)
        if ours and name != __name__ and "site-packages" not in file:
            del sys.modules[name]


def drawn(count: int, seed: int) -> list[Mutant]:
    """So many mutants of all."""
    return random.Random(seed).sample(all_mutants(), count)


def logged(log: Path) -> list[Json]:
    """The mutants of a log."""
    lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
    return [json.loads(line) for line in lines]


def run(
    mutants: Sequence[Mutant],
    log: Path,
    belonging: Callable[[str], list[list[str]]] = lambda module: [tests_of(module)],
) -> None:
    """Try mutants, but for those of the log, and add them to it. `belonging` are the tests of a
    module, in groups of files that are run together, until one fails.
    """
    warmed()
    kept = log.with_suffix(".orders")
    kept.mkdir(exist_ok=True)
    usual: dict[tuple[str, str], tuple[float, Order]] = {}
    known = {(each["module"], each["offset"], each["after"]) for each in logged(log)}
    for mutant in mutants:
        if (mutant.module, mutant.offset, mutant.after) in known:
            continue
        code, used, tests = 0, 0.0, list[str]()
        for tests in belonging(mutant.module):
            key = (mutant.module, str(tests))
            if key not in usual:
                usual[key] = _without(mutant.module, tests, kept)
            spent, order = usual[key]
            if order.reach(mutant) or _in_compiled(mutant):
                code, used, _ = tried(mutant, tests, max(LEAST_SECONDS, TIMES * spent), order)
            if code:
                break
        about = {"code": code, "killed": code != 0, "seconds": round(used, 2)}
        by = [Path(each).relative_to(ROOT).as_posix() for each in tests] if code else []
        found = {**asdict(mutant), **about, "by": by}
        with log.open("a", encoding="utf-8") as file:
            file.write(json.dumps(found) + "\n")
        print(json.dumps(found), flush=True)


def _without(module: str, tests: Sequence[str], kept: Path) -> tuple[float, Order]:
    """Processor time, s, and order of the tests of a module without a mutant, for which they must
    pass; from the folder `kept`, if they and the whole package were the same.
    """
    files = sorted({*(ROOT / "gaitval").rglob("*.py"),
                    *(ROOT / "tests" / "support").rglob("*.py")})  # fmt: skip
    digest = hashlib.sha256(module.encode())
    for path in (*files, *map(Path, tests)):
        digest.update(path.read_bytes())
    stored = kept / f"{digest.hexdigest()[:16]}.pickle"
    if stored.exists():
        order = Order(module)
        spent, order.seconds, order.lines, order.task = pickle.loads(stored.read_bytes())
        return spent, order
    failed, spent, order = tried(None, tests, LONGEST, Order(module))
    if failed:
        raise SystemExit(f"{tests}: fail without a mutant (exit code {failed})")
    stored.write_bytes(pickle.dumps((spent, order.seconds, order.lines, order.task)))
    return spent, order


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--mutants", type=int, default=400)
    parser.add_argument("--seed", type=int, default=43)
    parser.add_argument("--log", type=Path, required=True, help="a line for each; goes on from it")
    parser.add_argument("--again", type=Path, metavar="LOG", help="the survivors of a log instead")
    parser.add_argument("--planted", action="store_true", help="the faults of planted.toml instead")
    given = parser.parse_args()
    if given.planted:
        run(planted(), given.log, lambda module: [[each] for each in importing(module)])
        return
    if given.again is None:
        run(drawn(given.mutants, given.seed), given.log)
        return
    names = ("module", "line", "offset", "before", "after")
    left = [each for each in logged(given.again) if not each["killed"]]
    run([Mutant(**{name: each[name] for name in names}) for each in left], given.log)


if __name__ == "__main__":
    main()
