"""The estimate of a run: its curves as a table and on a page, in the folder `estimate` of the run.

The core asks for this module as the part `estimate`, after the walk of a person whose moments and
forces it did not know; `gaitval estimate` asks for it of a finished run.
"""

import csv
import io
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.artefacts import write_text
from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.errors import ConfigurationError
from gaitval.metrics.reference_curves import reference_curves
from gaitval.metrics.results import read_metrics
from gaitval.model.urdf import read_urdf
from gaitval.reference.motion import ReferenceMotion
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.page import write_html
from gaitval.study.sources import PACKAGE, code_of
from gaitval.study.stage import Run, Stage
from gaitval_estimate.deviations import KINETICS, fit_of, learned_from, trial_of
from gaitval_estimate.estimate import Estimate, estimate

FOLDER: Final = "estimate"
TABLE: Final = f"{FOLDER}/estimate.csv"
PAGE: Final = f"{FOLDER}/estimate.html"
Row = tuple[object, ...]
_UNITS: Final = {"moments": "Nm/kg", "forces": "% BW"}
_JOINTS: Final = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
_COLOURS: Final = {"right": "#0072b2", "left": "#d55e00"}


def stage(run: Run) -> Stage:
    """Known record and reference of `run` → the estimate's table and page."""
    return Stage(
        "estimate",
        lambda: write(run),
        inputs=("subject.toml", "model.urdf", "reference.npz", "metrics.json"),
        outputs=(TABLE, PAGE),
        values={
            **run.sections("record"),
            "code": code_of(write, PACKAGE, Path(__file__).parent),
        },
    )


def check(run: Run) -> None:
    """Raise ConfigurationError if `run` knew the moments and forces of the person."""
    if not run.knew_no_kinetics:
        raise ConfigurationError(
            f"{run.folder}: this run knew the person's moments and forces, so there is nothing to "
            "estimate. An estimate is for a person without force plates: give the folder of such a "
            "run, or run this person with --use kinematics."
        )


def of_run(run: Run) -> Estimate:
    """The estimate of the kinetics of `run`; raises as `check`."""
    check(run)
    record, subject, others = run.told().record, run.subject, builtin_subjects()
    reference = ReferenceMotion.load(run.folder / "reference.npz")
    mass = read_urdf(run.folder / "model.urdf").mass
    fit = fit_of(reference_curves(reference, mass, record.left_phase), record)
    same = any(subject.laboratory == other.laboratory for other in others)
    return estimate(trial_of(subject, record, fit), learned_from(subject, others), angles=same)


def write(run: Run) -> Estimate:
    """Write `TABLE` and `PAGE` into the folder of `run`; the errors are those of `of_run`."""
    found = of_run(run)
    curves = read_metrics(run.folder).walk.curves
    walked = [
        [
            [np.nan if v is None else v for v in getattr(curves, kind)[f"{name}_{side}"].mean or ()]
            for kind, name in KINETICS
        ]
        for side in "rl"
    ]
    rows = table(found, walked)
    (run.folder / FOLDER).mkdir(exist_ok=True)
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    write_text(run.folder / TABLE, text.getvalue())
    typical = np.sqrt(np.mean(found.half_width**2, axis=1))
    context = {
        "name": run.subject.identifier,
        "looked_at_angles": found.looked_at_angles,
        "rows": [
            (_title(kind, name), found.weights[i], _scale(kind) * typical[i], _UNITS[kind])
            for i, (kind, name) in enumerate(KINETICS)
        ],
        "drawings": {"estimate": partial(_draw, rows)},
    }
    write_html(run.folder / FOLDER, "estimate", "gaitval_estimate:estimate.html.j2", context)
    return found


def table(found: Estimate, walked: Sequence[Sequence[Sequence[float]]]) -> list[Row]:
    """A header, and a row for each quantity, side and percent of that side's gait cycle.

    Parameters
    ----------
    walked : of each side and of `KINETICS`, the 101 points of the walk in the units of reports;
        none where it made no gait cycle.
    """
    rows: list[Row] = [
        ("quantity", "side", "unit", "percent", "estimate", "plus_minus", "expected", "walk")
    ]
    for i, (kind, name) in enumerate(KINETICS):
        for j, side in enumerate(SIDES):
            for percent, values in enumerate(
                zip(found.kinetics[j, i], found.half_width[i], found.expected[j, i], strict=True)
            ):
                walk = walked[j][i][percent] if len(walked[j][i]) else np.nan
                numbers = [*(_scale(kind) * value for value in values), walk]
                rows.append(
                    (
                        _title(kind, name),
                        side,
                        _UNITS[kind],
                        percent,
                        *(f"{v:.5g}" for v in numbers),
                    )
                )
    return rows


def _title(kind: str, name: str) -> str:
    return f"{_JOINTS.get(name, name.replace('_', ' '))} {kind.removesuffix('s')}"


def _scale(kind: str) -> float:
    return 100.0 if kind == "forces" else 1.0


def _draw(rows: Sequence[Row]) -> str:
    """A panel for each quantity, both sides, as SVG: band and estimate, expectation, walk."""
    with new_figure(7.2) as figure:
        panels = figure.subplots(3, 3).ravel()
        for i, axes in enumerate(panels):
            if i >= len(KINETICS):
                axes.set_axis_off()
                continue
            title, unit = _title(*KINETICS[i]), _UNITS[KINETICS[i][0]]
            for side in SIDES:
                values = np.array(
                    [row[3:] for row in rows if row[:2] == (title, side)], dtype=float
                ).T  # percent, estimate, ±, expected, walk
                percent, mean, width, usual, walk = values
                colour, dashed = _COLOURS[side], "-" if side == "right" else "--"
                axes.fill_between(
                    percent, mean - width, mean + width, color=colour, alpha=0.15, lw=0
                )
                axes.plot(percent, mean, dashed, color=colour, label=f"estimate, {side}")
                axes.plot(percent, walk, dashed, color="#777777", lw=0.7, label=f"walk, {side}")
            axes.plot(percent, usual, ":", color="black", lw=0.9, label="expected of anybody")
            axes.set_title(f"{title}, {unit}")
            axes.set_xlim(0.0, 100.0)
        handles, names = panels[0].get_legend_handles_labels()
        panels[-1].legend(handles, names, loc="center")
        return svg(figure, "estimate")
