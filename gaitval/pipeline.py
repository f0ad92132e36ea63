"""Runs the stages of a subject in order, each only when what it reads has changed.

A stage is a function that reads and writes files of one run folder. `stages.json` there keeps,
for every stage, the hashes of all it depended on and of all it wrote; a stage whose hashes
still hold is skipped. `provenance.json` keeps versions, seed, hashes and wall times. Only
`provenance.json` holds times, so that equal runs give equal files.

Algorithm 1 (train, identify, until epsilon < kappa) is a sequence of such stages, one pair a
round, in `rounds/1`, `rounds/2`, ...; the round with the smallest epsilon is then copied to
`policy/` and `identification.json`, where the later stages read it.
"""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import filelock
import numpy as np
import tomli_w
from numpy.typing import NDArray

from gaitval import __version__
from gaitval.artefacts import (
    file_hash,
    read_json,
    replacing,
    value_hash,
    versions,
    write_json,
    write_text,
)
from gaitval.configuration import Configuration, load_configuration
from gaitval.errors import ArtefactError, PolicyError

if TYPE_CHECKING:
    from gaitval.data.subject import Subject
    from gaitval.policy.storage import Policy
    from gaitval.simulation.walker import WalkingTask

POLICY_FILES = ("policy.safetensors", "policy.json")
"""A stored policy: weights, and everything else about it."""

STORED_FILES = (
    "subject.toml",
    "configuration.toml",
    *(f"policy/{name}" for name in POLICY_FILES),
    "identification.json",
    "correction.json",
    "metrics.json",
)
"""What a baseline keeps of a run folder; enough to walk the policy again."""


TIMES = "times.json"
"""Wall times of the runs that a baseline came of, by what they started from (`_start_kind`)."""

GENERAL = "general"
"""Folder under `reports/`, and under `baselines/` in the package, of the general policy."""

FOLLOWING = ("evaluate", "choose")
"""Short stages without a command: they run by themselves after `identify`."""

INTERRUPTED = "was interrupted"
"""The reason to run a stage that can resume."""


class Observer:
    """Hears what the pipeline does. This one stays silent; the command line's prints."""

    def say(self, message: str) -> None:
        """One line for the user."""

    def skipped(self, stage: str) -> None:
        """`stage` was up to date."""

    def started(self, stage: str, reason: str) -> None:
        """`stage` runs now, because of `reason`."""

    def progress(self, values: Mapping[str, float]) -> None:
        """How far the running stage is: what its `on_progress` gets."""

    def finished(self, stage: str, seconds: float) -> None:
        """`stage` is done."""


@dataclass(frozen=True)
class Stage:
    """One step of a run.

    Attributes
    ----------
    name : as in `stages.json`: `scale`, `train-1`.
    run : writes `outputs`; each of them whole or not at all (`artefacts.replacing`).
    inputs : files that it reads, relative to the run folder.
    outputs : files that it writes, relative to the run folder.
    values : further JSON-able values that it depends on, such as sections of the configuration.
    workspace : a folder of its own, with what an unfinished run resumes from; emptied before
        a run with other inputs, which must not resume from it.
    """

    name: str
    run: Callable[[], object]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    values: Mapping[str, Any] = field(default_factory=dict)
    workspace: str | None = None

    def command(self, subject: str) -> str:
        """The command line that runs this stage for `subject`."""
        name, _, round_number = self.name.partition("-")
        return f"gaitval {name} {subject}" + (f" --round {round_number}" if round_number else "")


@dataclass(frozen=True)
class Run:
    """A run folder with the subject and the configuration that its stages work on."""

    folder: Path
    subject: "Subject"
    configuration: Configuration
    observer: Observer = field(default_factory=Observer)

    def sections(self, *names: str) -> dict[str, Any]:
        """Values of some sections of the configuration, for `Stage.values`."""
        values: dict[str, Any] = self.configuration.model_dump(mode="json", include=set(names))
        return values


# --- running one stage -------------------------------------------------------------------


