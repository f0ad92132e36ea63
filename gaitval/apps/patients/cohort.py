"""All people of a table of strides: subjects, table for `gaitval cohort`, walks."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval._internal.text.plain_numbers import plain_float
from gaitval.apps.patients.people import PersonRow, read_people
from gaitval.apps.patients.records import Patient, patient, two_sided
from gaitval.apps.patients.strides import read_strides
from gaitval.configuration import load_configuration
from gaitval.errors import ConfigurationError, RecordError


def found_patients(
    strides: Path,
    people: Sequence[Path],
    speeds: Sequence[str] = (),
    healthy: Sequence[str] = (),
    only: Sequence[str] = (),
    **about: Any,
) -> list[Patient]:
    """The patients of a table of `strides`, by tables of `people`. `speeds` are texts "WHO=M/S" of
    groups or people; a person's comes before the group's. `healthy` are groups whose walk ratio is
    that of healthy adults; `only` chooses groups or people, all if there are none. `about` has
    citation, licence and laboratory, as `records.patient` takes them. Raises RecordError,
    SubjectError or ConfigurationError if a table or an option cannot be used.
    """
    known: dict[str, PersonRow] = {}
    for table in people:
        for who, person in read_people(table).items():
            if known.setdefault(who, person) != person:
                raise RecordError(
                    f"{table}: {who} is in an earlier --people table with other values. Give the "
                    "tables of groups with the same names one at a time, with --only."
                )
    everybody = read_strides(strides)
    groups = sorted({each.group for each in everybody})
    names = [*groups, *sorted({each.subject for each in everybody})]
    given = dict(_speed(text, names) for text in speeds)
    for who in (*healthy, *only):
        if who not in names:
            raise ConfigurationError(
                f"{who}: no such group or person in {strides}. Groups: {', '.join(groups)}."
            )
    found = [
        patient(
            each,
            known,
            speed=given.get(each.subject, given.get(each.group)),
            healthy=each.group in healthy,
            **about,
        )
        for each in everybody
        if not only or {each.group, each.subject} & set(only)
    ]
    first = dict[str, Patient]()
    for each in found:
        name = each.subject.identifier
        if (other := first.setdefault(name, each)) is not each:
            who = " and ".join(f"{p.strides.subject} of {p.strides.group}" for p in (other, each))
            raise RecordError(
                f"{strides}: {who} would both be {name}, and one would take the other's place. "
                "Name one of them otherwise, or choose with --only."
            )
    return found


def written(found: Sequence[Patient], out: Path) -> Path:
    """Write the subjects, and the table of the cohort; returns its path."""
    rows = [["name", "subject", "record.use", "scaling.symmetric"]]
    for each in found:
        name = each.subject.identifier
        write_text(out / "subjects" / f"{name}.toml", each.subject.to_toml())
        symmetric = str(not two_sided(each.person)).lower()
        rows.append([name, f"subjects/{name}.toml", "kinematics", symmetric])
    write_text(out / "table.csv", csv_text(rows))
    return out / "table.csv"


def walked(
    found: Sequence[Patient], out: Path, notify: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Walk all of them (`apps.patients.walk.walk_all`); results are also in `out`/walks."""
    from gaitval.apps.patients.walk import walk_all
    from gaitval.study.stored_policy import general_walker

    configuration = load_configuration()
    return walk_all(
        {each.subject.identifier: each for each in found},
        out / "walks",
        general_walker(configuration.environment),
        configuration,
        notify,
    )


MOST_NAMES: Final = 12
"""Groups and people of a table that a message lists."""
FASTEST: Final = 3.0
"""m/s; nobody walks faster."""


def _speed(text: str, names: Sequence[str]) -> tuple[str, float]:
    who, _, value = text.partition("=")
    if who not in names:
        some = ", ".join(names[:MOST_NAMES])
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        raise ConfigurationError(
            f"--speed {text}: {who or 'nobody'} is no group or person of the table. Give "
            f"WHO=M/S, with one of {some}{more}."
        )
    try:
        speed = plain_float(value)
    except ValueError:
        raise ConfigurationError(
            f"--speed {text}: {value or 'nothing'} is no speed. Give WHO=M/S, such as {who}=1.1."
        ) from None
    if not 0.0 < speed < FASTEST:
        raise ConfigurationError(
            f"--speed {text}: {speed:g} m/s is no walking speed (above 0, below {FASTEST:g}). Give "
            "it in m/s."
        )
    return who, speed
