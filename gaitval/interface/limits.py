"""The limits that walks and recordings are held against, from Python."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import pandas as pd

from gaitval.artefacts import read_json, write_json
from gaitval.interface.result import Result
from gaitval.metrics.tolerances import Tolerance, load_registry


@dataclass(frozen=True, repr=False)
class Limits(Result):
    """Limits, their goals, and where they come from.

    Attributes
    ----------
    rows : one `gaitval.metrics.tolerances.Tolerance` a limit.
    """

    rows: tuple[Tolerance, ...]

    def title(self) -> str:
        """How many there are."""
        return f"{len(self.rows)} limits"

    def summary(self) -> pd.DataFrame:
        """What is limited, and to what."""
        return self.to_frame()[["quantity", "limit", "value", "goal", "unit", "role"]]

    def to_frame(self) -> pd.DataFrame:
        """One row a limit: quantity, measure, limit, value, goal, unit, role, status, source."""
        return pd.DataFrame(
            [
                {
                    "quantity": row.title,
                    "measure": row.measure,
                    "limit": row.limit.replace("_", " "),
                    "value": row.value,
                    "goal": row.goal,
                    "unit": row.unit,
                    "role": row.role,
                    "status": row.status,
                    "source": f"{row.citation}; {row.locator}",
                }
                for row in self.rows
            ]
        )

    def save(self, path: str | Path) -> None:
        """Write JSON, whole or not at all."""
        write_json(Path(path), [json.loads(row.model_dump_json()) for row in self.rows])

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote. Raises ArtefactError."""
        return cls(tuple(Tolerance.model_validate(row) for row in read_json(Path(path))))


def limits(*, role: str | None = None) -> Limits:
    """The limits that simulated walks and recordings are held against.

    Parameters
    ----------
    role : "acceptance" for those that decide a verdict, "context" for those shown beside it; all
        when not given.

    Returns
    -------
    Limits
        Values in the unit that each row names: deg, Nm/kg, % of body weight, cm, cycles.

    Raises
    ------
    ValueError
        Another role.

    References
    ----------
    Each row cites its own; all are in `gaitval/metrics/tolerances.toml`.

    Examples
    --------
    >>> import gaitval as gv
    >>> table = gv.limits(role="acceptance").to_frame()
    >>> print(*table[["quantity", "limit", "value", "unit"]].iloc[0])
    Hip, knee and ankle angles, sagittal: RMSE at most 4.0 deg
    """
    if role not in (None, "acceptance", "context"):
        raise ValueError(f'role is {role!r}; it must be "acceptance", "context" or None')
    rows = load_registry().tolerance
    return Limits(tuple(row for row in rows if role in (None, row.role)))
