"""The command that says which parameters matter."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli import display
from gaitval.cli.app import ConfigOption, SetOption, SubjectArgument, command


@command("gaitval screen 5", "gaitval screen 5 --out screening.csv")
def screen(
    subject: SubjectArgument,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write the table as CSV.")
    ] = None,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Which parameters of body and ground a walk depends on, and which a record can tell.

    One after the other is moved by a standard deviation of what is known of it, from six random
    bodies, and the general policy walks: the table has the mean change of the curves. SD, after /
    before: what is left of the uncertainty when all are looked for together
    (identification.parameters=extended). About a minute.
    """
    from gaitval.artefacts import write_text
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.identification.prior import prior_sd
    from gaitval.identification.screening import screened, table
    from gaitval.scaling.scaling import scale_subject
    from gaitval.simulation.walker import WalkingTask
    from gaitval.study.run import general_walker

    configuration = load_configuration(config, settings=settings or ())
    person = load_subject(subject)
    record = person.record()
    task = WalkingTask.of(scale_subject(person).model, record, configuration)
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
    joined = [
        [row[0].replace("_", " "), row[1], *(_joined(row[i : i + 2]) for i in (2, 4, 6)), row[-1]]
        for row in rows
    ]
    display.print_rows(joined, f"{person.identifier}: what a parameter does to the walk")


def _joined(cells: list[str]) -> str:
    """A mean and its SD; of the header, the mean's name."""
    mean, spread = cells
    return mean if spread.endswith("SD") else f"{float(mean):.2g} ± {float(spread):.2g}"
