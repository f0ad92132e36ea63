"""Store the results of a finished run, and simulate its policy again to compare."""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import (
    copy_files,
    file_hash,
    read_json,
    read_toml,
    write_json,
)
from gaitval._internal.io.folder_lock import check_links
from gaitval.apps.regression.finished import Record, check_finished, read_records
from gaitval.apps.regression.seal import changes, check_seal, read_seal, seal
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError, GaitvalError, SubjectError
from gaitval.metrics.results import StoredStarts
from gaitval.study.identification_stages import save_identified_reference
from gaitval.study.inputs import (
    IDENTIFIED,
    METRICS,
    STARTS,
    STORED_FILES,
    stored_policy,
    validated_task,
)
from gaitval.study.report_stages import metrics_of, validate_stage
from gaitval.study.scaling_stages import reference_stage, scale_stage
from gaitval.study.stage import Observer, Run, Stage, open_run, run_stage
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.study.walking_stages import push_stage, repeat_stage, simulate_stage

if TYPE_CHECKING:
    from gaitval.metrics.results import Metrics

FIX: Final = (
    "Restore the file, for instance with `git checkout`, or store the baseline again with "
    "`gaitval baseline SUBJECT`."
)
WALKING = ("scale", "reference", "simulate", "repeat", "push", "validate")
"""Stages of a run that `check` runs again, in this order."""


def store_baseline(folder: Path, target: Path, identifier: str | None = None) -> None:
    """Store policy, mu and metrics of the finished run in `folder` as the sealed baseline `target`,
    for `check` and to start trainings from. The seal is written last, so that a baseline of which
    only a part could be written is refused until it is stored again.

    Raises ArtefactError if the run is not finished, was edited, is of another subject than
    `identifier`, or would be refused by every check.
    """
    missing = [name for name in STORED_FILES if not (folder / name).is_file()]
    if missing:
        raise ArtefactError(
            f"{folder}: {', '.join(missing)} missing, so this is not a finished run. Run `gaitval "
            "subject` for it first."
        )
    records = read_records(folder)
    _check_unchanged(folder, records)
    check_finished(folder)
    _check_believed(folder)
    _check_subject(folder, identifier)
    # all that may be refused is read before anything is written
    versions = {name: records[name].version for name in WALKING if name in records}
    known = {name: each for name, each in versions.items() if each is not None}
    check_links(target)
    copy_files(folder, target, STORED_FILES)
    whole = known if len(known) == len(versions) else None
    seal(target, versions=whole, commit=_commit_of(folder))


def _commit_of(folder: Path) -> str | None:
    """The commit of the gaitval that ran in `folder`, as far as its provenance says."""
    provenance = read_json(folder / "provenance.json")
    found = provenance.get("commit") if isinstance(provenance, dict) else None
    return found if isinstance(found, str) else None


def _check_unchanged(folder: Path, records: Mapping[str, Record]) -> None:
    """Refuse files that are not as the stages of a run wrote them."""
    written = {
        name: found for record in records.values() for name, found in (record.outputs or {}).items()
    }
    for name in STORED_FILES:
        if name in written and file_hash(folder / name) != written[name]:
            raise ArtefactError(
                f"{folder / name}: not as the run wrote it. Run `gaitval subject` for it again, "
                "which restores what was changed."
            )


def _check_believed(folder: Path) -> None:
    """Refuse a run whose baseline every check would refuse."""
    try:
        believed(folder / METRICS)
    except ArtefactError as error:
        if not str(error).endswith(FIX):
            raise
        raise ArtefactError(
            f"{str(error).removesuffix(FIX)}Every check would refuse this baseline. Run `gaitval "
            f"subject SUBJECT --out {folder}` again with the settings that it is to have, or "
            f"`gaitval stage validate SUBJECT --out {folder} --force` to measure it with those "
            "that it has."
        ) from None


