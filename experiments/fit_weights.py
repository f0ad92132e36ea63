"""What the accuracies asked of the dynamic fit give, in the fit and in the walk.

    python -m experiments.fit_weights walks NAME FOLDER    # keep the errors of the runs FOLDER/Snn
    python -m experiments.fit_weights table                # fits of every set, tables in the docs

A set of accuracies trades one error for another. Fits of one set take a minute for ten people, and
say where the trade begins; the walk decides, because a reference can look good and not be walkable
(residuals of 2 % of body weight: ten limits lost). The sets were chosen on the walks of
`CHOSEN_ON`; the other people had no part in it and are shown by themselves.

Writes `reports/fit_weights.json` and the table of docs/learning.md.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from evidence import ROOT
from evidence.marked_table import with_table
from gaitval.artefacts import write_json
from gaitval.configuration import ContactSettings
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.action_bias import reference_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS, group_rows
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.results import read_metrics
from gaitval.reference.dynamic_fit import INFERENCE, Accuracy, ConventionAccuracy, fitted
from gaitval.reference.motion import build_reference
from gaitval.scaling.scaling import scale_subject

STORE: Final = ROOT / "reports" / "fit_weights.json"
PAGE: Final = ROOT / "docs" / "learning.md"
CHOSEN_ON: Final = ("S01", "S03", "S05", "S07", "S10")
EARLIER: Final = INFERENCE.record
NARROW: Final = INFERENCE.convention
SETS: Final[Mapping[str, tuple[str, Accuracy]]] = {
    "earlier": ("moments to 0.06 Nm/kg", INFERENCE),
    "moments": (
        "moments to 0.03 Nm/kg, else as earlier",
        Accuracy(EARLIER._replace(moment=0.03, adduction_moment=0.08), convention=NARROW),
    ),
    "rolling": (
        "and a foot that may roll by 6°",
        Accuracy(
            EARLIER._replace(moment=0.03, adduction_moment=0.08),
            convention=NARROW._replace(subtalar=np.deg2rad(6.0), toes=np.deg2rad(10.0)),
        ),
    ),
    "chosen": ("as it is", Accuracy(RecordAccuracy(), convention=ConventionAccuracy())),
    "tighter": (
        "moments to 0.02 Nm/kg, else as it is",
        Accuracy(RecordAccuracy(moment=0.02), convention=ConventionAccuracy()),
    ),
}
"""What each set asks for."""
Errors = dict[str, float]


def fit_errors(subject: Subject, accuracy: Accuracy) -> Errors:
    """RMSE of the fitted reference from the record, by group: degrees, Nm/kg, % BW."""
    model, record, contact = scale_subject(subject).model, subject.record(), ContactSettings()
    reference = fitted(build_reference(record, model, contact), record, model, contact, accuracy)
    found = by_kind(reference_curves(reference, model.mass, record.left_phase))
    truth = by_kind(recorded_curves(record))
    return {
        group: float(
            np.mean(
                [
                    rms(found[kind][f"{name}_{side}"] - truth[kind][f"{name}_{side}"])
                    for name in names
                    for side in "rl"
                ]
            )
        )
        for group, (kind, names) in GROUPS.items()
    }


def walk_errors(run: Path) -> Errors:
    """The same of a run's walk, and the acceptance goals that it reached."""
    metrics = read_metrics(run / "metrics.json")
    errors = {row.group: row.walked for row in group_rows(metrics) if row.walked is not None}
    return errors | {"goals": float(metrics.summary.goals_reached)}


def stored() -> dict[str, dict[str, Errors]]:
    """Errors of walks by set and person."""
    found: dict[str, dict[str, Errors]] = json.loads(STORE.read_text()) if STORE.exists() else {}
    return found


def walks(name: str, folder: Path) -> None:
    """Keep the errors of the runs in a folder, or of the baselines in it."""
    runs = {
        person: run
        for person in BUILTIN
        for run in (folder / person, folder / person / "baseline")
        if (run / "metrics.json").is_file()
    }
    kept = stored()
    kept[name] = {person: walk_errors(run) for person, run in sorted(runs.items())}
    write_json(STORE, kept)


def table() -> None:
    """Write the table: means of the fits of ten people, and of the walks of two halves of them."""
    walked = stored()
    others = [person for person in BUILTIN if person not in CHOSEN_ON]
    lines = [
        "| accuracies | | angles, ° | moments, Nm/kg | vertical, fore-aft, medial, % BW | goals |",
        "|---|---|---|---|---|---|",
    ]
    for name, (what, accuracy) in SETS.items():
        fits = [fit_errors(load_subject(person), accuracy) for person in BUILTIN]
        lines.append(f"| {what} | fits, ten people {_cells(fits)} |  |")
        for half, people in (("chosen on", CHOSEN_ON), ("others", others)):
            found = [walked.get(name, {}).get(person) for person in people]
            if all(found):
                reached = sum(each["goals"] for each in found if each)
                cells = _cells([each for each in found if each])
                lines.append(f"| | walks, five {half} {cells} | {reached:.0f} of {44 * 5} |")
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "weights", "\n".join(lines)), encoding="utf-8")


def _cells(errors: Sequence[Errors]) -> str:
    mean = {group: float(np.mean([each[group] for each in errors])) for group in GROUPS}
    forces = ", ".join(f"{mean[group]:.2f}" for group in GROUPS if group.endswith("force"))
    return f"| {mean['sagittal angles']:.2f} | {mean['moments']:.3f} | {forces}"


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    commands = parser.add_subparsers(dest="command", required=True)
    keep = commands.add_parser("walks")
    keep.add_argument("name", choices=SETS)
    keep.add_argument("folder", type=Path)
    commands.add_parser("table")
    arguments = parser.parse_args()
    if arguments.command == "walks":
        walks(arguments.name, arguments.folder)
    else:
        table()


if __name__ == "__main__":
    main()
