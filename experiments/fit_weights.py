"""What the accuracies asked of the dynamic fit give, in the fit and in the walk.

    python -m experiments.fit_weights walks NAME FOLDER    # keep the errors of the runs FOLDER/Snn
    python -m experiments.fit_weights table                # fits of every set, table in the docs

A set of accuracies trades one error for another. Fits of one set take a minute for ten people and
say where the trade begins; the walk decides, because a reference can look good and not be walkable
(residuals of 2 % of body weight: ten limits lost). The runs of a set are made with its numbers as
the defaults of `RecordAccuracy` and `ConventionAccuracy`.

Writes `reports/fit_weights.json` and the table of docs/learning.md.
"""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from evidence import ROOT
from evidence.marked_table import with_table
from gaitval.artefacts import read_json, write_json
from gaitval.configuration import ContactSettings
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.action_bias import reference_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS
from gaitval.metrics.recorded import by_kind
from gaitval.reference.dynamic_fit import Accuracy, fitted
from gaitval.reference.motion import build_reference
from gaitval.scaling.scaling import scale_subject

STORE: Final = ROOT / "reports" / "fit_weights.json"
PAGE: Final = ROOT / "docs" / "learning.md"
AS_IT_IS: Final = Accuracy()
RECORD: Final = AS_IT_IS.record
CONVENTION: Final = AS_IT_IS.convention
_MOMENTS: Final = RECORD._replace(moment=0.03, adduction_moment=0.08)
_KINETICS: Final = RECORD._replace(
    moment=0.025, adduction_moment=0.10, forward_force=0.006, sideways_force=0.006,
    vertical_force=0.007,
)  # fmt: skip
SETS: Final[Mapping[str, tuple[str, Accuracy]]] = {
    "as-it-is": ("as it is: moments 0.06 Nm/kg, forces 1 % BW", AS_IT_IS),
    "moments": ("moments 0.03 Nm/kg", AS_IT_IS._replace(record=_MOMENTS)),
    "rolling": (
        "and a foot that may roll by 6°",
        Accuracy(
            _MOMENTS,
            convention=CONVENTION._replace(subtalar=np.deg2rad(6.0), toes=np.deg2rad(10.0)),
        ),
    ),
    "between": (
        "moments 0.028, forces 0.7 %; foot 3.5°, trunk 2°, arms 0.3°",
        Accuracy(
            _KINETICS._replace(
                frontal=np.deg2rad(1.1), moment=0.028, forward_force=0.007, vertical_force=0.008
            ),
            convention=CONVENTION._replace(
                subtalar=np.deg2rad(3.5), toes=np.deg2rad(7.0), trunk=np.deg2rad(2.0),
                arms=np.deg2rad(0.3),
            ),
        ),
    ),
    "free": (
        "moments 0.025, forces 0.6 %; hip ab- and adduction, rotation 1.5°, pelvis 2°, foot 6°, "
        "trunk 3°, arms 0.3°",
        Accuracy(
            _KINETICS._replace(frontal=np.deg2rad(1.5), pelvis=np.deg2rad(2.0)),
            convention=CONVENTION._replace(
                subtalar=np.deg2rad(6.0), toes=np.deg2rad(10.0), trunk=np.deg2rad(3.0),
                arms=np.deg2rad(0.3),
            ),
        ),
    ),
}  # fmt: skip
"""What each set asks for."""
OTHER: Final = ("hip_adduction", "hip_rotation", "pelvis_tilt", "pelvis_list", "pelvis_rotation")
SHOWN: Final = {
    "sagittal angles": GROUPS["sagittal angles"],
    "other angles": ("angles", OTHER),
    **{group: GROUPS[group] for group in GROUPS if group != "sagittal angles"},
}
"""Kind and curves of each column."""
Errors = dict[str, float]


def group_means(error: Callable[[str, str], float]) -> Errors:
    """Mean over both sides of the `error` of each kind and curve, by group."""
    return {
        group: float(np.mean([error(kind, f"{name}_{side}") for name in names for side in "rl"]))
        for group, (kind, names) in SHOWN.items()
    }


def fit_errors(subject: Subject, accuracy: Accuracy) -> Errors:
    """RMSE of the fitted reference from the record, by group: degrees, Nm/kg, % BW."""
    model, record, contact = scale_subject(subject).model, subject.record(), ContactSettings()
    reference = fitted(build_reference(record, model, contact), record, model, contact, accuracy)
    found = by_kind(reference_curves(reference, model.mass, record.left_phase))
    truth = by_kind(recorded_curves(record))
    return group_means(lambda kind, name: rms(found[kind][name] - truth[kind][name]))


def walk_errors(run: Path) -> Errors:
    """The same of a run's walk, with the acceptance goals that it reached and the limits of the
    context of use that it fails.
    """
    metrics = read_json(run / "metrics.json")
    errors = metrics["walks"][metrics["final"]]["errors"]
    means = group_means(lambda kind, name: errors[kind][name]["rmse"])
    limits = [row for row in metrics["tolerances"] if row["role"] == "context"]
    failed = sum(row["passed"] is False for row in limits)
    return means | {"goals": metrics["summary"]["goals_reached"], "context": failed}


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
    """Write the table: means of the fits of ten people, and of the walks that are kept."""
    walked = stored()
    lines = [
        "| accuracies | | sagittal angles, ° | other angles, ° | moments, Nm/kg | "
        "vertical, fore-aft, medial, % BW | goals reached | context limits failed |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, (what, accuracy) in SETS.items():
        fits = [fit_errors(load_subject(person), accuracy) for person in BUILTIN]
        lines.append(f"| {what} | fits, {len(fits)} people | {_cells(fits)} | | |")
        found = list(walked.get(name, {}).values())
        if found:
            goals, context = (sum(each[key] for each in found) for key in ("goals", "context"))
            cells = f"{_cells(found)} | {goals:.0f} of {44 * len(found)} | {context:.0f}"
            lines.append(f"| | walks, {len(found)} people | {cells} |")
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "weights", "\n".join(lines)), encoding="utf-8")


def _cells(errors: Sequence[Errors]) -> str:
    mean = {group: float(np.mean([each[group] for each in errors])) for group in SHOWN}
    forces = ", ".join(f"{mean[group]:.2f}" for group in SHOWN if group.endswith("force"))
    angles = f"{mean['sagittal angles']:.2f} | {mean['other angles']:.2f}"
    return f"{angles} | {mean['moments']:.3f} | {forces}"


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
