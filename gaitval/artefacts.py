"""Read and write the files of a run, each whole or not at all, with hashes and provenance."""

import errno
import hashlib
import json
import os
import platform
import shutil
import tempfile
import tomllib
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitval import __version__
from gaitval.errors import ArtefactError, GaitvalError

if TYPE_CHECKING:  # a command that only shows its help need not wait for NumPy
    from numpy.typing import NDArray

LIBRARIES = (
    "dartpy",
    "ezc3d",
    "yourdfpy",
    "xacro",
    "torch",
    "stable-baselines3",
    "gymnasium",
    "cma",
    "numba",
    "numpy",
    "scipy",
    "pandas",
    "matplotlib",
)


PARTIAL = ".partial-"
"""How the name of a file begins that is still being written (`replacing`), and of a folder that
is needed only for a while (`scratch`)."""

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.EROFS)

DIGITS = 300
"""Longest number in a file that is read: no quantity needs more, and a float ends at 309 digits."""

DEPTH = 50
"""Most levels of tables and lists in a file that is read; ours have seven."""


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Say which file could not be written because of the disk or its permissions, and what to do.

    Raises
    ------
    ArtefactError : the disk is full, or the folder may not be written to.
    """
    try:
        yield
    except Exception as error:
        told = why_unwritable(error)
        if told is None or _of_another(error, Path(path)):
            raise
        raise ArtefactError(
            f"{path}: cannot be written: {told}, or give another folder with --out; then run the "
            "same command again. What was there before is unchanged."
        ) from None


def _of_another(error: Exception, path: Path) -> bool:
    """Whether an error names a file that is neither in the folder of `path` nor above it."""
    name = getattr(error, "filename", None)
    if not isinstance(name, str | os.PathLike):
        return False
    named = Path(name)
    return named.parent != path.parent and named not in (path, *path.parents)


def why_unwritable(error: Exception) -> str | None:
    """What a disk has against a file, and the mend; None for any other error."""
    # Libraries that write in another language tell the system's error in words only.
    number = error.errno if isinstance(error, OSError) else None
    for kinds, told in (
        (_NO_ROOM, "there is no space left for it. Free some space"),
        (_NOT_ALLOWED, "its folder may not be written to. Change the permissions"),
    ):
        if number in kinds or any(f"(os error {kind})" in str(error) for kind in kinds):
            return told
    return None


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, unless it is there.

    Raises
    ------
    ArtefactError : it cannot be made; the message says why.
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
    kill leaves is removed by `remove_partial`.

    Raises
    ------
    ArtefactError : the disk is full, or the folder may not be written to.
    """
    path = Path(path)
    with writing(path):
        make_folder(path.parent)
        handle, name = tempfile.mkstemp(
            dir=path.parent, prefix=f"{PARTIAL}{path.stem}-", suffix=path.suffix
        )
        os.close(handle)
        temporary = Path(name)
        try:
            yield temporary
            temporary.chmod(0o644)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def scratch(folder: Path) -> Iterator[Path]:
    """A folder in `folder` for files that are needed only for a while, removed when the block ends.

    What a kill leaves is removed by `remove_partial`; nobody would look for it among the temporary
    files of a system.

    Raises
    ------
    ArtefactError : the disk is full, or the folder may not be written to.
    """
    folder = Path(folder)
    with writing(folder):
        make_folder(folder)
        with tempfile.TemporaryDirectory(dir=folder, prefix=PARTIAL) as name:
            yield Path(name)


def remove_partial(folder: Path) -> None:
    """Remove what a killed process left of files that it was writing; call it with the folder
    locked, because another process may be writing.
    """
    for depth in ("", "*/", "*/*/", "*/*/*/"):
        for left in folder.glob(f"{depth}{PARTIAL}*"):
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left)
            else:
                left.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")  # the same on every system


