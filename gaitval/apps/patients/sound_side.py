"""What the sound side of an above-knee amputee does that its angles and healthy people do not say.

The angles of a stride say when a foot leaves the ground, as well as they do in healthy people
(`rolling_foot`), and healthy people say what its ankle's moment is. In each of twelve amputees the
sound side pushes off later than that, and most push off harder: they make up for a prosthetic ankle
that has no calf (larger moments of the sound ankle: Nolan and Lees 2000, Prosthet Orthot Int
24:117, from memory). `sound_sides.csv` has both figures of each; `experiments/sound_sides.py`
computes them. A person's own are left out of what is expected of him.

They are of one laboratory's treadmill at 0.8 m/s and of above-knee amputees, and are used for
nobody else.
"""

import csv
from collections.abc import Iterable
from functools import cache
from importlib import resources
from typing import Final, NamedTuple

import numpy as np

TABLE: Final = "sound_sides.csv"


class SoundSide(NamedTuple):
    """How sound sides of amputees differ from healthy people's.

    Attributes
    ----------
    later : of the cycle, by which the foot leaves the ground later than the angles say.
    later_sd : its standard deviation between people.
    larger : factor of the ankle's moment.
    """

    later: float
    later_sd: float
    larger: float


def expected_of(identifier: str) -> SoundSide:
    """Mean of all amputees of the table but the one who is called `identifier`."""
    others = np.array([row for name, row in _table().items() if name != identifier])
    later, larger = others.mean(axis=0).tolist()
    return SoundSide(later, float(others[:, 0].std(ddof=1)), larger)


@cache
def _table() -> dict[str, tuple[float, float]]:
    """By person: `SoundSide.later` and `SoundSide.larger`."""
    text = resources.files("gaitval.apps.patients").joinpath(TABLE).read_text("utf-8")
    rows: Iterable[dict[str, str]] = csv.DictReader(
        line for line in text.splitlines() if not line.startswith("#")
    )
    return {row["person"]: (float(row["later"]), float(row["larger"])) for row in rows}