def fingerprint(stage: Stage, folder: Path) -> dict[str, str]:
    """Hash of everything that a stage depends on, by name."""
    hashes = {"gaitval": value_hash(__version__)}
    hashes |= {name: value_hash(value) for name, value in stage.values.items()}
    for name in stage.inputs:
        try:
            hashes[name] = file_hash(folder / name)
        except FileNotFoundError:
            raise ArtefactError(
                f"{folder / name}: no such file, and {stage.name} reads it. "
                "Run the stage that writes it first, or `gaitval subject` for all of them."
            ) from None
    return hashes


def why_run(stage: Stage, folder: Path) -> str | None:
    """Why a stage has to run; None when its files stand as it wrote them from these inputs."""
    record = _records(folder).get(stage.name)
    if record is None:
        return "not run yet"
    before, now = record["inputs"], fingerprint(stage, folder)
    changed = [name for name in sorted(before | now) if before.get(name) != now.get(name)]
    if changed:
        return f"{', '.join(changed)} changed"
    if record["outputs"] is None:
        return INTERRUPTED
    for name in stage.outputs:
        if not (folder / name).is_file():
            return f"{name} is missing"
        if file_hash(folder / name) != record["outputs"].get(name):
            return f"{name} was changed or damaged"
    return None


def run_stage(
    stage: Stage, folder: Path, *, force: bool = False, observer: Observer | None = None
) -> bool:
    """Run a stage unless it is up to date; True when it ran.

    After a kill at any moment the next call finds either the finished stage or an unfinished
    one, which resumes from its workspace where its inputs are still the same.
    """
    observer = observer or Observer()
    reason = "asked for" if force else why_run(stage, folder)
    if reason is None:
        observer.skipped(stage.name)
        return False
    records = _records(folder)
    inputs = fingerprint(stage, folder)
    same_inputs = records.get(stage.name, {}).get("inputs") == inputs
    if stage.workspace and (force or not same_inputs):
        shutil.rmtree(folder / stage.workspace, ignore_errors=True)
    records[stage.name] = {"inputs": inputs, "outputs": None}
    write_json(folder / "stages.json", records)

    observer.started(stage.name, reason)
    started, clock = datetime.now(UTC), monotonic()
    stage.run()
    seconds = monotonic() - clock

    records[stage.name]["outputs"] = {name: file_hash(folder / name) for name in stage.outputs}
    write_json(folder / "stages.json", records)
    _add_provenance(
        folder,
        stage.name,
        {
            "started": started.isoformat(timespec="seconds"),
            "finished": datetime.now(UTC).isoformat(timespec="seconds"),
            "seconds": round(seconds, 1),
            "inputs": inputs,
        },
    )
    observer.finished(stage.name, seconds)
    return True


def _records(folder: Path) -> dict[str, Any]:
    path = folder / "stages.json"
    records: dict[str, Any] = read_json(path) if path.exists() else {}
    return records


def _add_provenance(folder: Path, stage: str, times: Mapping[str, Any]) -> None:
    path = folder / "provenance.json"
    provenance = read_json(path)
    provenance["versions"] = versions()
    provenance["stages"][stage] = times
    write_json(path, provenance)


# --- the run folder ----------------------------------------------------------------------


