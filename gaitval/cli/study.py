"""Commands of a subject's run: one for each stage, all of them, and stored baselines."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from importlib.util import find_spec
from inspect import Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitval.artefacts import read_json
from gaitval.errors import ToleranceError
from gaitval.missing_extras import need
from gaitval.terminal import display
from gaitval.terminal.app import (
    ConfigOption,
    ForceOption,
    OutOption,
    PaperOption,
    RoundOption,
    ScratchOption,
    SetOption,
    StartOption,
    SubjectArgument,
    TrainOption,
    UseOption,
    command,
    with_paper,
)

if TYPE_CHECKING:
    from gaitval.metrics.results import Metrics
    from gaitval.study.stage import Run


@contextmanager
def _opened(
    subject: str,
    out: Path | None,
    config: Path | None,
    settings: list[str] | None,
    *,
    keep_settings: bool,
    devices: list[str] | None = None,
) -> Iterator["Run"]:
    """The run of a `subject`; a single stage keeps the settings of its folder."""
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.study.stage import open_run

    person = load_subject(subject)
    if devices:
        from gaitval.apps.devices.of_subject import wearing

        person = wearing(person, devices)
    folder = out or Path("reports") / person.identifier
    stored = folder / "configuration.toml"
    if config is None and keep_settings and stored.is_file():
        config = stored
    configuration = load_configuration(config, settings=settings or ())
    with display.live_view() as live, open_run(person, configuration, folder, live) as run:
        yield run


def _stage(
    name: str,
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
    *,
    round_number: RoundOption = 1,
    scratch: ScratchOption = False,
    paper: PaperOption = None,
) -> Path:
    """Run one stage; returns the run folder."""
    from gaitval.study.one_stage import run_one

    settings = with_paper(settings, paper)
    with _opened(subject, out, config, settings, keep_settings=True) as run:
        run_one(run, name, round_number=round_number, scratch=scratch, force=force)
        return run.folder


def _stage_command(
    *examples: str, takes: Sequence[str] = ()
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make the command of a stage of the function that follows it, which has the stage's name and
    takes the run folder and options of its own. `takes` are those of the stage itself, besides the
    ones that all have (`_stage`).
    """

    def register(after: Callable[..., None]) -> Callable[..., None]:
        _, *every = signature(_stage).parameters.values()
        of_stage = [each for each in every if each.kind != each.KEYWORD_ONLY or each.name in takes]
        _, *own = signature(after).parameters.values()

        @wraps(after)
        def run(**options: Any) -> None:
            given = {each.name: options.pop(each.name) for each in of_stage}
            after(_stage(after.__name__, **given), **options)

        parameters = [each.replace(kind=each.KEYWORD_ONLY) for each in (*of_stage, *own)]
        vars(run)["__signature__"] = Signature(parameters)
        return command(*examples)(run)

    return register


@_stage_command("gaitval scale 5", "gaitval scale my_patient.toml --out runs/patient")
def scale(folder: Path) -> None:
    """Scale the body model to the subject: model.urdf, scaling.csv.

    Segment lengths come from the markers of the standing trial, masses and inertias from de Leva
    (1996). Prints each length with its mass, its ratio to the population mean, and its source.
    """
    display.print_csv(folder / "scaling.csv", f"Body model in {folder / 'model.urdf'}")


@_stage_command("gaitval reference 5")
def reference(_: Path) -> None:
    """Build the reference motion from the recorded gait: reference.npz."""


@_stage_command(
    "gaitval train 5",
    "gaitval train 5 --scratch --set training.samples=500000 --set seed=1",
    "tensorboard --logdir reports/S05",
    takes=("round_number", "scratch"),
)
def train(_: Path) -> None:
    """Train a walking policy (PPO): rounds/1/trained.

    It starts from the general policy, and trains only if that falls with this person or is pushed
    over too often (`--set training.samples=full`: in any case). Interrupt it when you like: the
    same command resumes. The better of start and trained policy is handed on.
    """


