"""Read and write the files of a run, each whole or not at all, with hashes and provenance."""

import hashlib
import json
import math
import platform
import shutil
import tempfile
import tomllib
import zipfile
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import MISSING, dataclass, fields
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitval import __version__
from gaitval._internal.io import file_gate
from gaitval._internal.io.partial_files import PARTIAL, in_use, own_folder, remove_abandoned
from gaitval._internal.io.text_tables import HIDDEN
from gaitval.constants import LARGEST_SIZE
from gaitval.errors import ArtefactError, GaitvalError

if TYPE_CHECKING:  # a command that only shows its help need not wait for NumPy
    from _typeshed import DataclassInstance
    from numpy.typing import NDArray

LIBRARIES = (
    # Those whose version can change a number of a result.
    *("dartpy", "ezc3d", "xacro", "torch", "stable-baselines3", "gymnasium", "cma"),
    *("numba", "numpy", "scipy", "pandas", "matplotlib"),
)


@dataclass(frozen=True)
class JsonLimits:
    """What a JSON file may hold."""

    digits: int = 300
    """Longest number in a file that is read: no quantity needs more, and a float ends at 309
    digits."""
    depth: int = 50
    """Most levels of tables and lists in a file that is read; ours have seven."""
    points: int = 150
    """Most points in a line of TOML: the time for a key grows with the square of its parts."""


JSON_LIMITS: Final = JsonLimits()


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """If the block cannot write because of the disk or its permissions, raise an ArtefactError that
    says how to fix it. `path` is the file or folder that the block writes; an error that names a
    file elsewhere is not about it, and is raised unchanged.
    """
    try:
        yield
    except Exception as error:
        from gaitval._internal.io.disk_errors import is_of_another, why_unwritable

        why = why_unwritable(error)
        if why is None or is_of_another(error, Path(path)):
            raise
        raise ArtefactError(
            f"{path}: cannot be written: {why}, or give another folder with --out; then run the "
            "same command again. What was there before is unchanged."
        ) from None


