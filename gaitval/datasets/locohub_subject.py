"""Subject files of the people of a LocoHub file."""

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.artefacts import write_text
from gaitval.coordinates import SIDES
from gaitval.datasets.curve_files import curve_problems
from gaitval.datasets.gait_values import gait_values
from gaitval.datasets.locohub import LocoHubTrial, grouped, read_locohub_trials, resampled
from gaitval.datasets.subject import Subject, make_subject
from gaitval.errors import ConfigurationError, GaitvalError, RecordError, count_of
from gaitval.gait.mean_curves import MeanCurves, stance_fraction
from gaitval.gait.record import MOMENT_NAMES, REQUIRED_ANGLES, REQUIRED_MOMENTS
from gaitval.gait.sampling import SAMPLES

LEG_OF_STATURE: Final = 0.53
"""Height of the hip over stature (Winter 2009, figure 4.1, after Drillis and Contini 1966)."""
_AXES: Final = ("forward", "left", "up")
_Notify = Callable[[str], None]


class GivenFacts(NamedTuple):
    """What the user says where the file does not: kg, m, years, m/s, s; None if not."""

    mass: float | None = None
    height: float | None = None
    sex: str | None = None
    age: float | None = None
    leg_length: float | None = None
    speed: float | None = None
    stride_time: float | None = None
    stance: float | None = None
    citation: str = "LocoHub (github.com/jmontp/LocoHub); see the data set's own publication"
    licence: str = "not stated"


def write_subjects(
    path: Path,
    out: Path,
    *,
    task: str = "level_walking",
    people: Sequence[str] = (),
    given: GivenFacts | None = None,
    fill_missing: bool = False,
    notify: _Notify = lambda text: None,
) -> tuple[list[Path], dict[str, str]]:
    """Write a subject file for each person of a LocoHub file, whose trials are its settings.

    Parameters
    ----------
    path : `DATASET_phase.parquet`.
    out : folder, which is made; a file is named after its person.
    task : of which cycles are read.
    people : whom to read; all of the file if empty.
    given : what holds for all of them where the file does not say it.
    fill_missing : whether angles that the file lacks stand in from other people.
    notify : called with a sentence on each decision.

    Returns
    -------
    tuple
        The files that were written, and why each of the others was not, by their names.

    Raises
    ------
    RecordError : the file cannot be read, or lacks someone of `people`.
    """
    known = grouped(read_locohub_trials(path, task))
    strangers = [name for name in people if name not in known]
    if strangers:
        raise RecordError(
            f"{path}: nobody of the name {', '.join(strangers)} does {task}; there are "
            f"{', '.join(list(known)[:12])}{' …' if len(known) > 12 else ''}. Give one of them."
        )
    written, refused = [], {}
    for name in people or known:
        target = out / f"{_identifier(name)}.toml"
        if target.exists():
            raise ConfigurationError(
                f"{target}: exists, and would be written over. Give another --out."
            )
        try:
            subject = subject_of(known[name], given or GivenFacts(), fill_missing, notify)
        except GaitvalError as error:
            refused[name] = str(error)
            continue
        out.mkdir(parents=True, exist_ok=True)
        write_text(target, subject.to_toml())
        written.append(target)
    return written, refused


def subject_of(
    trials: Sequence[LocoHubTrial], given: GivenFacts, fill_missing: bool, notify: _Notify
) -> Subject:
    """A person's subject; parameters as for `write_subjects`. The trial with the most cycles is the
    subject's own, the others are further ones.

    Raises RecordError or SubjectError if something is missing or cannot be.
    """
    first = trials[0]
    where = f"{first.source}: {first.subject}"
    mass = given.mass or first.value("weight_kg", "mass_kg", "body_mass_kg")
    height = given.height or first.value("height_m", "stature_m")
    if height is None and (cm := first.value("height_cm")) is not None:
        height = cm / 100.0
    sex = given.sex or _sex(first.about)
    missing = [
        flag
        for flag, value in (("--mass", mass), ("--height", height), ("--sex", sex))
        if value is None
    ]
    if mass is None or height is None or sex is None:
        raise RecordError(
            f"{where}: subject_metadata is {dict(first.about) or 'empty'}, which does not say who "
            f"it is whose body is scaled. Give {', '.join(missing)}."
        )
    assumed = []
    leg = given.leg_length or first.value("leg_length_m")
    if leg is None:
        leg = LEG_OF_STATURE * height
        assumed.append(f"leg length {leg:.3f} m, {LEG_OF_STATURE:g} of the stature")
    if not first.sides_given:
        assumed.append("cycles begin with the right foot")
    dataset = first.subject.partition("_")[0]
    values = {
        "identifier": _identifier(first.subject),
        "person": first.subject,
        "laboratory": f"LocoHub {dataset}",
        "guessed": "; ".join(assumed) or None,
        "citation": given.citation,
        "licence": given.licence,
        "sex": sex,
        "age_years": given.age or first.value("age", "age_years"),
        "mass_kg": mass,
        "height_m": height,
        "leg_length_m": leg,
        **_trial_values(first, mass, given, fill_missing, notify),
    }
    subject = make_subject(values, where)
    for number, trial in enumerate(trials[1:], start=2):
        try:
            further = _trial_values(trial, mass, given, fill_missing, notify)
            named = {"trial": f"{further['trial']}-{number}"}
            subject = subject.with_trial(make_subject(values | further | named, where))
        except GaitvalError as error:
            notify(f"{trial.subject} {trial.task_id}: left out: {error}")
    if assumed:
        notify(f"{first.subject}: assumed: {'; '.join(assumed)}")
    return make_subject(subject.model_dump(), where)