@_stage_command(
    "gaitval identify 5",
    "gaitval identify 5 --set identification.method=rollouts",
    takes=("round_number",),
)
def identify(_: Path) -> None:
    """Identify the 14 body parameters mu from the record: identification.json.

    Looks for the lengths and joint locations of the body with which the recorded motion, moments
    and forces agree best, and says of each parameter whether the record determines it. Nothing
    walks for it, and no policy is used (but with identification.method=rollouts that of the round,
    which is trained before); what the record leaves open draws each parameter towards the body as
    scaled.
    """


@_stage_command("gaitval correct 5", "gaitval correct 5 --set correction.steps=0")
def correct(_: Path) -> None:
    """Correct the reference of the trained policy: correction.json.

    Walks, compares with the reference, and changes the motion that the policy is given by a degree
    or so, so that the walk comes closer to the reference (iterative learning control), and three
    tenths of the way to what the run knew of the record. It reads nothing that was held out.
    """


@_stage_command("gaitval simulate 5", "gaitval simulate 5 --set validation.cycles=50")
def simulate(_: Path) -> None:
    """Walk with the trained policy, without pushes: rollouts/.

    The identified body and the nominal one walk the cycles that are compared, from the first start
    phase. The hundred cycles from every start phase are walked by `gaitval correct`.
    """


@_stage_command("gaitval push 5", "gaitval push 5 --set pushes.directions=24")
def push(folder: Path) -> None:
    """Push the walker, and find which pushes it survives: push.json.

    Horizontal pushes of 50 ms at the pelvis, from all directions, at phases of the right gait
    cycle. Prints the largest force up to which the walker survived every tested push.
    """
    from gaitval.metrics.walk_results import StoredPushes

    display.print_pushes(StoredPushes.model_validate(read_json(folder / "push.json")).recovery)


@_stage_command("gaitval validate 5", "gaitval validate 5 --all")
def validate(
    folder: Path,
    every: Annotated[
        bool, typer.Option("--all", help="Also print every limit with every value it was put to.")
    ] = False,
) -> None:
    """Compare the walks with the record and the limits: metrics.json.

    Prints the verdict and what failed. Exit code 1 if a limit that decides the verdict fails or is
    not shown to be kept, or if what decides was not recorded, so not judged. To check a policy
    against its earlier accuracy, use `gaitval check`.
    """
    from gaitval.metrics.results import read_metrics

    metrics = read_metrics(folder)
    if every:
        display.print_tolerances(metrics)
    display.print_verdict(metrics)
    refused = metrics.summary.refused
    if refused:
        raise ToleranceError(
            f"{refused} of {refused + metrics.summary.accepted} values are not accepted: they miss "
            "their limit, or a guess without a model is as near to the record (rows above). All "
            f"errors are in {folder / 'metrics.json'}; `gaitval report` shows the curves."
        )
    _judged(metrics, folder)


def _judged(metrics: "Metrics", folder: Path) -> None:
    """Raise ToleranceError if the verdict of the `metrics` of a run `folder` lacks what decides: it
    is no pass.
    """
    from gaitval.metrics.verdicts import not_judged

    if reason := not_judged(metrics):
        raise ToleranceError(
            f"{reason} The limits that were kept say nothing of this. All that was made is in "
            f"{folder}. To have it judged, import a recording that has it."
        )


@_stage_command(
    "gaitval report 5",
    "gaitval report 5 --paper letter",
    takes=("paper",),
)
def report(folder: Path) -> None:
    """Write the report: report.html and report.pdf, report-details.html, and the numbers behind
    its figures as CSV.

    Exit code 1 if angles, moments or forces were recorded on neither side, so not judged.
    """
    from gaitval.metrics.results import read_metrics

    display.output.print(f"Report: {folder / 'report.html'} and report.pdf")
    _judged(read_metrics(folder), folder)


