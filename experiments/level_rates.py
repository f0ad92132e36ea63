"""Which published rate of level walking people who were measured bear out, and what bands hold.

    python -m experiments.level_rates TRAINING_DATA [reports/S01 ...]

TRAINING_DATA is `1_data_driven_energy_expenditure_model/training_data` of
Harvard-Slade-Lab/OpenMetabolics_code: steady gross rates (W) of Slade et al. (2021) Nat Commun
12:4312, with mass and stature of whom. Level walking is five of its conditions: thirteen adults at
0.75, 1.25 and 1.75 m/s, and 22 others at 1.0 and 1.5. None of them is one of those from whom an
equation was made. Walks of runs that are named are held against those people, whose rates are
taken to the walk's speed in proportion to `expected_rate`. Nothing is shipped of it. Seconds, and
five more a run.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from claims.metabolic import ABOUT
from claims.slopes import OXYGEN
from gaitval.arrays import Array
from gaitval.metrics.comparison import rms
from gaitval.quantities.metabolic_cost import MODEL, PEOPLE
from gaitval.quantities.metabolic_rate import expected_rate

SPEEDS: Final = {"C02": 0.75, "C14": 1.0, "C03": 1.25, "C15": 1.5, "C04": 1.75}
PER_OXYGEN: Final = OXYGEN / 60.0
"""W/kg for each ml a minute and kg."""
REST: Final = 3.5
"""ml a minute and kg."""


class MeasuredWalk(NamedTuple):
    """One person at one speed (m/s): stature (m), and gross rate, W/kg."""

    person: str
    speed: float
    stature: float
    rate: float


def _sports_medicine(at: MeasuredWalk) -> float:
    return PER_OXYGEN * (REST + 6.0 * at.speed)


EQUATIONS: Final[dict[str, Callable[[MeasuredWalk], float]]] = {
    "load carriage (Looney 2019)": lambda at: expected_rate(at.speed),
    "sports medicine (ACSM)": _sports_medicine,
    "mean of both": lambda at: 0.5 * (expected_rate(at.speed) + _sports_medicine(at)),
    "Pandolf 1977": lambda at: 1.5 + 1.5 * at.speed**2,
    # Its coefficients as a public program has them.
    "stature (Ludlow and Weyand 2016)": lambda at: (
        PER_OXYGEN * (REST + 3.85 + 5.97 * at.speed**2 / at.stature)
    ),
}


def measured(folder: Path) -> list[MeasuredWalk]:
    """Level walking of the people in `folder`."""
    found = []
    for path in sorted(folder.iterdir()):
        person, condition = path.name.split("_")
        if condition in SPEEDS:
            given = np.atleast_2d(np.loadtxt(path / "x.csv", delimiter=","))[0]
            rate = float(np.mean(np.loadtxt(path / "y.csv", delimiter=",")))
            mass, stature = float(given[2]), float(given[3])
            found.append(MeasuredWalk(person, SPEEDS[condition], stature, rate / mass))
    return found


def errors(
    walked: list[MeasuredWalk], equation: Callable[[MeasuredWalk], float]
) -> tuple[Array, Array]:
    """% that an `equation` is off each, and off the mean of each speed."""
    own = np.array([100.0 * (equation(at) / at.rate - 1.0) for at in walked])
    means = []
    for speed in sorted({at.speed for at in walked}):
        here = [at for at in walked if at.speed == speed]
        expected = np.mean([equation(at) for at in here])
        means.append(100.0 * float(expected / np.mean([at.rate for at in here]) - 1.0))
    return own, np.array(means)


def interval(walked: list[MeasuredWalk], own: Array) -> tuple[float, float]:
    """95 % of the mean of errors, people drawn again."""
    people = sorted({at.person for at in walked})
    by = [own[[at.person == name for at in walked]] for name in people]
    random = np.random.default_rng(1)
    means = [
        np.concatenate([by[i] for i in random.integers(len(by), size=len(by))]).mean()
        for _ in range(4000)
    ]
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)


def _inside(walked: list[MeasuredWalk], run: str) -> list[bool]:
    """Whether the people who walked about as fast lie in the band of the walk of a `run`."""
    import gaitval as gv

    cost = gv.metabolic_cost(run)
    assert cost is not None
    assert cost.speed is not None
    low, high = cost.band()
    expected = expected_rate(cost.speed)
    print(f"{run}: {cost.middle:.2f} W/kg, {100 * (cost.middle / expected - 1):+.1f} %", flush=True)
    rates = [
        at.rate * expected / expected_rate(at.speed)
        for at in walked
        if abs(at.speed - cost.speed) < ABOUT
    ]
    return [low <= rate <= high for rate in rates]


def main() -> None:
    """Print how far each equation is off, how much people differ, and what bands hold."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("runs", nargs="*")
    given = parser.parse_args()
    walked = measured(given.data)
    for speed in sorted(SPEEDS.values()):
        rates = [at.rate for at in walked if at.speed == speed]
        print(
            f"{speed} m/s: {len(rates)} people, {np.mean(rates):.2f} ± {np.std(rates, ddof=1):.2f}"
        )
    for title, some in (
        ("all speeds", walked),
        ("1.0 to 1.5 m/s, for which all are meant", [at for at in walked if 1 <= at.speed <= 1.5]),
    ):
        print(title)
        for name, equation in EQUATIONS.items():
            own, means = errors(some, equation)
            low, high = interval(some, own)
            print(
                f"  {name}: mean {own.mean():+.1f} % ({low:.1f} to {high:.1f}), of means at the "
                f"speeds {means.round(1)}, RMS {rms(means):.1f}"
            )
    off = np.array([at.rate / expected_rate(at.speed) - 1.0 for at in walked])
    print(f"people about the first: SD {rms(off):.3f} (in use {PEOPLE}, {MODEL})")
    inside = [each for run in given.runs for each in _inside(walked, run)]
    if inside:
        print(f"people inside the bands of walks: {100 * np.mean(inside):.1f} % of {len(inside)}")


if __name__ == "__main__":
    main()
