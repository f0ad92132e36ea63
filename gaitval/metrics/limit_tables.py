"""The limits as a title, a small table and a tidy one (`display.Displayed`)."""

import pandas as pd

from gaitval.metrics.tolerances import Registry


def title(registry: Registry) -> str:
    """How many there are in a `registry`."""
    return f"{len(registry.tolerance)} limits"


def overview(registry: Registry) -> pd.DataFrame:
    """What a `registry` limits, and to what."""
    return to_frame(registry)[["quantity", "limit", "value", "goal", "unit", "role"]]


def to_frame(registry: Registry) -> pd.DataFrame:
    """One row a limit of a `registry`: quantity, measure, limit, value, goal, unit, role, status,
    source.
    """
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
            for row in registry.tolerance
        ]
    )
