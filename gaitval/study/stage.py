"""What a stage is: its files, its fingerprint, and the records of a run folder."""

import shlex
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic, time_ns
from typing import TYPE_CHECKING, Any, Final

import tomli_w

from gaitval._internal.io.artefacts import (
    file_hash,
    read_json,
    read_toml,
    value_hash,
    versions,
    write_json,
    write_text,
)
from gaitval._internal.io.build_info import source_commit
from gaitval._internal.io.folder_lock import locked
from gaitval._internal.numba.one_thread import one_thread
from gaitval.errors import ArtefactError, ConfigurationError

if TYPE_CHECKING:
    from gaitval.configuration import Configuration
    from gaitval.gait.record import GaitRecord
    from gaitval.subjects.prediction.known import KnownRecord
    from gaitval.subjects.subject import Subject
    from gaitval.walk.reference.motion import ReferenceMotion

RECORDS = "stages.json"
"""What each stage of a run folder depended on and wrote."""

CONFIGURATION = "configuration.toml"
"""The settings of the last command."""

INTERRUPTED = "was interrupted"
"""The reason to run a stage that can resume."""

SHORT: Final = {
    "need": "whether the person needs training",
    "keep": "which policy to keep",
    "evaluate": "the error epsilon of the walk",
    "choose": "the best round",
    "repeat": "walks from every start phase with noise",
    "body": "what the record says of the body",
}
"""Short stages without a command, and what each finds: they run before what depends on them."""

BESIDE = "started beside another"
"""The reason to wait for a stage that another process began earlier."""


def in_words(stage: str) -> str:
    """The name of a `stage`, with what it finds where no command explains it."""
    about = SHORT.get(stage.partition("-")[0])
    return f"{stage} ({about})" if about else stage


class Observer:
    """Receives what the stages report. This one ignores it; the command line's prints it."""

    def say(self, message: str) -> None:
        """One line for the user."""

    def skipped(self, stage: str) -> None:
        """`stage` was up to date."""

    def started(self, stage: str, reason: str) -> None:
        """`stage` runs now, because of `reason`."""

    def progress(self, values: Mapping[str, float]) -> None:
        """Progress of the running stage, as passed to its `on_progress`."""

    def finished(self, stage: str, seconds: float) -> None:
        """`stage` is done."""


@dataclass(frozen=True)
class Stage:
    """One step of a run.

    Attributes
    ----------
    name : as in `stages.json`: `scale`, `train-1`.
    run : writes `outputs`, each whole or not at all (`artefacts.replacing`).
    version : of what `run` computes (`stage_versions`).
    inputs : files that it reads, relative to the run folder.
    outputs : files that it writes, relative to the run folder.
    values : other JSON-serialisable values that it depends on, such as sections of the
        configuration.
    workspace : a folder with what an unfinished run resumes from; emptied before a run with other
        inputs or of another version, which must not resume from it.
    """

    name: str
    run: Callable[[], object]
    version: int
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    values: Mapping[str, Any] = field(default_factory=dict)
    workspace: str | None = None

    def command(self, run: "Run") -> str:
        """The command line that runs this stage of `run` alone."""
        name, _, round_number = self.name.partition("-")
        which = ("--round", round_number) if round_number not in ("", "1") else ()
        return shlex.join(["gaitval", "stage", name, *run.named, *which])


