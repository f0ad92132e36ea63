"""What every choice of the learning recipe is worth: docs/learning.md's table.

`run` trains each row of `ROWS` with the same number of samples and several seeds, walks the
policies and keeps the figures in reports/ablation.json; rows that are there are not trained
again. `table` writes them into docs/learning.md; `table --check` fails where they differ.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gaitval.artefacts import value_hash, versions, write_json
from gaitval.configuration import load_configuration
from gaitval.data.subject import load_subject
from gaitval.kinematics.reference import build_reference
from gaitval.metrics.comparison import (
    compare_curve,
    low_pass_of,
    recorded_curves,
    simulated_curves,
)
from gaitval.metrics.cycles import find_cycles
from gaitval.policy.training import train
from gaitval.policy.walking import walk
from gaitval.scaling.parameters import nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import WalkingTask

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "reports" / "ablation.json"
DOCUMENT = ROOT / "docs" / "learning.md"
BEGIN, END = "<!-- ablation: begin -->", "<!-- ablation: end -->"

SUBJECT, SAMPLES, SEEDS = "S05", 800_000, (0, 1, 2)
CYCLES = 24


@dataclass(frozen=True)
class Row:
    """One training that differs from the default in `settings`, or in its reference motion."""

    title: str
    settings: tuple[str, ...] = ()
    config: str | None = None
    recorded_reference: bool = False


ROWS = {
    "default": Row("default"),
    "recorded-reference": Row(
        "reference as recorded, not fitted to Newton's laws", recorded_reference=True
    ),
    "no-feed-forward": Row("no moments fed forward", ("servo.feed_forward=0.0",)),
    "no-mirror": Row("no mirror symmetry of the policy", ("environment.mirror=false",)),
    "no-kinetics": Row(
        "no reward for ground reaction and moments",
        ("reward.ground_reaction=0.0", "reward.joint_moments=0.0"),
    ),
    "blunt": Row(
        "kernels four times as wide",
        (
            "reward.joint_positions_sharpness=5.0",
            "reward.joint_velocities_sharpness=0.0125",
            "reward.pelvis_rotation_sharpness=10.0",
            "reward.end_effectors_sharpness=25.0",
            "reward.centre_of_mass_sharpness=10.0",
            "reward.ground_reaction_sharpness=5.0",
            "reward.joint_moments_sharpness=1.0",
        ),
    ),
    "constant-noise": Row("constant exploration noise", ("training.final_log_std=-1.0",)),
    "small-noise": Row(
        "small exploration noise from the start", ("training.initial_log_std=-2.3",)
    ),
    "constant-rate": Row("constant learning rate", ("training.final_learning_rate=3e-4",)),
    "no-curriculum": Row(
        "all of mu's range and all pushes from the start", ("training.difficulty_ramp=[0.0, 0.0]",)
    ),
    "no-pushes": Row("no pushes", ("environment.push_probability=0.0",)),
    "small-actions": Row("half the action scale", ("environment.action_scale=0.1",)),
    "tight": Row(
        "tight termination (0.1 m, 0.35 rad, 0.4 m)",
        (
            "environment.height_tolerance=0.1",
            "environment.rotation_tolerance=0.35",
            "environment.drift_tolerance=0.4",
        ),
    ),
    "paper-state": Row("the paper's state of 71 numbers", ("environment.observation=paper",)),
    "paper": Row("the paper's state and reward (`--config paper`)", config="paper"),
}


def measured(row: Row, seed: int) -> dict[str, Any]:
    """Train one row with one seed and walk the result."""
    settings = [f"seed={seed}", *row.settings]
    configuration = load_configuration(Path(row.config) if row.config else None, settings=settings)
    subject = load_subject(SUBJECT)
    model, record = scale_subject(subject).model, subject.record()
    task = WalkingTask.of(model, record, configuration)
    if row.recorded_reference:
        task = replace(task, reference=build_reference(record, model, configuration.contact))
    longest = configuration.environment.episode_seconds / record.stride_time
    learned: list[float] = []

    def watch(values: Any) -> None:
        if not learned and values["cycles"] > 0.9 * longest:
            learned.append(values["samples"])

    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        policy = train(task, Path(folder), samples=SAMPLES, subject=SUBJECT, on_progress=watch)
    seconds = time.monotonic() - began
    validation = configuration.validation
    rollout = walk(
        task,
        policy,
        mu=nominal_parameters(),
        start_phase=0.0,
        cycles=validation.settling_cycles + CYCLES,
    )
    cycles = find_cycles(rollout, configuration)
    simulated = simulated_curves(
        rollout,
        cycles,
        mass=model.mass,
        filters=low_pass_of(record, validation.filter_frequency),
    )
    recorded = recorded_curves(record)
    found: dict[str, Any] = {
        "samples_to_walk": learned[0] if learned else None,
        "cycles": len(cycles.starts["right"]),
        "fell": bool(rollout.fell[0]),
        "seconds": round(seconds, 1),
    }
    for kind, names, factor in (
        ("angles", ("hip_flexion", "knee_angle", "ankle_angle"), 57.29577951308232),
        ("moments", ("hip_flexion", "knee_angle", "ankle_angle"), 1.0),
        ("forces", ("forward", "medial", "vertical"), 100.0),
    ):
        errors = [
            compare_curve(getattr(simulated, kind)[key], getattr(recorded, kind)[key])
            for key in (f"{name}_{side}" for name in names for side in "rl")
        ]
        found[kind] = [None if error is None else factor * error.rmse for error in errors]
    return found


def run(names: Sequence[str]) -> None:
    """Train all rows that are not there yet."""
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {"rows": {}}
    setting = {
        "subject": SUBJECT,
        "samples": SAMPLES,
        "default": value_hash(load_configuration().model_dump(mode="json")),
    }
    if results["rows"] and results["setting"] != setting:
        sys.exit(
            f"{RESULTS}: made with another default configuration or budget "
            f"({results['setting']}, now {setting}); delete it to train all rows anew."
        )
    results["setting"] = setting
    for seed in SEEDS:
        for name in names:
            done = results["rows"].setdefault(name, {})
            if str(seed) in done:
                continue
            done[str(seed)] = measured(ROWS[name], seed)
            results["versions"] = versions()
            write_json(RESULTS, results)
            print(name, seed, done[str(seed)], flush=True)


def _spread(values: list[float | None], digits: int) -> str:
    """Mean ± standard deviation over the seeds that have a value; — where none has."""
    numbers = [float(value) for value in values if value is not None]
    if not numbers:
        return "—"
    deviation = statistics.stdev(numbers) if len(numbers) > 1 else 0.0
    return f"{statistics.mean(numbers):.{digits}f} ± {deviation:.{digits}f}"


def _mean(values: list[float | None]) -> float | None:
    return None if None in values else statistics.mean(v for v in values if v is not None)


def table() -> str:
    """The table of all rows in reports/ablation.json."""
    results = json.loads(RESULTS.read_text())
    lines = [
        f"{results['setting']['samples']:,} samples of {results['setting']['subject']} each, "
        "mean ± standard deviation over the seeds that walk at all; RMSE of hip, knee and ankle "
        f"(sagittal, mean of both sides) over {CYCLES} cycles against the record.",
        "",
        f"| choice | seeds | of them walk {CYCLES} cycles | angles, deg | moments, Nm/kg | "
        "ground reaction fore-aft, % BW | medial | vertical |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, row in ROWS.items():
        runs = list(results["rows"].get(name, {}).values())
        if not runs:
            continue
        forces = [[_mean(r["forces"][i : i + 2]) for r in runs] for i in (0, 2, 4)]
        cells = [
            row.title,
            str(len(runs)),
            f"{sum(not r['fell'] for r in runs)}",
            _spread([_mean(r["angles"]) for r in runs], 2),
            _spread([_mean(r["moments"]) for r in runs], 3),
            *(_spread(force, 1) for force in forces),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Command line; see the module."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run", help="train the rows that are not there yet")
    running.add_argument("rows", nargs="*", help=f"some of: {', '.join(ROWS)} (default: all)")
    writing = commands.add_parser("table", help="write the table into docs/learning.md")
    writing.add_argument("--check", action="store_true", help="fail where it differs")
    arguments = parser.parse_args()
    if arguments.command == "run":
        run(arguments.rows or list(ROWS))
        return
    text = DOCUMENT.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    wanted = f"{before}{BEGIN}\n{table()}\n{END}{after}"
    if arguments.check and wanted != text:
        sys.exit(f"{DOCUMENT}: not what {RESULTS} says; run scripts/ablation.py table.")
    DOCUMENT.write_text(wanted, encoding="utf-8")


if __name__ == "__main__":
    main()
