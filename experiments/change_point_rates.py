"""Measures how often the search for steps is right, and writes the table of docs/how-to/history.md.

    python -m experiments.change_point_rates

Histories are made up: every series scatters about its mean, one of them takes a step after a given
check. A false alarm is a step reported anywhere in a history that has none. The step of one series
is found if one is reported in that series, and placed if it is reported at the right check and
nowhere else.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from scipy.stats import beta

from evidence.marked_table import with_table
from gaitval.apps.regression.change_points import steps
from gaitval.arrays import Array
from gaitval.artefacts import write_text

ROOT: Final = Path(__file__).resolve().parents[1]
PAGE: Final = ROOT / "docs" / "how-to" / "history.md"
HISTORIES: Final = 1000
SERIES: Final = 129
"""Figures of a full check of one subject."""
QUIET: Final = 20
"""Series of a history without a step; the chance of a false alarm does not depend on it."""
CHECKS: Final = (6, 10, 20, 50)
SIZES: Final = (3.0, 6.0, 12.0)
"""Of a step, in SDs of the scatter."""

Scatter = Callable[[np.random.Generator, tuple[int, int]], Array]


def normal(random: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Independent and normal, as the test supposes."""
    return random.normal(size=shape)


def heavy(random: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Student's t with three degrees of freedom: rare values far away."""
    return random.standard_t(3, size=shape)


def drifting(random: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Each value half of the one before, and new scatter."""
    noise = random.normal(size=shape)
    for index in range(1, shape[1]):
        noise[:, index] = 0.5 * noise[:, index - 1] + np.sqrt(0.75) * noise[:, index]
    return noise


def false_alarms(random: np.random.Generator, scatter: Scatter, checks: int) -> int:
    """Histories of `HISTORIES` with a step reported though there is none."""
    return sum(
        any(steps(values, QUIET) for values in scatter(random, (QUIET, checks)))
        for _ in range(HISTORIES)
    )


def found(random: np.random.Generator, checks: int, after: int, size: float) -> tuple[int, int]:
    """Steps of `HISTORIES` that are found, and that are placed."""
    detected = placed = 0
    for values in random.normal(size=(HISTORIES, checks)):
        values[after:] += size
        told = [step.index for step in steps(values, SERIES)]
        detected += bool(told)
        placed += told == [after]
    return detected, placed


def share(count: int) -> str:
    """A share in % with its 95 % interval (Clopper and Pearson 1934)."""
    low = beta.ppf(0.025, count, HISTORIES - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, HISTORIES - count) if count < HISTORIES else 1.0
    return f"{100 * count / HISTORIES:.1f} ({100 * low:.1f}-{100 * high:.1f})"


def table() -> str:
    """The table, in Markdown."""
    random = np.random.default_rng(19)
    lines = [
        "| made-up histories | checks | reported, % (95 % interval) | at the right commit, % |",
        "|---|---|---|---|",
    ]
    for name, scatter in (("normal", normal), ("heavy-tailed", heavy), ("drifting", drifting)):
        for checks in CHECKS if scatter is normal else (20,):
            alarms = false_alarms(random, scatter, checks)
            lines.append(
                f"| no step, {name} scatter: false alarms | {checks} | {share(alarms)} | |"
            )
            print(lines[-1], flush=True)
    for checks in CHECKS:
        for size in SIZES:
            for after, where in ((checks // 2, "in the middle"), (checks - 2, "two checks ago")):
                detected, placed = found(random, checks, after, size)
                lines.append(
                    f"| a step of {size:g} SD {where} | {checks} | {share(detected)} | "
                    f"{100 * placed / HISTORIES:.1f} |"
                )
                print(lines[-1], flush=True)
    return "\n".join(lines)


def main() -> None:
    """Entry point."""
    text = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(text, "rates", table()))


if __name__ == "__main__":
    main()
