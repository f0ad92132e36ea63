"""Every figure of the paper from our own data, and a page that says what agrees.

    python -m experiments.paper.figures --out paper            # 2 to 3 minutes; `make paper`

The paper: V. Kumar, Modelling Human Kinetics and Kinematics during Walking using Reinforcement
Learning. The stored policy of the subject walks as scaled and as identified, and is pushed; the
bars over six seeds, the ten people's knees and the pushes they survive are read from `reports/`,
where simulations wrote them. Each figure is written as SVG, PNG and CSV, and `index.html` shows all
with what the paper says of them, what our data say, in numbers, and whether that is the same.

Winter's curves carry no licence and are not shipped: the torque loop shows them where the data
folder (`--data`, else GAITVAL_DATA, else ../shared/data) has them, else the published means of
Schwartz 2008.
"""

import argparse
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import jinja2
import matplotlib
from markupsafe import Markup
from matplotlib.backends.backend_agg import FigureCanvasAgg

from experiments.paper import claims as claims
from experiments.paper import data as paper_data
from experiments.paper import drawings as drawings
from gaitval._internal.io.artefacts import replacing, write_text
from gaitval.coordinates import COORDINATES
from gaitval.reporting.drawing import SETTINGS, svg

HERE = Path(__file__).resolve().parent
SUBJECT = "S05"
PIXELS_PER_INCH = 200


@dataclass(frozen=True)
class PaperFigure:
    """One figure of the page.

    Attributes
    ----------
    number : in the paper.
    name : of its files.
    title, source : what it shows; where its curves come from.
    drawn : the figure and its curves.
    claims : of the paper, judged.
    """

    number: str
    name: str
    title: str
    source: str
    drawn: drawings.Drawing
    claims: list[claims.Statement]

    @property
    def verdict(self) -> str:
        """On the whole figure."""
        return claims.counted(self.claims)


def figures(subject: str, simulated: paper_data.Simulated, data: Path | None) -> list[PaperFigure]:
    """All figures of the paper, in its order; they are long to list, each once."""
    runs, errors = paper_data.stored(), paper_data.ablation(subject)
    metrics = runs[subject]
    record = metrics["record"]["curves"]
    final = simulated.walks[paper_data.FINAL]
    loops = drawings.loop_curves(simulated.walks, record, paper_data.winter(data))
    moments, forces = drawings.JOINTS, drawings.FORCES
    cycles = len(final["angles"]["knee_angle_r"])
    walked = f"Stored policy of {subject}, simulated for this page: {cycles} gait cycles"
    stored = "reports/S*/baseline/metrics.json"
    return [
        PaperFigure(
            "1", "figure1_model", "The model", "Scaled body at heel strike of the reference",
            drawings.model(simulated), claims.model(len(COORDINATES)),
        ),
        PaperFigure(
            "2", "figure2_errors", "RMSE of RL and of RL + identification",
            f"{subject}, reports/identification/ablation.json, which "
            "experiments/identification_ablation.py writes: six seeds, mean ± SD, each seed a dot",
            drawings.errors(errors), claims.errors(errors),
        ),
        PaperFigure(
            "3", "figure3_angles", "Lower-limb angles before and after identification",
            walked + " before (above) and after (below) identification, without correction",
            drawings.angles(simulated.walks, record),
            claims.angles(simulated.walks, record["angles"]),
        ),
        PaperFigure(
            "4", "figure4_torque_loop", "Torque loop of the hip",
            walked + " after identification and correction, beside published loops",
            drawings.torque_loop(loops), claims.torque_loop(loops),
        ),
        PaperFigure(
            "5", "figure5_moments", "Joint moments",
            walked + ", mean ± SD, and the record (its plates corrected)",
            drawings.against_record(final, record, "moments", moments, rows=False),
            [claims.against_record(metrics, final, "moments", moments)],
        ),
        PaperFigure(
            "6", "figure6_ground_reaction", "Ground reaction, tangential and vertical",
            walked + ", mean ± SD, and the record (its plates corrected)",
            drawings.against_record(final, record, "forces", forces, rows=True),
            [claims.against_record(metrics, final, "forces", forces)],
        ),
        PaperFigure(
            "7 as the text has it", "figure7a_knee", "Knee of all subjects",
            f"{stored}: ten people instead of five, coloured by speed",
            drawings.knees(runs), claims.knees(runs),
        ),
        PaperFigure(
            "7 as its caption has it", "figure7b_pushes",
            "Stability region at four phases, and velocity around a push",
            f"{subject}: the region from {stored}, the velocities simulated for this page",
            drawings.pushes(metrics["push_recovery"], simulated.traces),
            claims.pushes(runs, subject, simulated.traces),
        ),
        PaperFigure(
            "beside 7b", "figure7c_placement", "Where the next foot lands after a push to the side",
            "Stored policies of a young person and two old ones, simulated for this page, beside "
            "Hof et al. 2010",
            drawings.placement(simulated.placed), claims.placement(simulated.placed),
        ),
    ]  # fmt: skip


def write_figure(figure: PaperFigure, folder: Path) -> str:
    """Write SVG, PNG and CSV of a figure; returns the SVG element."""
    drawn, table = figure.drawn
    with matplotlib.rc_context(SETTINGS):
        text = svg(drawn, figure.name)
        write_text(folder / f"{figure.name}.svg", text)
        FigureCanvasAgg(drawn)
        with replacing(folder / f"{figure.name}.png") as temporary:
            drawn.savefig(temporary, format="png", dpi=PIXELS_PER_INCH, facecolor="white")
    write_text(folder / f"{figure.name}.csv", table.to_csv(float_format="%.6g"))
    return text


def write_page(folder: Path, found: list[PaperFigure], elements: Mapping[str, str]) -> None:
    """Write `index.html` with the figures in it."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    page = environment.from_string((HERE / "page.html.j2").read_text(encoding="utf-8"))
    css = resources.files("gaitval.reporting").joinpath("report.css").read_text("utf-8")
    write_text(
        folder / "index.html",
        page.render(
            figures=found,
            elements={name: Markup(text) for name, text in elements.items()},
            css=Markup(css),
        ),
    )


def write_all(folder: Path, found: list[PaperFigure]) -> None:
    """Write all figures and the page."""
    folder.mkdir(parents=True, exist_ok=True)
    write_page(folder, found, {figure.name: write_figure(figure, folder) for figure in found})


def complete(folder: Path, found: list[PaperFigure]) -> int:
    """How many of the figures with curves have all their files."""
    return sum(
        all((folder / f"{each.name}{end}").stat().st_size > 0 for end in (".svg", ".png", ".csv"))
        for each in found
        if each.number != "1"
    )


def data_folder() -> Path | None:
    """The data beside the checkout, if there are any."""
    folder = Path(os.environ.get("GAITVAL_DATA") or paper_data.ROOT.parent / "shared" / "data")
    return folder if folder.is_dir() else None


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=paper_data.ROOT / "paper")
    parser.add_argument("--data", type=Path, default=data_folder())
    parser.add_argument("--subject", default=SUBJECT, choices=("S02", "S05", "S08"))
    arguments = parser.parse_args()
    began = time.monotonic()
    baseline = paper_data.REPORTS / arguments.subject / "baseline"
    found = figures(arguments.subject, paper_data.simulated(baseline), arguments.data)
    write_all(arguments.out, found)
    for figure in found:
        print(f"figure {figure.number}: {figure.title}: {figure.verdict}")
    seconds = time.monotonic() - began
    print(f"{arguments.out / 'index.html'}, {seconds:.0f} s")


if __name__ == "__main__":
    main()
