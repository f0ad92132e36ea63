"""What a folder holds of WBDS, as published or in part, and subjects of all that can be used.

The archive (figshare 10.6084/m9.figshare.5722711, `gaitval data fetch wbds`) has for each of 42
people a standing trial (`WBDS03static1.c3d`, `.txt`) and for each trial (`T01` to `T08` on the
treadmill, `O…` overground) `WBDS03walkT05.c3d`, markers `…mkr.txt`, forces `…grf.txt`, mean angles
`…ang.txt` and mean moments `…knt.txt`; and one table, `WBDSinfo.xlsx` (or saved as CSV: Subject,
FileName, Age, Height in cm, Mass, Gender, LegLength in m, GaitSpeed(m/s), '--' where there is
none). Files may lie in any folder below the given one. Tables of the project's developers are used
where they are there (`wbds.read_trial`), because they have corrected speeds.
"""

import re
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from gaitval import file_gate
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.datasets.subject import MARKERS, Subject
from gaitval.datasets.wbds import subject_of_curves
from gaitval.datasets.wbds_files import (
    read_static_markers,
    table_rows,
)
from gaitval.errors import GaitvalError, RecordError
from gaitval.mocap.mot import read_ground_reaction
from gaitval.mocap.reading import read_recording
from gaitval.mocap.wbds_text import read_wbds_forces
from gaitval.plain_numbers import plain_float

PEOPLE: Final = tuple(f"WBDS{number:02d}" for number in range(1, 43))
TREADMILL: Final = tuple(f"T{number:02d}" for number in range(1, 9))

_WALK: Final = re.compile(
    r"(WBDS\d\d)walk([TO]\w{1,3}?)(ang|knt|mkr|grf|_grf)?\.(txt|c3d|mot)", re.IGNORECASE
)
_STATIC: Final = re.compile(r"(WBDS\d\d)static\d(?:mkr)?\.(c3d|trc|txt)", re.IGNORECASE)
_TABLES: Final = {
    "stride_times.csv": "strides",
    "h2a_allspeeds_43subs.csv": "speeds",
    "WBDS_subjects_merged.csv": "people",
    "static_markers_10subjects.csv": "markers",
    "WBDSinfo.csv": "info",
    "WBDSinfo.xlsx": "info",
}
_KINDS: Final = {"ang": "angles", "knt": "kinetics", "mkr": "markers", "grf": "forces",
                 "_grf": "forces"}  # fmt: skip

_STRIKES: Final = 4
"""Fewest heel strikes for a stride time."""


@dataclass(frozen=True)
class Holdings:
    """The files of WBDS in a folder.

    Attributes
    ----------
    trials : by person and trial, the files by kind: angles, kinetics, markers, forces, c3d.
    standing : the standing trial of each person.
    tables : tables of people, speeds and stride times, by what they are of.
    """

    folder: Path
    trials: Mapping[tuple[str, str], Mapping[str, Path]]
    standing: Mapping[str, Path]
    tables: Mapping[str, Path]
    _read: dict[str, list[dict[str, str]]] = field(default_factory=dict)

    def rows(self, table: str) -> list[dict[str, str]]:
        """Rows of a table by the names of its columns; none if it is not there."""
        if table not in self.tables:
            return []
        if table not in self._read:
            self._read[table] = _rows(self.tables[table])
        return self._read[table]

    def missing(self, person: str, trial: str) -> list[str]:
        """What is not there of a treadmill trial to make a subject of its mean curves."""
        files = self.trials.get((person, trial), {})
        lacking = [f"{kind}.txt" for kind in ("ang", "knt") if _KINDS[kind] not in files]
        if lacking:
            return lacking
        checks: dict[str, Callable[[], Any]] = {
            "sex, mass, height and leg length (WBDSinfo)": lambda: person_values(self, person),
            "speed and stride time": lambda: trial_values(self, person, trial),
            "standing trial": lambda: standing_markers(self, person),
        }
        return [what for what, check in checks.items() if not _can(check)]


def _can(check: Callable[[], Any]) -> bool:
    try:
        check()
    except GaitvalError:
        return False
    return True


