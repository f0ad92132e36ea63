"""What the accuracies asked of the dynamic fit give, in the fit and in the walk.

    python -m experiments.fit_weights walks NAME FOLDER    # keep the errors of the runs FOLDER/Snn
    python -m experiments.fit_weights table                # fits of every set, table in the docs

A set of accuracies trades one error for another. Fits of one set take a minute for ten people and
say where the trade begins; the walk decides, because a reference can look good and not be walkable
(residuals of 2 % of body weight: ten limits lost). The runs of a set are made with its numbers as
the defaults of `RecordAccuracy` and `ConventionAccuracy`. Those of "free" and "tight" had the
correction's earlier weights and 4,096 samples of training; "trained" is the last that trained for
each person.

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
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.reference_curves import reference_curves
from gaitval.reference.dynamic_fit import INFERENCE, Accuracy, fitted
from gaitval.reference.motion import build_reference
from gaitval.scaling.scaling import scale_subject

STORE: Final = ROOT / "reports" / "fit_weights.json"
PAGE: Final = ROOT / "docs" / "learning.md"
_OWN_HIPS: Final = INFERENCE.record._replace(
    moment=0.025,
    adduction_moment=0.10,
    forward_force=0.006,
    sideways_force=0.006,
    vertical_force=0.007,
)
_CHOSEN: Final = Accuracy()
_WIDER: Final = _CHOSEN._replace(
    record=_CHOSEN.record._replace(sagittal=np.deg2rad(1.05), pelvis=np.deg2rad(1.3))
)
SETS: Final[Mapping[str, tuple[str, Accuracy]]] = {
    "as-it-was": ("as it was: moments 0.06 Nm/kg, forces 1 % BW, model's own hips", INFERENCE),
    "free": (
        "model's own hips, moments 0.025, forces 0.6 %; hip ab- and adduction, rotation 1.5°, "
        "pelvis 2°, foot 6°, trunk 3°, arms 0.3°",
        Accuracy(
            _OWN_HIPS._replace(frontal=np.deg2rad(1.5), pelvis=np.deg2rad(2.0)),
            convention=_CHOSEN.convention._replace(
                subtalar=np.deg2rad(6.0), toes=np.deg2rad(10.0), trunk=np.deg2rad(3.0),
                arms=np.deg2rad(0.3),
            ),
        ),
    ),
    "hips": (
        "as it was, about the record's hips",
        INFERENCE._replace(record=INFERENCE.record._replace(hip_centre=0.02)),
    ),
    "tight": (
        "record's hips, moments 0.025, forces 0.6 to 0.7 %; toes 15°, trunk 4.5°, arms 0.3°",
        Accuracy(
            _WIDER.record._replace(
                moment=0.025, forward_force=0.006, sideways_force=0.006, vertical_force=0.007
            ),
            convention=_CHOSEN.convention._replace(
                subtalar=np.deg2rad(3.2), toes=np.deg2rad(15.0), trunk=np.deg2rad(4.5)
            ),
        ),
    ),
    "trained": (
        "record's hips, moments 0.03, forces 0.7 to 1 %; toes 10°, arms 0.3°",
        Accuracy(
            _WIDER.record._replace(
                forward_force=0.0085, sideways_force=0.007, vertical_force=0.010
            )
        ),
    ),
    "forces": (
        "as before, forces 0.6 to 0.95 %; no own training, actions every 6 ms, a correction with "
        "12 harmonics that weighs forces more",
        _WIDER,
    ),
    "mean": ("as before, walked by the general policy that is the mean of two", _WIDER),
    "chosen": (
        "**chosen**: as before, hips, knees and ankles 1.0° instead of 1.05°, pelvis 1.1° instead "
        "of 1.3°",
        _CHOSEN,
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


def table(*, fits: bool = True) -> None:
    """Write the table: means of the `fits` of ten people, if wanted, and of walks that are kept."""
    walked = stored()
    lines = [
        "| accuracies | | sagittal angles, ° | other angles, ° | moments, Nm/kg | "
        "vertical, fore-aft, medial, % BW | goals reached | context limits failed |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, (what, accuracy) in SETS.items():
        if fits:
            errors = [fit_errors(load_subject(person), accuracy) for person in BUILTIN]
            lines.append(f"| {name}: {what} | fits, {len(errors)} people | {_cells(errors)} | | |")
        found = list(walked.get(name, {}).values())
        if found:
            goals, context = (sum(each[key] for each in found) for key in ("goals", "context"))
            cells = f"{_cells(found)} | {goals:.0f} of {44 * len(found)} | {context:.0f}"
            lines.append(f"| {name}: {what} | walks, {len(found)} people | {cells} |")
    lines += ["", *chosen_by_halves(walked)]
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "weights", "\n".join(lines)), encoding="utf-8")


def chosen_by_halves(walked: Mapping[str, Mapping[str, Errors]]) -> list[str]:
    """Choose a set on one half of the people and say what it gives the other half, and back.

    The sets are compared by the mean of the groups' errors of their walks, each over that of the
    walks as they were; and again with the number of failed context limits as one more group.
    """
    sets = [name for name in SETS if len(walked.get(name, {})) == len(BUILTIN)]
    people, lines = sorted(BUILTIN), []
    first, second = people[: len(people) // 2], people[len(people) // 2 :]

    def ratio(name: str, people: Sequence[str], groups: Sequence[str]) -> float:
        means = [
            [np.mean([walked[each][person][group] for person in people]) for group in groups]
            for each in (name, "as-it-was")
        ]
        return float(np.mean(np.divide(*means)))

    for groups, by in (
        (list(SHOWN), "by the errors alone"),
        ([*SHOWN, "context"], "with failed limits of the context of use as one more group"),
    ):
        for chosen_on, reported in ((first, second), (second, first)):
            best = min(sets, key=lambda name: ratio(name, chosen_on, groups))
            given = {name: ratio(name, reported, groups) for name in sets}
            others = ", ".join(f"{name} {value:.2f}" for name, value in given.items())
            lines.append(
                f"* {by}, {chosen_on[0]} to {chosen_on[-1]} choose “{best}”; what each set gives "
                f"the other five: {others}"
            )
    return lines


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
    commands.add_parser("table").add_argument("--walks-only", action="store_true")
    arguments = parser.parse_args()
    if arguments.command == "walks":
        walks(arguments.name, arguments.folder)
    else:
        table(fits=not arguments.walks_only)


if __name__ == "__main__":
    main()
