"""The sources that a stage uses: while they are unchanged, its files stay valid.

Imports are read from the package's syntax trees, not from a running interpreter, so checking a
stage loads nothing. A module outside `study/` counts as a whole, with all that it imports, also
inside functions. In `study/`, where a file contains several stages, only the definitions that a
stage's function reaches by name count. Comments, docstrings and layout do not count: changing them
runs nothing again.
"""

import ast
import hashlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Final, NamedTuple

from gaitval.artefacts import read_json, write_json
from gaitval.cache_home import own_cache
from gaitval.errors import ArtefactError, ConfigurationError

PACKAGE: Final = Path(__file__).parents[1]

DATA: Final = {
    "gaitval.apps.devices.page": ("apps/devices/device.html.j2",),
    "gaitval.apps.patients.sound_side": ("apps/patients/*.csv",),
    "gaitval.identification.offsets": ("identification/offsets.json",),
    "gaitval.learning_control.slopes": ("learning_control/*.safetensors",),
    "gaitval.gait.healthy_controls": ("gait/gps_controls.csv",),
    "gaitval.metrics.tolerances": ("metrics/tolerances.toml",),
    "gaitval.metrics.acceptance": ("metrics/time_step.csv",),
    "gaitval.metrics.single_case": ("metrics/healthy_cases.csv",),
    "gaitval.metrics.healthy_bands": ("metrics/*_bands.csv",),
    "gaitval.metrics.norms": ("metrics/norms.csv",),
    "gaitval.model.urdf": ("models/xacro/*.xacro", "../models/xacro/*.xacro"),
    "gaitval.musculature.paths": ("musculature/paths.npz", "musculature/passive.json"),
    "gaitval.musculature.strands": ("musculature/sites.json",),
    "gaitval.prediction.ankles": ("prediction/ankles.json",),
    "gaitval.prediction.deviations": ("prediction/fits.json",),
    "gaitval.prediction.force_split": ("prediction/forces_elsewhere.json",),
    "gaitval.prediction.laboratories": ("prediction/laboratories.json",),
    "gaitval.prediction.slopes": ("prediction/slope_angles.csv",),
    "gaitval.reporting.translated": ("reporting/languages/*.po", "reporting/texts.txt"),
    "gaitval.reporting.checklist": ("reporting/checklist.toml",),
    "gaitval.reporting.credibility": ("reporting/claims.csv",),
    "gaitval.reporting.page": ("reporting/*.j2", "reporting/*.css", "reporting/*.js"),
    "gaitval.reporting.replay": ("reporting/vendor/*",),
    "gaitval.scaling.marker_sets": ("scaling/markersets/*.toml",),
    "gaitval.scaling.markers.body": ("scaling/markers/sites.toml",),
    "gaitval.scaling.markers.names": ("scaling/markers/names.toml",),
}
"""Data that a module reads, relative to the package; in a wheel the body model is inside it."""


class _Place(NamedTuple):
    """A definition, by its module's dotted name and its own; the whole module if `name` is None."""

    module: str
    name: str | None


def code_of(function: Callable[..., object] | str) -> dict[str, str]:
    """SHA-256 of every source and data file that a stage's function uses, by file relative to the
    folder that contains its package, such as `gaitval/scaling/scaling.py`.

    `function` is of a module of this package, or its name, "module:function", for which nothing is
    loaded; one inside another counts as the outer one, and one from elsewhere has no sources here.
    """
    if isinstance(function, str):
        module, _, name = function.partition(":")
    else:
        module, name = function.__module__, function.__qualname__
    start = _Place(module, name.partition(".")[0])
    return dict(_code(start)) if _file(start.module) else {}


@cache
def _code(start: _Place) -> dict[str, str]:
    """`_read_code`, which takes a study a second; what it gave is kept in the user's cache."""
    path, key = _kept_at(), f"{start.module}:{start.name}"
    try:
        known = read_json(path) if path is not None and path.is_file() else {}
    except ArtefactError:
        known = {}
    if not isinstance(known, dict):
        known = {}
    if key not in known:
        known = {**known, key: _read_code(start)}
        with suppress(ArtefactError, OSError):  # then it is read again next time
            if path is not None:
                write_json(path, known)
    return dict(known[key])


@cache
def _kept_at() -> Path | None:
    """Where what was read of the package as it is is kept: a file named by its hash; None where
    there is no folder of this user's own.
    """
    files = {
        _name(file): file
        for pattern in ("**/*", *chain.from_iterable(DATA.values()))
        for file in _data(pattern)
        if file.suffix != ".pyc" and file.is_file()
    }
    content = hashlib.sha256()
    for name in sorted(files):
        content.update(f"{name}:{_hash(files[name].read_bytes())}\n".encode())
    try:
        return own_cache() / f"code-{content.hexdigest()[:16]}.json"
    except ConfigurationError:
        return None


def _read_code(start: _Place) -> dict[str, str]:
    found: dict[str, list[str]] = {}
    left, seen = [start], {start}
    # every definition reachable by name, each once
    while left:
        place = left.pop()
        tree = _tree(place.module)
        parts = tree.body if place.name is None else _definitions(tree, place.name)
        if place.name is None or parts:
            found.setdefault(place.module, []).extend(map(_text, parts))
        for reached in _reached(place, parts):
            if reached not in seen:
                seen.add(reached)
                left.append(reached)
    hashes = {}
    for module, texts in found.items():
        path = _file(module)
        assert path is not None
        hashes[_name(path)] = _hash("\n".join(sorted(texts)).encode())
        for pattern in DATA.get(module, ()):
            for data in _data(pattern):
                # the same hash where git checks out files with Windows line ends
                hashes[_name(data)] = _hash(data.read_bytes().replace(b"\r\n", b"\n"))
    return hashes


