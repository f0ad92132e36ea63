"""Shipped: the margins of gaitval/metrics/tolerances.toml, from how far stored walkers scatter.

    python -m experiments.margins measure [S05 ...]   # two minutes a subject
    python -m experiments.margins table [--check]     # the margins, into metrics/tolerances.toml

Another processor or library rounds otherwise, and a walk amplifies that. Each stored walker walks
again several times from the same state, with body parameters that differ in the tenth digit. The
largest difference between any two of its walks, the stored one among them, is the scatter of a
measure, kept in `benchmarks/margins.json`. A margin is a quarter more than the largest scatter of
all subjects, rounded up, so that no other rounding fails a check and little more than rounding
passes.
"""

import argparse
import json
import math
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gaitval._internal.io.artefacts import copy_files, read_json, write_json, write_text
from gaitval.apps.regression.baseline import walking_stages
from gaitval.apps.regression.regression import LONG_MEASURES
from gaitval.configuration import load_configuration
from gaitval.metrics.results import (
    CorrectionResult,
    IdentificationResult,
    Metrics,
    read_metrics,
)
from gaitval.metrics.rollouts import Rollouts, started_walk
from gaitval.metrics.validation import StageResults, validate
from gaitval.model.urdf import read_urdf
from gaitval.policy.rollouts import RolloutPool
from gaitval.study.inputs import (
    STORED_FILES,
    body_parameters,
    stored,
    stored_policy,
    validated_task,
    walking_task,
)
from gaitval.study.stage import Observer, Run, open_run, run_stage
from gaitval.subjects.subject_file import builtin_subjects, load_subject
from gaitval.walk.simulation.walker import WalkingTask

ROOT = Path(__file__).parent.parent
SCATTER = ROOT / "benchmarks" / "margins.json"
REGISTRY = ROOT / "gaitval" / "metrics" / "tolerances.toml"
WALKS = 8
BODY = 1e-10
FACTOR = 1.25
"""Nine walks of each of ten people do not show the largest difference that there is."""


def measured(baseline: Path) -> dict[str, float]:
    """The largest difference of each measure between a stored walker's walks."""
    walks = [_values(metrics) for _, metrics in new_walks(baseline, range(WALKS))]
    walks.append(_values(read_metrics(baseline)))
    values: dict[str, list[list[float]]] = {}
    for name, target in walks[0]:
        values.setdefault(name, []).append([walk[name, target] for walk in walks])
    return {name: float(np.ptp(found, axis=1).max()) for name, found in sorted(values.items())}


def new_walks(baseline: Path, numbers: range) -> Iterator[tuple[int, Metrics]]:
    """Metrics of walks of a stored walker; the number says by how much its body differs."""
    subject = load_subject(str(baseline / "subject.toml"))
    configuration = load_configuration(baseline / "configuration.toml")
    validation = configuration.validation
    one = validation.model_copy(update={"start_phases": validation.start_phases[:1]})
    configuration = configuration.model_copy(update={"validation": one})
    with (
        tempfile.TemporaryDirectory(prefix="gaitval-margins-") as folder,
        open_run(subject, configuration, Path(folder), Observer()) as run,
    ):
        copy_files(baseline, run.folder, STORED_FILES[2:-1])
        for stage in walking_stages(run, second_engine=False)[:-1]:
            run_stage(stage, run.folder)
        yield from _walks(run, numbers)


def _walks(run: Run, numbers: range) -> Iterator[tuple[int, Metrics]]:
    identification = stored(run, "identification.json", IdentificationResult)
    correction = stored(run, "correction.json", CorrectionResult)
    which = {
        name: body_parameters(run.folder / "identification.json", name)
        for name in ("nominal", "identified")
    }
    nominal = _walk(run, walking_task(run), which["nominal"], 0)
    for number in numbers:
        yield (
            number,
            validate(
                *run.compared(),
                read_urdf(run.folder / "model.urdf"),
                nominal,
                _walk(run, validated_task(run)[0], which["identified"], number),
                run.configuration,
                StageResults(identification=identification, correction=correction),
                others=builtin_subjects(),
            ),
        )


def _values(metrics: Metrics) -> dict[tuple[str, str], float]:
    return {
        (row.measure, row.target): row.value
        for row in metrics.measures
        if row.measure not in LONG_MEASURES and row.value is not None
    }


def _walk(run: Run, task: WalkingTask, mu: Any, number: int) -> Rollouts:
    policy = stored_policy(run, run.folder / "policy")
    phase = run.configuration.validation.start_phases[0]
    body = mu * (1.0 + BODY * number)
    with RolloutPool(task, workers=1) as pool:
        went, compared = started_walk(pool, policy, body, phase, engine="dart")()
    return Rollouts(compared, (went,))


def margin(scatter: float) -> float:
    """A quarter more than a scatter, rounded up to 1, 1.5, 2, 3, 5 or 7 of its leading digit."""
    if scatter == 0.0:
        return 0.0
    wanted = FACTOR * scatter
    power = 10.0 ** math.floor(math.log10(wanted))
    return next(
        round(step * power, 12) for step in (1, 1.5, 2, 3, 5, 7, 10) if step * power >= wanted
    )


def wanted_margins() -> dict[str, tuple[float, str]]:
    """The margin of each measured measure, and the subject with the largest scatter."""
    stored = read_json(SCATTER)["scatter"]
    names = sorted({name for found in stored.values() for name in found})
    largest = {name: max(stored, key=lambda who: stored[who].get(name, 0.0)) for name in names}
    return {name: (margin(stored[largest[name]][name]), largest[name]) for name in names}


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("measure").add_argument("subjects", nargs="*")
    commands.add_parser("table").add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    if arguments.command == "measure":
        names = arguments.subjects or [subject.identifier for subject in builtin_subjects()]
        for name in names:
            found = measured(ROOT / "reports" / name / "baseline")
            stored = read_json(SCATTER)["scatter"] if SCATTER.exists() else {}
            stored[name] = found
            write_json(SCATTER, {"walks": WALKS, "body": BODY, "scatter": stored})
            print(name, json.dumps(stored[name]), flush=True)
        return
    text = REGISTRY.read_text(encoding="utf-8")
    wanted = with_margins(text)
    if arguments.check and wanted != text:
        sys.exit(
            f"{REGISTRY}: margins that do not come from the scatter; run this without --check."
        )
    if not arguments.check:
        write_text(REGISTRY, wanted)
        for name, (value, who) in wanted_margins().items():
            print(f"{name:24s} {value:8g}  largest scatter in {who}")


def with_margins(text: str) -> str:
    """The text of `tolerances.toml` with the margins of all measures whose scatter is known."""
    for name, (value, _) in wanted_margins().items():
        entry = rf'(\[\[margin\]\]\nmeasure = "{name}"\nbetter = "\w+"\nvalue = )[\d.e-]+'
        text, count = re.subn(entry, lambda found, value=value: f"{found[1]}{value}", text)
        assert count == 1, name
    return text


if __name__ == "__main__":
    main()