def _check_subject(folder: Path, identifier: str | None) -> None:
    """Refuse a run of somebody else than was asked for."""
    from gaitval.subjects.subject_file import load_subject

    path = folder / "subject.toml"
    found = load_subject(path).identifier
    if identifier not in (None, found):
        raise ArtefactError(
            f"{path}: is of subject {found}, but a baseline of {identifier} was asked for. Give "
            f"the run folder of {identifier} with --out, or name subject {found}."
        )


def seal_again(baseline: Path) -> None:
    """Seal a stored `baseline` that was changed on purpose, or that an earlier gaitval wrote.
    Raises ArtefactError if it is still incomplete or its files are not of one walk.
    """
    believed(baseline / METRICS)
    try:
        # a new seal does not change what made the stored walk
        before = read_seal(baseline)
    except ArtefactError:
        seal(baseline, versions=None, commit=None)
    else:
        seal(baseline, versions=before.versions, commit=before.commit)


def installed_versions() -> dict[str, int]:
    """The versions of the stages of the installed gaitval that walk and measure."""
    return {name: STAGE_VERSIONS[name] for name in WALKING}


def identified_reference_stage(run: Run) -> Stage:
    """The reference of the identified body of a stored `run`, which does not contain it."""
    return Stage(
        "identified",
        lambda: save_identified_reference(run, run.folder),
        version=STAGE_VERSIONS["identify"],
        inputs=("subject.toml", "model.urdf", "reference.npz", "identification.json"),
        outputs=(IDENTIFIED,),
        values=run.sections("contact", "record"),
    )


def starts_stage(run: Run) -> Stage:
    """The walks of a stored `run` from every start phase, by which a correction is judged before it
    is stored.
    """

    def walk() -> None:
        from gaitval.metrics.rollouts import walked_far
        from gaitval.policy.rollouts import RolloutPool

        task, mu = validated_task(run)
        phases = run.configuration.validation.start_phases
        with RolloutPool(task, workers=run.configuration.training.workers) as pool:
            found = walked_far(pool, stored_policy(run, run.folder / "policy"), mu, phases)
        write_json(run.folder / STARTS, StoredStarts(starts=list(found)).as_dict())

    simulate = simulate_stage(run)
    return replace(
        simulate,
        name="starts",
        run=walk,
        inputs=tuple(name for name in simulate.inputs if name != STARTS),
        outputs=(STARTS,),
    )


def walking_stages(run: Run, *, second_engine: bool) -> tuple[Stage, ...]:
    """The stages of `run` from a stored policy to its walks, with a second engine if
    `second_engine`.
    """
    return (
        scale_stage(run),
        reference_stage(run),
        identified_reference_stage(run),
        starts_stage(run),
        simulate_stage(run, second_engine=second_engine),
    )


def stored_metrics(file: Path) -> "Metrics":
    """The metrics in the `file` of a stored baseline, if they can be trusted and are as stored.
    They lack measures that gaitval has learned since. Raises ArtefactError (see `believed`,
    `seal.check_seal`).
    """
    metrics = believed(file)
    check_seal(file.parent)
    return metrics


def believed(file: Path) -> "Metrics":
    """The metrics in the `file` of a stored baseline, if they can be trusted. Raises ArtefactError
    if they are not readable, or of another configuration, subject or record than those stored
    beside them; PolicyError if the policy cannot be used.
    """
    from gaitval.metrics.results import identification_from, read_metrics
    from gaitval.metrics.validation import provenance_of
    from gaitval.policy.storage import load_policy
    from gaitval.subjects.subject_file import load_subject
    from gaitval.walk.reference.adjustment import Adjustment

    metrics = read_metrics(file)
    folder = file.parent
    check_complete(folder)
    configuration = load_configuration(folder / "configuration.toml")
    load_subject(folder / "subject.toml")  # refuses one that cannot be used
    # loaded for their checks only: a damaged file is refused before a walk takes its time
    load_policy(folder / "policy", environment=configuration.environment)
    mu, correction = folder / "identification.json", folder / "correction.json"
    identification_from(read_json(mu), str(mu))
    Adjustment.from_dict(read_json(correction), str(correction))
    subject = file_gate.read_text(
        folder / "subject.toml", SubjectError, largest=file_gate.SIZES.written
    )
    settings = read_toml(folder / "configuration.toml", ArtefactError)
    beside = provenance_of(subject, settings, metrics.record)
    for name, what in (
        ("configuration", "configuration.toml has other settings than"),
        ("subject", "subject.toml is another than that of"),
        ("record", "the record in it is not that of"),
    ):
        if getattr(beside, name) != getattr(metrics.provenance, name):
            raise ArtefactError(
                f"{file}: {what} the walk that was measured: the hash in `provenance` differs. A "
                f"comparison would not be of like with like. {FIX}"
            )
    return metrics


