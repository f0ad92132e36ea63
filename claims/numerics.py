"""How far results depend on the physics step, and on rounding."""

import statistics
from dataclasses import dataclass, replace

import numpy as np

import claims
from claims import Claim
from gaitval._internal.io.text_tables import shipped_table
from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.constants import GRAVITY
from gaitval.model.tree import Tree, empty_frames, forward, velocities
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.contact.forces import ground_forces
from gaitval.walk.simulation.walker import Trajectory, Walker, WalkingTask

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


def changes_by_step() -> dict[tuple[str, str], list[tuple[float, float]]]:
    """Of each person, by group of curves and unit: the change of the mean curves in a study at a
    quarter of the step, and the error shown.
    """
    groups: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for row in shipped_table("gaitval.metrics", "time_step.csv").by_name():
        found = groups.setdefault((row["group"], row["unit"]), [])
        found.append((float(row["change"]), float(row["error"])))
    return groups


@claims.measured()
def convergence(_: claims.Given) -> list[Claim]:
    """The whole study made anew at a quarter of the step: change of the mean curves."""
    rows = []
    for (group, unit), values in changes_by_step().items():
        change, error = np.array(values).T
        what = f"{group}: change of the mean curves in a study at a quarter of the step"
        rows += [
            Claim(f"{what}, mean of the people", float(change.mean()), unit, len(values)),
            Claim(f"{what}, largest", float(change.max()), unit, len(values)),
            Claim(f"{what}, mean over the mean error shown", float(change.mean() / error.mean()),
                  "1", len(values)),
            Claim(f"{what}, over the error shown, largest", float((change / error).max()), "1",
                  len(values)),
        ]  # fmt: skip
    return rows
