"""The command that makes virtual people."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli import display
from gaitval.cli.app import ConfigOption, SetOption, command
from gaitval.errors import ConfigurationError


@command(
    "gaitval virtual --number 3 --out runs/virtual",
    "gaitval virtual --around 8 --by stature --seed 7 --out runs/virtual",
    "gaitval identify runs/virtual/V7_000.toml",
)
def virtual(
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Folder for the files.")
    ] = Path("reports/virtual"),
    number: Annotated[
        int, typer.Option("--number", metavar="N", help="Which person of the seed.", min=0)
    ] = 0,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Seed.", min=0)] = 0,
    around: Annotated[
        str,
        typer.Option("--around", metavar="SUBJECT", help="Whose body and gait it is drawn around."),
    ] = "5",
    by: Annotated[
        str,
        typer.Option(
            "--by",
            metavar="HOW",
            help="How the body was measured: markers, or stature alone, which knows it worse.",
        ),
    ] = "markers",
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Make a virtual person whose true body is known: a subject file, and the truth beside it.

    A body is drawn from what is uncertain about a person's scaling, walks with the general policy,
    and is measured with a laboratory's errors (`noise` in the configuration). Identify it like
    anyone else, and compare with NAME-truth.json.
    """
    from gaitval.artefacts import write_json, write_text
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.model.parameters import PARAMETERS
    from gaitval.study.run import general_walker
    from gaitval.virtual.person import virtual_person

    if by not in ("markers", "stature"):
        raise ConfigurationError(f"--by {by}: give markers or stature.")
    configuration = load_configuration(config, settings=settings or ())
    person = load_subject(around)
    if by == "stature":
        person = person.by_stature()
    policy = general_walker(configuration.environment)
    found = virtual_person(number, seed, person, policy, configuration)
    path = out / f"{found.subject.identifier}.toml"
    write_text(path, found.subject.to_toml())
    truth = {name: float(each) for name, each in zip(PARAMETERS, found.truth, strict=True)}
    write_json(out / f"{found.subject.identifier}-truth.json", truth)
    display.output.print(f"{path}: a virtual person; the truth is beside it.", highlight=False)