DeviceOption = Annotated[
    list[str] | None,
    typer.Option(
        "--device", metavar="DEVICE",
        help="Then walk with this device too (`gaitval device --help`). May be repeated.",
    ),
]  # fmt: skip


@command(
    "gaitval subject 5               # from the general policy",
    "gaitval subject 5 --train       # own training, needed or not",
    "gaitval subject 5 --scratch     # from nothing, the paper's way",
    "gaitval subject my_patient.toml --start my_walkers   # from another policy",
    "gaitval subject my_patient.toml --out runs/patient --set seed=1 --set validation.cycles=50",
    "gaitval subject 5 --use kinematics   # knows angles only; moments and forces are predicted",
    "gaitval subject 5 --device hip_exo   # and what the device would do",
    name="subject",
)
def subject_command(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
    train: TrainOption = False,
    scratch: ScratchOption = False,
    start: StartOption = None,
    use: UseOption = None,
    devices: DeviceOption = None,
    paper: PaperOption = None,
) -> None:
    """Run the main job: all stages, from the recorded gait to the report.

    The general policy walks the person; only if it falls, or is pushed over too often, is it
    trained further. Training and identification alternate until epsilon is below
    identification.kappa times the reference's own, until a round gains nothing, or until
    identification.rounds are done (Algorithm 1). Stages that are up to date are skipped.
    Exit code 1 if angles, moments or forces were recorded on neither side, so not judged.
    """
    lacking = [name for name in ("torch", "mujoco", "weasyprint") if find_spec(name) is None]
    if lacking not in ([], ["torch"]):
        need(*lacking)  # before any work
    from gaitval.apps.devices.of_subject import afterwards
    from gaitval.datasets.subject_file import load_subject
    from gaitval.study.run import run_subject

    settings = with_paper(settings, paper)
    if train:
        settings = ["training.samples=full", *(settings or ())]
    if use is not None:
        settings = [*(settings or ()), f"record.use={use}"]
        if use != "all" and out is None:
            out = Path("reports") / f"{load_subject(subject).identifier}-{use}"
    with _opened(subject, out, config, settings, keep_settings=False, devices=devices) as run:
        if scratch or run.configuration.training.samples != "auto":
            need(*lacking)  # the others do without torch, unless the walker falls with them
        device_study = afterwards(run.subject)
        run_subject(run, scratch=scratch, start=start, force=force, afterwards=device_study)
    from gaitval.metrics.results import read_metrics  # a second, in which a run has begun

    metrics = read_metrics(run.folder)
    display.print_groups(metrics)
    display.output.print(f"Report: {run.folder / 'report.html'} and report.pdf")
    display.print_verdict(metrics)
    _judged(metrics, run.folder)


@command("gaitval baseline 5")
def baseline(
    subject: SubjectArgument,
    out: OutOption = None,
    target: Annotated[
        Path | None,
        typer.Option("--to", help="Folder for it; by default RUN FOLDER/baseline."),
    ] = None,
    seal: Annotated[
        bool,
        typer.Option(
            "--seal",
            help="Store nothing: seal the baseline that is there as it is, after a change that is "
            "meant, or if an earlier gaitval wrote it.",
        ),
    ] = False,
) -> None:
    """Store the policy, mu and metrics of a finished run, for `gaitval check`.

    Commit the folder that this writes. It is small, and holds all that `check` needs, with a seal
    from which `check` knows whether it is as it was stored.
    """
    from gaitval.apps.regression import baseline as stored
    from gaitval.datasets.subject_file import load_subject

    identifier = load_subject(subject).identifier
    folder = out or Path("reports") / identifier
    target = target or folder / "baseline"
    if seal:
        stored.seal_again(target)
        display.output.print(f"Sealed {target}")
        return
    stored.store_baseline(folder, target, identifier)
    display.output.print(f"Stored {target}")
