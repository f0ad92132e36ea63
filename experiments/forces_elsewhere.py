"""Shipped: writes `gaitval/prediction/forces_elsewhere.json`, how forces of people of five other
laboratories differ from what the built-in people have one expect.

    python -m experiments.forces_elsewhere ../public          # the file
    python -m experiments.forces_elsewhere ../public --check  # fails if it is another

Reads the recordings of `claims.elsewhere`, with plates. Of all together, every laboratory as heavy
as another, the second moment is kept in its `COMPONENTS` largest directions: no person's own curve.
"""

from json import dumps
from pathlib import Path

import numpy as np

import gaitval.prediction
from claims.elsewhere import imported, pooled
from experiments.shipped import parser_of, ship
from gaitval.prediction.force_split import STORE, UNIT

FILE = Path(gaitval.prediction.__file__).parent / STORE
COMPONENTS = 12
"""Of 34. What is left out is less than the roughness that is added."""
SOURCE = (
    "Pooled statistics of ground reaction forces of 17 people of five laboratories (Arnold 2013; "
    "Gait2354 and Rajagopal 2016 of OpenSim; McGill and Shriners, Montreal; Plug-in Gait samples "
    "of BTKData), computed by experiments/forces_elsewhere.py. No recording is kept."
)


def forces_elsewhere(public: Path) -> str:
    """The file."""
    values, directions = np.linalg.eigh(pooled(imported(public)))
    order = np.argsort(values)[::-1][:COMPONENTS]
    shapes = (directions[:, order] * np.sqrt(np.maximum(values[order], 0.0))).T
    largest = np.take_along_axis(shapes, np.argmax(np.abs(shapes), axis=1)[:, None], axis=1)
    whole = np.rint(shapes * np.sign(largest) / UNIT).astype(int).tolist()
    print(f"kept {values[order].sum() / values.sum():.3f} of the second moment", flush=True)
    stored = {"source": SOURCE, "shapes": whole}
    return dumps(stored, separators=(",", ":")).replace("],", "],\n") + "\n"


def main() -> None:
    """Command line; see the module's docstring."""
    ship({FILE: forces_elsewhere}, parser_of(__doc__).parse_args(), "forces_elsewhere")


if __name__ == "__main__":
    main()
