"""The command that walks a person at a speed that was not recorded, or that is held out."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import (
    ConfigOption,
    ExtensorOption,
    OutOption,
    SetOption,
    SubjectArgument,
    UseOption,
    added_command,
    with_looks,
)
from gaitval.errors import ConfigurationError

AS_WALKED: Final = 0.005
"""m/s, from a trial's speed within which a speed is that of the trial."""

_UNCERTAIN: Final = (
    "How wrong this is for one person is not known: this person was not recorded on a slope or "
    "with a load. Angles change as they do in the mean of twenty people, who differ; nothing is "
    "added for a load; moments and forces follow from Newton's law. docs/how-to/slope.md says "
    "what published changes it was held against, and where it fails."
)

if TYPE_CHECKING:
    from gaitval.configuration import Configuration, RecordSettings
    from gaitval.metrics.results import Metrics
    from gaitval.subjects.subject import Subject


SpeedOption = Annotated[
    float | None,
    typer.Option("--speed", metavar="M/S", help="Speed to walk at."),
]
HoldoutOption = Annotated[
    str | None,
    typer.Option(
        "--holdout",
        metavar="TRIAL",
        help="Predict this trial of the subject, which is held out, and compare. A name, or "
        "the file of the same person on another trial.",
    ),
]
SlopeOption = Annotated[
    float | None,
    typer.Option(
        "--slope",
        metavar="PERCENT",
        help="Slope of the ground; uphill is positive.",
    ),
]
LoadOption = Annotated[
    float | None,
    typer.Option(
        "--load",
        metavar="PERCENT",
        help="A vest of so much of body mass, up to 40 %.",
    ),
]


@added_command(
    "gaitval predict 5 --speed 0.95",
    "gaitval predict 5 --slope 5 --load 20",
    "gaitval predict 5 --holdout T03",
    "gaitval predict 5 --holdout slow_trial.toml",
    "gaitval predict my_patient.toml --speed 1.3 --use kinematics",
    after="import",
)
def predict(
    subject: SubjectArgument,
    speed: SpeedOption = None,
    holdout: HoldoutOption = None,
    slope: SlopeOption = None,
    load: LoadOption = None,
    use: UseOption = None,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: Annotated[
        bool,
        typer.Option("--force", help="Also beyond 50 % of a speed that was walked; run again."),
    ] = False,
    extensor_positive: ExtensorOption = None,
) -> None:
    """Walk at a speed, on a slope or with a load that was not recorded, or a held-out trial.

    What is expected at that speed follows from the person's other trials and from how other people
    change with speed. A speed takes a minute. Where the general policy falls, one policy of this
    person first learns a range of speeds (5 minutes, once). With --holdout the walk is compared
    with the trial that was held out, beside predictions that need no model: the nearest trial
    copied, the straight line of two trials, the change of other people added. With --slope or
    --load, at the recorded speed unless --speed is given, what other people change there is added
    to the level record, and Newton's law on that ground does the rest.
    """
    from gaitval.configuration import load_configuration
    from gaitval.metrics.results import read_metrics
    from gaitval.study.predicted_study import run_prediction
    from gaitval.study.stage import open_run
    from gaitval.subjects.prediction.slopes import is_changed
    from gaitval.subjects.subject_file import load_subject

    person = load_subject(subject)
    if holdout is not None and holdout.endswith(".toml"):
        # a file of another trial: it is added to the person, and held out by its name
        person = person.with_trial(load_subject(holdout))
        holdout = person.trials[-1].name
    wanted = _wanted(speed, holdout, slope, load, person)
    settings = with_looks(settings, extensor_positive=extensor_positive)
    chosen = [*settings, *([f"record.use={use}"] if use else []), *wanted]
    configuration = load_configuration(config, settings=chosen)
    record = configuration.record
    _check(person, configuration, force)
    folder = out or Path("reports") / _name(person, record)
    # one range for all speeds: a speed in its settings would train it again for each
    of_range = configuration.model_copy(update={"record": record.model_copy(update={"speed": 0.0})})
    at = record.speed or person.on_trial(record.holdout).walking_speed_m_s
    with (
        display.live_view() as live,
        open_run(person, of_range, folder, live) as range_run,
        open_run(person, configuration, folder / f"at-{at:g}", live) as run,
    ):
        run_prediction(run, range_run, force=force)
    metrics = read_metrics(run.folder)
    if record.holdout:
        display.print_errors(metrics)
    else:
        print_distances(metrics, on_a_slope=is_changed(record))
        if is_changed(record):
            display.plain(_UNCERTAIN)
            display.plain(_rates(metrics))
    display.print_report(run.folder)
    changes = ((record.slope, "slope {:+g} %"), (record.cross_slope, "cross-slope {:+g} %"),
               (record.load, "load {:g} %"))  # fmt: skip
    where = "".join(f", {words.format(value)}" for value, words in changes if value)
    display.print_verdict(metrics, where)


def _check(person: "Subject", configuration: "Configuration", force: bool) -> None:
    """Refuse what cannot be predicted, and what was recorded. Raises SubjectError or
    ConfigurationError.
    """
    from gaitval.model.devices.loads import trunk_load
    from gaitval.subjects.prediction.known import known_record
    from gaitval.subjects.prediction.slopes import check_ground, is_changed
    from gaitval.subjects.subject_file import builtin_subjects

    record = configuration.record
    if person.slope_percent:
        raise ConfigurationError(
            f"{person.identifier} was recorded on a slope of {person.slope_percent:g} % "
            "(slope_percent of the subject's file), and a prediction begins with level walking: "
            "other people's changes with speed and slope are from there. Import a trial on level "
            "ground, or walk this one as it is with `gaitval subject`."
        )
    if record.speed and not is_changed(record):
        _check_unwalked(person, record.speed)
    level = record.model_copy(update={"slope": 0.0, "cross_slope": 0.0, "load": 0.0})
    known = known_record(person, level, builtin_subjects(), forced=force)
    if is_changed(record):
        check_ground(known.record, record, configuration.contact)
        if record.load:
            trunk_load(record.load, person.mass_kg)


