"""Calls of the sources by which a file is read, and whether the gate has seen the file."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

ROOT: Final = Path(__file__).resolve().parents[2]
READING: Final = frozenset(
    (
        *("open", "fdopen", "read_text", "read_bytes", "load", "load_file", "safe_open", "loadtxt"),
        *("genfromtxt", "fromfile", "memmap", "parse", "iterparse", "ZipFile", "TarFile", "c3d"),
        *("connect", "copyfile", "copy2", "copytree", "cat_file", "get_file", "from_xml_path"),
        *("safe_load", "run_path", "getlines", "read_metadata", "read_csv"),
        *("read_parquet", "read_excel", "read_json", "read_pickle", "read_hdf", "ParquetFile"),
        *("imread", "loadmat", "unpack_archive", "GzipFile", "BZ2File", "LZMAFile", "mmap"),
    )
)
"""Last names of calls that read a file, of Python and of libraries."""
LIBRARIES: Final = frozenset(
    (
        *("np", "numpy", "json", "tomllib", "pickle", "marshal", "joblib", "yaml", "torch"),
        *("yourdfpy.URDF", "ElementTree", "ET", "minidom", "expatbuilder", "configparser"),
    )
)
"""Whose `load` and `parse` read a file; other things are loaded as well."""
PARSING: Final = frozenset(("tomllib.loads", "pickle.loads", "marshal.loads", "ET.fromstring"))
"""Calls that no reader but the package's own (`OWN`) may use on a text, wherever it is from."""
GATE: Final = "file_gate"
OWN: Final = {
    "gaitval/_internal/numba/compiled_cache.py:get_source_stamp": "the package's own code",
    "gaitval/reporting/printer.py:fetch": "fonts of matplotlib, by names of ours",
    "gaitval/subjects/archive.py:registry": "registry.toml of the package",
    "gaitval/subjects/archive.py:_unpack": "a file whose hash is the published one",
    "gaitval/apps/export/mujoco_folder.py:write_mujoco": "a script of the package",
    "gaitval/apps/export/formats.py:write_training": "a script of the package",
    "gaitval/apps/export/walk.py:__init__": "runs without gaitval, on the folder beside it",
    "gaitval/kinetics/musculature/paths.py:table": "paths.npz without pickles, passive.json",
    "gaitval/kinetics/musculature/strands.py:tendons": "sites.json of the package",
    "gaitval/scaling/markers/names.py:meanings": "names.toml of the package",
    "gaitval/_internal/io/artefacts.py:_check_headers": "a file that `read_arrays` has seen",
    "gaitval/_internal/io/artefacts.py:parse_toml": "the reader of TOML",
    "gaitval/_internal/numba/compiled.py:_sources": "the package's own sources",
    "gaitval/_internal/numba/compiled_cache.py:_opened": "numba's cache, sealed by a key",
    "gaitval/_internal/numba/compiled_cache.py:_read": "that key: so many bytes, through no link",
    "gaitval/_internal/numba/compiled_cache.py:_without_links": "opens that key",
    "gaitval/subjects/subject_file.py:_read_builtin": "the package's own subjects",
    "gaitval/correction/slopes.py:_stored": "shared_slopes.safetensors of the package",
    "gaitval/metrics/tolerances.py:load_registry": "tolerances.toml of the package",
    "gaitval/mocap/c3d_contents.py:read_contents": "what the reader's own process has written",
    "gaitval/mocap/c3d_process.py:opened": "in a process of its own, after `check_size`",
    "gaitval/mocap/c3d_writing.py:write_c3d": "makes an empty one",
    "gaitval/_internal/io/partial_files.py:hold": "locks a folder that its caller has made",
    "gaitval/_internal/io/partial_files.py:own_folder": "locks a folder that it has made",
    "gaitval/_internal/io/partial_files.py:remove_abandoned": "locks a file, and reads nothing",
    "gaitval/plugins.py:of_ending": "loads what a distribution registers, and reads no file",
    "gaitval/study/stage.py:_undone": "a run's own files, which are put back as they were",
    "gaitval/scaling/marker_sets.py:_builtin": "marker sets of the package",
}
"""Readers, by module and function, of what is the package's own or the gate has looked at before,
with the reason."""


class Reader(NamedTuple):
    """A call that reads a file: where it is, its name, and whether it is behind the gate."""

    place: str
    line: int
    call: str
    gated: bool


@cache
def readers() -> list[Reader]:
    """Every call of gaitval/ that reads a file."""
    return [
        each
        for path in sorted((ROOT / "gaitval").rglob("*.py"))
        for each in readers_in(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())
    ]


def readers_in(text: str, name: str) -> Iterator[Reader]:
    """Those of a module `name` by its `text`. A call is behind the gate if one of the gate's is
    in it, or was given the same file before it in the same function, or gave it what it reads.
    """
    tree = ast.parse(text)
    within: dict[ast.AST, ast.AST] = {}
    for node in ast.walk(tree):  # outer functions first
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            within |= dict.fromkeys(ast.walk(node), node)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and _reads(node):
            function = within.get(node, tree)
            place = f"{name}:{getattr(function, 'name', '')}"
            own = place in OWN or name == f"gaitval/_internal/io/{GATE}.py"
            gated = own or "resources.files" in ast.unparse(node) or _gated(node, function)
            yield Reader(place, node.lineno, ast.unparse(node.func), gated)


def _reads(node: ast.Call) -> bool:
    called = ast.unparse(node.func)
    base, _, last = called.rpartition(".")
    if base in (GATE, "webbrowser") or called == "read_json":  # behind the gate itself; a page
        return False
    if last in ("load", "parse") and base and base not in LIBRARIES:
        return False
    if called == "os.open":
        return "O_WRONLY" not in ast.unparse(node)
    if last in ("open", "fdopen"):
        given = node.args[1:2] if last == "fdopen" or not base else node.args[:1]
        modes = [*given, *(each.value for each in node.keywords if each.arg == "mode")]
        for mode in modes:
            if isinstance(mode, ast.Constant) and isinstance(mode.value, str):
                return mode.value[:1] not in "wax" or "+" in mode.value
    return last in READING or called in PARSING


def _gated(node: ast.Call, function: ast.AST) -> bool:
    """Whether what a call reads has gone through the gate in its function."""
    looked: set[str] = set()
    for each in ast.walk(function):
        if getattr(each, "lineno", 0) > (node.end_lineno or node.lineno):
            continue
        if isinstance(each, ast.Call) and _is_gate(each):
            looked.add(ast.unparse(each.args[0]))
        elif isinstance(each, ast.Assign) and any(map(_is_gate, ast.walk(each.value))):
            looked |= {ast.unparse(target) for target in each.targets}
    parts = {ast.unparse(each) for each in ast.walk(node) if isinstance(each, ast.expr)}
    return any(map(_is_gate, ast.walk(node))) or bool(looked & parts)


def _is_gate(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and ast.unparse(node.func).startswith(f"{GATE}.")
