"""Every file is written by the one door, `artefacts`: whole or not at all, and through no link.

What is called to write is found in the syntax of the source; where it writes must come from
`replacing`, `scratch`, a temporary folder, `growing` or a text in memory.
"""

import ast
import os
import stat
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import TypeGuard

import pytest

from gaitval._internal.io.artefacts import growing, read_json, write_json
from gaitval._internal.io.partial_files import PARTIAL
from gaitval.errors import ArtefactError

ROOT = Path(__file__).parents[1]
DOORS = {"replacing", "scratch", "growing", "own_folder", "TemporaryDirectory", "_temporary"}
MEMORY = {"StringIO", "BytesIO"}
OF_TARGET = {
    # the file is what the method is called on
    "write_text", "write_bytes", "touch", "symlink_to", "hardlink_to",
}  # fmt: skip
OF_FIRST = {
    # the file is the first argument
    "savefig", "to_csv", "to_parquet", "to_json", "to_excel", "to_pickle", "to_hdf", "savez",
    "savez_compressed", "savetxt", "tofile", "write_pdf", "write_png", "print_png", "imsave",
    "extractall", "FileHandler", "RotatingFileHandler",
}  # fmt: skip
OF_SECOND = {"copy", "copy2", "copyfile", "copyfileobj", "copytree", "move", "link", "symlink"}
"""Of `shutil` and `os`."""
SECOND_ANYWHERE = {"save_file", "dump"}
ALLOWED = {
    "gaitval/_internal/io/artefacts.py": "is the door",
    "gaitval/_internal/io/partial_files.py": "is what the door is made of",
    "gaitval/_internal/numba/compiled_cache.py": "numba's own cache, whose key is made by a link",
    "gaitval/apps/export/walk.py": "runs without gaitval; has a `.partial-` of its own",
    "gaitval/apps/export/train.py": "runs without gaitval; has a `.partial-` of its own",
}


def _name(of: ast.expr) -> str:
    """Last word of what is called."""
    return of.attr if isinstance(of, ast.Attribute) else of.id if isinstance(of, ast.Name) else ""


def _is_name(of: ast.AST) -> TypeGuard[ast.expr]:
    return isinstance(of, ast.Name | ast.Attribute)


def _module(of: ast.expr) -> str:
    return _name(of.value) if isinstance(of, ast.Attribute) else ""


def _target(call: ast.Call) -> ast.expr | None:
    """What a call writes to; None if it writes no file."""
    name, module, given = _name(call.func), _module(call.func), call.args
    first = given[0] if given else next((k.value for k in call.keywords), call.func)
    second = given[1] if len(given) > 1 else first
    if name in OF_TARGET and isinstance(call.func, ast.Attribute):
        return call.func.value
    if name in OF_FIRST or (name == "save" and module == "np"):
        return first
    if (name in OF_SECOND and module in ("shutil", "os")) or (
        name in SECOND_ANYWHERE and (module in ("json", "pickle", "") or name == "save_file")
    ):
        return second
    if name == "connect" and module == "sqlite3":
        return first
    if name in ("mkstemp", "NamedTemporaryFile", "TemporaryFile"):
        return call.func
    words = [*given, *(k.value for k in call.keywords)]
    if name == "open" and module == "os":
        messages = {_name(each) for word in words for each in ast.walk(word)}
        return (
            first if messages & {"O_WRONLY", "O_RDWR", "O_CREAT", "O_APPEND", "O_TRUNC"} else None
        )
    if name in ("open", "fdopen"):
        if module in ("", "io", "gzip", "bz2", "lzma", "tarfile", "codecs", "os"):
            file, modes = first, words[1:]
        else:
            assert isinstance(call.func, ast.Attribute)
            file, modes = call.func.value, words
        written = any(
            isinstance(word, ast.Constant) and isinstance(word.value, str)
            and set(word.value) <= set("rwaxbt+") and set(word.value) & set("wax+")
            for word in modes
        )  # fmt: skip
        return file if written else None
    return None


def _words(of: ast.AST) -> set[str]:
    return {each.id for each in ast.walk(of) if isinstance(each, ast.Name)}


def _from_door(value: ast.AST, safe: set[str]) -> bool:
    calls = {_name(each.func) for each in ast.walk(value) if isinstance(each, ast.Call)}
    return bool(calls & (DOORS | MEMORY)) or bool(_words(value) & safe)


def _safe(scope: ast.AST) -> set[str]:
    """Names of a function that lie behind the door."""
    safe: set[str] = set()
    while True:
        before = len(safe)
        for each in ast.walk(scope):
            pairs: list[tuple[ast.AST, ast.AST]] = []
            if isinstance(each, ast.withitem) and each.optional_vars is not None:
                pairs = [(each.optional_vars, each.context_expr)]
            elif isinstance(each, ast.Assign):
                pairs = [(target, each.value) for target in each.targets]
            elif isinstance(each, ast.AnnAssign) and each.value is not None:
                pairs = [(each.target, each.value)]
            for target, value in pairs:
                # a name of its own, not the object that holds it
                if isinstance(target, ast.Name | ast.Tuple) and _from_door(value, safe):
                    safe |= _words(target)
        if len(safe) == before:
            return safe


