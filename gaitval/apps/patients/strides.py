"""One stride a side of many people, with the nine angles of the Gait Profile Score.

A CSV table with a row for each angle of each stride: columns `group`, `subject`, `trial`, `side`
(L, R), `angle`, and `p0` to `p100`, the angle at each percent of that side's own cycle, in degrees.
Angles have the names of `gait.record.GaitRecord`, or those of Visual3D with the number of an axis:
`hip_2`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.io.text_tables import MISSING
from gaitval._internal.text.plain_numbers import plain_float
from gaitval.apps.patients.one_stride import STRIKE_PRIOR, left_strike, smoothed
from gaitval.arrays import Array
from gaitval.datasets.curve_consistency import judge_curves
from gaitval.errors import RecordError
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.gait.sampling import SAMPLES

AXES: Final[Mapping[str, str]] = {
    "pelvis_1": "pelvis_list",
    "pelvis_2": "pelvis_tilt",
    "pelvis_3": "pelvis_rotation",
    "hip_1": "hip_adduction",
    "hip_2": "hip_flexion",
    "hip_3": "hip_rotation",
    "knee_2": "knee_angle",
    "ankle_2": "ankle_angle",
    "foot_3": "foot_progression",
}
"""Names by the number of Visual3D's axis; the signs are the project's (`turned` looks)."""


class SignLimits(NamedTuple):
    """From which on a sign is wrong and not somebody's gait.

    Attributes
    ----------
    nearer : how many times nearer to healthy people's both sides of all people together must be
        with the sign changed, as of one person in `gaitval.identification.unusual`; so much nearer
        must one side be to the other with its sign changed, too.
    few : people of whom a sign that is wrong by their shape is refused. Of 104 people, five alone
        are nearer to healthy people with a sign changed (a pelvis that tilts back, hips that turn
        in), and of 400 drawn threes of each group none.
    some : people of whom a sign that is wrong on one side is refused. Of 400 drawn twenties of
        healthy people or of people with Parkinson's disease none has sides so unequal; of 400 tens
        13 have.
    one_pelvis : deg, median of all people: by more than this right and left do not differ about
        one pelvis. 104 people have a median of 0.7 and a maximum of 1.65; with left list, rotation
        or both turned the median is 3.7, 6.1 and 5.8.
    """

    nearer: float
    few: int
    some: int
    one_pelvis: float


LIMITS: Final = SignLimits(nearer=1.6, few=3, some=20, one_pelvis=2.0)

SIDED: Final = ("hip_adduction", "hip_rotation", "foot_progression")
"""Angles whose sign may be wrong on one side without two pelves that differ."""

NOBODY: Final = ("hip_flexion", "knee_angle")
"""Angles that not even one person has with the sign changed."""

POSITIVE: Final = (
    "Flexion, adduction, internal rotation, anterior tilt, own side up and own side forward, and "
    "toes towards the midline are positive"
)
"""What is positive, for messages."""

_HEADER: Final = ("group", "subject", "trial", "side", "angle")
_PERCENT: Final = tuple(f"p{each}" for each in range(SAMPLES))


@dataclass(frozen=True)
class PersonStrides:
    """A person's stride of each side.

    Attributes
    ----------
    group : of people, such as "control".
    subject : name in the table.
    trials : by side "r", "l": the trial that the stride is of.
    angles : (101,) deg, by name with `_r` or `_l`; signs of `GaitRecord`.
    """

    group: str
    subject: str
    trials: Mapping[str, str]
    angles: Mapping[str, Array]


def read_strides(path: Path) -> tuple[PersonStrides, ...]:
    """All people of a table `path`, in its order. Raises RecordError if it is no such table, an
    angle of a person is missing, is there twice or is not a number, or an angle has its sign
    changed in all people, on both sides or on one. Of fewer than `LIMITS.few` people it may be
    their gait, which `turned` says. Lists up to ten problems.
    """
    rows: dict[tuple[str, str], dict[str, Array]] = {}
    trials: dict[tuple[str, str], dict[str, str]] = {}
    problems: list[str] = []
    for line, cells in file_gate.csv_rows(path, RecordError):
        missing = [name for name in (*_HEADER, *_PERCENT) if cells.get(name) is None]
        if missing:
            raise RecordError(
                f"{path}, line {line}: no {missing[0]}. A table of strides has the columns "
                f"{', '.join(_HEADER)}, p0 to p100, and a row for each angle of each side."
            )
        who = cells["group"].strip(), cells["subject"].strip()
        side, angle = cells["side"].strip().lower()[:1], cells["angle"].strip()
        name = f"{AXES.get(angle, angle)}_{side}"
        if side not in ("r", "l") or name[:-2] not in PROFILE_ANGLES:
            problems.append(
                f"line {line}: {angle} of side {cells['side']!r} is not one of "
                f"{', '.join(AXES)} of side L or R"
            )
            continue
        try:
            values = np.array([plain_float(cells[each]) for each in _PERCENT])
        except ValueError:
            values = np.full(SAMPLES, np.nan)
        if not np.isfinite(values).all():
            problems.append(f"line {line}: {name} of {who[1]} has a value that is not a number")
        elif (filled := values[np.isin(np.abs(values), MISSING)]).size:
            problems.append(
                f"line {line}: {name} of {who[1]} has {filled[0]:g}, which stands for a value "
                "that is missing"
            )
        if name in rows.setdefault(who, {}):
            problems.append(f"line {line}: {name} of {who[1]} is there twice; keep one stride")
        rows[who][name] = values
        trials.setdefault(who, {})[side] = cells["trial"].strip()
    wanted = [f"{name}_{side}" for name in PROFILE_ANGLES for side in "rl"]
    for (_, subject), found in rows.items():
        lacking = [name for name in wanted if name not in found]
        if lacking:
            problems.append(f"{subject}: no {', '.join(lacking)}. A side is not made of the other")
    people = tuple(
        PersonStrides(group, subject, trials[group, subject], found)
        for (group, subject), found in rows.items()
    )
    if not problems:
        problems = [
            f"{name}: nearer to healthy people's with its sign changed, in all people together. "
            f"{POSITIVE}"
            for name in turned(people)
            if len(people) >= LIMITS.few or name in NOBODY
        ]
        problems += [
            f"{name}: right is nearer to left with the sign of one side changed, in all people "
            f"together. {POSITIVE}, on both sides"
            for name in one_side_turned(people)
        ]
    if not problems:
        problems = [problem for each in people for problem in _causes(each)]
    if not problems and people and (apart := pelves_apart(people)) > LIMITS.one_pelvis:
        problems = [
            f"pelvis: right and left differ by {apart:.1f}° (median of all people) however they "
            "are shifted, which is impossible for one pelvis. Own side up and own side forward are "
            "positive on both sides: change the sign of list and rotation of one side, and look at "
            "its hip adduction, hip rotation and foot progression"
        ]
    if problems or not people:
        shown = problems[:10] or ["no stride in it"]
        more = [f"… and {len(problems) - 10} more"] if len(problems) > 10 else []
        lines = "\n".join(f"  - {each}" for each in [*shown, *more])
        raise RecordError(f"{path}: cannot be used\n{lines}")
    return people


def _causes(person: PersonStrides) -> list[str]:
    """A sentence on what is certainly wrong with a person's strides: a sign, a unit, the cycle."""
    judged = judge_curves({f"angle_{name}": values for name, values in person.angles.items()})
    if not judged.refused:
        return []
    words = judged.words.replace("Give --angle-unit rad", "Multiply by 180/pi")
    return [f"{person.subject}: {words.replace(' angle_', ' ')}"]


