"""Subjects of LocoHub's phase-indexed Parquet: 150 points of each gait cycle of many people.

Names, units and signs are those of LocoHub's `src/locohub/feature_constants.py` and
`docs/reference/biomechanical_standard.md` (repository jmontp/LocoHub, read in November 2026):
angles in rad; flexion, adduction, dorsiflexion, external rotation and eversion positive; moments in
Nm/kg or Nm, positive where they would increase their angle; forces in body weights or N on the
foot, forward, up and to the right; pelvis anterior tilt, right side up and right side forward
positive. A cycle begins with the strike of the foot that is `ipsi`.

The standard does not say which foot that is. gaitval's own export does (`ipsi_side` in task_info),
and so may other files; where none does, `ipsi` is read as right.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.interpolate import CubicSpline

from gaitval import file_gate
from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.errors import RecordError
from gaitval.plain_numbers import plain_float

if TYPE_CHECKING:
    import pandas as pd

POINTS: Final = 150
"""Of a cycle, both of its strikes among them."""
_NEEDED: Final = ("subject", "task", "step", "phase_ipsi")
_ANGLES: Final = {
    "hip_flexion": ("hip_flexion", 1.0),
    "hip_adduction": ("hip_adduction", 1.0),
    "hip_rotation": ("hip_rotation", -1.0),
    "knee_flexion": ("knee_angle", 1.0),
    "ankle_dorsiflexion": ("ankle_angle", 1.0),
    "ankle_eversion": ("subtalar_angle", -1.0),
}
"""Our name of each of their joint angles, and the sign: ours are positive for internal rotation and
inversion."""
_MOMENTS: Final = {name: _ANGLES[name] for name in list(_ANGLES)[:5]}
_PELVIS: Final = {
    "sagittal": ("pelvis_tilt", 1.0, 1.0),
    "frontal": ("pelvis_list", 1.0, -1.0),
    "transverse": ("pelvis_rotation", 1.0, -1.0),
}
"""Our name of each of their pelvis angles, and the signs of the right and the left side's curve,
which are positive for the own side up and forward."""
_FORCES: Final = (("anterior", 0, 1.0), ("lateral", 1, -1.0), ("vertical", 2, 1.0))
"""Their name of each of our axes (forward, left, up), and the sign."""
_SIDE_KEYS: Final = ("ipsi_side", "ipsi_leg", "leg_side", "leg", "side")
_SPEED_KEYS: Final = ("speed_m_s", "walking_speed_m_s")
SAME_SPEED: Final = 0.06
"""m/s. Cycles whose speeds lie closer to each other are of one setting: over ground every cycle has
a speed of its own."""
LARGEST: Final = 1e6
"""Of any column, whose units are rad, rad/s, m, N and Nm, and those per kg: far beyond a gait."""
_LOADED: Final = 0.05
"""Body weights from which on a foot is on the ground."""


@dataclass(frozen=True)
class LocoHubTrial:
    """The cycles of one person in one task at one setting.

    Attributes
    ----------
    source : the file, for messages.
    subject, task, task_id : as in the file.
    info : values of task_info, less the foot; texts.
    about : values of subject_metadata; texts.
    cycles : of each foot that begins some, its columns (n, 150), as in the file.
    sides_given : whether the file says which foot a cycle begins with.
    """

    source: str
    subject: str
    task: str
    task_id: str
    info: Mapping[str, str]
    about: Mapping[str, str]
    cycles: Mapping[Side, Mapping[str, Array]]
    sides_given: bool

    @property
    def count(self) -> int:
        """Number of cycles."""
        return sum(len(next(iter(each.values()))) for each in self.cycles.values())

    def value(self, *keys: str) -> float | None:
        """A number of subject_metadata or task_info by the first of `keys` that is there."""
        return _number(keys, self.about, self.info)

    def curves(self, mass: float | None = None) -> dict[str, Array]:
        """Mean curves (150,) over each side's own cycle, in the convention of `GaitRecord`, by kind
        and coordinate: `angle_knee_angle_r` rad, `moment_knee_angle_r` Nm/kg, `force_up_r` body
        weights. What the file lacks is not there. A side without cycles of its own has the other's,
        from its own strike on. `mass` kg is needed where moments are in Nm or forces in N:
        RecordError without it.
        """
        found: dict[str, Array] = {}
        for side in SIDES:
            own = side in self.cycles
            columns = self.cycles[side if own else opposite(side)]
            leg = "ipsi" if own else "contra"
            shift = 0.0 if own else _strike(columns, leg)
            for name, values in self._of_side(columns, leg, side, mass).items():
                found[name] = values if own else _rolled(values, shift)
        return found

    def _of_side(
        self, columns: Mapping[str, Array], leg: str, side: Side, mass: float | None
    ) -> dict[str, Array]:
        found: dict[str, Array] = {}
        for theirs, (ours, sign) in _ANGLES.items():
            if (values := columns.get(f"{theirs}_angle_{leg}_rad")) is not None:
                found[f"angle_{ours}_{side[0]}"] = sign * values.mean(axis=0)
        for plane, (ours, *signs) in _PELVIS.items():
            if (values := columns.get(f"pelvis_{plane}_angle_rad")) is not None:
                found[f"angle_{ours}_{side[0]}"] = signs[SIDES.index(side)] * values.mean(axis=0)
        for theirs, (ours, sign) in _MOMENTS.items():
            values = self._per(columns, f"{theirs}_moment_{leg}", "Nm_kg", "Nm", mass, 1.0)
            if values is not None:
                found[f"moment_{ours}_{side[0]}"] = sign * values
        for theirs, axis, sign in _FORCES:
            name = ("forward", "left", "up")[axis]
            values = self._per(columns, f"grf_{theirs}_{leg}", "BW", "N", mass, GRAVITY)
            if values is not None:
                found[f"force_{name}_{side[0]}"] = sign * values
        return found

    def _per(
        self, columns: Mapping[str, Array], name: str, per: str, raw: str,
        mass: float | None, gravity: float,
    ) -> Array | None:  # fmt: skip
        """Mean of a quantity per mass or weight, from the column that has it so, or not."""
        if (values := columns.get(f"{name}_{per}")) is not None:
            return np.asarray(values.mean(axis=0))
        if (values := columns.get(f"{name}_{raw}")) is None:
            return None
        if mass is None:
            raise RecordError(
                f"{self.source}: {self.subject}: {name}_{raw} is not divided by the body's mass, "
                "and subject_metadata has no weight_kg. Give the mass with --mass."
            )
        return np.asarray(values.mean(axis=0) / (mass * gravity))

    def stride_time(self) -> float | None:
        """Mean stride time, s: said in task_info, or that by which angular velocities are the
        angles' rates; None if the file shows neither.
        """
        if (given := self.value("stride_time_s", "stride_duration_s")) is not None:
            return given
        phase = np.linspace(0.0, 1.0, POINTS)
        product, square = 0.0, 0.0
        for columns in self.cycles.values():
            for joint in ("hip_flexion", "knee_flexion"):
                angle = columns.get(f"{joint}_angle_ipsi_rad")
                rate = columns.get(f"{joint}_velocity_ipsi_rad_s")
                if angle is not None and rate is not None and len(angle) == len(rate):
                    slope = CubicSpline(phase, angle, axis=1)(phase, 1)
                    product += float(np.sum(slope * rate))
                    square += float(np.sum(rate * rate))
        if product > 0.0 and square > 0.0:
            return product / square
        return None


def _strike(columns: Mapping[str, Array], leg: str) -> float:
    """Phase at which a foot strikes the ground in the other's cycle: from its vertical force, else
    half a cycle, which is LocoHub's own rule.
    """
    for unit, loaded in (("BW", _LOADED), ("N", _LOADED * 700.0)):
        values = columns.get(f"grf_vertical_{leg}_{unit}")
        if values is None:
            continue
        up = values.mean(axis=0) > loaded
        begins = [i for i in range(POINTS // 4, 3 * POINTS // 4) if up[i] and not up[i - 1]]
        if len(begins) == 1:
            return begins[0] / (POINTS - 1)
    return 0.5


def _rolled(values: Array, shift: float) -> Array:
    """A periodic curve (150,) from a phase on."""
    whole = values.copy()
    whole[-1] = whole[0] = (values[0] + values[-1]) / 2.0
    phase = np.linspace(0.0, 1.0, POINTS)
    return np.asarray(CubicSpline(phase, whole, bc_type="periodic")((phase + shift) % 1.0))


def resampled(values: Array, samples: int) -> Array:
    """A curve (150,) at so many samples from one strike to the next."""
    phase = np.linspace(0.0, 1.0, POINTS)
    return np.asarray(CubicSpline(phase, values)(np.linspace(0.0, 1.0, samples)))


def read_locohub_trials(path: Path, task: str = "level_walking") -> list[LocoHubTrial]:
    """Read a `task`, by LocoHub's name, of every person of a phase-indexed file (`path`,
    `DATASET_phase.parquet`). Trials are in the order of the file. A column that is nowhere filled
    in a trial is left out, and so are cycles in which one that is filled has gaps.

    Raises RecordError if the file is no Parquet file, lacks LocoHub's columns or the task, or a
    cycle has other than 150 points from 0 to 100 %.
    """
    import pandas as pd

    path = Path(path)
    try:
        file_gate.parquet_rows(path, RecordError, largest=file_gate.TABLE)
        frame = pd.read_parquet(path)
    except RecordError:
        raise
    except Exception as error:  # pyarrow's errors have no common class
        raise RecordError(
            f"{path}: cannot be read as Parquet ({_short(error)}). It is damaged, or another "
            "file: give a phase-indexed one of LocoHub (DATASET_phase.parquet)."
        ) from None
    frame.columns = [_present_name(str(name)) for name in frame.columns]
    twice = sorted({name for name in frame.columns if list(frame.columns).count(name) > 1})
    missing = [name for name in _NEEDED if name not in frame.columns]
    if missing or twice:
        wrong = f"{', '.join(missing)} missing" if missing else f"{', '.join(twice)} more than once"
        raise RecordError(
            f"{path}: columns: {wrong}, so it is not LocoHub's phase-indexed format. Give a file "
            "of the name DATASET_phase.parquet."
        )
    tasks = sorted(map(str, frame["task"].unique()))
    frame = frame[frame["task"].astype(str) == task].reset_index(drop=True)
    if frame.empty:
        raise RecordError(
            f"{path}: no cycle of the task {task}; there are {', '.join(tasks) or 'none'}. Give "
            "one of them with --task; subjects are made of walking on level ground."
        )
    for name in ("task_id", "task_info", "subject_metadata"):
        if name not in frame.columns:
            frame[name] = ""
    try:
        return _trials(path, task, frame)
    except (TypeError, ValueError, KeyError) as error:
        raise RecordError(
            f"{path}: its columns hold other things than LocoHub's ({_short(error)}). Export the "
            "data set again."
        ) from None


def _short(error: Exception) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__


def _present_name(name: str) -> str:
    """A column's name as LocoHub has it now: earlier files have `vertical_grf_ipsi_BW`."""
    for axis, _, _ in _FORCES:
        if name.startswith(f"{axis}_grf_"):
            return f"grf_{axis}_{name.removeprefix(f'{axis}_grf_')}"
    return name