@contextmanager
def open_run(
    subject: "Subject", configuration: Configuration, folder: Path, observer: Observer
) -> Iterator[Run]:
    """A run folder, held by this process alone, with the subject and configuration stored."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise ArtefactError(
            f"{folder}: is a file, or lies below one. Give a folder with --out."
        ) from None
    except PermissionError as error:
        raise ArtefactError(
            f"{error.filename}: may not be written to. Give another folder with --out."
        ) from None
    with _held(folder):
        write_text(folder / "subject.toml", subject.to_toml())
        write_text(
            folder / "configuration.toml", tomli_w.dumps(configuration.model_dump(mode="json"))
        )
        path = folder / "provenance.json"
        stages = read_json(path)["stages"] if path.exists() else {}
        write_json(
            path,
            {
                "versions": versions(),
                "seed": configuration.seed,
                "configuration": file_hash(folder / "configuration.toml"),
                "subject": file_hash(folder / "subject.toml"),
                "stages": stages,
            },
        )
        yield Run(folder, subject, configuration, observer)


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    """The folder held by this process alone, until the block or the process ends."""
    # The process is named in a file of its own: Windows lets nobody read a file that is locked.
    lock, holder = filelock.FileLock(folder / ".lock"), folder / ".process"
    try:
        lock.acquire(blocking=False)
    except filelock.Timeout:
        process = f" (process {holder.read_text()})" if holder.exists() else ""
        raise ArtefactError(
            f"{folder}: another gaitval{process} works in this folder. Wait for it to end, or "
            "give this run a folder of its own with --out."
        ) from None
    except OSError as error:
        raise ArtefactError(
            f"{folder / '.lock'}: cannot be locked ({error.strerror}); it must be a plain file "
            "that you may write to. Delete it, or give another folder with --out."
        ) from None
    try:
        write_text(holder, str(os.getpid()))
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def stored_baseline(folder: Path, identifier: str) -> Path | None:
    """Stored policy, mu and metrics for a run folder: its own, the checkout's, the package's."""
    package = Path(__file__).parent
    for candidate in (
        folder / "baseline",
        package.parent / "reports" / identifier / "baseline",
        package / "baselines" / identifier,
    ):
        if (candidate / "metrics.json").is_file():
            return candidate
    return None


def general_policy() -> Path | None:
    """The stored policy of several people that trainings of anybody may start from."""
    package = Path(__file__).parent
    for candidate in (package.parent / "reports" / GENERAL, package / "baselines" / GENERAL):
        if (candidate / POLICY_FILES[0]).is_file():
            return candidate
    return None


def choose_start(run: Run, *, scratch: bool) -> None:
    """Put the policy that round 1 starts from into `start/`, or none with `scratch`: the stored
    one of this body, else the general one.

    A training that is done or under way keeps its start, so that a later call resumes or
    skips instead of training again from a baseline that was rewritten since.
    """
    start = run.folder / "start"
    if not scratch and why_run(train_stage(run, 1), run.folder) in (None, INTERRUPTED):
        return
    shutil.rmtree(start, ignore_errors=True)
    if scratch:
        return
    baseline = stored_baseline(run.folder, run.subject.identifier)
    stored = [baseline / "policy"] if baseline else []
    general = general_policy()
    for source in (*stored, *([general] if general else [])):
        try:
            _start(run, source)
        except PolicyError as error:
            run.observer.say(f"A stored policy is not used: {error}")
            continue
        _copy(source, start, POLICY_FILES)
        kind = "general policy" if source == general else "stored policy of this body"
        run.observer.say(f"Training starts from the {kind} in {source} (--scratch: not).")
        return
    run.observer.say("No stored policy to start from: training from nothing.")


def _start_kind(folder: Path) -> str:
    """What round 1 of a run starts from: `scratch`, or `general` or `warm`, this body's own."""
    about = folder / "start" / POLICY_FILES[1]
    if not about.exists():
        return "scratch"
    return "general" if read_json(about).get("general") else "warm"


def _copy(source: Path, target: Path, names: tuple[str, ...]) -> None:
    for name in names:
        with replacing(target / name) as temporary:
            shutil.copyfile(source / name, temporary)


# --- the stages --------------------------------------------------------------------------

SIMULATION_SECTIONS = ("seed", "contact", "servo", "environment")
LEARNING_SECTIONS = (*SIMULATION_SECTIONS, "reward", "randomisation")


def scale_stage(run: Run) -> Stage:
    """Subject → body model."""

    def scale() -> None:
        from gaitval.scaling.scaling import scale_subject
        from gaitval.scaling.urdf import write_urdf

        body = scale_subject(run.subject)
        write_urdf(body.model, run.folder / "model.urdf")
        with replacing(run.folder / "scaling.csv") as temporary:
            body.frame().to_csv(temporary, index=False)

    return Stage("scale", scale, inputs=("subject.toml",), outputs=("model.urdf", "scaling.csv"))


