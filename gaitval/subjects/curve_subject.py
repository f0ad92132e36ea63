"""Subject files from mean curves: a new person, or a further trial of a known one."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, get_args

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.text.plain_numbers import plain_float
from gaitval.errors import ConfigurationError, SubjectError
from gaitval.mocap.repairs import passed_over
from gaitval.scaling.tape import measure_by_tape
from gaitval.subjects.curve_columns import AngleUnit
from gaitval.subjects.curve_files import read_mean_curves
from gaitval.subjects.gait_values import gait_values
from gaitval.subjects.identity import identity
from gaitval.subjects.plausible import unusual_build
from gaitval.subjects.subject import TAPE, Subject, make_subject
from gaitval.subjects.subject_file import load_subject


class PersonDetails(NamedTuple):
    """What is known of a person besides the curves; kg, m, years.

    Attributes
    ----------
    tape : texts `thigh=0.41`.
    person, laboratory : who it is; None if that was not given.
    """

    mass: float | None
    height: float | None
    leg_length: float | None
    sex: str | None
    age: float | None
    tape: Sequence[str]
    citation: str
    licence: str
    person: str | None = None
    laboratory: str | None = None


def new_subject(files: Sequence[Path], out: Path, person: PersonDetails, **trial: Any) -> Path:
    """Write the subject of a person's mean curves (`files`) to `out`, after which it is named;
    returns the path.

    `trial` as `_of_trial` takes it. Raises RecordError, SubjectError or ConfigurationError if
    curves, `person` or options cannot be used.
    """
    missing = [
        option
        for option, value in (
            ("--mass", person.mass),
            ("--height", person.height),
            ("--leg-length", person.leg_length),
            ("--sex", person.sex),
        )
        if value is None
    ]
    if missing:
        raise ConfigurationError(f"a new subject needs {', '.join(missing)} too.")
    _check_target(out)
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", out.stem).strip("_") or "subject"
    known = identity(
        person.person, person.laboratory, sources=[file.name for file in files], name=name
    )
    values = {
        "identifier": name,
        **known._asdict(),
        "trial": trial["name"],
        "source": f"{name} {trial['name']}",
        "citation": person.citation,
        "licence": person.licence,
        "sex": person.sex,
        "age_years": person.age,
        "mass_kg": person.mass,
        "height_m": person.height,
        "leg_length_m": person.leg_length,
        "tape": _tape(person.tape, person.height or 0.0),
        **_of_trial(files, **trial),
    }
    subject = make_subject(values, str(out))
    write_text(out, subject.to_toml())
    for doubt in unusual_build(subject.mass_kg, subject.height_m, subject.age_years):
        _say(f"{doubt.message}.", trial.get("notify"), str(out))
    if known.guessed and trial.get("notify"):
        trial["notify"](f"Assumed: {known.guessed}. Say so with --person and --laboratory.")
    return out


def add_trial(files: Sequence[Path], to: Path, **trial: Any) -> Path:
    """Add a trial from `files` to a subject's file `to`; returns the path.

    `trial` as `_of_trial` takes it. Raises RecordError or SubjectError if the curves cannot be
    used, or the trial is there already.
    """
    subject = load_subject(str(to))
    name = trial["name"]
    if name in (subject.trial, *(known.name for known in subject.trials)):
        raise SubjectError(f"{to}: there is a trial {name} already. Give another --trial-name.")
    values = {
        **subject.model_dump(exclude={"trials", "gait", "plates", "low_pass", "paper"}),
        "left_phase_from_force": None,
        "mean_vertical_force": None,
        "trial": name,
        "source": f"{subject.person} {name}",
        **_of_trial(files, **trial),
    }
    added = subject.with_trial(make_subject(values, str(to)))
    # checked as a whole, as it will be read
    whole: Subject = make_subject(added.model_dump(), str(to))
    write_text(to, whole.to_toml())
    return to


def _of_trial(
    files: Sequence[Path],
    *,
    name: str,
    speed: float,
    stride_time: float,
    stance: float | None,
    angle_unit: str,
    notify: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Values of the subject that the trial gives; speed m/s, stride time s, stance of the cycle.
    `notify` is called with a sentence on what was read.
    """
    del name
    unit: AngleUnit | None = next((u for u in get_args(AngleUnit) if u == angle_unit.lower()), None)
    if unit is None:
        raise ConfigurationError(f"--angle-unit {angle_unit}: give deg or rad.")
    where = ", ".join(str(path) for path in files)
    curves = read_mean_curves([Path(path) for path in files], angle_unit=unit)
    values = gait_values(curves, where, stance)
    for warning in curves.warnings:
        _say(warning, notify, where)
    if notify is not None:
        read = {"deg": "degrees", "rad": "radians"}[unit]
        stances = values["stance_fraction"]
        notify(
            f"Read {where}: {curves.in_words()}; angles in {read} unless their names say "
            "otherwise. The left foot strikes at "
            f"{100 * values['left_phase']:.0f} % of the right cycle, stance lasts "
            f"{100 * stances.right:.0f} % (right) and {100 * stances.left:.0f} % (left) of it."
        )
    return {"walking_speed_m_s": speed, "stride_time_s": stride_time, **values}


def _say(warning: str, notify: Callable[[str], None] | None, where: str) -> None:
    if notify is None:
        passed_over(f"{where}: {warning}")
    else:
        notify(f"Warning: {warning}")


def _check_target(out: Path) -> None:
    if out.suffix != ".toml":
        raise ConfigurationError(f"--out {out}: give the name of a .toml file.")
    if out.exists():
        raise ConfigurationError(
            f"{out}: exists. Give another name, or add the trial to it with --to."
        )


def _tape(texts: Sequence[str], height_m: float) -> dict[str, float]:
    found: dict[str, float] = {}
    for text in texts:
        name, separator, value = text.partition("=")
        try:
            found[name.strip()] = plain_float(value)
        except ValueError:
            separator = ""
        if not separator or name.strip() not in TAPE:
            raise ConfigurationError(
                f"--tape {text}: not of the form LENGTH=METRES with one of {', '.join(TAPE)}."
            )
    measure_by_tape(height_m=height_m, **found)  # refuses what cannot be, before it is written
    return found
