"""Store the results of a finished run, and simulate its policy again to compare."""

import os
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from gaitval.artefacts import read_json, write_json
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError
from gaitval.study.inputs import POLICY_FILES, copy_files, start_kind
from gaitval.study.stage import Observer, open_run, run_stage
from gaitval.study.stages import (
    identified_reference_stage,
    metrics_of,
    push_stage,
    reference_stage,
    scale_stage,
    simulate_stage,
    validate_stage,
)

STORED_FILES = (
    "subject.toml",
    "configuration.toml",
    *(f"policy/{name}" for name in POLICY_FILES),
    "identification.json",
    "correction.json",
    "metrics.json",
)
"""What a baseline keeps of a run folder; enough to simulate the policy again."""


TIMES = "times.json"
"""Wall times of the runs that made a baseline, by what they started from (`start_kind`)."""


def store_baseline(folder: Path, target: Path) -> None:
    """Store the policy, mu and metrics of a finished run, for `check` and to start trainings from.

    Its wall times go into `TIMES`, beside those of runs with another start.
    """
    missing = [name for name in STORED_FILES if not (folder / name).is_file()]
    if missing:
        raise ArtefactError(
            f"{folder}: {', '.join(missing)} missing, so this is not a finished run. Run `gaitval "
            "subject` for it first."
        )
    copy_files(folder, target, STORED_FILES)
    path = target / TIMES
    earlier = read_json(path) if path.exists() else {}
    write_json(path, {**earlier, start_kind(folder): _times(folder)})


def _times(folder: Path) -> dict[str, Any]:
    """Wall times of a finished run: seconds of each stage, and their sum.

    For a stage that was interrupted, only its last part counts.
    """
    rounds = len(read_json(folder / "identification.json")["rounds"])
    stages = {
        name: times["seconds"]
        for name, times in read_json(folder / "provenance.json")["stages"].items()
        if int(name.partition("-")[2] or 1) <= rounds
    }
    return {
        "seconds": round(sum(stages.values()), 1),
        "stages": stages,
        "processors": processors(),
    }


def processors() -> int:
    """Processors that this process may use; all of the machine's if that is not known."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def stored_metrics(file: Path) -> dict[str, Any]:
    """The metrics of a stored baseline, if they can be believed.

    Raises
    ------
    ArtefactError : not readable, incomplete, in contradiction to themselves, or of another
        configuration, subject or record than those stored beside them.
    """
    from gaitval.datasets.subject_file import load_subject
    from gaitval.metrics.stored import MEND, believe
    from gaitval.metrics.validation import provenance_of

    metrics: dict[str, Any] = read_json(file)
    believe(metrics, str(file))
    folder = file.parent
    _check_complete(folder)
    configuration = load_configuration(folder / "configuration.toml")
    subject = load_subject(str(folder / "subject.toml"))
    beside = provenance_of(subject, configuration, metrics["record"])
    for name, what in (
        ("configuration", "configuration.toml has other settings than"),
        ("subject", "subject.toml is another than that of"),
        ("record", "the record in it is not that of"),
    ):
        if beside[name] != metrics["provenance"][name]:
            raise ArtefactError(
                f"{file}: {what} the walk that was measured: the hash in `provenance` differs. A "
                f"comparison would not be of like with like. {MEND}"
            )
    return metrics


def _check_complete(baseline: Path) -> None:
    missing = [name for name in STORED_FILES if not (baseline / name).is_file()]
    if missing:
        raise ArtefactError(
            f"{baseline}: {', '.join(missing)} missing. A baseline is a whole folder, as "
            "`gaitval baseline SUBJECT` writes it. Give --baseline that folder."
        )


def walk_again(baseline: Path, observer: Observer, *, quick: bool = False) -> dict[str, Any]:
    """Metrics of a stored policy, simulated and validated again with the installed code.

    Parameters
    ----------
    quick : only the rollouts that are compared with the record, which takes seconds. How far the
        policy walks and which pushes it survives are then not measured
        (`regression.LONG_MEASURES`).
    """
    from gaitval.datasets.subject_file import load_subject

    _check_complete(baseline)
    subject = load_subject(str(baseline / "subject.toml"))
    configuration = load_configuration(baseline / "configuration.toml")
    if quick:
        settings = configuration.validation
        short = {
            "start_phases": settings.start_phases[:1],
            "consecutive_cycles": settings.cycles + 2,
        }
        configuration = configuration.model_copy(
            update={"validation": settings.model_copy(update=short)}
        )
    with (
        tempfile.TemporaryDirectory(prefix="gaitval-check-") as temporary,
        open_run(subject, configuration, Path(temporary), observer) as run,
    ):
        copy_files(baseline, run.folder, STORED_FILES[2:-1])
        for stage in (
            scale_stage,
            reference_stage,
            identified_reference_stage,
            partial(simulate_stage, witness=not quick),
        ):
            run_stage(stage(run), run.folder, observer=observer)
        if quick:
            return metrics_of(run, pushes=None)
        for stage in (push_stage, validate_stage):
            run_stage(stage(run), run.folder, observer=observer)
        metrics: dict[str, Any] = read_json(run.folder / "metrics.json")
    return metrics