def _rows(path: Path) -> list[dict[str, str]]:
    if path.suffix != ".xlsx":
        return table_rows(path, ())
    try:
        file_gate.passed(path, RecordError, largest=file_gate.VALUES)
        with zipfile.ZipFile(path) as members:
            sizes = (each.file_size for each in members.infolist())
            file_gate.check_unpacked(sizes, path, RecordError)
        table = pd.read_excel(path, dtype=str)
    except RecordError:
        raise
    except ImportError:
        raise RecordError(
            f"{path}: an Excel file, and openpyxl is not installed here. Install it (python -m pip "
            "install openpyxl), or save the table as WBDSinfo.csv beside it."
        ) from None
    except Exception as error:  # openpyxl raises whatever its parsing hits first
        raise RecordError(f"{path}: cannot be read ({error!r}). Download it again.") from None
    return [{str(key): str(each) for key, each in row.items()} for row in table.to_dict("records")]


def holdings(folder: Path) -> Holdings:
    """The files of WBDS in `folder` and all below it. Raises RecordError if there are none."""
    folder = Path(folder)
    if not folder.is_dir():
        raise RecordError(f"{folder}: no such folder. Give the one with the files of WBDS.")
    trials: dict[tuple[str, str], dict[str, Path]] = {}
    standing: dict[str, Path] = {}
    tables: dict[str, Path] = {}
    for path in sorted(folder.rglob("*")):
        if walk := _WALK.fullmatch(path.name):
            ending = (walk[3] or "").lower()
            kind = "c3d" if walk[4].lower() == "c3d" else _KINDS.get(ending, "")
            if kind:
                trials.setdefault((walk[1].upper(), walk[2]), {})[kind] = path
        elif stood := _STATIC.fullmatch(path.name):
            # C3D comes first by name; it has the unit inside.
            standing.setdefault(stood[1].upper(), path)
        elif path.name in _TABLES:
            tables.setdefault(_TABLES[path.name], path)
    if not trials:
        raise RecordError(
            f"{folder}: no trial of WBDS here or below (WBDS01walkT05ang.txt, …). Give the folder "
            "of the files, or fetch them: `gaitval data fetch wbds`."
        )
    return Holdings(folder, trials, standing, tables)


def person_values(data: Holdings, person: str) -> dict[str, Any]:
    """Sex, age, mass (kg), height and leg length (m) of a `person`, by the names of `Subject`.
    Raises RecordError if no table of `data` has them.
    """
    number = str(int(person.removeprefix("WBDS")))
    for table, leg, metres in (("people", "LegLen", 1.0), ("info", "LegLength", 0.01)):
        for row in data.rows(table):
            if row.get("Subject", "").partition(".")[0] != number:
                continue
            values = [_number(row, each) for each in ("Age", "Mass", "Height", leg)]
            if None in values[1:] or row.get("Gender") not in ("F", "M"):
                continue
            age, mass, height, leg_length = values
            assert height is not None
            return {
                "sex": row["Gender"],
                "age_years": age,
                "mass_kg": mass,
                "height_m": metres * height,
                "leg_length_m": leg_length,
            }
    raise RecordError(
        f"{data.folder}: no table with sex, mass, height and leg length of {person}. WBDSinfo.xlsx "
        "has them; save it there."
    )


def trial_values(data: Holdings, person: str, trial: str) -> dict[str, float]:
    """Belt speed (m/s) and stride time (s) of a treadmill `trial` of `person`, by the names of
    `Subject`.

    The speed is that of `stride_times.csv` where it has one (measured at the feet), else that of
    the published table. The stride time is from a table, else from the forces. Raises RecordError
    if neither a table nor a file of `data` has them.
    """
    number = int(person.removeprefix("WBDS"))
    for row in data.rows("strides"):
        if int(row["WBDS"]) == number and row["trial"] == trial:
            speed, stride = _number(row, "belt_speed_m_s"), _number(row, "stride_time_s")
            if speed and stride:
                return {"walking_speed_m_s": speed, "stride_time_s": stride}
    found = _speed(data, number, person, trial)
    if found is None:
        raise RecordError(f"{data.folder}: no table with the speed of {person} {trial}.")
    return {"walking_speed_m_s": found, "stride_time_s": _stride(data, number, person, trial)}


def _speed(data: Holdings, number: int, person: str, trial: str) -> float | None:
    for row in data.rows("info"):
        if row.get("FileName", "").startswith(f"{person}walk{trial}"):
            value = _number(row, "GaitSpeed(m/s)")
            if value is not None:
                return value
    for row in data.rows("people"):
        if row["Subject"] == str(number):
            return _number(row, trial)
    return None


