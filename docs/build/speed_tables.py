"""Write the tables of docs/speed.md: `make speed`, on an otherwise idle machine.

    python docs/build/speed_tables.py steps                  # no times: whatever the machine does
    python docs/build/speed_tables.py steered                # likewise
    python docs/build/speed_tables.py trainings              # likewise, of the stored wall times
    python docs/build/speed_tables.py profile                # times of this machine
    python docs/build/speed_tables.py ratios benchmark.json  # of one run of pytest-benchmark

`steps`: the same open-loop walk with different physics steps, compared with the smallest one.
`steered`: likewise rollouts of the stored policies, which were trained with the default step.
`profile`: how the time of a training is spent. `trainings`: times of whole trainings in the runs of
the baselines. `ratios`: the engines of benchmarks/test_physics_step.py.
"""

import argparse
import json
import statistics
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.logger import Logger

from evidence.marked_table import with_table
from gaitval.arrays import Array
from gaitval.artefacts import read_json
from gaitval.configuration import Configuration
from gaitval.constants import GRAVITY
from gaitval.contact.forces import ground_forces
from gaitval.datasets.subject_file import load_subject
from gaitval.lanes import WIDTH
from gaitval.metrics.comparison import low_pass_of, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.model.tree import Tree, empty_frames, forward, velocities
from gaitval.policy.environment import WalkingEnvironment, action_size
from gaitval.policy.learner import Learner
from gaitval.policy.rollout_buffer import WalkingWorkers
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy, load_policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.reference.adjustment import Adjustment, adjusted
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import Trajectory, Walker, WalkingTask

ROOT = Path(__file__).parents[2]
PAGE, REPORTS = ROOT / "docs" / "speed.md", ROOT / "reports"
SUBJECT = "S05"

STEPS = (0.125e-3, 0.25e-3, 0.5e-3, 1e-3, 2e-3, 3e-3)
"""s; the first is what the others are compared with."""
ACTION = 0.03
"""s, whatever the step."""
ACTIONS = 13
SETTLING = 1
"""Number of actions left out at the start, where contact starts from zero force."""
GRID = 0.006
"""s, a multiple of every step: the ground reaction is compared at these instants."""
START_PHASES = np.arange(8) / 8

STEERED = ("S01", "S05", "S10")
"""Subjects whose stored policies are simulated with each of the steps ..."""
STEERED_STEPS = (0.25e-3, 0.5e-3, 1e-3, 2e-3)
"""... s; the first is what the others are compared with."""
STEERED_CYCLES = 24


def walking_task(name: str = SUBJECT) -> WalkingTask:
    """The task of a subject, with the default configuration."""
    subject = load_subject(name)
    return WalkingTask.of(scale_subject(subject).model, subject.record(), Configuration())


# ---- The physics step. ----


def energy(tree: Tree, state: Array) -> float:
    """Kinetic and potential energy, J."""
    frames = empty_frames()
    forward(tree.joint_position, state[0], frames, 14)
    velocities(state[1], frames, 14)
    arm = np.einsum("sij,sj->si", frames.rotation, tree.centre_of_mass)
    velocity = frames.linear + np.cross(frames.angular, arm)
    turning = np.einsum("sji,sj->si", frames.rotation, frames.angular)
    kinetic = 0.5 * tree.mass @ (velocity**2).sum(axis=1)
    kinetic += 0.5 * np.einsum("si,sij,sj->", turning, tree.inertia, turning)
    return float(kinetic + GRAVITY * tree.mass @ (frames.origin + arm)[:, 2])


@dataclass(frozen=True)
class Walk:
    """One walk after settling.

    Attributes
    ----------
    ground_reaction : (T, 2, 3) body weights, at the instants of `GRID`.
    impulse : (3,) body weights x s, of both feet.
    unexplained_energy : J, change of energy minus the work of the servos and of the ground.
    work : J, of the servos, with negative work counted as positive.
    """

    ground_reaction: Array
    impulse: Array
    unexplained_energy: float
    work: float


def with_step(task: WalkingTask, step: float) -> WalkingTask:
    """The task with another physics step and actions of the same duration."""
    values = task.configuration.model_dump()
    values["environment"] |= {"physics_step": step, "steps_per_action": round(ACTION / step)}
    return replace(task, configuration=Configuration.model_validate(values))


