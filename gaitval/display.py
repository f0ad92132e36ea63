"""What the results of the stages can do: print themselves, become a table, be saved and loaded."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

import numpy as np

from gaitval.arrays import Array
from gaitval.artefacts import read_arrays, write_arrays
from gaitval.coordinates import ACTUATED, COORDINATES, split_side
from gaitval.errors import ArtefactError

if TYPE_CHECKING:  # it takes long to load, and most commands print no table
    import pandas as pd

COLUMNS = ("side", "quantity", "percent", "value", "unit")
"""Columns of a tidy table, one row a value. `percent` is of the gait cycle, and NaN for what is not
a curve; a trial has `time`, in s, in its place."""

MOMENT, FORCE = "moment", "ground reaction"
"""Words that follow a curve's name in a table, so that it is not taken for an angle."""

NamedCurve = tuple[str, str, Array]
"""Name with the suffix of its side, unit, and values (n,)."""

DEGREES: Final[float] = float(np.degrees(1.0))
ABOUT: Final = "about"


class Displayed:
    """A result that prints itself as a title and a small table."""

    def title(self) -> str:
        """One line on what this is."""
        raise NotImplementedError

    def overview(self) -> "pd.DataFrame":
        """The small table that is printed."""
        return ranges(self.to_frame())

    def to_frame(self) -> "pd.DataFrame":
        """The values as a tidy table, one row a value (`COLUMNS`)."""
        raise NotImplementedError

    def __repr__(self) -> str:
        shown = self.overview().to_string(index=False, float_format="{:.4g}".format, na_rep="")
        return f"{self.title()}\n{shown}"

    def __str__(self) -> str:
        return repr(self)


class Saved(Displayed):
    """A frozen dataclass of arrays, numbers and names, saved as one npz without pickle."""

    KIND: ClassVar[str] = ""
    """What files call it, where that is not the name of the class."""

    def save(self, path: str | Path) -> None:
        """Write one npz file, whole or not at all; what is not an array is JSON in it."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]
        arrays = {name: each for name, each in values.items() if isinstance(each, np.ndarray)}
        others = {name: each for name, each in values.items() if name not in arrays}
        write_record(Path(path), self.KIND or type(self).__name__, arrays, others)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote. Raises ArtefactError for a missing or damaged file, or one of
        another kind of result.
        """
        arrays, others = read_record(Path(path), cls.KIND or cls.__name__)
        try:
            return cls(**arrays, **others)
        except (TypeError, ValueError) as error:
            raise edited(Path(path), error) from None


def write_record(path: Path, kind: str, arrays: dict[str, Any], others: dict[str, Any]) -> None:
    """Write `arrays` and JSON-able `others` as one npz file of a `kind` of result."""
    about = {"kind": kind, "arrays": sorted(arrays), "values": others}
    write_arrays(path, {**arrays, ABOUT: np.array(json.dumps(about))})


def read_record(path: Path, kind: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The arrays and other values of a file of `write_record`; lists come back as tuples. Raises
    ArtefactError where the file is of another `kind`.
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


def of_kind(name: str, kind: str) -> str:
    """`"knee_angle moment_r"` of `"knee_angle_r"` and `"moment"`; the name of no kind stays."""
    side, quantity = split_side(name)
    return f"{quantity} {kind}{name[-2:] if side else ''}" if kind else name


def angle_curves(positions: Array, names: Sequence[str] = ACTUATED) -> list[NamedCurve]:
    """Name, unit and values of joint angles; `positions` are (T, 31), rad."""
    return [(n, "deg", DEGREES * positions[:, COORDINATES.index(n)]) for n in names]


def moment_curves(moments: Array) -> list[NamedCurve]:
    """Name, unit and values of joint moments, (T, 25) Nm in the order of `ACTUATED`."""
    named = zip(ACTUATED, moments.T, strict=True)
    return [(of_kind(name, MOMENT), "Nm", values) for name, values in named]


def curve_frame(
    curves: Iterable[NamedCurve], *, axis: str = "percent", at: Array | None = None
) -> "pd.DataFrame":
    """Tidy table of curves.

    Parameters
    ----------
    curves : name with its side's suffix, unit, values (n,).
    axis, at : name and values (n,) of what they run over; 0 to 100 % when not given.
    """
    import pandas as pd

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


def sourced_frame(sources: Mapping[str, Iterable[NamedCurve]]) -> "pd.DataFrame":
    """Tidy table of the curves of several `sources`, with a column `source`."""
    import pandas as pd

    parts = [curve_frame(curves).assign(source=name) for name, curves in sources.items()]
    return pd.concat(parts, ignore_index=True)


def value_frame(rows: Iterable[tuple[str, str, float | None, str]]) -> "pd.DataFrame":
    """Tidy table of single values; `rows` are of side, quantity, value and unit."""
    import pandas as pd

    return pd.DataFrame(
        [(side, quantity, np.nan, value, unit) for side, quantity, value, unit in rows],
        columns=list(COLUMNS),
    )


def ranges(frame: "pd.DataFrame") -> "pd.DataFrame":
    """Lowest and highest value of each quantity and side of a tidy `frame`."""
    grouped = frame.groupby(["quantity", "side", "unit"], sort=False)["value"]
    table = grouped.agg(["min", "max"]).reset_index()
    return table.rename(columns={"min": "lowest", "max": "highest"})
