"""The npz files that results are saved in: arrays, and all else as JSON, without pickle."""

import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io.artefacts import read_arrays, write_arrays
from gaitval.errors import ArtefactError

ABOUT: Final = "about"


def write_record(path: Path, kind: str, arrays: dict[str, Any], others: dict[str, Any]) -> None:
    """Write `arrays` and JSON-able `others` as one npz file at `path`, of a `kind` of result."""
    about = {"kind": kind, "arrays": sorted(arrays), "values": others}
    write_arrays(path, {**arrays, ABOUT: np.array(json.dumps(about))})


def read_record(path: Path, kind: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The arrays and other values of the file `path` of `write_record`; lists come back as
    tuples. Raises ArtefactError where the file is of another `kind`.
    """
    try:
        about = json.loads(str(read_arrays(path, (ABOUT,))[ABOUT]))
        found, names, values = str(about["kind"]), tuple(about["arrays"]), about["values"]
        others = {name: _fixed(value) for name, value in values.items()}
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise edited(path, error) from None
    if found != kind:
        raise ArtefactError(f"{path} holds a {found}, not a {kind}. Load it with {found}.load.")
    return read_arrays(path, names), others


def edited(path: Path, error: Exception) -> ArtefactError:
    """The refusal of a saved file `path` at which an `error` was raised."""
    return ArtefactError(
        f"{path}: not what gaitval saves ({error!r}); it was edited, or is of another version. "
        "Save it again."
    )


def _fixed(value: Any) -> Any:
    return tuple(_fixed(each) for each in value) if isinstance(value, list) else value