def open_loop_walk(task: WalkingTask, step: float, phase: float) -> Walk:
    """An open-loop walk from a state of the reference, with the reference as the servos'
    targets.
    """
    count = round(ACTION / step)
    walker = Walker(with_step(task, step))
    row = round(phase * len(task.reference.phase))
    walker.reset(task.reference.positions[row], task.reference.velocities[row], phase)
    start = walker.state.copy()
    recording = Trajectory(ACTIONS * count)
    for _ in range(ACTIONS):
        walker.step(np.zeros(25), np.zeros(6), recording)

    first = SETTLING * count
    q = np.vstack([start[:1], recording.positions])
    qd = np.vstack([start[1:], recording.velocities])
    memory, work_of_ground = np.zeros((len(task.model.spheres), 3)), 0.0
    for t in range(recording.rows):
        generalised, feet = np.zeros(31), np.empty((2, 6))
        ground_forces(walker.tree, walker.law, q[t], qd[t], walker.lag, memory, generalised, feet)
        if t >= first:
            work_of_ground += step * generalised @ qd[t + 1]
    power = recording.moments[first:] * recording.velocities[first:, 6:]
    change = energy(walker.tree, walker.state) - energy(
        walker.tree, np.array([q[first], qd[first]])
    )
    force = recording.feet[first:, :, :3] / walker.weight
    return Walk(
        ground_reaction=force[:: round(GRID / step)],
        impulse=step * force.sum(axis=(0, 1)),
        unexplained_energy=change - float(step * power.sum()) - work_of_ground,
        work=float(step * np.abs(power).sum()),
    )


def steps_table(task: WalkingTask) -> list[str]:
    """Differences of walks with larger steps from those with the smallest."""
    walks = {step: [open_loop_walk(task, step, phase) for phase in START_PHASES] for step in STEPS}
    finest = walks[STEPS[0]]
    seconds = (ACTIONS - SETTLING) * ACTION
    lines = [
        "| step, ms | ground reaction, RMS, % of body weight: forward / left / up "
        "| impulse, largest difference, % of body weight x time "
        "| energy not explained, % of the servos' work |",
        "|---|---|---|---|",
    ]
    for step in STEPS:
        pairs = list(zip(walks[step], finest, strict=True))
        differences = [w.ground_reaction - f.ground_reaction for w, f in pairs]
        rms = 100 * np.sqrt(np.mean(np.square(differences), axis=(0, 1, 2)))
        impulse = max(np.abs(w.impulse - f.impulse).max() for w, f in pairs)
        unexplained = [abs(w.unexplained_energy) / w.work for w in walks[step]]
        compared = step != STEPS[0]
        lines.append(
            f"| {1e3 * step:g} | "
            + (" / ".join(f"{value:.2f}" for value in rms) if compared else "(compared with)")
            + f" | {f'{100 * impulse / seconds:.2f}' if compared else ''}"
            + f" | {100 * statistics.mean(unexplained):.1f} |"
        )
    return lines


def steered_walk(name: str, step: float) -> dict[str, Array]:
    """Mean curves of the stored walker with identified body and corrected reference: joint angles
    in degrees, moments in Nm/kg, vertical forces in % of body weight.
    """
    task, stored = with_step(walking_task(name), step), REPORTS / name / "baseline"
    mu = np.array(read_json(stored / "identification.json")["identified"])
    task = WalkingTask.of(task.model, task.record, task.configuration, mu=mu)
    correction = Adjustment.from_dict(read_json(stored / "correction.json"), str(stored))
    task = replace(task, reference=adjusted(task.reference, task.reference_body, correction))
    rollout = record_rollout(
        WalkingEnvironment(task),
        load_policy(stored / "policy"),
        mu=mu,
        start_phase=0.0,
        cycles=task.configuration.validation.settling_cycles + STEERED_CYCLES,
    )
    curves = simulated_curves(
        rollout,
        find_cycles(rollout, task.configuration),
        mass=task.model.mass,
        filters=low_pass_of(task.record, task.configuration.validation.filter_frequency),
    )

    def means(values: dict[str, Array], *names: str) -> Array:
        keys = [f"{name}_{side}" for name in names for side in "rl"]
        return np.array([values[key].mean(axis=0) for key in keys])

    joints = ("hip_flexion", "knee_angle", "ankle_angle")
    return {
        "angles": np.rad2deg(means(curves.angles, *joints)),
        "moments": means(curves.moments, *joints),
        "vertical": 100.0 * means(curves.forces, "vertical"),
    }