def reference_stage(run: Run) -> Stage:
    """Recorded gait and body model → reference motion."""

    def build() -> None:
        from gaitval.kinematics.dynamic_fit import consistent_reference
        from gaitval.scaling.urdf import read_urdf

        model = read_urdf(run.folder / "model.urdf")
        contact = run.configuration.contact
        consistent_reference(run.subject.record(), model, contact).save(
            run.folder / "reference.npz"
        )

    return Stage(
        "reference",
        build,
        inputs=("subject.toml", "model.urdf"),
        outputs=("reference.npz",),
        values=run.sections("contact"),
    )


def train_stage(run: Run, round_number: int) -> Stage:
    """One training of Algorithm 1; round 1 starts from `start/` or nothing."""
    training = run.configuration.training
    here = f"rounds/{round_number}/policy"
    before = f"rounds/{round_number - 1}"
    start = f"{before}/policy" if round_number > 1 else "start"
    has_start = round_number > 1 or (run.folder / start).exists()
    earlier = [f"{start}/{name}" for name in POLICY_FILES] if has_start else []
    samples = {
        "scratch": training.samples,
        "general": training.transfer_samples,
        "warm": training.refinement_samples,
    }[_start_kind(run.folder) if round_number == 1 else "warm"]

    def train() -> None:
        from gaitval.policy.storage import save_policy
        from gaitval.policy.training import train

        policy = train(
            _task(run),
            run.folder / here,
            samples=samples,
            start=_start(run, run.folder / start) if has_start else None,
            subject=run.subject.identifier,
            on_progress=run.observer.progress,
        )
        save_policy(policy, run.folder / here)

    return Stage(
        f"train-{round_number}",
        train,
        inputs=("model.urdf", "reference.npz", *earlier),
        outputs=tuple(f"{here}/{name}" for name in (*POLICY_FILES, "training.csv")),
        values=run.sections(*LEARNING_SECTIONS, "training"),
        workspace=here,
    )


def identify_stage(run: Run, round_number: int) -> Stage:
    """One identification of Algorithm 1, of the policy of the same round."""
    here = f"rounds/{round_number}/identification"
    policy = f"rounds/{round_number}/policy"
    before = f"rounds/{round_number - 1}/identification/identification.json"
    values = run.sections(*LEARNING_SECTIONS, "identification")
    # More rounds, or another threshold, do not change what one round finds.
    for name in ("rounds", "kappa"):
        del values["identification"][name]

    def identify() -> None:
        from gaitval.identification.identify import identify

        found = identify(
            _task(run),
            _policy(run, run.folder / policy),
            run.folder / here,
            start=_body_parameters(run.folder / before) if round_number > 1 else None,
            on_progress=run.observer.progress,
        )
        write_json(run.folder / here / "identification.json", found.as_dict())

    return Stage(
        f"identify-{round_number}",
        identify,
        inputs=(
            "model.urdf",
            "reference.npz",
            *(f"{policy}/{name}" for name in POLICY_FILES),
            *([before] if round_number > 1 else []),
        ),
        outputs=(f"{here}/identification.json",),
        values=values,
        workspace=here,
    )


