"""The people of session files or folders, one import after the other.

An import that is refused does not stop the others.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final, get_args

from gaitval import plugins
from gaitval._internal.io.artefacts import read_toml, write_text
from gaitval._internal.io.folder_lock import check_links
from gaitval._internal.io.text_tables import csv_text
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.errors import ConfigurationError, GaitvalError
from gaitval.metrics.recording_limits import State, failure
from gaitval.session.importing.batch_person import BatchPerson, person_of
from gaitval.session.importing.files import FOLDER
from gaitval.session.importing.importing import Imported, import_files
from gaitval.session.importing.program_folders import opencap_sessions, pose2sim_sessions
from gaitval.session.importing.summary import limit_rows, not_judged
from gaitval.session.request import Notify, silent
from gaitval.session.trial import valid_cycles

TABLE: Final = "batch.csv"
_OF_THE_PAGE: Final = ("What was found before this:", "Everything else was worked out:")
"""What begins a line that only says where the page is, which has a column of its own."""


@dataclass(frozen=True)
class ImportOutcome:
    """What became of one person; empty where it was not reached.

    Attributes
    ----------
    trials : used, of those given.
    cycles : for moments and forces, or for angles if there are no forces; right and left.
    reason : why it was refused and what to do, in one line.
    page : to read.
    limits : how many passed, failed and were not judged.
    failed : those that failed, with value and limit.
    not_judged : why no moments came of forces that were given, so that limits that passed say
        nothing of them.
    warnings : of the import, and why trials were left out.
    """

    name: str
    made: bool
    trials: str
    cycles: str
    reason: str
    page: str
    limits: str = ""
    failed: str = ""
    not_judged: str = ""
    warnings: str = ""


_SessionsOf = Callable[[Path], Iterable[tuple[Path, Sequence[Mapping[str, Any]]]]]
"""From a folder to each session in it: the file that describes it, and a table a person."""


def _program_folders() -> dict[str, _SessionsOf]:
    """Readers of the folders of other programs, by their name."""
    others = {
        name: plugins.load(plugins.SESSIONS, name) for name in plugins.names(plugins.SESSIONS)
    }
    return {"opencap": opencap_sessions, "pose2sim": pose2sim_sessions, **others}


def read_batch(paths: Sequence[Path], notify: Notify = silent) -> tuple[BatchPerson, ...]:
    """The people of session files; of a folder among the `paths`, of every `session.toml` in or
    below it, else of the program that wrote it, if its folders can be read.

    `notify` is called with a sentence for each person of a program's folder, which of its files are
    read. Raises
    ConfigurationError if a file is missing or not TOML, has unknown or missing keys, or if two
    people have one name.
    """
    people = [person for path in paths for person in _people(Path(path), notify)]
    names = [person.name for person in people]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ConfigurationError(
            f"{', '.join(map(str, paths))}: {', '.join(twice)}: more than one person of this name, "
            "whose files would be written over each other. Give each a name of their own."
        )
    return tuple(people)


def _people(path: Path, notify: Notify) -> list[BatchPerson]:
    files = sorted(path.rglob("session.toml")) if path.is_dir() else [path]
    people = [person for file in files for person in _read(file)]
    for name, sessions_of in _program_folders().items() if path.is_dir() and not files else ():
        for about, tables in sessions_of(path):
            for table in tables:
                people.append(person_of(about, f"read as {name}", table))
                still = table.get("static", "none")
                walks = ", ".join(table["trials"])
                notify("session", f"{about}: read as {name}: standing trial {still}; walks {walks}")
    if not people:
        raise ConfigurationError(
            f"{path}: no session.toml in this folder or below it. Write one with a table "
            "[[people]] for each person (gaitval import --help)."
        )
    return people


def _read(file: Path) -> list[BatchPerson]:
    values = read_toml(file, ConfigurationError, "Check the name and the folder")
    tables = values.get("people")
    if not isinstance(tables, list) or not tables or set(values) != {"people"}:
        raise ConfigurationError(
            f"{file}: a session file has a table [[people]] for each person, and nothing else; "
            f"this one has {', '.join(values) or 'nothing'}."
        )
    return [
        person_of(file, f"person {number}", table) for number, table in enumerate(tables, start=1)
    ]


def import_batch(
    people: Sequence[BatchPerson],
    out: Path,
    configuration: Configuration,
    *,
    notify: Callable[[str, str, str], None] | None = None,
) -> list[ImportOutcome]:
    """Import `people` one after the other, each into a folder of their name in `out`; writes a
    table.

    `configuration` serves all; `notify` is called with each decision: person, step, and a sentence.
    """
    check_links(Path(out))
    outcomes = []
    for person in people:

        def notify_person(step: str, text: str, name: str = person.name) -> None:
            if notify is not None:
                notify(name, step, text)

        # The table is written after every person: a run that is cut off has those that are done.
        outcomes.append(_one(person, Path(out), configuration, notify_person if notify else silent))
        _write(Path(out) / TABLE, outcomes)
    return outcomes


def _one(
    person: BatchPerson, out: Path, configuration: Configuration, notify: Notify
) -> ImportOutcome:
    options = person.model_copy(update={"person": person.person or person.name})
    try:
        imported = import_files(
            options, out / person.name, configuration=configuration, notify=notify
        )
    except GaitvalError as error:
        notify("refused", str(error))
        pages = [out / person.name / FOLDER / f"{name}.html" for name in ("recording", "refused")]
        page = next((str(each) for each in pages if each.exists()), "")
        trials = f"0 of {len(person.trials)}"
        return ImportOutcome(person.name, False, trials, "", _in_one_line(error), page)
    return _made(person, imported, out)


def _in_one_line(error: GaitvalError) -> str:
    """All that an error says, and the options to continue with, without line breaks."""
    lines = [line for line in str(error).splitlines() if not line.startswith(_OF_THE_PAGE)]
    if error.goes_on:
        lines.append(f"To continue without it: {' or '.join(error.goes_on)}.")
    return " ".join(" ".join(lines).split())


def _made(person: BatchPerson, imported: Imported, out: Path) -> ImportOutcome:
    found = imported.found
    kinetics = bool(found.forces)
    counts = [
        sum(len(valid_cycles(walk, side, kinetics=kinetics)) for walk in found.trials)
        for side in SIDES
    ]
    rows = limit_rows(found)
    states = Counter(row.state for row in rows)
    return ImportOutcome(
        name=person.name,
        made=True,
        trials=f"{len(found.trials)} of {len(person.trials)}",
        cycles=f"{counts[0]} right, {counts[1]} left",
        reason="",
        page=str(out / person.name / FOLDER / "recording.html"),
        limits=", ".join(f"{states[state]} {state}" for state in get_args(State)),
        failed="; ".join(
            failure(row.name, row.value, row.limit, row.unit) for row in rows if row.failed
        ),
        not_judged=not_judged(found),
        warnings="; ".join(
            re.sub(r"\s+", " ", text.strip().rstrip("."))
            for step, text in found.decisions
            if step in ("warnings", "trials")  # of these, those that are left out
        ),
    )


def _write(path: Path, outcomes: Sequence[ImportOutcome]) -> None:
    names = [field.name for field in fields(ImportOutcome)]
    write_text(path, csv_text([names, *(asdict(each).values() for each in outcomes)]))
