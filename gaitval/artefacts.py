"""Write the files of a run, each whole or not at all, with hashes and provenance."""

import hashlib
import json
import os
import platform
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitval import __version__
from gaitval.errors import ArtefactError

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


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` that replaces it when the block ends without an error.

    A reader, or a run after a kill, sees the old file or the new one, never half a file.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")  # the same on every system


def write_json(path: Path, value: Any) -> None:
    """Write JSON with sorted keys, so that equal values give equal bytes. NaN is refused."""
    write_text(path, json.dumps(value, indent=1, sort_keys=True, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Read a JSON file of a run folder; raises `ArtefactError` if it is missing or damaged."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ArtefactError(f"{path}: no such file. Run the stage that writes it first.") from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ArtefactError(
            f"{path}: cannot be read as JSON ({error}); it is truncated or was edited. Delete it "
            "and run its stage again."
        ) from None


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
