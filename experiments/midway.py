"""What the mean of two general policies is worth beside either.

    python -m experiments.midway --start FIRST --trained SECOND    # 5 min

FIRST and SECOND are folders of general policies, one the start of the other's training
(`experiments/general_policy.py`); they are not stored, only their mean is. Each policy walks every
built-in person as `gaitval subject` tries it before any training: from every start phase, and
pushed. Writes `reports/general/midway.json` and the table of docs/learning.md.
"""

import argparse
from pathlib import Path
from typing import Any, Final

import numpy as np

from evidence import ROOT
from evidence.marked_table import with_table
from experiments.general_policy import midway
from gaitval.artefacts import versions, write_json, write_text
from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import BUILTIN, builtin_subjects, load_subject
from gaitval.metrics.policy_comparison import standing_of
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.storage import load_start
from gaitval.prediction.known import told
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import WalkingTask

STORE: Final = ROOT / "reports" / "general" / "midway.json"
PAGE: Final = ROOT / "docs" / "learning.md"


def standings(start: Path, trained: Path) -> dict[str, dict[str, dict[str, Any]]]:
    """How each of the three policies walks each person, by person and policy."""
    configuration = load_configuration()
    first, second = (load_start(each, configuration.environment) for each in (start, trained))
    policies = {"start": first, "trained": second, "mean": midway(first, second)}
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for name in BUILTIN:
        subject = load_subject(name)
        known = told(subject, configuration.record, builtin_subjects())
        model = scale_subject(subject).model
        task = WalkingTask.of(model, known.record, configuration, known.accuracy)
        found[name] = {
            kind: standing_of([task], policy, nominal_parameters()).as_dict()
            for kind, policy in policies.items()
        }
        print(name, found[name], flush=True)
    return found


def table(found: dict[str, dict[str, dict[str, Any]]]) -> str:
    """ε and pushes survived, by person."""
    kinds = ("start", "trained", "mean")
    lines = [
        f"| subject | {' | '.join(f'{kind}: ε' for kind in kinds)} "
        f"| {' | '.join(f'{kind}: pushes, %' for kind in kinds)} |",
        "|---|" + "---|" * 6,
    ]
    pushes = {
        k: [100.0 * each[k]["survived"] / each[k]["pushes"] for each in found.values()]
        for k in kinds
    }
    errors = {kind: [each[kind]["epsilon"] for each in found.values()] for kind in kinds}
    rows = [*found, "mean"]
    for number, name in enumerate(rows):
        values = [
            f"{(numbers[number] if number < len(found) else np.mean(numbers)):{form}}"
            for figures, form in ((errors, ".3f"), (pushes, ".0f"))
            for numbers in figures.values()
        ]
        lines.append(f"| {name} | {' | '.join(values)} |")
    return "\n".join(lines)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--start", type=Path, required=True)
    parser.add_argument("--trained", type=Path, required=True)
    arguments = parser.parse_args()
    found = standings(arguments.start, arguments.trained)
    write_json(STORE, {"people": found, "versions": versions()})
    write_text(PAGE, with_table(PAGE.read_text(encoding="utf-8"), "mean-of-two", table(found)))


if __name__ == "__main__":
    main()