def _data(pattern: str) -> Iterator[Path]:
    inside = pattern.removeprefix("../")
    return (PACKAGE if inside == pattern else PACKAGE.parent).glob(inside)


def _reached(place: _Place, parts: list[ast.stmt]) -> Iterator[_Place]:
    """What some statements of a module use from the package."""
    if place.name is None:
        yield from _imported_by(place.module)
        return
    bound = {
        name: target
        for statement in _tree(place.module).body
        # An import for type checkers names the class of an argument.
        for each in (statement.body if isinstance(statement, ast.If) else [statement])
        for name, target in _imports(each)
    }
    for part in parts:
        for node in ast.walk(part):
            if isinstance(node, ast.Name):
                yield bound.get(node.id, _Place(place.module, node.id))
            elif isinstance(node, ast.Constant) and node.value in bound:
                yield bound[node.value]  # an annotation in quotes
            for _, target in _imports(node):
                yield target


@cache
def _imported_by(module: str) -> tuple[_Place, ...]:
    """What a module imports from the package, anywhere in it."""
    tree = _tree(module)
    return tuple({target for node in _nodes(tree) for _, target in _imports(node)})


def _nodes(part: ast.AST) -> Iterator[ast.AST]:
    """All nodes of a tree, except those that only a type checker reads."""
    if isinstance(part, ast.If) and getattr(part.test, "id", "") == "TYPE_CHECKING":
        return
    yield part
    for child in ast.iter_child_nodes(part):
        yield from _nodes(child)


def _imports(node: ast.AST) -> Iterator[tuple[str, _Place]]:
    """Each name that an import binds, and what it refers to in the package.

    A package itself does not count: `gaitval` contains the version, which is an input of every
    stage, and the names of the Python interface, which no stage uses.
    """
    if isinstance(node, ast.Import):
        for alias in node.names:
            if "." in alias.name and _file(alias.name):
                yield alias.asname or alias.name, _Place(alias.name, None)
    elif isinstance(node, ast.ImportFrom) and node.module:
        for alias in node.names:
            whole = f"{node.module}.{alias.name}"
            if _file(whole):
                yield alias.asname or alias.name, _Place(whole, None)
            elif "." in node.module and _file(node.module):
                # by definition within `study/`, elsewhere the whole module (see above)
                fine = node.module.split(".")[1:2] == ["study"] and node.module.count(".") > 1
                yield alias.asname or alias.name, _Place(node.module, alias.name if fine else None)


def _definitions(tree: ast.Module, name: str) -> list[ast.stmt]:
    """The statements of a module that define a name."""
    found = []
    for statement in tree.body:
        match statement:
            case ast.FunctionDef(name=defined) | ast.ClassDef(name=defined):
                names = [defined]
            case ast.Assign(targets=targets):
                names = [node.id for node in targets if isinstance(node, ast.Name)]
            case ast.AnnAssign(target=ast.Name(id=defined)):
                names = [defined]
            case _:
                names = []
        if name in names:
            found.append(statement)
    return found


@cache
def _file(module: str) -> Path | None:
    """The file of a module, by its dotted name; None if it is of another package."""
    first, *rest = module.split(".")
    if first != PACKAGE.name:
        return None
    path = PACKAGE.joinpath(*rest)
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


@cache
def _tree(module: str) -> ast.Module:
    path = _file(module)
    assert path is not None
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef):
            node.body = [each for each in node.body if not _is_text(each)]
    return tree


def _is_text(statement: ast.stmt) -> bool:
    """Whether a statement is a docstring, which does nothing."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


@cache
def _text(statement: ast.stmt) -> str:
    """A statement as text that is the same on every Python.

    `ast.dump` differs between versions: 3.12 gives each function a list of type parameters, and
    3.13 leaves out empty lists. Here a field that is empty or not given is left out.
    """
    return _node_text(statement)


def _node_text(node: object) -> str:
    match node:
        case ast.Constant(value=value):
            # With its type: 1, 1.0 and True are equal, and not the same constant.
            return f"{type(value).__name__}({value!a})"
        case ast.JoinedStr(values=values):
            return f"JoinedStr({', '.join(_string_parts(values))})"
        case ast.AST():
            fields = [(name, getattr(node, name, None)) for name in sorted(node._fields)]
            given = [
                f"{name}={_node_text(value)}" for name, value in fields if value not in ([], None)
            ]
            return f"{type(node).__name__}({', '.join(given)})"
        case list():
            return f"[{', '.join(map(_node_text, node))}]"
    return ascii(node)


def _string_parts(values: list[ast.expr]) -> Iterator[str]:
    """Parts of an f-string; how its plain text is cut into pieces differs between versions."""
    plain = ""
    for value in values:
        if isinstance(value, ast.Constant):
            plain += str(value.value)
            continue
        if plain:
            yield ascii(plain)
        plain = ""
        yield _node_text(value)
    if plain:
        yield ascii(plain)


def _name(path: Path) -> str:
    """A file's name, the same in a checkout and in a wheel, which has the body model inside."""
    inside = PACKAGE / "models"
    start = PACKAGE if path.is_relative_to(inside) else PACKAGE.parent
    return path.relative_to(start).as_posix()


def _hash(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()
