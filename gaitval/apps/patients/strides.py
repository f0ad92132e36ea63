"""One stride a side of many people, with the nine angles of the Gait Profile Score.

A CSV table with a row for each angle of each stride: columns `group`, `subject`, `trial`, `side`
(L, R), `angle`, and `p0` to `p100`, the angle at each percent of that side's own cycle, in degrees.
Angles have the names of `gait.record.GaitRecord`, or those of Visual3D with the number of an axis:
`hip_2`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.io.text_tables import MISSING
from gaitval._internal.text.plain_numbers import plain_float
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.gait.healthy_controls import PROFILE_ANGLES
from gaitval.gait.sampling import SAMPLES
from gaitval.subjects.curve_consistency import Judged, judge_curves

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
"""Names by the number of Visual3D's axis; the signs are the project's (`doubts` looks)."""


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
    angle of a person is missing, is there twice or is not a number, or somebody's curves are
    certainly no walker's. Lists up to ten problems.
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
        if not np.isfinite(values).all() or np.isin(np.abs(values), MISSING).any():
            problems.append(f"line {line}: {name} of {who[1]} has a value that is missing")
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
            f"{each.subject}: {judged.words}"
            for each in people
            if (judged := _judged(each.angles)).refused
        ]
    if problems or not people:
        shown = problems[:10] or ["no stride in it"]
        more = [f"… and {len(problems) - 10} more"] if len(problems) > 10 else []
        lines = "\n".join(f"  - {each}" for each in [*shown, *more])
        raise RecordError(f"{path}: cannot be used\n{lines}")
    return people


def doubts(people: Sequence[PersonStrides]) -> list[str]:
    """Sentences on what may be wrong with the mean curves of all `people`, who make the same
    mistake where a program made it, and walk each in his own way.
    """
    mean = {
        name: np.mean([each.angles[name] for each in people], axis=0) for name in people[0].angles
    }
    judged = _judged(mean)
    return [f"the mean of all people: {words}" for words in (judged.words, judged.unseen) if words]


def _judged(angles: Mapping[str, Array]) -> Judged:
    return judge_curves({f"angle_{name}": values for name, values in angles.items()})
