"""Print the means and spreads of `gaitval.measurement.expected` from sound recordings.

    python -m experiments.measurement_constants --from FOLDER

FOLDER has the clones of `experiments/public_recordings.toml`, of the laboratories that constants
are chosen on (`evidence.measurement.faults.CHOSEN_ON`), and one more that only this uses (`BASEL`).
A person counts once, whatever the number of recordings. A laboratory's mean is as good as its
number of people and as laboratories differ: with as much between laboratories as between people,
its weight is n / (n + 1); half of that without standing trials, where bodies are less sure. The
spread is that of people, and of the laboratories' means.
"""

import argparse
import re
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evidence.measurement.faults import CHOSEN_ON, _imported, _read, _recordings
from gaitval.arrays import Array
from gaitval.errors import GaitvalError
from gaitval.measurement.balance import NEWTON, PRESSURE, STRIDE_BINS, Data, data_of, trials_of
from gaitval.measurement.estimate import acceleration_of
from gaitval.measurement.expected import ODD, relative

WITH_A_FAULT = "HC040A|NP101[0134]"
"""Markers that jump; a plate (3) whose fore-aft force holds 3 to 5 % of the vertical one in whole
stances, forwards or backwards with the direction of the walk, of those four people alone."""
ONE_PERSON = r"Subject4|walkNorm_NP\d+|HC\d+"
BASEL = "fmoissenet+GaitEventsAlgorithms/NormSubjects"
"""A laboratory of Basel: 29 recordings of 17 people, most of them children, without
standing trials; https://github.com/fmoissenet/GaitEventsAlgorithms, commit be9ca55e. Nothing of it
is kept here."""
WITHOUT_STANDING = 0.5
"""Weight of such a laboratory beside others."""
EXPLAINED = 0.68
"""Share of the printed spreads that `expected` has: they hold what scatters from stride to stride
and what `expected.NUISANCE` explains."""


class Sound(NamedTuple):
    """A recording: its laboratory, its person, stature m, and its data."""

    laboratory: str
    person: str
    height_m: float
    data: Data


def listed(base: Path) -> Iterator[dict[str, Any]]:
    """The recordings."""
    for recording in _recordings():
        if any(word in recording["laboratory"] for word in CHOSEN_ON):
            yield recording
    yield from of_basel(base)


def of_basel(base: Path) -> list[dict[str, Any]]:
    """The recordings of that laboratory."""
    return [
        {"name": path.stem, "laboratory": "Basel", "trials": [str(path)], "sex": "M"}
        for path in sorted((base / BASEL).glob("*.c3d"))
    ]


def sound(base: Path) -> list[Sound]:
    """Each recording without a known fault."""
    found = []
    for recording in listed(base):
        if re.search(WITH_A_FAULT, recording["name"]):
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                made = _imported(*_read(recording, base, Path(folder)))
            except (GaitvalError, OSError) as error:
                print(recording["name"], error)
                continue
        data = data_of(trials_of(made.body.model, made.trials), made.request.mass_kg)
        person = re.search(ONE_PERSON, recording["name"])
        if data is not None:
            whose = person.group() if person else recording["name"]
            found.append(Sound(recording["laboratory"], whose, made.request.height_m, data))
    return found


def half_strides(kind: str, one: Sound) -> list[Array]:
    """A kind of Newton's law by tenths of half a stride, NaN where it is not seen."""
    mine = np.array(one.data.kind) == kind
    values = np.full(STRIDE_BINS, np.nan)
    values[np.floor(one.data.phase[mine] * STRIDE_BINS).astype(int)] = one.data.value[mine]
    half = values.reshape(2, -1) * np.array([[1.0], [-1.0 if kind in ODD else 1.0]])
    still = np.nanmean(half) if kind == "moment y" else 0.0
    return [*(still + (half - still) / relative(acceleration_of(one.data)))]


def stances(kind: str, one: Sound) -> list[Array]:
    """A centre of pressure over stature by tenths of the stance, of each foot and plate."""
    kinds, groups = np.array(one.data.kind), np.array(one.data.group)
    each = [one.data.value[(kinds == kind) & (groups == g)] for g in sorted({*one.data.group})]
    return [values / one.height_m for values in each if len(values) == 8]


def of_people(rows: Sequence[tuple[str, Array]]) -> tuple[Array, Array, int]:
    """Mean and variance of the `rows` of people, each of whom counts once, and their number."""
    count = Counter(person for person, _ in rows)
    table = np.array([values for _, values in rows])
    seen = np.array([1 / count[person] for person, _ in rows])[:, None] * np.isfinite(table)
    mean = (np.nan_to_num(table) * seen).sum(axis=0) / seen.sum(axis=0)
    off = np.nan_to_num(table - mean)
    return mean, (off**2 * seen).sum(axis=0) / seen.sum(axis=0), len(count)


def of_laboratories(rows: Mapping[str, Sequence[tuple[str, Array]]]) -> tuple[Array, Array]:
    """Mean over the laboratories, and spread of anybody of any laboratory."""
    known = [of_people(each) for each in rows.values()]
    weight = np.array([count / (count + 1) for *_, count in known])
    weight *= [WITHOUT_STANDING if laboratory == "Basel" else 1.0 for laboratory in rows]
    weight /= weight.sum()
    means = np.array([mean for mean, *_ in known])
    mean = weight @ means
    between = weight @ (means - mean) ** 2 * len(known) / (len(known) - 1)
    within = np.mean([variance for _, variance, count in known if count > 1], axis=0)
    return mean, np.sqrt(between + within)


def main() -> None:
    """Print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--from", dest="clones", type=Path, required=True)
    recordings = sound(parser.parse_args().clones)
    print(Counter(one.laboratory for one in recordings), len({one.person for one in recordings}))
    for kinds, work in ((NEWTON, half_strides), (PRESSURE, stances)):
        for kind in kinds:
            rows: dict[str, list[tuple[str, Array]]] = {}
            for one in recordings:
                mine = [(one.person, values) for values in work(kind, one)]
                rows.setdefault(one.laboratory, []).extend(mine)
            mean, spread = of_laboratories(rows)
            spread *= EXPLAINED
            print(kind, "mean", np.round(mean, 4).tolist(), "SD", np.round(spread, 4).tolist())


if __name__ == "__main__":
    main()
