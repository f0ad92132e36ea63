"""What every result of the interface can do: print itself, become a table, be saved and loaded."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd

from gaitval.arrays import Array
from gaitval.artefacts import read_arrays, write_arrays
from gaitval.coordinates import ACTUATED, COORDINATES, split_side
from gaitval.errors import ArtefactError

COLUMNS = ("side", "quantity", "percent", "value", "unit")
"""Columns of a tidy table, one row a value. `percent` is of the gait cycle, and NaN for what is not
a curve; a trial has `time`, in s, in its place."""

DEGREES: float = float(np.degrees(1.0))
ABOUT = "about"


class Result:
    """A frozen dataclass of arrays, numbers and names.

    It is saved as one npz without pickle, with what is not an array as JSON in it.
    """

    def title(self) -> str:
        """One line on what this is."""
        raise NotImplementedError

    def summary(self) -> pd.DataFrame:
        """The small table that is printed."""
        return ranges(self.to_frame())

    def to_frame(self) -> pd.DataFrame:
        """The values as a tidy table, one row a value (`COLUMNS`)."""
        raise NotImplementedError

    def __repr__(self) -> str:
        table = self.summary()
        shown = table.to_string(index=False, float_format=lambda value: f"{value:.4g}", na_rep="")
        return f"{self.title()}\n{shown}"

    def save(self, path: str | Path) -> None:
        """Write one npz file, whole or not at all."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]
        arrays = {name: each for name, each in values.items() if isinstance(each, np.ndarray)}
        others = {name: each for name, each in values.items() if name not in arrays}
        write_record(Path(path), type(self).__name__, arrays, others)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote. Raises ArtefactError for a missing or damaged file, or one of
        another kind of result.
        """
        arrays, others = read_record(Path(path), cls.__name__)
        return cls(**arrays, **others)


def write_record(path: Path, kind: str, arrays: dict[str, Any], others: dict[str, Any]) -> None:
    """Write arrays, and JSON-able values, as one npz."""
    about = {"kind": kind, "arrays": sorted(arrays), "values": others}
    write_arrays(path, {**arrays, ABOUT: np.array(json.dumps(about))})


def read_record(path: Path, kind: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arrays and other values of `write_record`; lists come back as tuples."""
    about = json.loads(str(read_arrays(path, (ABOUT,))[ABOUT]))
    if about["kind"] != kind:
        raise ArtefactError(
            f"{path} holds a {about['kind']}, not a {kind}. Load it with {about['kind']}.load."
        )
    others = {name: _fixed(value) for name, value in about["values"].items()}
    return read_arrays(path, tuple(about["arrays"])), others


def _fixed(value: Any) -> Any:
    return tuple(_fixed(each) for each in value) if isinstance(value, list) else value


def same_fields(result: type[Any], stage: Any, **more: Any) -> Any:
    """A result with the fields of what a stage returned, and `more` fields or other values."""
    return result(**{each.name: getattr(stage, each.name) for each in fields(stage)} | more)


def of_kind(name: str, kind: str) -> str:
    """`"knee_angle moment_r"` of `"knee_angle_r"` and `"moment"`; the name of no kind stays."""
    side, quantity = split_side(name)
    return f"{quantity} {kind}{name[-2:] if side else ''}" if kind else name


def angle_curves(positions: Array, names: Sequence[str] = ACTUATED) -> list[tuple[str, str, Array]]:
    """Name, unit and values of joint angles; `positions` are (T, 31), rad."""
    return [(n, "deg", DEGREES * positions[:, COORDINATES.index(n)]) for n in names]


def curve_frame(
    curves: Iterable[tuple[str, str, Array]], *, axis: str = "percent", at: Array | None = None
) -> pd.DataFrame:
    """Tidy table of curves.

    Parameters
    ----------
    curves : name with its side's suffix, unit, values (n,).
    axis, at : name and values (n,) of what they run over; 0 to 100 % when not given.
    """
    parts = []
    for name, unit, values in curves:
        side, quantity = split_side(name)
        over = np.linspace(0.0, 100.0, len(values)) if at is None else at
        parts.append(
            pd.DataFrame(
                {"side": side, "quantity": quantity, axis: over, "value": values, "unit": unit}
            )
        )
    return pd.concat(parts, ignore_index=True)


def sourced_frame(sources: Mapping[str, Iterable[tuple[str, str, Array]]]) -> pd.DataFrame:
    """Tidy table of the curves of several sources, with a column `source`."""
    parts = [curve_frame(curves).assign(source=name) for name, curves in sources.items()]
    return pd.concat(parts, ignore_index=True)


def value_frame(rows: Iterable[tuple[str, str, float | None, str]]) -> pd.DataFrame:
    """Tidy table of single values: side, quantity, value, unit."""
    return pd.DataFrame(
        [(side, quantity, np.nan, value, unit) for side, quantity, value, unit in rows],
        columns=list(COLUMNS),
    )


def ranges(frame: pd.DataFrame) -> pd.DataFrame:
    """Lowest and highest value of each quantity and side."""
    grouped = frame.groupby(["quantity", "side", "unit"], sort=False)["value"]
    table = grouped.agg(["min", "max"]).reset_index()
    return table.rename(columns={"min": "lowest", "max": "highest"})