def pelves_apart(people: tuple[PersonStrides, ...]) -> float:
    """By how much right and left of `people` differ about the one pelvis, deg, RMS, median."""
    found = []
    for each in people:
        curves = {
            name: smoothed(np.radians(values)).curve.periodic()
            for name, values in each.angles.items()
            if name.startswith("pelvis")
        }
        found.append(left_strike(curves, STRIKE_PRIOR).mismatch)
    return float(np.degrees(np.median(found)))


def one_side_turned(people: tuple[PersonStrides, ...]) -> list[str]:
    """Angles of `SIDED` of which the means of right and left have opposite signs.

    None of fewer than `LIMITS.some` people, who may really be so unequal.
    """
    found = []
    for name in SIDED if len(people) >= LIMITS.some else ():
        right, left = (
            np.mean([each.angles[f"{name}_{side}"] for each in people], axis=0) for side in "rl"
        )
        if np.linalg.norm(right - left) > LIMITS.nearer * np.linalg.norm(right + left):
            found.append(name)
    return found


def turned(people: tuple[PersonStrides, ...]) -> list[str]:
    """Angles whose sign is wrong by the shape of all `people` and both sides together.

    The distance from healthy people's mean curve is compared with that of the curve with its sign
    changed. One patient may walk like that; all of them do not.
    """
    controls = load_controls().curves
    found = []
    for name in PROFILE_ANGLES if people else ():
        own = np.array([each.angles[f"{name}_{side}"] for each in people for side in "rl"])
        far, near = (np.sum((sign * own - controls[name]) ** 2) for sign in (1.0, -1.0))
        if np.sqrt(far / near) > LIMITS.nearer:
            found.append(name)
    return found
