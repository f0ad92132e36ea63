"""Whether the markers of the pelvis are where they were put.

A spine's marker that is put too high or too low leaves the distances between the four nearly as
they are. It tilts the line through its pair: beside the other pair's line, and, of the front pair,
beside the horizontal, on which the pelvis is level on average over a walk. Who really leans, or has
a shorter leg, tilts both lines alike; so the two are added, and neither is asked alone.

Axes: the project's (REP-103, z up). Angles are positive with the right side up.
"""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.findings.feet import Beside
from gaitval.findings.finding import Finding, Seen
from gaitval.mocap.recording import Recording

FRONT: Final = ("R.ASIS", "L.ASIS")
REAR: Final = ("R.PSIS", "L.PSIS")


def _level(
    beside: Beside, *, twist: float, both: float, share: float, alone: float
) -> Iterator[Seen]:
    """Degrees by which a line through two spines is tilted as only a misplaced marker tilts it."""
    front, rear = ([beside.landmarks.get(mark, "") for mark in pair] for pair in (FRONT, REAR))
    if not all(_shown(trial, front) for trial in (beside.standing, beside.walking)):
        return
    stood, walked = (_list_of(trial, front) for trial in (beside.standing, beside.walking))
    lists = {"stood": stood, "walked": walked}
    if _shown(beside.standing, rear):
        turned = stood - _list_of(beside.standing, rear)
        # a marker of the front line makes both
        if (
            turned * walked > 0.0
            and abs(walked) > share * abs(turned)
            and (abs(turned + walked) > both)
        ):
            yield _line(
                front, abs(turned + walked), both,
                f"is turned by {turned:+.1f}° against that of the rear spines in standing, and "
                f"lists by {walked:+.1f}° on average in walking (right side up is positive): one "
                "of the two is put on too high or too low, in all trials alike",
            )  # fmt: skip
        else:
            yield _line(
                rear, abs(turned), twist,
                f"is turned by {-turned:+.1f}° against that of {' and '.join(front)} in standing "
                "(right side up is positive; elsewhere within 4°): one of the four is put on too "
                "high or too low, most likely one of the rear ones, which are close together",
            )  # fmt: skip
    elif stood * walked > 0.0:
        yield _line(
            front, min(abs(stood), abs(walked)), alone,
            "lists by {stood:+.1f}° in standing and {walked:+.1f}° on average in walking (right "
            "side up is positive; at most 4° in healthy walking): one of them is put on too high "
            "or too low, or the person leans".format(**lists),
        )  # fmt: skip


def _line(names: Sequence[str], value: float, limit: float, seen: str) -> Seen:
    return Seen(value, " and ".join(names), {"seen": seen}, limits=(-np.inf, limit))


def _shown(trial: Recording, names: Sequence[str]) -> bool:
    return all(
        name in trial.names and bool(np.isfinite(trial.marker(name)).all(axis=1).any())
        for name in names
    )


def _list_of(trial: Recording, pair: Sequence[str]) -> float:
    """Degrees, mean over the trial of the angle of a pair's line (right less left) to the
    horizontal; 0 if they are never seen together.
    """
    line: Array = trial.marker(pair[0]) - trial.marker(pair[1])
    line = line[np.isfinite(line).all(axis=1)]
    if not len(line):
        return 0.0
    return float(np.degrees(np.arcsin(line[:, 2] / np.linalg.norm(line, axis=1)).mean()))


LEVEL: Final[Finding] = Finding(
    name="level of the pelvis",
    needs=Beside,
    values=_level,
    numbers={"twist": 7.0, "both": 7.5, "share": 0.3, "alone": 4.2},
    limits=7.0,
    unit="deg",
    sentence=(
        "the line through them {seen}. Tilt and list of the pelvis, and the hips' angles, are some "
        "degrees off"
    ),
    remedy="Look at them in standing",
    source=(
        "the front line against the rear one in standing: 2.0 (SD) of ten people, at most 3.9; its "
        "mean list in walking: 1.25 (SD) of 42 adults (Fukuchi 2018), at most 3.9. The rear spines "
        "are 70 to 90 mm apart: 10 mm at one turn their line by 7 degrees"
    ),
)