def _trials(path: Path, task: str, frame: "pd.DataFrame") -> list[LocoHubTrial]:
    info = {text: _pairs(text) for text in map(str, frame["task_info"].unique())}
    setting = {text: _without(pairs, (*_SIDE_KEYS, *_SPEED_KEYS)) for text, pairs in info.items()}
    speeds = {text: _number(_SPEED_KEYS, pairs) for text, pairs in info.items()}
    texts = frame["task_info"].astype(str)
    keys = [
        frame["subject"].astype(str),
        frame["task_id"].astype(str),
        texts.map(lambda text: str(sorted(setting[text].items()))),
    ]
    found = []
    for (subject, task_id, _), group in frame.groupby(keys, sort=False):
        for several in _by_speed(speeds, list(texts[group.index].unique())):
            part = group[texts[group.index].isin(several)]
            cycles: dict[Side, Mapping[str, Array]] = {}
            for side in SIDES:
                started = [each for each in several if (_side_of(info[each]) or "right") == side]
                if started:
                    own = part[texts[part.index].isin(started)]
                    cycles[side] = _cycles(path, str(subject), own)
            about = dict(setting[several[0]])
            if speeds[several[0]] is not None:
                mean = texts[part.index].map(speeds).mean()
                about[_SPEED_KEYS[0]] = repr(float(mean))
            found.append(
                LocoHubTrial(
                    source=str(path), subject=str(subject), task=task, task_id=str(task_id),
                    info=about, about=_pairs(str(part.iloc[0]["subject_metadata"])), cycles=cycles,
                    sides_given=all(_side_of(info[each]) is not None for each in several),
                )
            )  # fmt: skip
    return found