def _stride(data: Holdings, number: int, person: str, trial: str) -> float:
    for row in data.rows("speeds"):
        if row["Subject"] == str(number) and row["SpeedCat"] == f"V{int(trial[1:])}":
            cadence = _number(row, "Cadence")
            if cadence:
                # Cadence is in steps a minute, and a stride is two steps.
                return 120.0 / cadence
    files = data.trials.get((person, trial), {})
    for kind in ("forces", "c3d"):
        if kind in files:
            return stride_time(files[kind])
    raise RecordError(
        f"{data.folder}: nothing says the stride time of {person} {trial}: neither a table nor "
        "forces (grf.txt, C3D)."
    )


def stride_time(path: Path) -> float:
    """Median time between heel strikes of the treadmill trial `path`, s.

    From the events that a C3D file stores, else from the plate on which they come most evenly: a
    foot that also steps on the other plate makes that one's uneven. A foot is down while the
    vertical force is above a fifth of its range: plates that were not zeroed have an offset. Raises
    RecordError for fewer than three strides.
    """
    candidates: list[Array] = []
    if path.suffix.lower() == ".c3d":
        trial = read_recording(path)
        rate, plates = trial.force_rate, trial.plates
        for side in SIDES:
            strikes = [e.time for e in trial.events if (e.side, e.kind) == (side, "heel_strike")]
            candidates.append(np.array(strikes))
    elif path.suffix.lower() == ".mot":
        rate, _, plates = read_ground_reaction(path)
    else:
        rate, _, plates = read_wbds_forces(path)
    if not any(len(each) >= _STRIKES for each in candidates):
        # Column 1 is up: these files have y upwards.
        candidates = [_strikes(plate.force[:, 1], rate) for plate in plates]
    strides = [np.diff(each) for each in candidates if len(each) >= _STRIKES]
    if not strides:
        raise RecordError(f"{path}: fewer than three strides, so no stride time.")
    return float(np.median(min(strides, key=lambda each: float(np.std(each) / np.mean(each)))))


def _strikes(vertical: Array, rate: float) -> Array:
    """Times, s, at which a foot comes down on a plate; (N,)."""
    low, high = np.nanpercentile(vertical, [5, 99])
    if high - low < 100.0:  # N: nobody walks on it
        return np.empty(0)
    down = np.nan_to_num(vertical, nan=low) > low + 0.2 * (high - low)
    starts = np.flatnonzero(down[1:] & ~down[:-1]) / rate
    # Noise at the threshold is no step: nobody takes a stride in 0.4 s.
    kept = [time for i, time in enumerate(starts) if i == 0 or time - starts[i - 1] > 0.4]
    return np.array(kept)


def _number(row: Mapping[str, str], column: str) -> float | None:
    try:
        value = plain_float(row[column])
    except (KeyError, TypeError, ValueError):
        return None
    return value if np.isfinite(value) else None


def standing_markers(data: Holdings, person: str) -> dict[str, tuple[float, float, float]]:
    """Standing marker positions of a `person`, m, REP-103 axes: means over the standing trial in
    `data`. Raises RecordError if there is no standing trial, or markers are missing in it.
    """
    if "markers" in data.tables:
        known = data.rows("markers")
        if any(row["Subject"] == person for row in known):
            return read_static_markers(data.tables["markers"], person)
    if person not in data.standing:
        raise RecordError(f"{data.folder}: no standing trial of {person} ({person}static1.c3d).")
    trial = read_recording(data.standing[person])
    found = {}
    for name in MARKERS:
        if name not in trial.names:
            raise RecordError(f"{trial.source}: no marker {name}, which scaling needs.")
        x, y, z = np.nanmean(trial.marker(name), axis=0)
        # The files have x forward, y up, z to the right.
        found[name] = (float(x), float(-z), float(y))
    return found


def subject_of(data: Holdings, person: str, trials: Iterable[str]) -> Subject:
    """A `person` of `data` with the mean curves of these treadmill `trials`; the first is the
    subject's own.

    Raises RecordError or SubjectError if a file is missing or cannot be used, or a value is
    implausible.
    """
    found: Subject | None = None
    for trial in trials:
        one = _of_trial(data, person, trial)
        found = one if found is None else found.with_trial(one)
    if found is None:
        raise RecordError(f"{data.folder}: no trial of {person} was asked for.")
    return found


def _of_trial(data: Holdings, person: str, trial: str) -> Subject:
    files = data.trials[person, trial]
    about = {
        **person_values(data, person),
        **trial_values(data, person, trial),
        "markers": standing_markers(data, person),
    }
    return subject_of_curves(person, person, trial, files["angles"], files["kinetics"], about)