def check_complete(baseline: Path) -> None:
    """Raise ArtefactError if a file of a stored baseline is missing."""
    missing = [name for name in STORED_FILES if not (baseline / name).is_file()]
    if missing:
        raise ArtefactError(
            f"{baseline}: {', '.join(missing)} missing. A baseline is a whole folder, as "
            "`gaitval baseline SUBJECT` writes it. Give --baseline that folder."
        )


def walk_again(baseline: Path, observer: Observer, *, quick: bool = False) -> "Metrics":
    """Metrics of the policy of a stored `baseline`, walked and validated again with the installed
    code.

    `observer` sees the stages. `quick` walks only what is compared with the record, which takes
    seconds; how far the policy walks and which pushes it survives is then not measured
    (`regression.LONG_MEASURES`).
    """
    from gaitval.subjects.subject_file import load_subject

    check_complete(baseline)
    subject = load_subject(str(baseline / "subject.toml"))
    configuration = load_configuration(baseline / "configuration.toml")
    if quick:
        settings = configuration.validation
        short = {
            "start_phases": settings.start_phases[:1],
            "consecutive_cycles": settings.cycles + 2,
        }
        # Two short walks: a process that takes one off this one starts for as long.
        alone = configuration.training.model_copy(update={"workers": 1})
        configuration = configuration.model_copy(
            update={"validation": settings.model_copy(update=short), "training": alone}
        )
    with _temporary() as temporary:
        try:
            with open_run(subject, configuration, temporary, observer) as run:
                return _walked(run, baseline, quick=quick)
        except GaitvalError as error:
            message = str(error).replace(
                str(temporary), str(baseline)
            )  # theirs, not a copy of ours
            raise type(error)(message).with_way_on(*error.goes_on) from None


@contextmanager
def _temporary() -> Iterator[Path]:
    """A temporary folder to walk in."""
    try:
        made = tempfile.TemporaryDirectory(prefix="gaitval-check-")
    except OSError as error:
        raise ArtefactError(
            f"a check walks in a temporary folder, which cannot be made here: {error}. Make room, "
            "or set TMPDIR to a folder on another disk."
        ) from None
    with made as name:
        yield Path(name)


def changed_inputs(baseline: Path, now: "Metrics") -> list[str]:
    """Dependencies of `baseline` that differ in the new walk with metrics `now`, a phrase each."""
    from gaitval.metrics.results import read_metrics

    return changes(read_seal(baseline), read_metrics(baseline), now, installed_versions())


def _walked(run: Run, baseline: Path, *, quick: bool) -> "Metrics":
    from gaitval.metrics.results import read_metrics

    # `open_run` has written subject and configuration, and the metrics are to be found anew
    copy_files(baseline, run.folder, STORED_FILES[2:-1])
    for stage in walking_stages(run, second_engine=not quick):
        run_stage(stage, run.folder, observer=run.observer)
    if quick:
        return metrics_of(run, pushes=None)
    for stage in (repeat_stage(run), push_stage(run), validate_stage(run)):
        run_stage(stage, run.folder, observer=run.observer)
    return read_metrics(run.folder)