def _number(keys: Sequence[str], *tables: Mapping[str, str]) -> float | None:
    """The first finite number in `tables` by the first of `keys` that has one."""
    for key in keys:
        for values in tables:
            try:
                number = plain_float(values.get(key, ""))
            except ValueError:
                continue
            if np.isfinite(number):
                return number
    return None


def _by_speed(speeds: Mapping[str, float | None], texts: Sequence[str]) -> list[list[str]]:
    """Texts of task_info, those of one speed together; those without a speed are of one."""
    unknown = [text for text in texts if speeds[text] is None]
    groups = [unknown] if unknown else []
    last = -np.inf
    for speed, text in sorted((speeds[text] or 0.0, text) for text in texts if text not in unknown):
        if speed - last > SAME_SPEED:
            groups.append([])
        groups[-1].append(text)
        last = speed
    return groups


def _pairs(text: str) -> dict[str, str]:
    """`key:value,key:value` as LocoHub writes it."""
    parts = (part.partition(":") for part in text.split(","))
    return {key.strip(): value.strip() for key, colon, value in parts if colon}


def _side_of(info: Mapping[str, str]) -> Side | None:
    for key in _SIDE_KEYS:
        value = info.get(key, "").lower()[:1]
        if value in ("r", "l"):
            return "right" if value == "r" else "left"
    return None


