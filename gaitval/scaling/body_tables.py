"""A scaled body as its title, a small table and a tidy one (`display.Displayed`)."""

import pandas as pd

from gaitval.frames import value_frame
from gaitval.scaling.scaling import ScaledBody


def title(body: ScaledBody) -> str:
    """Name and mass of a `body`."""
    return f"Body model {body.model.name}, {body.model.mass:.1f} kg"


def overview(body: ScaledBody) -> pd.DataFrame:
    """Length, mass and factor over the population's mean, of each segment of a `body`."""
    rows = body.frame()[["length_m", "mass_kg", "factor"]]
    rows.insert(0, "segment", [row.name for row in body.table])
    return rows


def to_frame(body: ScaledBody) -> pd.DataFrame:
    """Length in m and mass in kg of each segment of a `body`."""
    masses = [(row.name, row.mass_kg) for row in body.table if row.mass_kg is not None]
    return value_frame(
        [
            *(("", f"{row.name} length", row.length_m, "m") for row in body.table),
            *(("", f"{name} mass", mass, "kg") for name, mass in masses),
        ]
    )
