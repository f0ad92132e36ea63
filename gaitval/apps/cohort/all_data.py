"""The studies of all data there is: treadmill trials of WBDS in a folder, and virtual people."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gaitval.apps.cohort.table import Study, Virtual
from gaitval.artefacts import write_text
from gaitval.datasets import wbds_archive
from gaitval.datasets.identity import WBDS
from gaitval.datasets.subject_file import BUILTIN
from gaitval.datasets.wbds import CITATION, FURTHER_TRIALS, LICENCE
from gaitval.errors import ConfigurationError, GaitvalError

PEOPLE_PER_PERSON: Final = 2
"""Virtual people in a row around the same built-in subject."""


@dataclass(frozen=True)
class AllData:
    """What a folder is good for.

    Attributes
    ----------
    studies : one for each trial that can be used.
    missing : what cannot, and why: a line each.
    """

    studies: tuple[Study, ...]
    missing: tuple[str, ...]


def wbds_studies(folder: Path, subjects: Path, *, trials: Sequence[str] = ()) -> AllData:
    """A study of every treadmill trial in a `folder`; only of those in `trials`, such as T05, if
    there are any.

    A built-in subject's trial is that of the package. Of another trial with mean curves a subject
    file is written, into `subjects`; one with a recording alone is imported by its study. Raises
    RecordError if the folder has no trial of WBDS, ConfigurationError if there is no such trial, or
    none of them can be used.
    """
    unknown = [name for name in trials if name not in wbds_archive.TREADMILL]
    if unknown:
        raise ConfigurationError(
            f"--trials {unknown[0]}: no treadmill trial. There are "
            f"{', '.join(wbds_archive.TREADMILL)}."
        )
    data = wbds_archive.holdings(folder)
    wanted = tuple(trials) or wbds_archive.TREADMILL
    studies: list[Study] = []
    lines: list[str] = []
    absent: list[str] = []
    for person in wbds_archive.PEOPLE:
        found, lacking = _of_person(data, person, wanted, subjects)
        studies += found
        if not found and all("ang.txt" in each for each in lacking.values()):
            absent.append(person)
        else:
            lines += _listed(person, lacking)
    first = (
        f"{folder}: {len(studies)} of {len(wbds_archive.PEOPLE) * len(wanted)} treadmill trials of "
        f"{len(wbds_archive.PEOPLE)} people can be run."
    )
    if absent:
        lines.append(f"not there: {', '.join(absent)}. `gaitval data fetch wbds` fetches them.")
    overground = sum(trial.startswith("O") for _, trial in data.trials)
    if overground:
        lines.append(f"left out: {overground} overground trials, which have no belt speed.")
    if not studies:
        raise ConfigurationError("\n".join([first, *lines]))
    return AllData(tuple(studies), (first, *lines))


def _listed(person: str, lacking: dict[str, str]) -> list[str]:
    by_reason: dict[str, list[str]] = {}
    for trial, reason in lacking.items():
        by_reason.setdefault(reason, []).append(trial)
    return [f"{person} {', '.join(names)}: {reason}" for reason, names in by_reason.items()]


def _of_person(
    data: wbds_archive.Holdings, person: str, wanted: Sequence[str], subjects: Path
) -> tuple[list[Study], dict[str, str]]:
    """The studies of a person, and what is missing of the other trials, by trial."""
    builtin = _builtin_trials(person)
    studies: list[Study] = []
    own: list[str] = []
    lacking: dict[str, str] = {}
    for trial in wanted:
        absent = data.missing(person, trial)
        if not absent and trial in builtin:
            name = builtin[trial]
            studies.append(Study(name=f"{name}-{trial}", subject=name, trial=trial))
        elif not absent:
            own.append(trial)
        elif (recorded := _recorded(data, person, trial)) is not None:
            studies.append(recorded)
        else:
            lacking[trial] = f"no {', no '.join(absent)}"
    if own:
        try:
            text = wbds_archive.subject_of(data, person, own).to_toml()
        except GaitvalError as error:
            lacking |= dict.fromkeys(own, " ".join(str(error).split()))
        else:
            path = subjects / f"{person}.toml"
            write_text(path, text)
            about = str(path.resolve())
            studies += [Study(name=f"{person}-{each}", subject=about, trial=each) for each in own]
    return studies, lacking


def _builtin_trials(person: str) -> dict[str, str]:
    """Trials of a person that are built in, with the subject's name."""
    return {
        trial: name
        for name, (built_in, first) in BUILTIN.items()
        for trial in (first, *FURTHER_TRIALS.get(name, ()))
        if built_in == person
    }


def _recorded(data: wbds_archive.Holdings, person: str, trial: str) -> Study | None:
    """The study of a trial's recording; None if it is not there whole."""
    files = data.trials.get((person, trial), {})
    if "c3d" in files:
        walk: dict[str, Any] = {"trials": [str(files["c3d"].resolve())]}
    elif {"markers", "forces"} <= set(files):
        walk = {
            "trials": [str(files["markers"].resolve())],
            "forces": [str(files["forces"].resolve())],
        }
    else:
        return None
    try:
        about = wbds_archive.person_values(data, person)
    except GaitvalError:
        return None
    if person not in data.standing:
        return None
    recording = {
        **walk,
        "static": str(data.standing[person].resolve()),
        "sex": about["sex"],
        "mass": about["mass_kg"],
        "height": about["height_m"],
        "age": about["age_years"],
        "person": person,
        "trial_name": trial,
        "laboratory": WBDS,
        "citation": CITATION,
        "licence": LICENCE,
    }
    # no age is known of some people, and TOML has no word for that
    known = {name: each for name, each in recording.items() if each is not None}
    return Study(name=f"{person}-{trial}-raw", recording=known)


def virtual_people(count: int, seed: int = 0) -> tuple[Study, ...]:
    """`count` studies of virtual people drawn with `seed`, around each of the built-in subjects in
    turn; every other pair of them was measured by stature alone.
    """
    names = list(BUILTIN)
    return tuple(
        Study(
            name=f"V{seed}_{number:03d}",
            virtual=Virtual(
                number=number,
                seed=seed,
                around=names[number // PEOPLE_PER_PERSON % len(names)],
                by="stature" if number // PEOPLE_PER_PERSON % 2 else "markers",
            ),
        )
        for number in range(count)
    )
