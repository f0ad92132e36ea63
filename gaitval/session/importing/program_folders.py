"""Folders of OpenCap and Pose2Sim, as sessions for `gaitval import`.

OpenCap: `sessionMetadata.yaml` has mass_kg, height_m and gender_mf; `MarkerData/*.trc` are the
trials, that whose name has neutral, static or calib is the standing one; `ForceData/NAME.mot` or
`NAME_forces.mot`, if it is there, has the ground reaction of a trial; `OpenSimData/Model/*.osim` is
the scaled model, whose joint centres are shown beside ours. Pose2Sim: `Config.toml` has
participant_mass and participant_height; `*/pose-3d/*.trc` are the trials, those with the augmented
markers (`…LSTM.trc`) before others of one folder; that whose name has static is the standing one;
`kinematics/*.osim` is the scaled model.

Both have markers in m with y up. Layouts are those of stanfordnmbl/opencap-processing and
perfanalytics/pose2sim on GitHub, looked up in November 2026.
"""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import read_toml
from gaitval._internal.text.plain_numbers import plain_float
from gaitval.errors import RecordError

Sessions = list[tuple[Path, list[dict[str, Any]]]]

METADATA: Final = "sessionMetadata.yaml"
CONFIG: Final = "Config.toml"
_STANDING: Final = re.compile(r"static|neutral|calib|standing", re.IGNORECASE)
_MOST: Final = 10_000
"""Folders of one session."""


def opencap_sessions(folder: Path) -> Sessions:
    """Each OpenCap session in or below a `folder` (`OpenCapData_…`, or one of several): its
    metadata file, and a person's table. Raises RecordError if the metadata lack the mass, the
    height or the sex, or there is no trial.
    """
    files = sorted(folder.rglob(METADATA))[:_MOST]
    return [(file, [_opencap_person(file)]) for file in files]


def _opencap_person(file: Path) -> dict[str, Any]:
    known = _top_level(file)
    mass, height = (_number(file, known, key) for key in ("mass_kg", "height_m"))
    sex = known.get("gender_mf", "").strip().upper()
    if sex not in ("F", "M"):
        raise RecordError(
            f"{file}: gender_mf is {known.get('gender_mf', '') or 'missing'!r}, but segment tables "
            "exist for f and m only. Write the one whose tables fit the person better."
        )
    trials = sorted((file.parent / "MarkerData").rglob("*.trc"))
    standing, walking = _shared_out(file, trials, "MarkerData")
    forces = [_forces_of(file.parent / "ForceData", trial) for trial in walking]
    given = [path for path in forces if path is not None]
    if given and len(given) < len(walking):
        without = next(t for t, f in zip(walking, forces, strict=True) if f is None)
        raise RecordError(
            f"{file.parent / 'ForceData'}: forces of {len(given)} of {len(walking)} trials, none "
            f"of {without.name}; moments need them of every trial. Add {without.stem}.mot, or move "
            "the trial out of MarkerData."
        )
    found = _person(file, mass, height, sex, standing, walking)
    if given:
        found["forces"] = [str(path.relative_to(file.parent)) for path in given]
    return found | _scaled_model(file.parent, "OpenSimData/Model")


def _scaled_model(folder: Path, models: str) -> dict[str, str]:
    """The person's scaled model in the folder `models` below a session's `folder`; of OpenCap's two
    the one with patellae.
    """
    files = sorted((folder / models).glob("*.osim"))
    model = min(files, key=lambda path: "no_patella" in path.stem.lower(), default=None)
    return {} if model is None else {"scaled_model": str(model.relative_to(folder))}


def _forces_of(folder: Path, trial: Path) -> Path | None:
    names = (f"{trial.stem}.mot", f"{trial.stem}_forces.mot", f"{trial.stem}_grf.mot")
    return next((folder / name for name in names if (folder / name).exists()), None)


def pose2sim_sessions(folder: Path) -> Sessions:
    """Each participant of Pose2Sim in or below a `folder`: their Config.toml, and a person's table.
    The folder is a participant's, with a folder for each trial, or a session's of several. Raises
    RecordError if Config.toml lacks the mass, the height or the sex, there is no trial, or one of
    several people.
    """
    trials: dict[Path, list[Path]] = {}
    for found in sorted(folder.rglob("pose-3d"))[:_MOST]:
        files = sorted(found.glob("*.trc"))
        _check_one_person(found, files)
        # Augmented markers lie on the body's landmarks, as those of a laboratory do.
        best = [f for f in files if f.stem.endswith("LSTM")] or files
        if best:
            trials.setdefault(found.parent.parent, []).append(best[-1])
    sessions: Sessions = []
    for participant, files in trials.items():
        configs = [each / CONFIG for each in (participant, participant.parent)]
        file = next((each for each in configs if each.exists()), None)
        if file is None:
            raise RecordError(
                f"{participant}: trials of Pose2Sim (pose-3d), but no {CONFIG} in it or above, "
                "which has the person's mass and height. Put it there."
            )
        sessions.append((participant / CONFIG, [_pose2sim_person(file, participant, files)]))
    return sessions