def _without(info: Mapping[str, str], keys: Sequence[str]) -> dict[str, str]:
    return {key: value for key, value in info.items() if key not in keys}


def _cycles(path: Path, subject: str, group: "pd.DataFrame") -> dict[str, Array]:
    """Columns (n, 150) of the whole cycles of a person."""
    # A number may come again, in another trial or of the other foot: phases begin anew as well.
    step, phase = group["step"].to_numpy(), group["phase_ipsi"].to_numpy(dtype=float)
    begins = np.flatnonzero(np.r_[True, (step[1:] != step[:-1]) | (np.diff(phase) < 0.0)])
    sizes = np.diff(np.r_[begins, len(group)])
    if (sizes != POINTS).any():
        raise RecordError(
            f"{path}: {subject}: a cycle has {int(sizes[sizes != POINTS][0])} points, but a cycle "
            f"of LocoHub has {POINTS}. Give the phase-indexed file, not the one over time."
        )
    columns = {
        str(name): group[name].to_numpy(dtype=float).reshape(-1, POINTS)
        for name in group.select_dtypes("number").columns
        if name != "step"
    }
    columns.pop("phase_ipsi", None)
    even = np.tile(np.linspace(0.0, 100.0, POINTS), len(sizes))
    if not np.abs(phase - even).max() < 0.5:
        raise RecordError(
            f"{path}: {subject}: phase_ipsi of a cycle does not go evenly from 0 to 100 % "
            f"(there are {np.nanmin(phase):g} to {np.nanmax(phase):g}), so its points have no "
            "place in the cycle. Export the data set again."
        )
    filled = {name: values for name, values in columns.items() if np.isfinite(values).any()}
    whole = np.all([np.isfinite(values).all(axis=1) for values in filled.values()], axis=0)
    if not filled or not np.any(whole):
        raise RecordError(
            f"{path}: {subject}: none of {len(sizes)} cycles is without gaps in the {len(filled)} "
            "columns that have numbers. Leave the columns with gaps out of the file."
        )
    found = {name: values[whole] for name, values in filled.items()}
    for name, values in found.items():
        if (largest := np.abs(values).max()) > LARGEST:
            raise RecordError(
                f"{path}: {subject}: {name} goes up to {largest:.3g}, which nothing in a gait "
                "does. Export the data set again."
            )
    return found


def grouped(trials: Sequence[LocoHubTrial]) -> dict[str, list[LocoHubTrial]]:
    """Trials by person, that with the most cycles first."""
    found: dict[str, list[LocoHubTrial]] = {}
    for trial in trials:
        found.setdefault(trial.subject, []).append(trial)
    return {name: sorted(each, key=lambda one: -one.count) for name, each in found.items()}
