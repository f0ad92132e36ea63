"""The command that judges models and results of OpenSim."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.apps.judge.results import JudgeResult


def _file(option: str, what: str) -> typer.models.OptionInfo:
    """An `option` for a file, which may be left out."""
    found: typer.models.OptionInfo = typer.Option(option, metavar="FILE", help=what)
    return found


@added_command(
    "gaitval judge model.osim --ik ik.mot --id id.sto --markers walk.trc "
    "--external-loads grf.xml --out judged",
    "gaitval judge model.osim --mass 74.3 --height 1.725      # the model alone",
    after="report",
)
def judge(
    model: Annotated[Path, typer.Argument(metavar="MODEL.osim")],
    ik: Annotated[Path | None, _file("--ik", "Motion: .mot or .sto of inverse kinematics.")] = None,
    id: Annotated[Path | None, _file("--id", "Results of inverse dynamics, .sto.")] = None,
    markers: Annotated[
        Path | None, _file("--markers", "Trial that inverse kinematics was run on: TRC, C3D.")
    ] = None,
    grf: Annotated[Path | None, _file("--grf", "Ground reaction, .mot or .sto.")] = None,
    external_loads: Annotated[
        Path | None, _file("--external-loads", "Which force acts on which foot, .xml.")
    ] = None,
    mass: Annotated[float | None, typer.Option("--mass", help="Of the person, kg.")] = None,
    height: Annotated[float | None, typer.Option("--height", help="Of the person, m.")] = None,
    belt: Annotated[
        float | None,
        typer.Option(
            "--belt",
            min=0.0,
            max=5.0,
            help="Speed of the treadmill's belt, m/s; as the flat feet move if left out.",
        ),
    ] = None,
    reduced: Annotated[
        bool,
        typer.Option(
            "--reduced", help="The motion is that of RRA: limits of residuals in N and Nm apply."
        ),
    ] = False,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Exit code 1 if a limit failed."),
    ] = False,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the report.")] = Path(
        "judged"
    ),
) -> None:
    """Judge an OpenSim model that was scaled elsewhere, and its results, by gaitval's limits.

    Reads models of OpenSim 3 and 4 without OpenSim. Marker errors, residuals at the root, moments
    beside those of healthy people at the same speed, angles, masses and inertias, right against
    left. Writes OUT/judge.html, judge.pdf and judge.json. Of files in the folder of a gaitval
    import it takes mass, height and belt from there. The exit code is 1 if what decides could not
    be judged: limits that are kept say nothing then. Failed limits leave it 0, as in `gaitval
    import`; with --strict it is 1.
    """
    from gaitval._internal.io.folder_lock import locked
    from gaitval.apps.judge.judge import judge as judged
    from gaitval.apps.judge.request import JudgeRequest
    from gaitval.apps.judge.write import write_judgement

    request = JudgeRequest(
        model=model, ik=ik, id=id, markers=markers, grf=grf,
        external_loads=external_loads, mass=mass, height=height, belt=belt, reduced=reduced,
    )  # fmt: skip
    found = judged(request)
    with locked(out):  # or the page of one and the numbers of another could lie side by side
        result = write_judgement(found, out)
    _say(result, model.name, f"Page: {out / result.NAME}.html")
    if result.undecided or (strict and not result.passed):
        raise typer.Exit(1)


def _say(result: "JudgeResult", model: str, page: str) -> None:
    """Limits that are not kept, what was noticed, what could not be judged, and the page."""
    from gaitval.metrics.recording_limits import WHY_NOT_JUDGED
    from gaitval.metrics.verdicts import SIGNS

    rows = [["limit", "of", "value", "limit", "verdict"]]
    for one in result.limits:
        if one.decides and not one.passed:
            value = "not measured" if one.value is None else f"{one.value:.4g} {one.unit}"
            limit = f"{SIGNS[one.relation]} {one.limit:g} {one.unit}"
            shown = (each.removesuffix(" 1") for each in (value, limit))
            rows.append([one.title, one.target, *shown, "FAILED"])
    if len(rows) > 1:
        display.print_rows(rows, f"{model}: limits that are not kept")
    # First: what it names explains what is said of forces below.
    for reason in result.undecided:
        display.plain(f"NOT JUDGED. {reason}", "red")
    for finding in result.findings:
        if finding not in result.undecided:
            display.plain(finding)
    for reason in result.not_judged:
        display.plain(f"Not judged. {reason}")
    if any(one.verdict == "not judged" for one in result.limits):
        display.plain(f"Not judged. Residuals: {WHY_NOT_JUDGED}; give --reduced for one.")
    kept = sum(one.decides and one.passed for one in result.limits)
    display.plain(f"Limits: {kept} kept, {len(rows) - 1} failed. {page}")
