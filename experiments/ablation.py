"""The effect of every choice in the learning recipe: the table of docs/learning.md.

`run` trains each row of `ROWS` with the same number of samples and several seeds, simulates the
policies and stores the figures in reports/ablation.json; rows already there are not trained again.
`table` writes them into docs/learning.md; `table --check` fails if they differ.
"""

import argparse
import json
import multiprocessing as mp
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from evidence.marked_table import with_table
from gaitval.artefacts import value_hash, versions, write_json
from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.comparison import compare_curve, low_pass_of, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.push_recovery import PushTrial, required_pushes, trials, without_drift
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.policy.training import train
from gaitval.reference.motion import build_reference
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import WalkingTask
from gaitval_devices.scores import score_rollout

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "reports" / "ablation.json"
DOCUMENT = ROOT / "docs" / "learning.md"

SUBJECT, SLOW, SAMPLES, SEEDS = "S05", "S10", 600_000, (0, 1, 2)
CYCLES = 24
LEARNING = {"contact", "servo", "environment", "reward", "randomisation", "training"}
"""Sections of the configuration that the figures depend on."""


@dataclass(frozen=True)
class Row:
    """One training that differs from the default in `settings`, or in its reference motion."""

    title: str
    settings: tuple[str, ...] = ()
    config: str | None = None
    recorded_reference: bool = False
    subject: str = SUBJECT


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
    "mild-force": Row(
        "ground reaction with half the weight, half as sharp",
        ("reward.ground_reaction=3.0", "reward.ground_reaction_sharpness=20.0"),
    ),
    "blunt": Row(
        "kernels four times as wide",
        (
            "reward.joint_positions_sharpness=5.0",
            "reward.joint_velocities_sharpness=0.0125",
            "reward.pelvis_rotation_sharpness=10.0",
            "reward.end_effectors_sharpness=25.0",
            "reward.centre_of_mass_sharpness=10.0",
            "reward.ground_reaction_sharpness=10.0",
            "reward.joint_moments_sharpness=1.0",
        ),
    ),
    "fixed-pace": Row("pace of the record, not the policy's", ("environment.pace_scale=0.0",)),
    "constant-noise": Row("constant exploration noise", ("training.final_log_std=-1.0",)),
    "less-noise": Row("0.6 of the exploration noise at the end", ("training.final_log_std=-2.3",)),
    "no-curriculum": Row(
        "full range of mu and of pushes from the start", ("training.difficulty_ramp=[0.0, 0.0]",)
    ),
    "rare-pushes": Row(
        "one push of 0 to 800 N in six of ten episodes",
        (
            "environment.push_probability=0.6",
            "environment.push_interval=[5.0, 5.0]",
            "environment.push_focus=800.0",
        ),
    ),
    "no-pushes": Row("no pushes", ("environment.push_probability=0.0",)),
    "small-actions": Row("half the action scale", ("environment.action_scale=0.1",)),
    "constant-rate": Row("constant learning rate", ("training.final_learning_rate=3e-4",)),
    "late-end": Row(
        "episodes end only at a fall (0.2 m, 0.7 rad, 0.8 m) from the start",
        ("training.tolerance_shares=[1.0, 1.0]",),
    ),
    "early-end": Row(
        "episodes end at half the limits of a fall throughout",
        ("training.tolerance_shares=[0.5, 0.5]",),
    ),
    "paper-state": Row("the paper's state of 71 numbers", ("environment.observation=paper",)),
    "paper": Row("the paper's state and reward (`--config paper`)", config="paper"),
    "slow": Row(f"default, for {SLOW}", subject=SLOW),
    "slow-fixed-pace": Row(
        f"pace of the record, not the policy's, for {SLOW}",
        ("environment.pace_scale=0.0",),
        subject=SLOW,
    ),
}


def pushes_survived(task: WalkingTask, policy: Policy) -> float:
    """Fraction of the required pushes that the walker survives."""
    environment = WalkingEnvironment(without_drift(task))
    pushes = required_pushes(task.configuration.pushes)
    tried = trials(task, policy, nominal_parameters(), pushes)

    def fell(trial: PushTrial) -> bool:
        seconds = trial.planned_cycles() * task.reference.stride_time
        return score_rollout(environment, policy, seconds=seconds, **trial.settings()).fell

    return statistics.mean(not fell(trial) for trial in tried)