def make_folder(folder: Path) -> None:
    """Make `folder`, and those above it, unless it is there. Raises ArtefactError, which says why,
    if it cannot be made.
    """
    try:
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise ArtefactError(
            f"{folder}: is a file, or lies below one. Give a folder with --out."
        ) from None
    except OSError as error:  # such as below /proc, or a name that is too long
        raise ArtefactError(
            f"{folder}: cannot be made ({error.strerror}). Give a folder on a disk with --out."
        ) from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` that replaces it when the block ends without an error.

    A reader, or a run after a kill, sees the old file or the new one, never half a file. What a
    kill leaves is removed when the same file is written again, or by `remove_partial`. Raises
    ArtefactError if the disk is full, the folder may not be written to, or `path` is a folder.
    """
    path = Path(path)
    with writing(path):
        if path.is_dir():
            raise ArtefactError(f"{path}: is a folder. Give the name of a file.")
        make_folder(path.parent)
        # In the same folder, because a file can only be replaced in one step within a file system;
        # with the same suffix, because some libraries choose the format by it.
        prefix = f"{PARTIAL}{path.stem}-"
        remove_abandoned(path.parent, prefix, path.suffix)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=prefix, suffix=path.suffix)
        temporary = Path(name)
        try:
            with in_use(handle):
                yield temporary
                # `mkstemp` makes a file that only its owner may read, but results are for everybody
                temporary.chmod(0o644)
                temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def scratch(folder: Path) -> Iterator[Path]:
    """A folder in `folder` for temporary files, removed when the block ends.

    What a kill leaves is removed by the next one in `folder`, or by `remove_partial`; nobody would
    look for it among the temporary files of a system. Raises ArtefactError as `replacing`.
    """
    folder = Path(folder)
    with writing(folder):
        make_folder(folder)
        with own_folder(folder, PARTIAL) as own:
            yield own


def workplace(path: Path) -> Path:
    """The folder for what other libraries read to write `path`: its own, or the system's temporary
    one where the own one's name has something that they would evaluate between quotes, or is not
    text, as that of a folder from another system.
    """
    folder = Path(path).resolve().parent
    odd = set("$'\"\\\n\r") & set(str(folder)) or HIDDEN.search(str(folder))
    return Path(tempfile.gettempdir()) if odd else folder


def copy_files(source: Path, target: Path, names: tuple[str, ...]) -> None:
    """Copy the files `names` of the folder `source` to `target`, each whole or not at all."""
    for name in names:
        copy_file(source / name, target / name)


def copy_file(source: Path, target: Path) -> None:
    """Copy the file `source` to `target`, whole or not at all."""
    # not `shutil.copyfile`, whose error for a full disk names the source
    with (
        file_gate.opened(source, ArtefactError, largest=file_gate.SIZES.binary) as file,
        replacing(target) as temporary,
        temporary.open("wb") as copy,
    ):
        shutil.copyfileobj(file, copy)


def write_text(path: Path, text: str) -> None:
    """Write `text` as UTF-8 to `path`, whole or not at all. Raises ArtefactError as `replacing`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")  # the same on every system


def write_json(path: Path, value: Any) -> None:
    """Write `value` as JSON to `path`, with sorted keys, so that equal values give equal bytes.
    Raises ArtefactError as `replacing`, and ValueError for a NaN or an infinity, which JSON does
    not have.
    """
    write_text(path, json.dumps(value, indent=1, sort_keys=True, allow_nan=False) + "\n")


def without_nan(value: Any) -> Any:
    """`value` for JSON: NumPy numbers as Python numbers, NaN and infinities as null."""
    if isinstance(value, Mapping):
        return {str(key): without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def read_json(path: Path, fix: str = "Delete it and run its stage again") -> Any:
    """Value of the JSON file `path`, of a run folder if nothing else is said. Raises ArtefactError
    if it is missing, a folder, may not be read, or is damaged: `fix` says what to do then.
    """
    try:
        text = file_gate.read_text(
            path,
            ArtefactError,
            largest=file_gate.SIZES.values,
            fix="Run the stage that writes it first",
        )
        value = json.loads(text, parse_int=_integer, parse_constant=_no_number)
        _check_depth(value)
        return value
    except (ValueError, RecursionError) as error:
        raise ArtefactError(
            f"{path}: cannot be read as JSON ({_reason(error)}); it is truncated or was edited. "
            f"{fix}."
        ) from None


def read_toml(
    path: Path, refusal: type[GaitvalError], fix: str = "Check the path"
) -> dict[str, Any]:
    """Read the TOML file `path` that a person wrote; a byte order mark at its start is accepted.
    Raises a GaitvalError of type `refusal` if it is missing (`fix` is then the last sentence of the
    message, without a stop), a folder, may not be read, or is not valid.
    """
    try:
        text = file_gate.read_text(path, refusal, largest=file_gate.SIZES.written, fix=fix)
    except UnicodeDecodeError:
        raise refusal(
            f"{path}: not UTF-8 text, so not valid TOML. Save the file as UTF-8."
        ) from None
    return parse_toml(text, str(path), refusal)


def parse_toml(text: str, origin: str, refusal: type[GaitvalError]) -> dict[str, Any]:
    """Values of TOML `text` from `origin`, which the message of an error names. Raises a
    GaitvalError of type `refusal` if it is not TOML, is nested too deeply, or has an integer of
    more than `JSON_LIMITS.digits` digits (inside, a ValueError or RecursionError).
    """
    try:
        _check_lines(text)
        values = tomllib.loads(text)
        _check_depth(values)
        for value in _leaves(values):
            # TOML allows integers of any length, and turning a huge one into a float raises an
            # error far from here.
            if isinstance(value, int) and abs(value) >= 10**JSON_LIMITS.digits:
                raise ValueError(f"an integer has more than {JSON_LIMITS.digits} digits")
        return values
    except (ValueError, RecursionError) as error:
        raise refusal(f"{origin}: not valid TOML: {_reason(error)}. Correct that line.") from None


def _check_depth(value: Any, levels: int = JSON_LIMITS.depth) -> None:
    """Raise RecursionError for a value nested deeper than recursive functions can read."""
    if isinstance(value, dict | list):
        if levels == 0:
            raise RecursionError
        for each in value.values() if isinstance(value, dict) else value:
            if type(each) in (dict, list):  # as parsers make them; most are numbers
                _check_depth(each, levels - 1)


def _check_lines(text: str) -> None:
    """Raise ValueError for a key of so many parts that Python would read it for hours."""
    for number, line in enumerate(text.split("\n"), start=1):
        if line.count(".") > JSON_LIMITS.points:
            raise ValueError(
                f"line {number} has more than {JSON_LIMITS.points} points; write lists in lines"
            )


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _leaves(each)
    else:
        yield value


def _integer(digits: str) -> int:
    if len(digits) > JSON_LIMITS.digits:
        raise ValueError(f"an integer has {len(digits)} digits")
    return int(digits)


def _no_number(constant: str) -> float:
    raise ValueError(f"{constant} is no number, and JSON does not have it")


def _reason(error: Exception) -> str:
    """What is wrong with a text, in words for whoever wrote it."""
    if isinstance(error, RecursionError):
        return "lists or tables lie too deep in each other"
    if "integer string conversion" in str(error):
        return f"an integer has more than {JSON_LIMITS.digits} digits"
    return str(error)


def write_arrays(path: Path, arrays: Mapping[str, "NDArray[Any]"]) -> None:
    """Write `arrays` of numbers or text, by name, as the npz file `path`, without pickle. It is not
    compressed, which takes ten times as long and saves a sixth of what was simulated. Raises
    ArtefactError as `replacing`.
    """
    import numpy as np

    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **dict(arrays))


def read_arrays(
    path: Path, names: Sequence[str], optional: Sequence[str] = ()
) -> dict[str, "NDArray[Any]"]:
    """The arrays `names`, and those of `optional` that it has, of the npz file `path` that
    `write_arrays` wrote, without unpickling; others are ignored. Raises ArtefactError if it is
    missing, a folder or damaged, or lacks one of `names` (inside, a ValueError).
    """
    import numpy as np

    fix = "Run the stage that writes it first"
    try:
        file_gate.passed(path, ArtefactError, largest=file_gate.SIZES.binary, fix=fix)
        with zipfile.ZipFile(path) as members:
            _check_headers(members, Path(path))
        with np.load(path, allow_pickle=False) as stored:
            missing = [name for name in names if name not in stored]
            if missing:
                raise ArtefactError(
                    f"{path}: the arrays {', '.join(missing)} are missing; another version "
                    "of gaitval wrote the file. Delete it and run its stage again."
                )
            found = (*names, *(name for name in optional if name in stored))
            arrays = {name: stored[name] for name in found}
        for name, each in arrays.items():
            if each.dtype.kind == "U" and each.nbytes:
                letters = each.astype(each.dtype.newbyteorder("=")).reshape(-1).view(np.uint32)
                if letters.max() > 0x10FFFF:  # NumPy makes a text of them that breaks Python
                    raise ValueError(f"{name} holds letters that are none")
        return arrays
    except ArtefactError:
        raise
    except Exception as error:  # zipfile, its decompressors and NumPy have no common one
        raise ArtefactError(
            f"{path}: cannot be read as npz ({error}); it is truncated. Delete it and run its "
            "stage again."
        ) from None


def array_names(kind: type["DataclassInstance"]) -> tuple[list[str], list[str]]:
    """`names` and `optional` of `read_arrays` for the fields of the dataclass `kind`: a field with
    a default is optional, since files of earlier versions lack it.
    """
    found: tuple[list[str], list[str]] = [], []
    for each in fields(kind):
        has_default = each.default is not MISSING or each.default_factory is not MISSING
        found[has_default].append(each.name)
    return found


def _check_headers(stored: zipfile.ZipFile, path: Path) -> None:
    """Refuse arrays that are said to be larger than the members that they lie in: memory for all of
    an array is taken before its first value is read.
    """
    from numpy.lib import format as npy

    members = stored.infolist()
    file_gate.check_unpacked((each.file_size for each in members), path, ArtefactError)
    for member in members:
        with stored.open(member) as file:
            version = npy.read_magic(file)
            header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, _, kind = header(file)
        # Python's own numbers, which have no largest one
        size = math.prod(map(int, shape)) * kind.itemsize
        if size > member.file_size or min(shape, default=0) < 0:
            raise ValueError(f"{member.filename} is shorter than its header says")


def check_arrays(
    arrays: Mapping[str, "NDArray[Any]"],
    shapes: Mapping[str, tuple[int, ...]],
    path: Path,
    *,
    may_lack: Collection[str] = (),
) -> None:
    """Refuse `arrays` of the npz file `path` that are not of their `shapes`, by name, or hold what
    is no number: raises ArtefactError. 0 is the length of an axis as long as the first one of the
    first array; those that `may_lack` values may hold NaN.
    """
    import numpy as np

    long = next(iter(arrays.values())).shape[:1]
    for name, shape in shapes.items():
        if name not in arrays:  # an optional one
            continue
        found = arrays[name]
        if found.shape != tuple(size or (*long, -1)[0] for size in shape):
            why = f"has the shape {found.shape}"
        elif found.dtype.kind not in "fiub":
            why = f"holds {found.dtype.name}, not numbers"
        elif not ((np.abs(found) < LARGEST_SIZE) | ((name in may_lack) & np.isnan(found))).all():
            why = "holds numbers that are not finite, or beyond all that moves"
        else:
            continue
        raise ArtefactError(f"{path}: {name} {why}. Delete it and run its stage again.")


def check_times(time: "NDArray[Any]", path: Path) -> None:
    """Refuse times (T,), s, of the npz file `path` that do not go on in even steps: rates are
    taken from the first step. Raises ArtefactError.
    """
    import numpy as np

    steps = np.diff(time)
    if not len(steps):
        return
    step = (time[-1] - time[0]) / len(steps)
    wrong = np.flatnonzero(~(np.abs(steps - step) < 0.01 * abs(step)) | (steps <= 0.0))
    if len(wrong):
        row = int(np.argmax(np.abs(steps - np.median(steps)))) if step > 0.0 else int(wrong[0])
        raise ArtefactError(
            f"{path}: time goes from {time[row]:g} to {time[row + 1]:g} s after sample {row + 1}, "
            "but must rise in even steps; the file was edited. Delete it and run its stage again."
        )


def there_below(folder: Path, name: str) -> str:
    """Which folders in `folder` have the file `name` that it has not, as a sentence at the end of a
    message: who names the folder of several runs wants one of them. Nothing without one.
    """
    if not folder.is_dir():
        return ""
    found = [each for each in sorted(folder.iterdir()) if (each / name).is_file()]
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    return f" There is one in {', '.join(map(str, found[:3]))}{more}." if found else ""


def file_hash(path: Path) -> str:
    """SHA-256 of the bytes of the file `path`, hexadecimal. Raises ArtefactError without one."""
    with file_gate.opened(path, ArtefactError, largest=file_gate.SIZES.binary) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def value_hash(value: Any) -> str:
    """SHA-256 of a JSON-serialisable `value`, independent of key order, hexadecimal."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def versions() -> dict[str, str]:
    """Versions of gaitval, Python, the machine and the libraries that results depend on."""
    found = {"gaitval": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        with suppress(metadata.PackageNotFoundError):  # an extra that is not installed
            found[name] = _version(name)
    return found


_version = cache(metadata.version)  # every stage asks, and each answer is read from a file
