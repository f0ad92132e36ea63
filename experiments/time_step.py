"""Shipped: gaitval/metrics/time_step.csv, how far the physics step changes the result of a study.

    python -m experiments.time_step [S05 ...]            # a minute or two a subject
    python -m experiments.time_step --from DEFAULT QUARTER   # of folders of studies, by subject

The whole main job up to the compared walk is made anew at a quarter of the step: reference,
identification, correction and walk, with actions of the same duration. So it is the change of the
result that a user would have got, not that of one policy replayed at another step, whose correction
was found at the first. Both are made by the code of today. The general policy is the same: it was
trained at the default step.
"""

import argparse
import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from experiments.held_out_runs import walked
from gaitval._internal.io.artefacts import write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval.cli.terminal.display import live_view
from gaitval.configuration import Configuration, load_configuration
from gaitval.metrics.baselines import GROUPS
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import CURVE_UNITS
from gaitval.metrics.results import WalkResult
from gaitval.metrics.typed import array, sided
from gaitval.study.report_stages import metrics_of
from gaitval.study.stage import Run, open_run
from gaitval.subjects.subject_file import BUILTIN, load_subject

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "gaitval" / "metrics" / "time_step.csv"
WORK = ROOT / "reports" / "claims" / "work" / "time_step"
FINER = 4
HEADER = """\
# The study made anew at a quarter of the physics step: by person and group of curves, the RMS
# difference of the mean curves (mean over the group and both sides) and the error shown, in the
# unit. Made by experiments/time_step.py.
"""


def quarter() -> Configuration:
    """The default settings with a quarter of the step, and actions as long."""
    usual = load_configuration().environment
    return load_configuration(
        settings=[
            f"environment.physics_step={usual.physics_step / FINER:g}",
            f"environment.steps_per_action={usual.steps_per_action * FINER}",
        ]
    )


def changes(usual: WalkResult, finer: WalkResult) -> Iterator[tuple[str, str, float, float]]:
    """By group: its name, unit, change of the mean curves from `usual` to `finer`, and the error
    of `usual`.
    """
    for group, (kind, names) in GROUPS.items():
        apart, errors = [], []
        for curve in sided(names):
            one, other = (walk.curves.of(kind)[curve].mean for walk in (usual, finer))
            error = usual.errors.of(kind)[curve]
            if one is None or other is None or error is None:
                raise SystemExit(f"{curve}: the walk has no whole gait cycle to compare")
            apart.append(rms(array(one) - array(other)))
            errors.append(error.rmse)
        yield group, CURVE_UNITS[kind], float(np.mean(apart)), float(np.mean(array(errors)))


def _study(name: str, configuration: Configuration, folder: Path) -> WalkResult:
    with live_view() as live, open_run(load_subject(name), configuration, folder, live) as run:
        walked(run)
        return metrics_of(run, pushes=None).walk


def of_folder(folder: Path) -> WalkResult:
    """The walk of a study in a `folder`, against the record as the code of today compares it."""
    run = Run(
        folder,
        load_subject(str(folder / "subject.toml")),
        load_configuration(folder / "configuration.toml"),
    )
    return metrics_of(run, pushes=None).walk


COLUMNS = ("subject", "group", "unit", "change", "error")


def table(pairs: Mapping[str, tuple[WalkResult, WalkResult]]) -> str:
    """The file, of the usual and the finer walk by subject; rows of the others stay."""
    lines = FILE.read_text("utf-8").splitlines() if FILE.exists() else []
    stored = csv.DictReader(line for line in lines if not line.startswith("#"))
    rows: list[Sequence[object]] = [
        tuple(row[name] for name in COLUMNS) for row in stored if row["subject"] not in pairs
    ]
    for name, pair in pairs.items():
        for group, unit, change, error in changes(*pair):
            rows.append((name, group, unit, f"{change:.3g}", f"{error:.3g}"))
    rows.sort(key=lambda row: str(row[0]))  # groups stay in their order
    return HEADER + csv_text([COLUMNS, *rows])


def main() -> None:
    """Make the studies, or read them, and write the file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", help="all ten if none is named")
    parser.add_argument("--from", dest="folders", nargs=2, type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    pairs = {}
    for name in arguments.subjects or BUILTIN:
        if arguments.folders:
            usual, finer = (of_folder(folder / name) for folder in arguments.folders)
        else:
            usual = _study(name, load_configuration(), WORK / name / "usual")
            finer = _study(name, quarter(), WORK / name / "quarter")
        pairs[name] = usual, finer
        for group, unit, change, error in changes(usual, finer):
            print(f"{name} {group}: {change:.3g} of {error:.3g} {unit}", flush=True)
        write_text(FILE, table(pairs))


if __name__ == "__main__":
    main()