def measured(row: Row, seed: int) -> dict[str, Any]:
    """Train one row with one seed and simulate the result."""
    # One worker: two trainings in parallel take less time than one after the other.
    settings = [f"seed={seed}", "training.workers=1", *row.settings]
    configuration = load_configuration(Path(row.config) if row.config else None, settings=settings)
    subject = load_subject(row.subject)
    model, record = scale_subject(subject).model, subject.record()
    task = WalkingTask.of(model, record, configuration)
    if row.recorded_reference:
        task = replace(task, reference=build_reference(record, model, configuration.contact))
    half = 0.5 * configuration.environment.episode_seconds / record.stride_time
    learned: list[float] = []

    def watch(values: Any) -> None:
        if not learned and values["cycles"] > half:
            learned.append(values["samples"])

    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        policy = train(task, Path(folder), samples=SAMPLES, subject=row.subject, on_progress=watch)
    seconds = time.monotonic() - began
    validation = configuration.validation
    rollout = record_rollout(
        WalkingEnvironment(task, engine="dart"),
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
        "samples_to_half": learned[0] if learned else None,
        "cycles": len(cycles.starts["right"]),
        "fell": bool(rollout.fell[0]),
        "pushes": pushes_survived(task, policy),
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


def run(names: Sequence[str], trainings: int) -> None:
    """Train all rows that do not exist yet, this many at a time."""
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {"rows": {}}
    setting = {
        "samples": SAMPLES,
        "default": value_hash(load_configuration().model_dump(mode="json", include=LEARNING)),
    }
    if results["rows"] and results["setting"] != setting:
        sys.exit(
            f"{RESULTS}: made with another default configuration or budget ({results['setting']}, "
            f"now {setting}). Delete it to train all rows again."
        )
    results["setting"] = setting
    with ProcessPoolExecutor(trainings, mp_context=mp.get_context("spawn")) as pool:
        under_way = {
            pool.submit(measured, ROWS[name], seed): (name, str(seed))
            for name in names
            for seed in SEEDS
            if str(seed) not in results["rows"].get(name, {})
        }
        for future in as_completed(under_way):
            name, seed = under_way[future]
            results["rows"].setdefault(name, {})[seed] = future.result()
            results["versions"] = versions()
            write_json(RESULTS, results)
            print(name, seed, results["rows"][name][seed], flush=True)


def _spread(values: list[float | None], digits: int) -> str:
    """Mean ± standard deviation over the seeds that have a value; — if none has."""
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
        f"{results['setting']['samples']:,} samples each, for {SUBJECT} unless another subject is "
        "named. Errors: RMSE of hip, knee and ankle (sagittal) and of the ground reaction, mean "
        f"of both sides, over {CYCLES} cycles compared with the record, mean ± standard deviation "
        "over the seeds that walk at all.",
        "",
        f"| choice | seeds | walk {CYCLES} cycles | thousand samples until episodes last half "
        "their full length | angles, deg | moments, Nm/kg | fore-aft force, % BW | medial | "
        "vertical | 300 N pushes survived, % |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, row in ROWS.items():
        runs = list(results["rows"].get(name, {}).values())
        if not runs:
            continue
        forces = [[_mean(r["forces"][i : i + 2]) for r in runs] for i in (0, 2, 4)]
        samples = [r["samples_to_half"] and r["samples_to_half"] / 1e3 for r in runs]
        cells = [
            row.title,
            str(len(runs)),
            f"{sum(not r['fell'] for r in runs)}",
            _spread(samples, 0) if None not in samples else "never, or not all",
            _spread([_mean(r["angles"]) for r in runs], 2),
            _spread([_mean(r["moments"]) for r in runs], 3),
            *(_spread(force, 1) for force in forces),
            _spread([100.0 * r["pushes"] for r in runs], 0),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run", help="train the rows that do not exist yet")
    running.add_argument(
        "--trainings", type=int, default=2, help="trainings in parallel, one core each (default: 2)"
    )
    running.add_argument("rows", nargs="*", help=f"some of: {', '.join(ROWS)} (default: all)")
    writing = commands.add_parser("table", help="write the table into docs/learning.md")
    writing.add_argument("--check", action="store_true", help="fail if it differs")
    arguments = parser.parse_args()
    if arguments.command == "run":
        run(arguments.rows or list(ROWS), arguments.trainings)
        return
    text = DOCUMENT.read_text(encoding="utf-8")
    wanted = with_table(text, "ablation", table())
    if arguments.check and wanted != text:
        sys.exit(f"{DOCUMENT}: does not match {RESULTS}. Run experiments/ablation.py table.")
    DOCUMENT.write_text(wanted, encoding="utf-8")


if __name__ == "__main__":
    main()