def _name(person: "Subject", record: "RecordSettings") -> str:
    """The name of the folder of what is predicted of a `person` by the settings of `record`."""
    parts = [
        f"{person.identifier}-range",
        f"without-{record.holdout}" if record.holdout else "",
        "kinematics" if record.use == "kinematics" else "",
        f"slope{record.slope:+g}" if record.slope else "",
        f"across{record.cross_slope:+g}" if record.cross_slope else "",
        f"load{record.load:g}" if record.load else "",
    ]
    return "-".join(part for part in parts if part)


def _check_unwalked(person: "Subject", speed: float) -> None:
    """Refuse to predict what was recorded: the walk would then not be compared with it."""
    for name in (person.trial, *(trial.name for trial in person.trials)):
        walked = person.on_trial(name).walking_speed_m_s
        if abs(walked - speed) < AS_WALKED:
            raise ConfigurationError(
                f"--speed {speed:g}: {person.identifier} was recorded at {walked:g} m/s (trial "
                f"{name}), so there is nothing to predict. Give --holdout {name} to predict that "
                "trial from the others and compare."
            )


def _wanted(
    speed: float | None,
    holdout: str | None,
    slope: float | None,
    load: float | None,
    person: "Subject",
) -> list[str]:
    """Settings for the speed, the trial, or the slope and load to predict."""
    if slope is not None or load is not None:
        if holdout is not None:
            raise ConfigurationError(
                f"--holdout {holdout} with --slope or --load: the trial was walked on the level "
                "without a load, so it says nothing about this walk. Leave one of them out."
            )
        if load is not None and load < 0.0:
            raise ConfigurationError(f"--load {load:g}: nobody carries less than nothing.")
        speed = person.walking_speed_m_s if speed is None else speed
        changed = [f"record.slope={slope or 0.0}", f"record.load={load or 0.0}"]
        return [*_wanted(speed, None, None, None, person), *changed]
    if (speed is None) == (holdout is None):
        raise ConfigurationError(
            "give one of --speed (m/s), --holdout (a trial, whose speed is predicted), and --slope "
            "or --load (%)."
        )
    if holdout is not None and not holdout.strip():
        raise ConfigurationError(
            "--holdout: empty. Give the name of a trial of the subject, such as T03."
        )
    if speed is not None:
        if not 0.0 < speed < math.inf:
            raise ConfigurationError(
                f"--speed {speed:g}: not a walking speed. Give one above zero, in m/s."
            )
        return [f"record.speed={speed}"]
    return [f'record.holdout="{holdout}"']


def _rates(metrics: "Metrics") -> str:
    """What the walk of `metrics` costs, by each model, in a sentence."""
    from gaitval.quantities import METABOLIC_JOINTS, METABOLIC_MUSCLES
    from gaitval.quantities.metabolic_rate import TITLES

    found: dict[str, list[float]] = {}
    for quantity in (METABOLIC_MUSCLES, METABOLIC_JOINTS):
        known = metrics.walk.quantities.get(quantity.name)
        for name, rate in (known.figures.get("gross", {}) if known is not None else {}).items():
            if rate is not None:
                found.setdefault(TITLES.get(name[:-2], "joints"), []).append(rate)
    if not found:
        return "Its metabolic rate is not known: no gait cycle is whole."
    rates = ", ".join(f"{sum(each) / len(each):.2f} ({name})" for name, each in found.items())
    return (
        f"Its gross metabolic rate, W/kg of the person without the load, by model: {rates}. A "
        "difference from the level walk (its report, or `gaitval muscles`) is more credible than "
        "a level; docs/how-to/muscles.md says how far each is off."
    )


def print_distances(metrics: "Metrics", *, on_a_slope: bool = False) -> None:
    """Print, where nothing was recorded, the walk's distance in `metrics` from its prediction,
    beside the errors of predictions of held-out trials, of which there are none `on_a_slope` or
    with a load.
    """
    from rich.table import Table

    from gaitval._internal.text.number_text import unit_sign
    from gaitval.metrics.baselines import group_rows

    errors = metrics.prediction_errors
    held_out = {} if errors is None else {row.group: row for row in errors.groups}
    table = Table(title=f"{metrics.subject.identifier}: distance from the prediction")
    for name in ("mean RMSE", "walk from prediction", "prediction from held-out trials", "unit"):
        table.add_column(name)
    for row in group_rows(metrics):
        known = held_out.get(row.group)
        spread = "" if known is None or known.sd is None else f" ± {known.sd:.2g}"
        table.add_row(
            row.group,
            "fell" if row.walked is None else f"{row.walked:.3g}",
            "not known" if known is None else f"{known.mean:.3g}{spread}",
            unit_sign(row.unit),
        )
    display.output.print(table)
    if errors is not None:
        whose = "of this person" if errors.own else f"of {errors.people} other people"
        display.output.print(
            f"The uncertainty of the prediction is that of {errors.trials} recorded trials "
            f"{whose}, each predicted from the same person's others, from as far in speed.",
            soft_wrap=True,
        )  # fmt: skip
    elif not on_a_slope:
        display.plain(
            "How wrong the prediction is, is not known: no recorded trial is as far in speed from "
            "the same person's others."
        )
