"""How far results depend on the physics step, and on rounding."""

import statistics
from dataclasses import dataclass, replace

import numpy as np

import claims
from claims import ROOT, Claim
from gaitval.arrays import Array
from gaitval.artefacts import read_json
from gaitval.configuration import Configuration
from gaitval.constants import GRAVITY
from gaitval.contact.forces import ground_forces
from gaitval.datasets.subject_file import load_subject
from gaitval.metrics.comparison import low_pass_of, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.model.tree import Tree, empty_frames, forward, velocities
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import load_policy
from gaitval.reference.adjustment import Adjustment, adjusted
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import Trajectory, Walker, WalkingTask

REPORTS = ROOT / "reports"
FINEST, STEPS = 0.125e-3, (1e-3, 2e-3)
"""s; what the others are compared with, and these."""
ACTION = 0.03
"""s, whatever the step."""
ACTIONS = 13
SETTLING = 1
"""Number of actions left out at the start, where contact starts from zero force."""
GRID = 0.006
"""s, a multiple of every step: the ground reaction is compared at these instants."""
START_PHASES = np.arange(8) / 8

STEERED = ("S01", "S05", "S10")
"""Subjects whose stored policies walk with each of the steps."""
FINEST_STEERED = 0.25e-3
STEERED_CYCLES = 24


def walking_task(name: str = "S05") -> WalkingTask:
    """The task of a subject, with the default configuration."""
    subject = load_subject(name)
    return WalkingTask.of(scale_subject(subject).model, subject.record(), Configuration())


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
class SettledWalk:
    """One walk after settling.

    Attributes
    ----------
    ground_reaction : (T, 2, 3) body weights, at the instants of `GRID`.
    unexplained_energy : J, change of energy minus the work of the servos and of the ground.
    work : J, of the servos, with negative work counted as positive.
    """

    ground_reaction: Array
    unexplained_energy: float
    work: float


def with_step(task: WalkingTask, step: float) -> WalkingTask:
    """The task with another physics step and actions of the same duration."""
    values = task.configuration.model_dump()
    values["environment"] |= {"physics_step": step, "steps_per_action": round(ACTION / step)}
    return replace(task, configuration=Configuration.model_validate(values))


def open_loop_walk(task: WalkingTask, step: float, phase: float) -> SettledWalk:
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
    return SettledWalk(
        ground_reaction=force[:: round(GRID / step)],
        unexplained_energy=change - float(step * power.sum()) - work_of_ground,
        work=float(step * np.abs(power).sum()),
    )


@claims.measured()
def steps(_: claims.Given) -> list[Claim]:
    """Open-loop walks with usual physics steps against those with a small one."""
    task = walking_task()
    finest = [open_loop_walk(task, FINEST, phase) for phase in START_PHASES]
    rows = []
    for step in STEPS:
        walks = [open_loop_walk(task, step, phase) for phase in START_PHASES]
        apart = [w.ground_reaction - f.ground_reaction for w, f in zip(walks, finest, strict=True)]
        vertical = 100.0 * float(np.sqrt(np.mean(np.square(apart)[..., 2])))
        energy = 100.0 * statistics.mean(abs(w.unexplained_energy) / w.work for w in walks)
        at = f"at a step of {1e3 * step:g} ms"
        what = "energy that the work of servos and ground does not explain"
        rows += [
            Claim(f"{what}, {at}", energy, "% of the servos' work", len(walks)),
            Claim(f"vertical ground reaction off that of a step of 0.125 ms, RMS, {at}", vertical,
                  "% of body weight", len(walks)),
        ]  # fmt: skip
    return rows


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


@claims.measured()
def steered(_: claims.Given) -> list[Claim]:
    """Mean curves of stored policies with usual physics steps against those with a small one."""
    finest = {name: steered_walk(name, FINEST_STEERED) for name in STEERED}
    kinds = {
        "angles": ("hip, knee and ankle angles", "deg"),
        "moments": ("moments of hip, knee and ankle", "Nm/kg"),
        "vertical": ("vertical force", "% of body weight"),
    }
    rows = []
    for step in STEPS:
        walks = {name: steered_walk(name, step) for name in STEERED}
        for kind, (noun, unit) in kinds.items():
            off = [
                np.sqrt(np.mean((walks[name][kind] - finest[name][kind]) ** 2, axis=1)).max()
                for name in STEERED
            ]
            what = f"{noun} off those of a step of 0.25 ms, RMS, at a step of {1e3 * step:g} ms"
            what = what.replace("force off those", "force off that")
            rows.append(Claim(what, float(max(off)), unit, len(STEERED)))
    return rows


@claims.measured(stored=("benchmarks/margins.json",))
def scatter(_: claims.Given) -> list[Claim]:
    """What differs between walks of the stored policies that differ by rounding alone."""
    stored = read_json(ROOT / "benchmarks" / "margins.json")
    walks = len(stored["scatter"]) * (stored["walks"] + 1)
    units = {"angle_rmse": "deg", "moment_rmse": "Nm/kg", "force_rmse": "% BW"}
    return [
        Claim(
            f"scatter of {measure} between walks that differ by rounding, largest",
            max(found[measure] for found in stored["scatter"].values()),
            units.get(measure, "1"),
            walks,
        )
        for measure in (*units, "epsilon")
    ]
