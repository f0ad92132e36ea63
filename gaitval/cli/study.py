"""Commands of a subject's run: all stages, one of them, its report, and stored baselines."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal, get_args

import typer

from gaitval._internal.io.artefacts import read_json
from gaitval._internal.text.missing_extras import need
from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import (
    ConfigOption,
    ExtensorOption,
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
    with_looks,
)
from gaitval.errors import ArtefactError, ConfigurationError, ToleranceError

if TYPE_CHECKING:
    from gaitval.metrics.results import Metrics
    from gaitval.study.stage import Run

StageName = Literal[
    "scale", "reference", "train", "identify", "correct", "simulate", "push", "validate"
]
STAGE_NAMES: Final[tuple[str, ...]] = get_args(StageName)


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
    from gaitval.study.stage import open_run
    from gaitval.subjects.subject_file import load_subject

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


StageArgument = Annotated[
    StageName,
    typer.Argument(
        metavar="NAME",
        help="The stage; docs/commands.md says what each does and writes.",
    ),
]
AllOption = Annotated[
    bool,
    typer.Option(
        "--all", help="After validate, also print every limit with every value it was put to."
    ),
]


@command(
    "gaitval stage scale my_patient.toml --out runs/patient",
    "gaitval stage train 5 --scratch --set training.samples=500000 --set seed=1",
    "gaitval stage identify 5 --set identification.method=rollouts",
    "gaitval stage push 5 --set pushes.directions=24",
    "gaitval stage validate 5 --all",
    name="stage",
)
def stage_command(
    name: StageArgument,
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
    round_number: RoundOption = 1,
    scratch: ScratchOption = False,
    every: AllOption = False,
) -> None:
    """Run one stage of a run alone, with the settings of the run folder.

    It refuses to build on a stage that is not up to date, and says which. An interrupted one
    resumes with the same command. Prints the lengths of the body after scale, the largest force
    that was survived after push, and the verdict after validate.

    Exit code 1 of validate: a limit that decides the verdict fails or is not shown to be kept, or
    what decides was not recorded, so not judged. To check a policy against its earlier accuracy,
    use `gaitval check`.
    """
    _refuse_unread(name, {"--round": round_number != 1, "--scratch": scratch, "--all": every})
    from gaitval.study.one_stage import run_one

    with _opened(subject, out, config, settings, keep_settings=True) as run:
        run_one(run, name, round_number=round_number, scratch=scratch, force=force)
    match name:
        case "scale":
            display.print_csv(
                run.folder / "scaling.csv", f"Body model in {run.folder / 'model.urdf'}"
            )
        case "push":
            from gaitval.metrics.results import StoredPushes

            found = StoredPushes.model_validate(read_json(run.folder / "push.json"))
            display.print_pushes(found.recovery)
        case "validate":
            _print_verdict(run.folder, every=every)


def _refuse_unread(name: str, given: Mapping[str, bool]) -> None:
    """Refuse the options of other stages than `name` that are `given`."""
    of = {"--round": ("train", "identify"), "--scratch": ("train",), "--all": ("validate",)}
    for option, is_given in given.items():
        if is_given and name not in of[option]:
            raise ConfigurationError(
                f"{option} is for {' and '.join(of[option])}, and changes nothing about {name}. "
                "Leave it out."
            )


def _print_verdict(folder: Path, *, every: bool) -> None:
    """Print the verdict of a run `folder`, before it `every` limit; raise ToleranceError if it is
    no pass.
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
            "their limit, or a prediction without a model is as near (rows above). All "
            f"errors are in {folder / 'metrics.json'}; `gaitval report {folder}` shows the curves."
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


