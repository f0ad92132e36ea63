"""What a device does to a person, by three assumptions on how the person adapts.

* Kinematics kept: the motion stays exactly as it was. The devices act along it, added masses need
  further ground reaction and moments, and the muscles do what is left. Nothing can fall.
* Moments kept: the person's control stays as it was, servo, feed-forward and policy. The device's
  torque is added and the motion changes. What people carry on the trunk they know the weight of:
  its part of the moments is fed forward, too (`walking.moments_of_carrying`).
* Learned: the policy is trained on with the device and a cost of the muscles' moments
  (`learning`).

Nobody knows which is right; results name the one that they rest on.
"""

from dataclasses import dataclass, replace

import numpy as np

from gaitval.apps.devices.device_walk import LOGGED, DeviceWalk, at_states
from gaitval.apps.devices.walking import (
    DeviceEnvironment,
    DeviceTask,
)
from gaitval.arrays import Array
from gaitval.inverse.inverse_dynamics import inverse_dynamics
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.model.tree import ROOT_DOFS, centres_of_mass, tree_arrays
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.simulation.rollout import Rollout


def walk_without(task: DeviceTask, policy: Policy, mu: Array, cycles: float) -> DeviceWalk:
    """The walk of the person without devices."""
    person = task.person or task.model
    plain = replace(task, model=person, devices=(), own=None)
    rollout = record_rollout(
        WalkingEnvironment(plain), policy, mu=mu, start_phase=0.0, cycles=cycles
    )
    nothing = np.zeros((len(rollout.time), 0))
    return DeviceWalk(rollout, (), nothing, nothing, nothing, nothing, nothing)


@dataclass(frozen=True)
class KinematicsKept:
    """A walk whose motion devices do not change.

    Attributes
    ----------
    walk : the motion without devices, with the torques that devices give along it, with the centre
        of mass of the body that wears them, and with the further ground reaction that their weight
        and inertia need.
    own : (T, 25) Nm, what is left for the muscles; at a prosthetic joint, what is missing.
    """

    walk: DeviceWalk
    own: Array


def kinematics_kept(environment: DeviceEnvironment, before: Rollout) -> KinematicsKept:
    """What is left for the muscles if the motion of `before`, a walk without devices, is kept.

    The ground reaction that added masses need is shared by the feet as the vertical force is, at
    the same centres of pressure.
    """
    walker, task = environment.walker, environment.walker.task
    assert isinstance(task, DeviceTask)
    logged = _followed(environment, before)
    person = apply_parameters(task.person or task.model, before.mu)
    laden = apply_parameters(task.model, before.mu)
    force = before.ground_reaction
    tree = tree_arrays(laden)
    centre = centres_of_mass(tree, before.positions)
    further = _further_force(person, laden.mass, centre, before)
    vertical = np.maximum(force[..., 2], 0.0)
    share = vertical / np.maximum(vertical.sum(axis=1, keepdims=True), 1.0)
    carried = force + share[..., None] * further[:, None, :]
    moments = before.moments + _moments(laden, before, carried) - _moments(person, before, force)
    names = tuple(fitted.name for fitted in walker.fitted)
    changed = replace(before, ground_reaction=carried, centre_of_mass=centre)
    walk = DeviceWalk(changed, names, *(logged[:, :, k] for k in range(len(LOGGED))))
    own = moments.copy()
    for h, joint in enumerate(walk.joints):
        own[:, joint] -= walk.limb[:, h]
    return KinematicsKept(replace(walk, rollout=replace(changed, moments=own)), own)


def _followed(environment: DeviceEnvironment, before: Rollout) -> Array:
    """(T, H, 5) of devices whose joints are led along a walk, as `DeviceWalker.logged`."""
    walker = environment.walker
    walker.set_parameters(before.mu)
    walker.reset(before.positions[0], before.velocities[0], float(before.phase[0]))
    steps, rows = walker.steps_per_action, len(before.time)
    states = np.stack([before.positions, before.velocities], axis=1)
    # a step moves the joints by their rates after it
    step = float(before.time[1] - before.time[0])
    states[1:, 1, ROOT_DOFS:] = np.diff(before.positions[:, ROOT_DOFS:], axis=0) / step
    logged = np.zeros((rows, len(walker.fitted), len(LOGGED)))
    for first in range(0, rows, steps):
        at = max(first - 1, 0)
        loads, moments = before.ground_reaction[at, :, 2], before.moments[at]
        walker.sense(before.positions[at], before.velocities[at], loads, moments)
        for t in range(first, min(first + steps, rows)):
            logged[t] = walker.led(states[max(t - 1, 0)], states[t])
    # nothing follows the last row, so it keeps what led to it
    return at_states(np.concatenate([logged, logged[-1:]]))


def _further_force(person: BodyModel, laden: float, centre: Array, before: Rollout) -> Array:
    """(T, 3) N, ground reaction that the masses added to a `person` need in a motion; the whole is
    `laden` kg, and `centre` (T, 3) m is that of mass of the laden body.
    """
    step = float(before.time[1] - before.time[0])
    moved = laden * centre - person.mass * before.centre_of_mass
    further = np.gradient(np.gradient(moved, step, axis=0), step, axis=0)
    further -= (laden - person.mass) * person.ground.gravity
    return np.asarray(further, dtype=float)


def _moments(body: BodyModel, before: Rollout, force: Array) -> Array:
    """(T, 25) Nm, that a motion needs on a body under ground reactions (T, 2, 3)."""
    point = np.nan_to_num(before.centre_of_pressure)
    nothing = np.zeros((*force.shape[:2], 3))
    found = inverse_dynamics(body, before.time, before.positions, force, point, nothing)
    return found.moments