def evaluate_stage(run: Run, round_number: int) -> Stage:
    """Epsilon of a round's policy with the nominal and with the identified body."""
    here = f"rounds/{round_number}"
    identification = f"{here}/identification/identification.json"
    validation = run.configuration.validation
    values = run.sections(*SIMULATION_SECTIONS, "validation")
    # How far other walks go does not change the cycles that are compared.
    del values["validation"]["consecutive_cycles"]

    def evaluate() -> None:
        from gaitval.metrics.comparison import low_pass_of, recorded_curves, simulated_curves
        from gaitval.metrics.cycles import find_cycles
        from gaitval.metrics.epsilon import epsilon
        from gaitval.policy.walking import walk

        task = _task(run)
        policy = _policy(run, run.folder / here / "policy")
        errors = {}
        for which in ("nominal", "identified"):
            rollout = walk(
                task,
                policy,
                mu=_body_parameters(run.folder / identification, which),
                start_phase=validation.start_phases[0],
                cycles=validation.settling_cycles + validation.cycles,
            )
            curves = simulated_curves(
                rollout,
                find_cycles(rollout, run.configuration).first(validation.cycles),
                mass=task.model.mass,
                filters=low_pass_of(task.record, validation.filter_frequency),
            )
            error = epsilon(curves, recorded_curves(task.record))
            errors[which] = None if error is None else error.as_dict()
        write_json(run.folder / here / "epsilon.json", errors)

    return Stage(
        f"evaluate-{round_number}",
        evaluate,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            identification,
            *(f"{here}/policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(f"{here}/epsilon.json",),
        values=values,
    )


def choose_stage(run: Run, rounds: int) -> Stage:
    """The round with the smallest epsilon, copied to where later stages read it."""
    numbers = range(1, rounds + 1)

    def choose() -> None:
        errors = [read_json(run.folder / f"rounds/{number}/epsilon.json") for number in numbers]
        best = min(numbers, key=lambda number: round_epsilon(run, number))
        source = run.folder / f"rounds/{best}"
        _copy(source / "policy", run.folder / "policy", POLICY_FILES)
        _join_logs(
            [run.folder / f"rounds/{number}/policy/training.csv" for number in range(1, best + 1)],
            run.folder / "policy" / "training.csv",
        )
        write_json(
            run.folder / "identification.json",
            {
                **read_json(source / "identification" / "identification.json"),
                "chosen_round": best,
                "epsilon_nominal": errors[best - 1]["nominal"],
                "epsilon_identified": errors[best - 1]["identified"],
                "rounds": [
                    {"round": number, "epsilon": error["identified"]}
                    for number, error in zip(numbers, errors, strict=True)
                ],
            },
        )

    return Stage(
        "choose",
        choose,
        inputs=tuple(
            f"rounds/{number}/{name}"
            for number in numbers
            for name in (
                *(f"policy/{name}" for name in (*POLICY_FILES, "training.csv")),
                "identification/identification.json",
                "epsilon.json",
            )
        ),
        outputs=(
            *(f"policy/{name}" for name in (*POLICY_FILES, "training.csv")),
            "identification.json",
        ),
    )


def _join_logs(logs: Sequence[Path], target: Path) -> None:
    """One log of several trainings that went on from each other."""
    import pandas as pd

    parts = [pd.read_csv(log) for log in logs]
    for before, part in pairwise(parts):
        for name in ("samples", "wall_seconds"):
            part[name] += before[name].iloc[-1]
    with replacing(target) as temporary:
        pd.concat(parts).to_csv(temporary, index=False)


def round_epsilon(run: Run, round_number: int) -> float:
    """Normalised error epsilon at mu* of a finished round; infinite where the walk fell early."""
    error = read_json(run.folder / f"rounds/{round_number}/epsilon.json")["identified"]
    return float("inf") if error is None else float(error["total"])


def correct_stage(run: Run) -> Stage:
    """Policy and mu → the change of the reference with which they walk the record."""

    def correct() -> None:
        from gaitval.correction.correct import correct

        result = correct(
            _task(run),
            _policy(run, run.folder / "policy"),
            _body_parameters(run.folder / "identification.json"),
            on_progress=run.observer.progress,
        )
        write_json(run.folder / "correction.json", result.as_dict())

    validation = run.configuration.validation
    return Stage(
        "correct",
        correct,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            "identification.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=("correction.json",),
        values={
            **run.sections(*SIMULATION_SECTIONS, "correction"),
            # How far other walks go does not change the cycles that are compared.
            "walks": validation.model_dump(mode="json", exclude={"consecutive_cycles"}),
        },
    )


ROLLOUTS = {"nominal": "rollouts/nominal.npz", "identified": "rollouts/identified.npz"}
"""The compared walk with each mu, as far as it is compared."""
WALKS = "rollouts/walks.json"
"""How far the walk from each start phase went."""


def simulate_stage(run: Run) -> Stage:
    """Policy, mu and correction → walks without pushes, of the deterministic policy.

    The identified body with the corrected reference walks from every start phase. The nominal one
    with the reference as it was, which is there to be compared with it, walks from the first, as
    far as it is compared.
    """
    validation = run.configuration.validation

    def simulate() -> None:
        from gaitval.metrics.walks import walk_from
        from gaitval.policy.walking import WalkingPool

        policy = _policy(run, run.folder / "policy")
        planned = {
            "nominal": (_task(run), validation.start_phases[:1], validation.cycles + 2),
            "identified": (
                _corrected_task(run),
                validation.start_phases,
                validation.consecutive_cycles,
            ),
        }
        starts = {}
        workers = run.configuration.training.workers
        for which, (task, phases, cycles) in planned.items():
            mu = _body_parameters(run.folder / "identification.json", which)
            with WalkingPool(task, workers=min(workers, len(phases)), engine="dart") as pool:
                walks = walk_from(
                    pool, policy, mu, phases, cycles=validation.settling_cycles + cycles
                )
            walks.compared.save(run.folder / ROLLOUTS[which])
            starts[which] = [went.as_dict() for went in walks.starts]
        write_json(run.folder / WALKS, starts)

    return Stage(
        "simulate",
        simulate,
        inputs=(
            "model.urdf",
            "reference.npz",
            "identification.json",
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(*ROLLOUTS.values(), WALKS),
        values={
            **run.sections(*SIMULATION_SECTIONS),
            "walks": validation.model_dump(mode="json", exclude={"filter_frequency"}),
        },
    )


def push_stage(run: Run) -> Stage:
    """Policy and mu → which pushes the identified body survives."""
    validation = run.configuration.validation

    def push() -> None:
        from gaitval.metrics.push_recovery import push_recovery

        recovery, traces = push_recovery(
            _corrected_task(run),
            _policy(run, run.folder / "policy"),
            _body_parameters(run.folder / "identification.json"),
            on_progress=run.observer.progress,
        )
        write_json(
            run.folder / "push.json",
            {"recovery": recovery.as_dict(), "traces": [trace.as_dict() for trace in traces]},
        )

    return Stage(
        "push",
        push,
        inputs=(
            "model.urdf",
            "reference.npz",
            "identification.json",
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=("push.json",),
        values={
            **run.sections(*SIMULATION_SECTIONS, "pushes"),
            "settling_cycles": validation.settling_cycles,
        },
    )


def _metrics(run: Run, *, pushes: Mapping[str, Any] | None) -> dict[str, Any]:
    """The walks of the run folder against the record and the tolerances."""
    from gaitval.metrics.validation import validate
    from gaitval.metrics.walks import Endurance, Walks
    from gaitval.scaling.urdf import read_urdf
    from gaitval.simulation.rollout import Rollout

    starts = read_json(run.folder / WALKS)
    nominal, identified = (
        Walks(
            Rollout.load(run.folder / name),
            tuple(Endurance.from_dict(start) for start in starts[which]),
        )
        for which, name in ROLLOUTS.items()
    )
    return validate(
        run.subject,
        run.subject.record(),
        read_urdf(run.folder / "model.urdf"),
        nominal,
        identified,
        run.configuration,
        identification=read_json(run.folder / "identification.json"),
        correction=read_json(run.folder / "correction.json"),
        pushes=pushes,
    )


def validate_stage(run: Run) -> Stage:
    """Walks and pushes against the record and the tolerances → metrics.json."""
    from gaitval.metrics.validation import SCHEMA_VERSION

    def validate() -> None:
        pushes = read_json(run.folder / "push.json")["recovery"]
        write_json(run.folder / "metrics.json", _metrics(run, pushes=pushes))

    return Stage(
        "validate",
        validate,
        inputs=(
            "subject.toml",
            "model.urdf",
            "identification.json",
            "correction.json",
            *ROLLOUTS.values(),
            WALKS,
            "push.json",
        ),
        outputs=("metrics.json",),
        values={
            **run.sections("seed", "contact", "validation"),
            # metrics of an earlier version are not read, so they are written again
            "schema_version": SCHEMA_VERSION,
        },
    )


def report_stage(run: Run) -> Stage:
    """Everything in the run folder → report.html and report.pdf."""

    def report() -> None:
        from gaitval.reporting.report import write_report

        write_report(run.folder)

    return Stage(
        "report",
        report,
        inputs=(
            "subject.toml",
            "configuration.toml",
            "model.urdf",
            "scaling.csv",
            "reference.npz",
            "policy/training.csv",
            "identification.json",
            "metrics.json",
            "push.json",
            *ROLLOUTS.values(),
        ),
        outputs=("report.html", "report.pdf"),
    )


def _policy(run: Run, folder: Path) -> "Policy":
    """The policy in `folder`, refused where it is not for the body and settings of this run."""
    from gaitval.policy.storage import load_policy
    from gaitval.scaling.urdf import model_hash, read_urdf

    return load_policy(
        folder,
        model_hash=model_hash(read_urdf(run.folder / "model.urdf")),
        environment=run.configuration.environment,
    )


def _start(run: Run, folder: Path) -> "Policy":
    """The policy in `folder` to train from: general, or of the body of this run."""
    from gaitval.policy.storage import load_start
    from gaitval.scaling.urdf import model_hash, read_urdf

    body = model_hash(read_urdf(run.folder / "model.urdf"))
    return load_start(
        folder,
        run.configuration.environment,
        model_hash=body,
        hidden_units=run.configuration.training.hidden_units,
    )


def _task(run: Run) -> "WalkingTask":
    """The walking task that training, identification and correction share."""
    from gaitval.kinematics.reference import ReferenceMotion
    from gaitval.scaling.urdf import read_urdf
    from gaitval.simulation.walker import WalkingTask

    return WalkingTask(
        model=read_urdf(run.folder / "model.urdf"),
        record=run.subject.record(),
        reference=ReferenceMotion.load(run.folder / "reference.npz"),
        configuration=run.configuration,
    )


def _corrected_task(run: Run) -> "WalkingTask":
    """The task with the corrected reference, for the walks that are judged."""
    from gaitval.kinematics.correction import Correction, corrected

    task, path = _task(run), run.folder / "correction.json"
    correction = Correction.from_dict(read_json(path), str(path))
    return replace(task, reference=corrected(task.reference, task.model, correction))


def _body_parameters(identification: Path, which: str = "identified") -> NDArray[np.float64]:
    """Mu, (14,), from a file of an identification."""
    return np.array(read_json(identification)[which], dtype=float)


# --- jobs --------------------------------------------------------------------------------


def plan(run: Run, rounds: int) -> tuple[Stage, ...]:
    """All stages in order, with this number of rounds of Algorithm 1."""
    pairs = [
        stage(run, number)
        for number in range(1, rounds + 1)
        for stage in (train_stage, identify_stage, evaluate_stage)
    ]
    return (
        scale_stage(run),
        reference_stage(run),
        *pairs,
        choose_stage(run, rounds),
        correct_stage(run),
        simulate_stage(run),
        push_stage(run),
        validate_stage(run),
        report_stage(run),
    )


def finished_rounds(run: Run) -> int:
    """Number of rounds whose training and identification are up to date."""
    count = 0
    while (run.folder / f"rounds/{count + 1}").exists() and not any(
        why_run(stage(run, count + 1), run.folder) for stage in (train_stage, identify_stage)
    ):
        count += 1
    return count


def run_one(
    run: Run, name: str, *, round_number: int = 1, scratch: bool = False, force: bool = False
) -> None:
    """Run one stage; those before it must be up to date.

    Parameters
    ----------
    name : `scale`, `reference`, `train`, `identify`, `correct`, `simulate`, `push`, `validate`
        or `report`.
    round_number : round of Algorithm 1, for `train` and `identify`.
    scratch : for `train`: from nothing even where there is a stored policy for this body.
    force : run it though it is up to date.

    Raises
    ------
    ArtefactError : an earlier stage has not run, or ran on other inputs or settings.
    """
    repeated = name in ("train", "identify")
    wanted = f"{name}-{round_number}" if repeated else name
    reached = False
    for stage in plan(run, round_number if repeated else max(finished_rounds(run), 1)):
        if stage.name == wanted:
            if wanted == "train-1":
                choose_start(run, scratch=scratch)
                stage = train_stage(run, 1)
            run_stage(stage, run.folder, force=force, observer=run.observer)
            reached = True
        elif stage.name.partition("-")[0] in FOLLOWING:
            run_stage(stage, run.folder, observer=run.observer)
        elif reached:
            return
        else:
            _require(run, stage, name)


def _require(run: Run, stage: Stage, name: str) -> None:
    """Raise ArtefactError unless `stage`, which `name` builds on, is up to date."""
    reason = why_run(stage, run.folder)
    if reason is not None:
        subject = run.subject.identifier
        raise ArtefactError(
            f"{run.folder}: {name} builds on {stage.name}, and that is not up to date: {reason}. "
            f"First run `{stage.command(subject)}` with the same options, or "
            f"`gaitval subject {subject}`, which does all stages."
        )


def run_subject(run: Run, *, scratch: bool = False, force: bool = False) -> None:
    """The main job: every stage that is not up to date, with the loop of Algorithm 1.

    Parameters
    ----------
    scratch : train from nothing even where there is a stored policy for this body.
    force : run every stage, up to date or not.
    """

    def perform(stage: Stage) -> None:
        run_stage(stage, run.folder, force=force, observer=run.observer)

    settings = run.configuration.identification
    perform(scale_stage(run))
    perform(reference_stage(run))
    choose_start(run, scratch=scratch)
    rounds = 0
    epsilon = float("inf")
    while rounds < settings.rounds and epsilon >= settings.kappa:
        rounds += 1
        perform(train_stage(run, rounds))
        perform(identify_stage(run, rounds))
        perform(evaluate_stage(run, rounds))
        epsilon = round_epsilon(run, rounds)
        shown = "the walk fell early" if epsilon == float("inf") else f"epsilon {epsilon:.3f}"
        run.observer.say(f"Round {rounds} of Algorithm 1: {shown}, kappa {settings.kappa:g}.")
    perform(choose_stage(run, rounds))
    perform(correct_stage(run))
    perform(simulate_stage(run))
    perform(push_stage(run))
    perform(validate_stage(run))
    perform(report_stage(run))


def store_baseline(folder: Path, target: Path) -> None:
    """Keep the policy, mu and metrics of a finished run, for `check` and as a start.

    Its wall times go into `TIMES`, beside those of runs that started otherwise.
    """
    missing = [name for name in STORED_FILES if not (folder / name).is_file()]
    if missing:
        raise ArtefactError(
            f"{folder}: {', '.join(missing)} missing, so this is not a finished run. "
            "Run `gaitval subject` for it first."
        )
    _copy(folder, target, STORED_FILES)
    path = target / TIMES
    earlier = read_json(path) if path.exists() else {}
    write_json(path, {**earlier, _start_kind(folder): _times(folder)})


def _times(folder: Path) -> dict[str, Any]:
    """Wall times of a finished run: seconds of each stage of it, and their sum.

    A stage that was interrupted counts its last part only.
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
        "processors": _processors(),
    }


def _processors() -> int:
    """Processors that this process may use; where that is not told, those of the machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def walk_again(baseline: Path, observer: Observer, *, quick: bool = False) -> dict[str, Any]:
    """Metrics of a stored policy, simulated and validated anew with the present code.

    Parameters
    ----------
    quick : only the walks that are compared with the record, in seconds. How far the policy walks
        and which pushes it survives is then not measured (`regression.LONG_MEASURES`).
    """
    from gaitval.data.subject import load_subject

    missing = [name for name in STORED_FILES if not (baseline / name).is_file()]
    if missing:
        raise ArtefactError(
            f"{baseline}: {', '.join(missing)} missing. A baseline is a whole folder, as "
            "`gaitval baseline SUBJECT` writes it; give --baseline the metrics.json in it."
        )
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
        _copy(baseline, run.folder, STORED_FILES[2:-1])
        for stage in (scale_stage, reference_stage, simulate_stage):
            run_stage(stage(run), run.folder, observer=observer)
        if quick:
            return _metrics(run, pushes=None)
        for stage in (push_stage, validate_stage):
            run_stage(stage(run), run.folder, observer=observer)
        metrics: dict[str, Any] = read_json(run.folder / "metrics.json")
    return metrics