def steered_table() -> list[str]:
    """Differences of the mean curves of policy walks from those with the smallest step."""
    lines = [
        "| step, ms | hip, knee, ankle angles, ° | their moments, Nm/kg | vertical force, % BW |",
        "|---|---|---|---|",
    ]
    finest = {name: steered_walk(name, STEERED_STEPS[0]) for name in STEERED}
    for step in STEERED_STEPS[1:]:
        worst = {"angles": 0.0, "moments": 0.0, "vertical": 0.0}
        for name in STEERED:
            for kind, curves in steered_walk(name, step).items():
                rms = np.sqrt(np.mean((curves - finest[name][kind]) ** 2, axis=1))
                worst[kind] = max(worst[kind], float(rms.max()))
        lines.append(
            f"| {1e3 * step:g} | {worst['angles']:.2f} | {worst['moments']:.3f} "
            f"| {worst['vertical']:.2f} |"
        )
    return lines


# ---- Where the time goes. ----


def least_seconds(
    work: Callable[[], object], *, rounds: int, prepare: Callable[[], object] = lambda: None
) -> float:
    """The least time of a few runs, so that other work on the machine matters little."""
    times = []
    for _ in range(rounds):
        prepare()
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)


def action_rows(task: WalkingTask, policy: Policy) -> list[tuple[str, float]]:
    """Parts of one action of one of eight environments, s."""
    group = WalkingGroup([task] * WIDTH)
    constants = group.environments[0].constants
    actions = 10
    no_action = np.zeros((WIDTH, action_size(constants)), dtype=np.float32)
    observations = np.array([group.reset(e, seed=e) for e in range(WIDTH)])

    def begin() -> None:
        for e in range(WIDTH):
            group.reset(e)

    def steps() -> None:
        for _ in range(actions):
            group.step(no_action, observations)

    def physics() -> None:
        for _ in range(actions):
            group.beside.advance()

    def policies() -> None:
        for _ in range(actions):
            policy.act(observations)

    steps()  # compiles
    physics()
    whole, walker, acting = (
        least_seconds(work, rounds=200, prepare=begin) / (WIDTH * actions)
        for work in (steps, physics, policies)
    )
    count = constants.steps_per_action
    return [
        (f"{count} physics steps, eight walkers side by side", walker),
        ("observation, errors, reward, pushes", whole - walker),
        ("policy (mean action)", acting),
    ]


def training_seconds(task: WalkingTask, rollouts: int = 6) -> tuple[float, float]:
    """Walking and learning, s: medians of the rollouts after the first, and their updates."""
    walked, learned, _ = _trained(task, rollouts)
    return walked, learned


def _trained(task: WalkingTask, rollouts: int) -> tuple[float, float, Learner]:
    torch.set_num_threads(1)  # as in a training
    training = task.configuration.training
    learner = Learner(task.configuration)
    learner.ppo.set_logger(Logger(None, []))
    learner.begin(0)
    walking, learning = [], []
    workers = WalkingWorkers(
        [task],
        count=training.environments,
        workers=training.workers,
        steps=training.rollout_steps,
    )
    with workers:
        workers.begin(0)
        for _ in range(rollouts):
            start = perf_counter()
            experience = workers.walk(learner.actor(), learner.noise())
            middle = perf_counter()
            learner.learn(experience, learning_rate=training.learning_rate)
            walking.append(middle - start)
            learning.append(perf_counter() - middle)
    return statistics.median(walking[1:]), statistics.median(learning[1:]), learner