def beside_the_door(source: str) -> Iterator[str]:
    """Lines that write a file in place."""
    tree = ast.parse(source)
    functions = [e for e in ast.walk(tree) if isinstance(e, ast.FunctionDef | ast.AsyncFunctionDef)]
    for call in (e for e in ast.walk(tree) if isinstance(e, ast.Call)):
        target = _target(call)
        if target is None or {"devnull", "dup"} & set(
            map(_name, filter(_is_name, ast.walk(target)))
        ):
            continue  # no file
        around = [f for f in functions if f.lineno <= call.lineno <= (f.end_lineno or f.lineno)]
        scope = min(around, key=lambda f: (f.end_lineno or 0) - f.lineno, default=tree)
        if not _from_door(target, _safe(scope)):
            yield f"line {call.lineno}: {ast.unparse(call)[:90]}"


def test_every_writer_goes_by_the_one_door() -> None:
    found = []
    for path in sorted((ROOT / "gaitval").rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if name not in ALLOWED:
            found += [f"{name}, {line}" for line in beside_the_door(path.read_text("utf-8"))]
    assert found == []


@pytest.mark.parametrize("name", [name for name, why in ALLOWED.items() if "partial" in why])
def test_what_runs_without_gaitval_writes_whole_files_too(name: str) -> None:
    text = (ROOT / name).read_text("utf-8")
    assert ".partial-" in text
    assert ".replace(arguments.out" in text


@pytest.mark.parametrize(
    "line",
    [
        "figure.savefig(path)", "figure.savefig(folder / 'a.svg')", "path.write_text('')",
        "Path('a').write_bytes(b'')", "open(path, 'w')", "path.open('ab')", "path.open(mode='x')",
        "with open(path, 'w') as file: json.dump({}, file)", "table.to_csv(path)",
        "np.savez(path, a=1)", "np.save(path, a)", "shutil.copy(a, path)", "path.touch()",
        "save_file({}, path)", "shutil.copytree(a, path)", "os.open(path, os.O_WRONLY)",
        "with open(path, 'r+b') as file: np.savez(file)", "path.symlink_to(a)",
        "os.symlink(a, path)", "gzip.open(path, 'wt')", "tempfile.mkstemp()",
    ],
)  # fmt: skip
def test_the_list_sees_what_writes_in_place(line: str) -> None:
    assert list(beside_the_door(f"def f(path, a, table, figure, folder):\n    {line}\n"))


@pytest.mark.parametrize(
    "line",
    [
        "with replacing(path) as own: figure.savefig(own)",
        "with scratch(path) as own:\n        file = own / 'a'\n        file.write_text('')",
        "text = io.StringIO()\n    table.to_csv(text)",
        "with growing(path, 'append') as file: file.write(b'')",
        "path.open()", "open(path, 'rb')", "write_text(path, '')", "os.open(path, os.O_RDONLY)",
    ],
)  # fmt: skip
def test_the_list_lets_the_door_be(line: str) -> None:
    assert not list(beside_the_door(f"def f(path, table, figure):\n    {line}\n"))


class TestGrowing:
    def test_it_goes_on_and_is_made_in_a_new_folder(self, tmp_path: Path) -> None:
        path = tmp_path / "new" / "a.log"
        for _ in range(2):
            with growing(path, "append") as file:
                file.write(b"12\n")
        with growing(path, "change") as file:
            assert file.read() == b"12\n12\n"
            file.truncate(3)
        assert path.read_bytes() == b"12\n"
        with pytest.raises(FileExistsError):
            growing(path, "new")
        with growing(tmp_path / "key", "new", private=True):
            assert stat.S_IMODE((tmp_path / "key").stat().st_mode) == 0o600

    @pytest.mark.parametrize("how", ["append", "change"])
    def test_through_no_link_and_into_no_pipe(self, tmp_path: Path, how: str) -> None:
        other = tmp_path / "other"
        other.write_text("theirs")
        (tmp_path / "link").symlink_to(other)
        os.mkfifo(tmp_path / "pipe")
        (tmp_path / "folder").mkdir()
        for name in ("link", "pipe", "folder"):
            with pytest.raises(ArtefactError, match=rf"{name}: is a link, or no file.* Remove it"):
                growing(tmp_path / name, how)  # type: ignore[arg-type]
        assert other.read_text() == "theirs"


def test_two_that_write_at_once_leave_one_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    values = [{"of": number, "long": "x" * 100_000} for number in range(4)]
    each = [threading.Thread(target=write_json, args=(path, value)) for value in values]
    for one in each:
        one.start()
    for one in each:
        one.join()
    assert read_json(path) in values
    assert not list(tmp_path.glob(f"{PARTIAL}*"))