@command("gaitval report reports/S05", "gaitval report 5 --paper letter")
def report(
    run: Annotated[
        str,
        typer.Argument(
            metavar="RUN",
            help="The folder of a run, a prediction, a stored baseline or an import, or the "
            "subject whose run is in reports (5: reports/S05).",
        ),
    ],
    force: ForceOption = False,
    paper: PaperOption = None,
    extensor_positive: ExtensorOption = None,
) -> None:
    """Write the report of a run again: report.html and report.pdf, report-details.html, and the
    numbers behind its figures as CSV. Of an import, say where its page is.

    Exit code 1 if angles, moments or forces were recorded on neither side, so not judged.
    """
    from gaitval._internal.io.folder_lock import locked
    from gaitval.metrics.results import METRICS, read_metrics
    from gaitval.reporting.report import write_report
    from gaitval.study.one_stage import run_one
    from gaitval.study.stage import RECORDS

    given = _folder_of(run)
    page = given / "recording" / "recording.html"
    if page.is_file() and not (given / METRICS).is_file():
        display.output.print(f"Page: {page} and recording.pdf (an import again writes them anew)")
        return
    folder = _walk_in(given)
    settings = with_looks(None, paper, extensor_positive=extensor_positive)
    stages = (folder / RECORDS).is_file() and not folder.name.startswith("at-")
    if stages:  # a prediction has others, and is written anew as a whole
        subject = str(folder / "subject.toml")
        with _opened(subject, folder, None, settings, keep_settings=True) as opened:
            run_one(opened, "report", force=force)
        written = folder
    else:
        written = given if folder.name == "baseline" else folder
        with locked(written):
            write_report(folder, settings, written)
    display.print_report(written)
    _judged(read_metrics(folder), folder)


def _walk_in(folder: Path) -> Path:
    """Where in a `folder` a finished walk is: in itself, a stored baseline or a prediction."""
    from gaitval.metrics.results import METRICS
    from gaitval.study.stage import RECORDS

    within = [folder, folder / "baseline", *sorted(folder.glob("at-*"))]
    found = [each for each in within if (each / METRICS).is_file() or (each / RECORDS).is_file()]
    if not found:
        raise ArtefactError(
            f"{folder}: no walk is in this folder, so there is nothing to report. Run `gaitval "
            "subject` first, or give the folder of a run."
        )
    if len(found) > 1 and found[0] != folder:
        raise ArtefactError(
            f"{folder}: walks are in {', '.join(map(str, found))}. Give one of these folders."
        )
    return found[0]


def _folder_of(run: str) -> Path:
    """The folder that a `run` is in, given by itself or by its subject."""
    from gaitval.subjects.subject_file import builtin_name, load_subject

    if Path(run).is_dir():
        return Path(run)
    if builtin_name(run) is None and not Path(run).is_file():
        raise ConfigurationError(
            f"{run}: no such folder, and no subject. Give a run folder, such as reports/S05, or "
            "the subject whose run is in reports."
        )
    return Path("reports") / load_subject(run).identifier


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
    extensor_positive: ExtensorOption = None,
) -> None:
    """Run the main job: all stages, from the recorded gait to the report.

    The general policy walks the person; only if it falls, or is pushed over too often, is it
    trained further. Training and identification alternate until epsilon is below
    identification.kappa times the reference's own, until a round gains nothing, or until
    identification.rounds are done (Algorithm 1). Stages that are up to date are skipped.
    Exit code 1 if angles, moments or forces were recorded on neither side, so not judged.
    """
    from gaitval.apps.devices.of_subject import afterwards
    from gaitval.study.run import run_subject
    from gaitval.subjects.subject_file import load_subject

    settings = with_looks(settings, paper, extensor_positive=extensor_positive)
    if train:
        settings = ["training.samples=full", *(settings or ())]
    if use is not None:
        settings = [*(settings or ()), f"record.use={use}"]
        if use != "all" and out is None:
            out = Path("reports") / f"{load_subject(subject).identifier}-{use}"
    with _opened(subject, out, config, settings, keep_settings=False, devices=devices) as run:
        if scratch or run.configuration.training.samples != "auto":
            need("torch")  # the others do without, unless the walker falls with them
        device_study = afterwards(run.subject)
        run_subject(run, scratch=scratch, start=start, force=force, afterwards=device_study)
    from gaitval.metrics.results import read_metrics  # a second, in which a run has begun

    metrics = read_metrics(run.folder)
    display.print_errors(metrics)
    display.print_report(run.folder)
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
    from gaitval.subjects.subject_file import load_subject

    identifier = load_subject(subject).identifier
    folder = out or Path("reports") / identifier
    target = target or folder / "baseline"
    if seal:
        stored.seal_again(target)
        display.output.print(f"Sealed {target}")
        return
    stored.store_baseline(folder, target, identifier)
    display.output.print(f"Stored {target}")