@dataclass(frozen=True)
class Run:
    """A run folder with the subject and the configuration that its stages work on."""

    folder: Path
    subject: "Subject"
    configuration: "Configuration"
    observer: Observer = field(default_factory=Observer)

    @property
    def named(self) -> tuple[str, ...]:
        """The words of a command line that mean this run: its subject, a file if it is not built
        in, and its folder where that is not the usual one.
        """
        from gaitval.subjects.subject_file import builtin_name

        own = self.subject.identifier
        subject = own if builtin_name(own) else f"{own}.toml"
        return (
            (subject,)
            if self.folder == Path("reports") / own
            else (subject, "--out", str(self.folder))
        )

    @property
    def knew_no_kinetics(self) -> bool:
        """Whether the person's moments and forces are unknown, or not to be used."""
        return not self.subject.has_kinetics or self.configuration.record.use == "kinematics"

    def known_record(self, *, speed: float | None = None) -> "KnownRecord":
        """What the run may know of the record; at `speed` m/s instead of the configured one."""
        from gaitval.subjects.prediction.known import known_record
        from gaitval.subjects.subject_file import builtin_subjects

        settings = self.configuration.record
        return known_record(self.subject, settings, builtin_subjects(), speed=speed, forced=True)

    def expected_of(
        self, reference: "ReferenceMotion", *, speed: float | None = None
    ) -> "GaitRecord":
        """What is known of the walk of a `reference`, at `speed` m/s as for `known_record`; on a
        slope or with a load, with the moments and forces of the reference, which nothing else
        tells.
        """
        from gaitval.model.urdf import read_urdf
        from gaitval.subjects.prediction.slopes import is_changed
        from gaitval.walk.reference.fitted_record import with_fitted_kinetics

        record = self.known_record(speed=speed).record
        if not is_changed(self.configuration.record):
            return record
        mass = read_urdf(self.folder / "model.urdf").mass
        return with_fitted_kinetics(record, reference, mass)

    def compared(self) -> "tuple[Subject, GaitRecord]":
        """The person on the trial that the walk is compared with, and its record; at an unrecorded
        speed, the predicted one. Kinetics that were not recorded are expected ones, which judge
        nothing.
        """
        from gaitval.subjects.prediction.known import is_unrecorded, with_expected_kinetics
        from gaitval.subjects.prediction.slopes import is_changed

        settings = self.configuration.record
        if is_unrecorded(settings):
            record = self.known_record().record
            if is_changed(settings):
                from gaitval.walk.reference.motion import ReferenceMotion

                record = self.expected_of(ReferenceMotion.load(self.folder / "reference.npz"))
            at: dict[str, Any] = {
                "walking_speed_m_s": record.speed,
                "plates": None,
                "trial": "predicted",
                "source": f"{self.subject.person} predicted",
                "trials": (self.subject.as_trial(), *self.subject.trials),
            }
            return self.subject.model_copy(update=at), record
        from gaitval.subjects.subject_file import builtin_subjects

        person = self.subject.on_trial(settings.holdout) if settings.holdout else self.subject
        return person, with_expected_kinetics(person, builtin_subjects())

    def sections(self, *names: str) -> dict[str, Any]:
        """Values of some sections of the configuration, for `Stage.values`."""
        values: dict[str, Any] = self.configuration.model_dump(mode="json", include=set(names))
        return values


def fingerprint(stage: Stage, folder: Path) -> dict[str, str]:
    """Hash of every value and file of a run `folder` that `stage` depends on, by name. Raises
    ArtefactError if an input is missing.
    """
    hashes = {name: value_hash(value) for name, value in stage.values.items()}
    for name in stage.inputs:
        if not (folder / name).exists():
            raise ArtefactError(
                f"{folder / name}: no such file, but {stage.name} reads it. Run the stage that "
                "writes it first, or `gaitval subject` for all of them."
            )
        hashes[name] = _hash_of(folder / name)
    return hashes


_SETTLED: Final = 100_000_000
"""ns after which a file that is changed once more has another time: a tick of the clock is less."""
_Same = tuple[str, int, int, int, int]
_hashes: Final[dict[_Same, str]] = {}


def _same_file(path: Path) -> _Same | None:
    """What stays while the file `path` is not written; None if it was just written."""
    about = path.stat()
    if abs(time_ns() - max(about.st_mtime_ns, about.st_ctime_ns)) < _SETTLED:
        return None
    return str(path), about.st_ino, about.st_size, about.st_mtime_ns, about.st_ctime_ns


def _hash_of(path: Path) -> str:
    """`file_hash` of a file that is there, once while nobody writes it: stages share their inputs,
    and each is asked several times whether it is up to date.
    """
    same = _same_file(path)
    if same is None:
        return file_hash(path)
    if same not in _hashes:
        _hashes[same] = file_hash(path)
    return _hashes[same]


