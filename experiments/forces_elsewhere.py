"""Shipped: writes `forces_elsewhere.json` and `laboratories.json` of `gaitval/subjects/prediction`.

    python -m experiments.forces_elsewhere ../public          # the files
    python -m experiments.forces_elsewhere ../public --check  # fails if they are others

How forces, angles and walk of people of six other laboratories differ from what the built-in people
have one expect, each at the own contacts; and angles, moments and forces of the same people for a
regression. Reads the recordings of `claims.elsewhere`, with plates. Of all together, every
laboratory as heavy as another, the second moment of the first is kept in its `COMPONENTS` largest
directions, and gaits are turned onto their principal directions
(`gaitval.subjects.prediction.laboratories`): no person's own curve.
"""

from functools import cache
from json import dumps
from pathlib import Path

import numpy as np

import gaitval.subjects.prediction
from claims.elsewhere import ImportedElsewhere, apart, imported, pooled, regressed_from
from experiments.shipped import parser_of, ship
from gaitval.subjects.prediction import laboratories
from gaitval.subjects.prediction.force_split import SPLIT, STORE

FILE = Path(gaitval.subjects.prediction.__file__).parent / STORE
ALL = FILE.with_name(laboratories.STORE)
COMPONENTS = 20
"""Of 68. What is left out is less than the roughness that is added."""
SOURCE = (
    "Pooled statistics of gait of 34 people of six laboratories (Arnold 2013; "
    "Gait2354 and Rajagopal 2016 of OpenSim; McGill and Shriners, Montreal; Plug-in Gait samples "
    "of BTKData; Basel), computed by experiments/forces_elsewhere.py. No recording is kept. "
    "Licences: of Montreal's MIT, of BTKData BSD-3-Clause; Basel's lie in a repository of programs "
    "under GPL-3.0, the others name none, and nothing of theirs but this pool is here."
)


@cache
def _imported(public: Path) -> list[ImportedElsewhere]:
    """Both files are of them; minutes."""
    return imported(public)


def forces_elsewhere(public: Path) -> str:
    """The file."""
    found = _imported(public)
    values, directions = np.linalg.eigh(pooled(found, apart(found)))
    order = np.argsort(values)[::-1][:COMPONENTS]
    shapes = (directions[:, order] * np.sqrt(np.maximum(values[order], 0.0))).T
    largest = np.take_along_axis(shapes, np.argmax(np.abs(shapes), axis=1)[:, None], axis=1)
    whole = np.rint(shapes * np.sign(largest) / SPLIT.unit).astype(int).tolist()
    print(f"kept {values[order].sum() / values.sum():.3f} of the second moment", flush=True)
    stored = {"source": SOURCE, "shapes": whole}
    return dumps(stored, separators=(",", ":")).replace("],", "],\n") + "\n"


def gaits_elsewhere(public: Path) -> str:
    """The other file."""
    rows = laboratories.to_rows(regressed_from(_imported(public)))
    whole = np.rint(rows / laboratories.UNIT).astype(int).tolist()
    stored = {"source": SOURCE, "rows": whole}
    return dumps(stored, separators=(",", ":")).replace("],", "],\n") + "\n"


def main() -> None:
    """Command line; see the module's docstring."""
    ship(
        {FILE: forces_elsewhere, ALL: gaits_elsewhere},
        parser_of(__doc__).parse_args(),
        "forces_elsewhere",
    )


if __name__ == "__main__":
    main()