def profile_table(task: WalkingTask, rollouts: int = 6) -> list[str]:
    """The profile of a training with the default configuration."""
    training = task.configuration.training
    walked, learned, learner = _trained(task, rollouts)
    samples = training.environments * training.rollout_steps
    rows = action_rows(task, Policy(learner.actor(), {}))
    alone = sum(seconds for _, seconds in rows)
    lines = [
        f"{samples / (walked + learned):,.0f} samples/s with {training.workers} workers, median of "
        f"{rollouts - 1} rollouts and their updates: {1e3 * walked:.0f} ms of walking and "
        f"{1e3 * learned:.0f} ms of learning for {samples:,} samples.",
        "",
        "| part of an action, of one of eight environments, one core | µs | share of training, % |",
        "|---|---|---|",
    ]
    for name, seconds in rows:
        share = 100 * seconds / alone * walked / (walked + learned)
        lines.append(f"| {name} | {1e6 * seconds:.1f} | {share:.0f} |")
    lines.append(
        f"| learning (update, advantages), per sample | {1e6 * learned / samples:.1f} | "
        f"{100 * learned / (walked + learned):.0f} |"
    )
    return lines


# ---- Whole trainings. ----


def trainings_table(reports: Path = REPORTS) -> list[str]:
    """Times of the runs that made the baselines."""
    kinds = {
        "scratch": "nothing",
        "general": "the general policy",
        "policy": "another policy of this body",
    }
    lines = ["| starts from | samples | runs | s | samples/s |", "|---|---|---|---|---|"]
    for kind, title in kinds.items():
        runs: dict[int, list[float]] = {}
        for path in sorted(reports.glob("S*/baseline/times.json")):
            times = read_json(path)
            if kind in times:
                samples = int(read_json(path.parent / "policy" / "policy.json")["samples"])
                runs.setdefault(samples, []).append(float(times[kind]["stages"]["train-1"]))
        for samples, seconds in sorted(runs.items()):
            ends = sorted({min(seconds), max(seconds)})
            lines.append(
                f"| {title} | {samples:,} | {len(seconds)} | "
                + "-".join(f"{end:.0f}" for end in ends)
                + " | "
                + "-".join(f"{samples / end:,.0f}" for end in reversed(ends))
                + " |"
            )
    return lines


# ---- Ratios. ----


def ratios_table(results: dict[str, Any]) -> list[str]:
    """The table from pytest-benchmark's JSON."""
    walks = [b for b in results["benchmarks"] if "steps of a walk" in b["group"]]
    steps = int(walks[0]["group"].split()[0])
    least = {
        b["name"].removeprefix("test_"): b["stats"]["min"] / b["extra_info"].get("walkers", 1)
        for b in walks
    }
    (goal,) = (b for b in results["benchmarks"] if b["name"] == "test_the_goal")
    seen = goal["extra_info"]
    names = {
        "gaitval_side_by_side": ("compiled engine, eight walkers side by side", 1.0),
        "gaitval_compiled": ("compiled engine, one walker", seen["times_compiled"]),
        "mujoco": ("MuJoCo's C step", seen["times_mujoco"]),
        "gaitval_in_dart": ("DART with our contact and servo", seen["times_dart"]),
    }
    return [
        "| engine | µs a physics step | times the walkers side by side |",
        "|---|---|---|",
        *(
            f"| {title} | {1e6 * least[name] / steps:.2f} | {times:.1f} |"
            for name, (title, times) in names.items()
        ),
    ]


def main() -> None:
    """Write one of the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    tables = parser.add_subparsers(dest="table", required=True)
    tables.add_parser("steps")
    tables.add_parser("steered")
    tables.add_parser("profile")
    tables.add_parser("trainings")
    tables.add_parser("ratios").add_argument("benchmark", type=Path)
    arguments = parser.parse_args()
    if arguments.table == "steps":
        lines = steps_table(walking_task())
    elif arguments.table == "steered":
        lines = steered_table()
    elif arguments.table == "profile":
        lines = profile_table(walking_task())
    elif arguments.table == "trainings":
        lines = trainings_table()
    else:
        lines = ratios_table(json.loads(arguments.benchmark.read_text(encoding="utf-8")))
    table = "\n".join(lines)
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, arguments.table, table), encoding="utf-8")
    print(table)


if __name__ == "__main__":
    main()