def _identifier(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_")[:60] or "subject"


def _sex(about: Mapping[str, str]) -> str | None:
    text = (about.get("sex") or about.get("gender") or "").strip().upper()[:1]
    return text if text in ("F", "M") else None


def _trial_values(
    trial: LocoHubTrial, mass: float, given: GivenFacts, fill_missing: bool, notify: _Notify
) -> dict[str, Any]:
    where = f"{trial.source}: {trial.subject} {trial.task_id}"
    speed = trial.value("speed_m_s", "walking_speed_m_s") or given.speed
    stride = trial.stride_time() or given.stride_time
    missing = [f for f, v in (("--speed", speed), ("--stride-time", stride)) if v is None]
    if speed is None or stride is None:
        raise RecordError(
            f"{where}: task_info is {dict(trial.info) or 'empty'}, and there are no angular "
            f"velocities to tell the stride time by. Give {' and '.join(missing)}."
        )
    curves, left_out = mean_curves(trial, mass, fill_missing)
    _check_signs(where, curves)
    stance = given.stance
    if not curves.forces and stance is None:
        stance = _stance(trial.curves(mass))
    values = gait_values(curves, where, stance)
    notify(f"{where}: {count_of(trial.count, 'cycle')}, {curves.in_words()}")
    for note in left_out:
        notify(f"{where}: {note}")
    return {
        "trial": _trial_name(trial, speed),
        "source": "; ".join([f"LocoHub {trial.subject} {trial.task_id}", *left_out]),
        "walking_speed_m_s": speed,
        "stride_time_s": stride,
        **values,
    }


def _trial_name(trial: LocoHubTrial, speed: float) -> str:
    name = re.sub(r"[^A-Za-z0-9_-]+", "", trial.task_id) or trial.task
    return f"{name}-{f'{speed:.2f}'.replace('.', 'p')}"


def mean_curves(
    trial: LocoHubTrial, mass: float, fill_missing: bool
) -> tuple[MeanCurves, list[str]]:
    """A trial's curves over each side's own cycle, and what of them is not the file's.

    Raises RecordError if angles are missing and may not stand in from other people.
    """
    curves = {name: resampled(values, SAMPLES) for name, values in trial.curves(mass).items()}
    angles = _of_kind(curves, "angle")
    notes = []
    missing = [name for name in REQUIRED_ANGLES if name not in angles]
    if missing and not fill_missing:
        raise RecordError(
            f"{trial.source}: {trial.subject}: no columns of the angles {', '.join(missing)}, "
            "which a subject's record has. Give --fill-missing to let the mean of the built-in "
            "subjects stand in for them; what stands in is named in the subject, and is no record."
        )
    if missing:
        angles |= {name: _stand_in()[name] for name in missing}
        joints = sorted({name[:-2] for name in missing})
        notes.append(f"{', '.join(joints)} not recorded: the mean of other people stands in")
    moments = {
        name: values for name, values in _of_kind(curves, "moment").items() if name in MOMENT_NAMES
    }
    forces = _of_kind(curves, "force")
    lacking = [f"moment {name}" for name in REQUIRED_MOMENTS if name not in moments]
    lacking += [
        f"force {axis}_{side[0]}"
        for side in SIDES
        for axis in _AXES
        if f"{axis}_{side[0]}" not in forces
    ]
    if lacking:
        if moments or forces:
            notes.append(f"moments and forces left out, for {', '.join(lacking)} is missing")
        return MeanCurves(angles, {}, {}), notes
    of_sides = {
        side: np.stack([forces[f"{axis}_{side[0]}"] for axis in _AXES], axis=1) for side in SIDES
    }
    return MeanCurves(angles, moments, of_sides), notes


def _of_kind(curves: Mapping[str, Array], kind: str) -> dict[str, Array]:
    start = f"{kind}_"
    return {k.removeprefix(start): v for k, v in curves.items() if k.startswith(start)}


@cache
def _stand_in() -> dict[str, Array]:
    """Mean angles (101,) rad of the built-in subjects."""
    from gaitval.datasets.subject_file import builtin_subjects

    phase = np.linspace(0.0, 1.0, SAMPLES)
    records = [subject.record() for subject in builtin_subjects()]
    return {
        name: np.mean([record.angles[name](phase) for record in records], axis=0)
        for name in REQUIRED_ANGLES
    }


def _check_signs(where: str, curves: MeanCurves) -> None:
    """Refuse curves whose signs, units or sides cannot be a gait's, as `gaitval curves` does."""
    forces = {
        f"{axis}_{side[0]}": values[:, number]
        for side, values in curves.forces.items()
        for number, axis in enumerate(_AXES)
    }
    degrees = {name: np.degrees(values) for name, values in curves.angles.items()}
    problems = curve_problems(degrees, curves.moments, forces)
    if problems:
        listed = "\n".join(f"  - {problem}" for problem in problems)
        raise RecordError(
            f"{where}: no gait has such curves:\n{listed}\nIn LocoHub's files angles are in rad "
            "and moments in Nm/kg; flexion, adduction and dorsiflexion are positive, and forces "
            "forward, up and to the right. Correct the columns in the file."
        )


def _stance(curves: Mapping[str, Array]) -> float | None:
    """Stance fraction from the vertical forces, if there are any."""
    ends = [
        stance_fraction(resampled(curves[f"force_up_{side}"], SAMPLES))
        for side in "rl"
        if f"force_up_{side}" in curves
    ]
    return float(np.mean(ends)) if ends else None