def _check_one_person(folder: Path, files: list[Path]) -> None:
    """Refuse files of several people, whom Pose2Sim numbers: `…_P1_0-100.trc`, `…_P2_0-100.trc`."""
    numbers = [re.findall(r"_P(\d+)(?=_|$)", file.stem) for file in files]
    # The name of the trial may have its participant's number before.
    longest = max(map(len, numbers), default=0)
    people = {each[-1] for each in numbers if len(each) == longest > 0}
    if len(people) > 1:
        raise RecordError(
            f"{folder}: files of {len(people)} people ({', '.join(file.name for file in files)}), "
            f"but {CONFIG} has the mass and the height of one. Move the others' files out of the "
            "folder."
        )


def _pose2sim_person(file: Path, participant: Path, trials: list[Path]) -> dict[str, Any]:
    tables = read_toml(file, RecordError, "Check the name and the folder")
    known: dict[str, Any] = {}
    for name in ("markerAugmentation", "project"):
        table = tables.get(name)
        known |= table if isinstance(table, dict) else {}
    values = {
        key: str(known.get(key, ""))
        for key in ("participant_mass", "participant_height", "participant_sex")
    }
    mass, height = (_number(file, values, f"participant_{each}") for each in ("mass", "height"))
    sex = values["participant_sex"].strip().upper()
    if sex not in ("F", "M"):
        raise RecordError(
            f"{file}: participant_sex is {values['participant_sex'] or 'missing'!r}; Pose2Sim does "
            "not ask for it, but it chooses the segment tables. Write participant_sex = 'F' or 'M' "
            "below [project]."
        )
    at = participant / CONFIG
    standing, walking = _shared_out(at, trials, "pose-3d")
    found = _person(at, mass, height, sex, standing, walking)
    return found | _scaled_model(participant, "kinematics")


def _shared_out(file: Path, trials: list[Path], where: str) -> tuple[Path | None, list[Path]]:
    """The standing trial, None if there is none, and the others."""

    def own(path: Path) -> str:
        return str(path.relative_to(file.parent))

    standing = [path for path in trials if _STANDING.search(own(path))]
    walking = [path for path in trials if path not in standing]
    if not walking:
        raise RecordError(
            f"{file}: {len(trials)} trials in {where}, of which {len(standing)} are standing ones, "
            "so nobody walks. Add the .trc file of a walking trial."
        )
    return (standing[0] if standing else None), walking


def _person(
    file: Path, mass: float, height: float, sex: str, standing: Path | None, walking: list[Path]
) -> dict[str, Any]:
    folder = file.parent
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", folder.resolve().name).strip("_") or "person"
    table: dict[str, Any] = {
        "name": name, "sex": sex, "mass": mass, "height": height,
        "trials": [str(path.relative_to(folder)) for path in walking],
    }  # fmt: skip
    if standing is not None:
        table["static"] = str(standing.relative_to(folder))
    has_forces = (folder / "ForceData").is_dir() and any((folder / "ForceData").iterdir())
    return table | ({} if has_forces else {"kinematics_only": True})


def _top_level(file: Path) -> dict[str, str]:
    """The plain values at the top level of a YAML file, as text; nothing else of it is read."""
    try:
        text = file_gate.read_text(file, RecordError, largest=file_gate.SIZES.written)
    except UnicodeDecodeError:
        raise RecordError(
            f"{file}: not UTF-8 text, so it is not the metadata that OpenCap writes. Download the "
            "session again."
        ) from None
    lines: Iterable[str] = text.splitlines()
    found = (re.match(r"([A-Za-z_]\w*):\s+([^#]*)", line) for line in lines)
    return {each[1]: each[2].strip().strip("'\"") for each in found if each}


def _number(file: Path, known: dict[str, str], key: str) -> float:
    text = known.get(key, "")
    try:
        value = plain_float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1e4:
        raise RecordError(
            f"{file}: {key} is {text or 'missing'!r}, but must be a number: the body cannot be "
            "scaled without it. Write it into the file."
        )
    return value
