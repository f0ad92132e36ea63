"""The command that says which parameters matter."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.terminal import display
from gaitval.terminal.app import ConfigOption, SetOption, SubjectArgument, added_command


@added_command("gaitval screen 5", "gaitval screen 5 --out screening.csv", after="subjects")
def screen(
    subject: SubjectArgument,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write the table as CSV.")
    ] = None,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Which parameters of body and ground a walk depends on, and which a record can determine.

    One after the other is moved by a standard deviation of what is known of it, from six random
    bodies, and the general policy walks: the table has the mean change of the curves. SD, after /
    before: what is left of the uncertainty when all are looked for together, sole and legs too. Two
    to three minutes.
    """
    from gaitval.apps.virtual.screening import screened, table
    from gaitval.artefacts import write_text
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.identification.prior import prior_sd
    from gaitval.scaling.scaling import scale_subject
    from gaitval.simulation.walker import WalkingTask
    from gaitval.study.stored_policy import general_walker

    configuration = load_configuration(config, settings=settings or ())
    person = load_subject(subject)
    record = person.record()
    model = scale_subject(person, symmetric=configuration.scaling.symmetric).model
    task = WalkingTask.of(model, record, configuration)
    with display.live_view() as live:
        live.started("screen", f"{person.identifier}, general policy")
        found = screened(
            task,
            general_walker(configuration.environment),
            record,
            prior_sd(person),
            on_progress=lambda done, total: live.progress({"walks": done, "total": total}),
        )
    rows = table(found)
    if out is not None:
        write_text(out, "".join(",".join(row) + "\n" for row in rows))
    display.print_rows(
        [_shown(row) for row in rows], f"{person.identifier}: what a parameter does to the walk"
    )
    display.output.print(
        "Step: a standard deviation of what is known of the parameter (no unit: a factor, "
        "coefficient or logarithm). Mean ± SD over the bodies that could walk before and after "
        "the step (column walks; without an SD there was only one).",
    )
    if out is not None:
        display.plain(f"Table: {out}")


def _shown(row: list[str]) -> list[str]:
    """A row of the table for a terminal: step with its unit, means with their SD."""
    name, step, unit, walks, *effects, ratio = row
    with_unit = step if unit in ("unit", "1") else f"{step} {unit}"
    pairs = [_joined(effects[i : i + 2]) for i in range(0, len(effects), 2)]
    return [name.replace("_", " "), with_unit, walks, *pairs, ratio]


def _joined(cells: list[str]) -> str:
    """A mean and its SD; of the header, the mean's name."""
    mean, spread = cells
    if spread.endswith("SD"):
        return mean
    if mean == "nan":
        return "falls"
    return f"{float(mean):.2g}" + ("" if spread == "nan" else f" ± {float(spread):.2g}")