def write_json(path: Path, value: Any) -> None:
    """Write JSON with sorted keys, so that equal values give equal bytes. NaN is refused."""
    write_text(path, json.dumps(value, indent=1, sort_keys=True, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Read a JSON file of a run folder.

    Raises
    ------
    ArtefactError : it is missing, a folder, may not be read, or is damaged.
    """
    try:
        text = _text(path, ArtefactError, "Run the stage that writes it first")
        value = json.loads(text, parse_int=_integer)
        _check_depth(value)
        return value
    except (ValueError, RecursionError) as error:
        raise ArtefactError(
            f"{path}: cannot be read as JSON ({_told(error)}); it is truncated or was edited. "
            "Delete it and run its stage again."
        ) from None


def read_toml(
    path: Path, refusal: type[GaitvalError], mend: str = "Check the path"
) -> dict[str, Any]:
    """Read a TOML file that a person wrote; a byte order mark at its beginning is accepted.

    Parameters
    ----------
    refusal : the error that is raised.
    mend : what to do if the file is missing.

    Raises
    ------
    GaitvalError : of type `refusal`: missing, a folder, may not be read, or not valid.
    """
    try:
        text = _text(path, refusal, mend)
    except UnicodeDecodeError:
        raise refusal(
            f"{path}: not UTF-8 text, so not valid TOML. Save the file as UTF-8."
        ) from None
    return parse_toml(text, str(path), refusal)


def parse_toml(text: str, origin: str, refusal: type[GaitvalError]) -> dict[str, Any]:
    """Values of TOML `text`; the message of a refusal names `origin`."""
    try:
        values = tomllib.loads(text)
        _check_depth(values)
        for value in _leaves(values):
            if isinstance(value, int) and abs(value) >= 10**DIGITS:
                raise ValueError(f"an integer has more than {DIGITS} digits")
        return values
    except (ValueError, RecursionError) as error:
        raise refusal(f"{origin}: not valid TOML: {_told(error)}. Correct that line.") from None


def _check_depth(value: Any, levels: int = DEPTH) -> None:
    """Raise RecursionError for a value that others could not walk through."""
    if isinstance(value, dict | list):
        if levels == 0:
            raise RecursionError
        for each in value.values() if isinstance(value, dict) else value:
            _check_depth(each, levels - 1)


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _leaves(each)
    else:
        yield value


def _text(path: Path, refusal: type[GaitvalError], mend: str) -> str:
    """The UTF-8 text of a file, without a byte order mark; raises UnicodeDecodeError."""
    path = Path(path)
    try:
        if path.exists() and not path.is_file():
            what = "a folder" if path.is_dir() else "a pipe or a device"
            raise refusal(f"{path}: is {what}, but a file is read here. Give the file itself.")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise refusal(f"{path}: no such file. {mend}.") from None
    except OSError as error:
        raise refusal(
            f"{path}: cannot be read ({error.strerror}). Change its permissions, or give another."
        ) from None


def _integer(digits: str) -> int:
    if len(digits) > DIGITS:
        raise ValueError(f"an integer has {len(digits)} digits")
    return int(digits)


def _told(error: Exception) -> str:
    """What is wrong with a text, in words for whoever wrote it."""
    if isinstance(error, RecursionError):
        return "lists or tables lie too deep in each other"
    if "integer string conversion" in str(error):
        return f"an integer has more than {DIGITS} digits"
    return str(error)


def write_arrays(path: Path, arrays: Mapping[str, "NDArray[Any]"]) -> None:
    """Write named arrays as a compressed npz without pickle."""
    import numpy as np

    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **dict(arrays))


def read_arrays(path: Path, names: tuple[str, ...]) -> dict[str, "NDArray[Any]"]:
    """Read the arrays `names` of an npz without unpickling; see `write_arrays`."""
    import numpy as np

    try:
        with np.load(path, allow_pickle=False) as stored:
            missing = [name for name in names if name not in stored]
            if missing:
                raise ArtefactError(
                    f"{path}: the arrays {', '.join(missing)} are missing; another version "
                    "of gaitval wrote the file. Delete it and run its stage again."
                )
            return {name: stored[name] for name in names}
    except FileNotFoundError:
        raise ArtefactError(f"{path}: no such file. Run the stage that writes it first.") from None
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        if Path(path).is_dir():
            raise ArtefactError(f"{path}: is a folder, but a file is read here.") from None
        raise ArtefactError(
            f"{path}: cannot be read as npz ({error}); it is truncated. Delete it and run its "
            "stage again."
        ) from None


def file_hash(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def value_hash(value: Any) -> str:
    """SHA-256 of a JSON-serialisable value, independent of key order."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def versions() -> dict[str, str]:
    """Versions of gaitval, Python, the machine and the libraries that results depend on."""
    found = {"gaitval": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        found[name] = metadata.version(name)
    return found
