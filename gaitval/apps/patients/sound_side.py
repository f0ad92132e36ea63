"""What the sound side of an above-knee amputee does that its angles and healthy people do not say.

The angles of a stride say when a foot leaves the ground, as well as they do in healthy people
(`rolling_foot`), and healthy people say what its ankle's moment is. In each of twelve amputees the
sound side pushes off later than that, and most push off harder: they make up for a prosthetic ankle
that has no calf (larger moments of the sound ankle: Nolan and Lees 2000, Prosthet Orthot Int
24:117, from memory). `sound_sides.csv` has both figures of each, and `sound_rests.csv` what of the
ankle's moment is left then; `experiments/sound_sides.py` computes them. A person's own are left out
of what is expected of him.

The prosthetic foot leaves the ground later than the angles say, too, if less
(`prosthetic_sides.csv`; what of its ankle's moment is left then: `prosthetic_rests.csv`). They say
it by the ball of the foot, which is furthest behind the pelvis only some time after the load has
ended, for a sound ankle goes on to push; a passive foot does not, so this time is shorter.

They are of one laboratory's treadmill at 0.8 m/s and of above-knee amputees, and are used for
nobody else.
"""

from functools import cache
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.arrays import Array

TABLE: Final = "sound_sides.csv"
PROSTHETIC_TABLE: Final = "prosthetic_sides.csv"
RESTS: Final = "sound_rests.csv"
PROSTHETIC_RESTS: Final = "prosthetic_rests.csv"
PROSTHETIC_NOISE: Final = 1.0
"""Of the regression of prosthetic ankles' rests on their angles, over the signal of one person: as
much. Convention; with 0.03 to 3 of it moments of twelve people are 0.099 to 0.109 Nm/kg off, and
0.118 without it."""
REST_SHARE: Final = 0.5
"""Of what is left of the moment in the mean of the others, as much noise as signal: with 0.3 to 1
of it twelve people's moments are equally near (0.129 to 0.131 Nm/kg where they were 0.135)."""


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


def later_of_prosthesis(identifier: str) -> tuple[float, float]:
    """By how much later than the angles say a passive prosthetic foot leaves the ground, of the
    cycle: mean and SD between people, of all but the one who is called `identifier`.
    """
    rows = rows_of(PROSTHETIC_TABLE)
    others = np.array([float(row["later"]) for row in rows if row["person"] != identifier])
    return float(others.mean()), float(others.std(ddof=1))


def rest_of(identifier: str) -> Array:
    """(101,) Nm/kg, dorsiflexion positive, that is expected of the sound ankle's moment beside what
    healthy people and the ankle's angle say: from all but the one who is called `identifier`.
    """
    rests = [
        np.array([float(row[f"p{each}"]) for each in range(101)])
        for row in rows_of(RESTS)
        if row["person"] != identifier
    ]
    return np.asarray(REST_SHARE * np.mean(rests, axis=0))


def prosthetic_rest_of(identifier: str, angle: Array) -> Array:
    """(101,) Nm/kg, dorsiflexion positive, that is expected of a prosthetic ankle's moment beside
    what healthy people and two springs say, by its `angle` (101,) rad over its own cycle: half of
    what a ridge regression through all but the one who is called `identifier` says.
    """
    curves = {
        kind: np.array(
            [
                [float(row[f"p{each}"]) for each in range(101)]
                for row in rows_of(PROSTHETIC_RESTS)
                if row["person"] != identifier and row["curve"] == kind
            ]
        )
        for kind in ("angle", "rest")
    }
    usual, rest = (each.mean(axis=0) for each in curves.values())
    differs, left = curves["angle"] - usual, curves["rest"] - rest
    gram = differs @ differs.T
    gram += PROSTHETIC_NOISE * np.trace(gram) / len(gram) * np.eye(len(gram))
    return np.asarray(
        REST_SHARE * (rest + (angle - usual) @ differs.T @ np.linalg.solve(gram, left))
    )


def _table() -> dict[str, tuple[float, float]]:
    """By person: `SoundSide.later` and `SoundSide.larger`."""
    return {row["person"]: (float(row["later"]), float(row["larger"])) for row in rows_of(TABLE)}


@cache
def rows_of(table: str) -> tuple[dict[str, str], ...]:
    """The rows of a `table` that comes with this package, without its head of comments."""
    return tuple(shipped_table("gaitval.apps.patients", table).by_name())
