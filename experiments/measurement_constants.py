"""Print the means and spreads of `gaitval_measurement.expected` from sound recordings.

    python -m experiments.measurement_constants --from FOLDER

FOLDER has the clones of `experiments/public_recordings.toml`. The recordings are those of the
laboratories that constants are chosen on (`evidence.measurement.faults.CHOSEN_ON`); one person's
four ways of walking count as 1.2 people. The printed spreads still hold what scatters from stride
to stride and what `expected.NUISANCE` explains; those of `expected` are 0.85 of them.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from evidence.measurement.faults import CHOSEN_ON, _imported, _read, _recordings
from gaitval.arrays import Array
from gaitval.errors import GaitvalError
from gaitval_measurement.balance import NEWTON, PRESSURE, STRIDE_BINS, Data, data_of, trials_of
from gaitval_measurement.expected import ODD

WITH_A_FAULT = "HC040A"
"""Its markers jump."""
SEVERAL_OF_ONE = "Subject4"
WEIGHT = 0.3
"""Of each recording of that person."""


def sound(base: Path) -> list[tuple[float, float, Data]]:
    """Weight, stature and data of each recording."""
    found = []
    for recording in _recordings():
        known = any(word in recording["laboratory"] for word in CHOSEN_ON)
        if not known or WITH_A_FAULT in recording["name"]:
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                made = _imported(*_read(recording, base, Path(folder)))
            except (GaitvalError, OSError) as error:
                print(recording["name"], error)
                continue
        data = data_of(trials_of(made.body.model, made.trials), made.request.mass_kg)
        if data is not None:
            weight = WEIGHT if SEVERAL_OF_ONE in recording["name"] else 1.0
            found.append((weight, made.request.height_m, data))
    return found


def half_strides(kind: str, parts: list[tuple[float, float, Data]]) -> tuple[Array, Array]:
    """Mean and spread of a kind of Newton's law by tenths of half a stride."""
    rows, weights = [], []
    for weight, _, data in parts:
        mine = np.array(data.kind) == kind
        values = np.full(STRIDE_BINS, np.nan)
        values[np.floor(data.phase[mine] * STRIDE_BINS).astype(int)] = data.value[mine]
        half = values.reshape(2, -1) * np.array([[1.0], [-1.0 if kind in ODD else 1.0]])
        rows += [*half]
        weights += [weight, weight]
    table, weight = np.array(rows), np.array(weights)[:, None]
    seen = weight * np.isfinite(table)
    mean = (np.nan_to_num(table) * seen).sum(axis=0) / seen.sum(axis=0)
    off = np.nan_to_num(table - mean)
    return mean, np.sqrt((off**2 * seen).sum(axis=0) / seen.sum(axis=0))


def stances(kind: str, parts: list[tuple[float, float, Data]]) -> tuple[Array, Array]:
    """Mean and spread over stature of a centre of pressure by tenths of the stance."""
    rows, weights = [], []
    for weight, height, data in parts:
        kinds, groups = np.array(data.kind), np.array(data.group)
        for group in sorted({*data.group}):
            values = data.value[(kinds == kind) & (groups == group)]
            if len(values) == 8:
                rows.append(values / height)
                weights.append(weight)
    table, weight = np.array(rows), np.array(weights)
    mean = np.average(table, axis=0, weights=weight)
    return mean, np.sqrt(np.average((table - mean) ** 2, axis=0, weights=weight))


def main() -> None:
    """Print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--from", dest="clones", type=Path, required=True)
    parts = sound(parser.parse_args().clones)
    print(len(parts), "recordings")
    for kinds, work in ((NEWTON, half_strides), (PRESSURE, stances)):
        for kind in kinds:
            mean, spread = work(kind, parts)
            print(kind, "mean", np.round(mean, 4).tolist(), "SD", np.round(spread, 4).tolist())


if __name__ == "__main__":
    main()
