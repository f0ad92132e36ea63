"""The command that makes virtual people."""

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.errors import ConfigurationError
from gaitval.terminal import display
from gaitval.terminal.app import ConfigOption, SetOption, added_command

if TYPE_CHECKING:
    from gaitval.apps.virtual.harsh import HarshPerson
    from gaitval.apps.virtual.person import VirtualPerson
    from gaitval.apps.virtual.recording import RecordedPerson


@added_command(
    "gaitval virtual --number 3 --out runs/virtual",
    "gaitval virtual --around 8 --by stature --seed 7 --out runs/virtual",
    "gaitval subject runs/virtual/V7_000.toml     # identify it, and walk as it does",
    "gaitval virtual --world harsh --out runs/virtual   # records err otherwise",
    "gaitval virtual --c3d --out runs/recorded",
    after="subjects",
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
    world: Annotated[
        str,
        typer.Option(
            "--world",
            metavar="WORLD",
            help="plain: records err as the identification supposes. harsh: soft tissue moves "
            "with the joints; belt, axes, masses, sole and arms are others, and legs differ.",
        ),
    ] = "plain",
    c3d: Annotated[
        bool,
        typer.Option(
            "--c3d",
            help="Instead of a subject file, write what a laboratory records: standing.c3d, "
            "walking.c3d, and the true angles and moments.",
        ),
    ] = False,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Make a virtual person whose true body is known: a subject file, and the truth beside it.

    A body is drawn from what is uncertain about a person's scaling, walks with the general policy,
    and is measured with a laboratory's errors (`noise` in the configuration). Identify it like
    anyone else, and compare with NAME-truth.json. With --world harsh the record errs in ways that
    the identification does not expect, which NAME-faults.json has. With --c3d it is recorded by
    markers and force plates, to be imported; only the lengths of foot, shank and thigh are drawn
    then. About half a minute.
    """
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.study.stored_policy import general_walker

    by, world = by.lower(), world.lower()
    _check_options(by, world, c3d=c3d)
    configuration = load_configuration(config, settings=settings or ())
    person = load_subject(around)
    if by == "stature":
        person = person.by_stature()
    policy = general_walker(configuration.environment)
    display.messages.print(
        f"Walking: virtual person {number} of seed {seed}, drawn around {person.identifier} "
        f"({person.source}).",
    )
    drawn = (number, seed, person, policy, configuration)
    if c3d:
        from gaitval.apps.virtual.recording import recorded_person

        _write_recording(out / f"V{seed}_{number:03d}", recorded_person(*drawn))
    elif world == "harsh":
        from gaitval.apps.virtual.harsh import harsh_person

        harsh = harsh_person(*drawn)
        _write_person(out, harsh)
        _write_faults(out, harsh)
    else:
        from gaitval.apps.virtual.person import virtual_person

        _write_person(out, virtual_person(*drawn))


def _check_options(by: str, world: str, *, c3d: bool) -> None:
    """Refuse options that are unknown, or do not go together."""
    if by not in ("markers", "stature"):
        raise ConfigurationError(f"--by {by}: give markers or stature.")
    if world not in ("plain", "harsh"):
        raise ConfigurationError(f"--world {world}: give plain or harsh.")
    if c3d and world == "harsh":
        raise ConfigurationError(
            "--world harsh writes mean curves, not --c3d: markers on moving skin are not made yet. "
            "Leave out one of the two."
        )


def _write_faults(out: Path, found: "HarshPerson") -> None:
    """What is wrong with the record beyond noise."""
    from gaitval.artefacts import write_json

    faults = out / f"{found.subject.identifier}-faults.json"
    write_json(faults, found.about())
    display.plain(f"What else is wrong with the record: {faults}")


def _write_person(out: Path, found: "VirtualPerson | HarshPerson") -> None:
    """The subject file and the truth, and how to go on."""
    from gaitval.artefacts import write_json, write_text
    from gaitval.model.parameters import PARAMETERS

    made_of = found.subject
    path = out / f"{made_of.identifier}.toml"
    write_text(path, made_of.to_toml())
    truth = {name: float(each) for name, each in zip(PARAMETERS, found.truth, strict=True)}
    beside = out / f"{made_of.identifier}-truth.json"
    write_json(beside, truth)
    display.plain(
        f"Subject: {path} ({made_of.mass_kg:g} kg, {made_of.height_m:g} m, walks at "
        f"{made_of.walking_speed_m_s:.2f} m/s); truth: {beside} (the {len(truth)} body "
        f"parameters); continue with: gaitval subject {quote(str(path))}"
    )


def _write_recording(folder: Path, made: "RecordedPerson") -> None:
    """The files of a recorded virtual person, and how to go on."""
    from gaitval.artefacts import write_json, write_text
    from gaitval.mocap.c3d_writing import write_c3d
    from gaitval.model.parameters import PARAMETERS

    write_c3d(folder / "standing.c3d", made.standing)
    write_c3d(folder / "walking.c3d", made.walking)
    rows = made.truth()
    write_text(folder / "truth.csv", "".join(",".join(row) + "\n" for row in rows))
    person = made.subject
    about = {
        "mu": {name: float(each) for name, each in zip(PARAMETERS, made.mu, strict=True)},
        "lengths": made.lengths(),
        "mass_kg": person.mass_kg,
        "height_m": person.height_m,
        "sex": person.sex,
        "belt_m_s": made.belt,
    }
    write_json(folder / "truth.json", about)
    trial = made.walking
    seconds, plates = len(trial.markers) / trial.marker_rate, len(trial.plates)
    display.plain(
        f"Recording: {folder} (standing.c3d; walking.c3d, {seconds:g} s, {len(trial.names)} "
        f"markers at {trial.marker_rate:g} Hz, {plates} force plates at {trial.force_rate:g} Hz); "
        f"truth: truth.csv (angles and moments of {len(rows) - 1} frames), truth.json"
    )
    from gaitval.datasets.sample import import_line

    line = import_line(folder, about)
    display.plain(f"Import it: {line}")