def why_run(stage: Stage, folder: Path) -> str | None:
    """Why `stage` has to run in `folder`; None if its files are as written from these inputs."""
    record = _records(folder).get(stage.name)
    if record is None:
        return "not run yet"
    changed = _differences(record["inputs"], fingerprint(stage, folder))
    if changed:
        return f"{', '.join(changed)} changed"
    made_by = record.get("version")
    if made_by != stage.version:
        return f"made by version {made_by} of {stage.name}, which is at version {stage.version} now"
    if record["outputs"] is None:
        return INTERRUPTED
    for name in stage.outputs:
        if not (folder / name).is_file():
            return f"{name} is missing"
        if _hash_of(folder / name) != record["outputs"].get(name):
            return f"{name} was changed or damaged"
    return None


def _differences(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """Names of the hashes that differ, or that only one side has."""
    return [name for name in sorted({*before, *now}) if before.get(name) != now.get(name)]


@dataclass(frozen=True)
class PendingStage:
    """A running stage, as in its records.

    Attributes
    ----------
    reason : why it runs.
    inputs : fingerprint of what it depends on.
    """

    stage: Stage
    folder: Path
    reason: str
    inputs: Mapping[str, str]
    started: datetime


def begin_stage(stage: Stage, folder: Path, *, force: bool = False) -> PendingStage | None:
    """Record that `stage` runs in `folder`, and empty its workspace if it must not resume; None if
    it is up to date and not run by `force`.
    """
    reason = "asked for" if force else why_run(stage, folder)
    if reason is None:
        return None
    records = _records(folder)
    inputs = fingerprint(stage, folder)
    before = records.get(stage.name, {})
    same = before.get("inputs") == inputs and before.get("version") == stage.version
    if stage.workspace and (force or not same):
        shutil.rmtree(folder / stage.workspace, ignore_errors=True)
    # a kill from here on leaves a record without outputs, which `why_run` calls interrupted
    records[stage.name] = {"version": stage.version, "inputs": inputs, "outputs": None}
    write_json(folder / RECORDS, records)
    return PendingStage(stage, folder, reason, inputs, datetime.now(UTC))


def end_stage(started: PendingStage, seconds: float) -> None:
    """Record that the stage `started` has run, and for how many `seconds`."""
    stage, folder = started.stage, started.folder
    outputs = {name: file_hash(folder / name) for name in stage.outputs}
    _add_provenance(  # first: a stage that is recorded as ended is not run again
        folder,
        stage.name,
        {
            "started": started.started.isoformat(timespec="seconds"),
            "finished": datetime.now(UTC).isoformat(timespec="seconds"),
            "seconds": round(seconds, 1),
            "inputs": started.inputs,
        },
    )
    records = _records(folder)  # another stage may have started or ended meanwhile
    records[stage.name] = {"version": stage.version, "inputs": started.inputs, "outputs": outputs}
    write_json(folder / RECORDS, records)


def perform(stage: Stage) -> float:
    """The work of `stage`, with `one_thread`; returns how long it took, s."""
    clock = monotonic()
    with one_thread():
        stage.run()
    return monotonic() - clock


def run_stage(
    stage: Stage, folder: Path, *, force: bool = False, observer: Observer | None = None
) -> bool:
    """Run `stage` in `folder` unless it is up to date, or by `force`; True if it ran. `observer`
    sees it.

    After a kill at any moment the next call finds either the finished stage or an unfinished one,
    which resumes from its workspace where its inputs are still the same.
    """
    observer = observer or Observer()
    started = begin_stage(stage, folder, force=force)
    if started is None:
        observer.skipped(stage.name)
        return False
    observer.started(stage.name, started.reason)
    seconds = perform(stage)
    end_stage(started, seconds)
    observer.finished(stage.name, seconds)
    return True


_last: dict[_Same, dict[str, Any]] = {}
"""The records that were read last, by their file."""


def _records(folder: Path) -> dict[str, Any]:
    path = folder / RECORDS
    if not path.exists():
        return {}
    same = _same_file(path)
    if same not in _last:
        records = _read_records(path)
        if same is None:
            return records
        _last.clear()
        _last[same] = records
    return dict(_last[same])  # whoever adds to them adds to a copy


def _read_records(path: Path) -> dict[str, Any]:
    records: dict[str, Any] = _table(path, Mapping)
    for stage, record in records.items():
        for key in ("inputs", "outputs"):
            # None are the outputs of a stage that has not ended
            unended = key == "outputs" and record.get(key, {}) is None
            if not (unended or isinstance(record.get(key), dict)):
                raise ArtefactError(
                    f"{path}: {stage}: {key} is missing or no table; it was edited. Remove {stage} "
                    "from the file and run the same command again, which runs that stage anew."
                )
    return records


def _table(path: Path, kind: type[Any]) -> dict[str, Any]:
    """A file of our own records: a table by stage, whose values are of a kind."""
    values = read_json(path)
    if not isinstance(values, dict) or not all(isinstance(each, kind) for each in values.values()):
        raise ArtefactError(
            f"{path}: not the records of a run folder; it was edited. Delete it and run the same "
            "command again."
        )
    return values


def _stages(path: Path) -> dict[str, Any]:
    """Times of the stages in `provenance.json`; none if there is no such file."""
    stages = _table(path, object).get("stages", {}) if path.exists() else {}
    if not isinstance(stages, dict):
        raise ArtefactError(f"{path}: stages is no table; it was edited. Delete the file.")
    return stages


def _add_provenance(folder: Path, stage: str, times: Mapping[str, Any]) -> None:
    path = folder / "provenance.json"
    provenance = read_json(path)
    provenance |= {"versions": versions(), "commit": source_commit()}
    # times are kept here and nowhere else, so that all other files of equal runs are equal
    provenance["stages"][stage] = times
    write_json(path, provenance)


@contextmanager
def _undone(folder: Path) -> Iterator[None]:
    """Restore what a run says of itself in `folder` if the block fails before a stage begins."""
    files = [folder / name for name in ("subject.toml", CONFIGURATION, "provenance.json")]
    before = {
        path: path.read_bytes().decode(errors="replace") if path.is_file() else None
        for path in files
    }
    records = folder / RECORDS
    started = records.read_bytes() if records.is_file() else None
    try:
        yield
    except BaseException:
        if started == (records.read_bytes() if records.is_file() else None):
            for path, content in before.items():
                if content is None:
                    path.unlink(missing_ok=True)
                else:
                    write_text(path, content)
        raise


def _check_subject(folder: Path, subject: "Subject") -> None:
    """Refuse to write the run of a `subject` over that of another, whose policy would be lost."""
    try:
        there = read_toml(folder / "subject.toml", ArtefactError).get("identifier")
    except ArtefactError:  # missing or damaged: nothing that could be used again
        return
    if there != subject.identifier:
        raise ConfigurationError(
            f"{folder}: holds a run of {there}, which one of {subject.identifier} would replace. "
            "Give another folder with --out, or delete it."
        )


@contextmanager
def open_run(
    subject: "Subject", configuration: "Configuration", folder: Path, observer: Observer
) -> Iterator[Run]:
    """The run `folder`, locked for this process, with `subject` and `configuration` stored in it;
    `observer` sees its stages.
    Where no stage has started when an exception ends the block, the files are as they were before.
    Raises ConfigurationError if the folder holds a run of another subject.
    """
    with locked(folder), _undone(folder):
        _check_subject(folder, subject)
        plain = subject.model_copy(update={"devices": ()})  # their own stage keeps them
        write_text(folder / "subject.toml", plain.to_toml())
        write_text(folder / CONFIGURATION, tomli_w.dumps(configuration.model_dump(mode="json")))
        path = folder / "provenance.json"
        # read before the file is replaced: the times of earlier stages are kept
        stages = _stages(path)
        write_json(
            path,
            {
                "versions": versions(),
                "commit": source_commit(),
                "seed": configuration.seed,
                "configuration": file_hash(folder / CONFIGURATION),
                "subject": file_hash(folder / "subject.toml"),
                "stages": stages,
            },
        )
        yield Run(folder, subject, configuration, observer)
