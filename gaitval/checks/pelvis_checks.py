"""Whether the markers of the pelvis are where they were put, by the level of the pelvis.

A spine's marker that is put too high or too low leaves the distances between the four nearly as
they are. It tilts the line through its pair: beside the other pair's line, and, of the front pair,
beside the horizontal, on which the pelvis is level on average over a walk. Who really leans, or has
a shorter leg, tilts both lines alike; so the two are added, and neither is asked alone.

Axes: the project's (REP-103, z up). Angles are positive with the right side up.
"""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording

TWIST: Final = 7.0
"""Degrees, of the front line against the rear one in standing: 2.0 (SD) of the ten built-in people,
at most 3.9. The rear spines are 70 to 90 mm apart, the front ones 250: 10 mm at one rear spine turn
its line by 7°."""
TWIST_AND_LIST: Final = 7.5
"""Degrees, of that and the mean list of the front line in walking. Their SD are 2.0 and 1.25 (the
latter of 42 adults, Fukuchi 2018, at most 3.9): 3.2 SD."""
LISTS: Final = 0.3
"""Of the twist, from which on a list is that of a marker of the front line, which makes both."""
LIST_IN_BOTH: Final = 4.2
"""Degrees, that the front line lists in standing and in walking, to the same side, where no marker
shows the rear line: 3.3 SD of the list in walking alone."""
LIST_AND_CHANGE: Final = 8.0
"""Degrees, of the front line's list in walking and what it is more than in standing: a marker that
was put on anew between them makes both, and somebody who stands on one leg neither in walking."""
SACRAL_SIDES: Final = 0.015
"""m, by which the front spines' distances to the sacrum's marker differ: at most 4 mm of twelve
children (McGill), 12.5 mm of one adult."""
FRONT: Final = ("R.ASIS", "L.ASIS")
REAR: Final = ("R.PSIS", "L.PSIS")


def pelvis_level_warnings(
    standing: Recording, walking: Recording, landmarks: Mapping[str, str]
) -> Iterator[QualityFlag]:
    """A warning about a marker of the pelvis that is too high or too low, in both trials or in one
    of them; and one about spines that are unlike far from the sacrum's marker. `landmarks` names
    the landmarks' markers.
    """
    front, rear = ([landmarks.get(mark, "") for mark in pair] for pair in (FRONT, REAR))
    if not all(_shown(trial, front) for trial in (standing, walking)):
        return
    stood, walked = (_list_of(trial, front) for trial in (standing, walking))
    if _shown(standing, rear):
        twist = stood - _list_of(standing, rear)
        yield from _against_rear(front, rear, twist, walked)
    elif stood * walked > 0.0 and min(abs(stood), abs(walked)) > LIST_IN_BOTH:
        yield _level(
            front, min(abs(stood), abs(walked)), LIST_IN_BOTH,
            f"the line through them lists by {stood:+.1f}° in standing and {walked:+.1f}° on "
            "average in walking (right side up is positive; at most 4° in healthy walking): one of "
            "them is put on too high or too low, or the person leans",
        )  # fmt: skip
    change = walked - stood
    if walked * change > 0.0 and abs(walked + change) > LIST_AND_CHANGE:
        yield _level(
            front, abs(walked + change), LIST_AND_CHANGE,
            f"the line through them lists by {stood:+.1f}° in standing and by {walked:+.1f}° on "
            "average in walking (right side up is positive): one of them was moved between the "
            "trials, or the person stands on one leg",
        )  # fmt: skip
    sacrum = landmarks.get("Sacrum", "")
    if _shown(standing, [sacrum]):
        away = [standing.marker(name) - standing.marker(sacrum) for name in front]
        sides = [float(np.nanmedian(np.linalg.norm(each, axis=1))) for each in away]
        if abs(sides[0] - sides[1]) > SACRAL_SIDES:
            yield QualityFlag(
                "sides that differ", f"{', '.join(front)} to {sacrum}", abs(sides[0] - sides[1]),
                SACRAL_SIDES, "m",
                f"{1000 * sides[0]:.0f} mm on the right and {1000 * sides[1]:.0f} mm on the left: "
                "one of the three markers is misplaced, in all trials alike, or the pelvis is "
                "uneven. Look at them in standing; hip centres, and list and rotation of the "
                "pelvis, are off with it",
            )  # fmt: skip


def _against_rear(
    front: list[str], rear: list[str], twist: float, walked: float
) -> Iterator[QualityFlag]:
    """The front line beside the rear one, in standing (`twist`), and its list in walking."""
    both = twist * walked > 0.0 and abs(walked) > LISTS * abs(twist)
    if both and abs(twist + walked) > TWIST_AND_LIST:
        yield _level(
            front, abs(twist + walked), TWIST_AND_LIST,
            f"the line through them is turned by {twist:+.1f}° against that of the rear spines in "
            f"standing, and lists by {walked:+.1f}° on average in walking (right side up is "
            "positive): one of the two is put on too high or too low, in all trials alike",
        )  # fmt: skip
    elif abs(twist) > TWIST:
        yield _level(
            rear, abs(twist), TWIST,
            f"the line through them is turned by {-twist:+.1f}° against that of "
            f"{' and '.join(front)} in standing (right side up is positive; elsewhere within 4°): "
            "one of the four is put on too high or too low, most likely one of the rear ones, "
            "which are close together",
        )  # fmt: skip


def _level(names: list[str], value: float, limit: float, seen: str) -> QualityFlag:
    return QualityFlag(
        "level of the pelvis", " and ".join(names), value, limit, "deg",
        f"{seen}. Look at them in standing; tilt and list of the pelvis, and the hips' angles, are "
        "some degrees off",
    )  # fmt: skip


def _shown(trial: Recording, names: list[str]) -> bool:
    return all(
        name in trial.names and bool(np.isfinite(trial.marker(name)).all(axis=1).any())
        for name in names
    )


def _list_of(trial: Recording, pair: list[str]) -> float:
    """Degrees, mean over the trial of the angle of a pair's line (right less left) to the
    horizontal; 0 if they are never seen together.
    """
    line: Array = trial.marker(pair[0]) - trial.marker(pair[1])
    line = line[np.isfinite(line).all(axis=1)]
    if not len(line):
        return 0.0
    return float(np.degrees(np.arcsin(line[:, 2] / np.linalg.norm(line, axis=1)).mean()))
