"""Whether a run folder is finished: whether its figures are those of the files beside them.

A command that is killed, or runs one stage alone, leaves a folder half redone, such as a new policy
beside the figures of the one before. The records of the folder say so. Which gaitval is installed
does not matter: a run of an earlier one is finished, too.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from gaitval._internal.io.artefacts import file_hash, read_json
from gaitval.errors import ArtefactError
from gaitval.metrics.typed import OpenResult
from gaitval.study.stage import RECORDS

LAST: Final = "validate"
"""The stage that writes the figures."""

ONCE: Final = (
    *("scale", "reference", "choose", "correct", "simulate", "repeat", "body", "push", LAST),
    "adopt",  # of a prediction, instead of a training
)
"""Stages up to the figures, each once ..."""
IN_ROUNDS: Final = ("need", "train", "identify", "keep", "evaluate")
"""... and those of every round of Algorithm 1."""


class Record(OpenResult):
    """What a stage depended on and wrote, as hashes by name.

    Attributes
    ----------
    inputs : of files and settings.
    outputs : of files; None while the stage has not ended.
    version : of the stage; None if an earlier gaitval ran it, which recorded none.
    """

    inputs: dict[str, str]
    outputs: dict[str, str] | None
    version: int | None = None


def read_records(folder: Path) -> dict[str, Record]:
    """The records of the run `folder`, by stage. Raises ArtefactError: missing, or edited."""
    path = folder / RECORDS
    values = read_json(path)
    fix = "delete it and run `gaitval subject` again"
    if not isinstance(values, dict):
        raise ArtefactError(
            f"{path}: not the records of a run folder, which are a table by stage; it was edited. "
            f"To go on, {fix}."
        )
    return {
        name: Record.read(value, f"{path}, {name}", file=RECORDS, fix=fix)
        for name, value in values.items()
    }


def why_unfinished(folder: Path) -> str | None:
    """Why the figures of the run `folder` may not be those of its other files, for the middle of a
    message; None if it is finished. Raises ArtefactError (`read_records`).
    """
    records = read_records(folder)
    if LAST not in records:
        return f"{LAST} has not run"
    rounds = _rounds(records)
    for name, record in records.items():
        stage, _, number = name.partition("-")
        counts = name in ONCE or (stage in IN_ROUNDS and number in rounds)
        if counts and record.outputs is None:
            return f"{name} has begun and not ended"
    return _changed(records, folder)


def check_finished(folder: Path) -> None:
    """Refuse the run `folder` unless it is finished (`why_unfinished`). Raises ArtefactError."""
    reason = why_unfinished(folder)
    if reason is not None:
        raise ArtefactError(
            f"{folder}: not a finished run: {reason}. Its metrics may not be those of its policy. "
            "Run its command again with the options that it is to have, such as `gaitval subject "
            f"SUBJECT --out {folder}`; it runs what is left."
        )


def _rounds(records: Mapping[str, Record]) -> set[str]:
    """Numbers of the rounds of Algorithm 1 that the result was chosen from. Records of later ones
    are of a run before, which had more.
    """
    chosen = records.get("choose")
    files = chosen.inputs if chosen else ()
    return {name.split("/")[1] for name in files if name.startswith("rounds/")}


def _changed(records: Mapping[str, Record], folder: Path) -> str | None:
    """Of all files that the figures depend on, one that changed after a stage used it."""
    for name, found in (records[LAST].outputs or {}).items():
        if _hash(folder / name) != found:
            return f"{name} is not as {LAST} wrote it"
    left, seen = [LAST], {LAST}
    while left:
        reader = left.pop()
        for name, found in records[reader].inputs.items():
            if "." not in name:  # a setting
                continue
            if _hash(folder / name) != found:
                return f"{name} is not as {reader} read it"
            written = {
                stage: record.outputs[name]
                for stage, record in records.items()
                if record.outputs and name in record.outputs
            }
            writers = {stage for stage, each in written.items() if each == found}
            if written and not writers:
                return f"{name} is not as {' or '.join(written)} wrote it"
            left += writers - seen
            seen |= writers
    return None


def _hash(path: Path) -> str | None:
    return file_hash(path) if path.is_file() else None
