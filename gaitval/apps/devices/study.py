"""A person without and with devices.

With them the person's control stays as it was: servo, feed-forward and policy. The devices' torque
and mass are added, and the motion changes. What people carry on the trunk they know the weight of:
its part of the moments is fed forward, too (`walking.moments_of_carrying`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

import gaitval
from gaitval.apps.devices.curves import WalkCurves, walk_curves
from gaitval.apps.devices.device_walk import DeviceWalk
from gaitval.apps.devices.sound_leg import check_side
from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices
from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.coordinates import Side
from gaitval.errors import ConfigurationError, GaitvalError, RecordError
from gaitval.kinetics.musculature.gait import MuscleGait, muscles_of
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.walk_muscles import walk_motion
from gaitval.model.devices.composite import fitted as body_with
from gaitval.model.devices.device import Device, devices_of
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.quantities.metabolic_cost import MetabolicCost, metabolic_cost
from gaitval.scaling.scaling import scale_subject
from gaitval.study.stored_policy import general_walker
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.simulation.walker import WalkingTask

CYCLES: Final = 20.0
"""Gait cycles of each walk."""
SAME_SPEED: Final = 0.01
"""Fraction by which a walk may be slower or faster than that without and counts as of one speed.
Positive work of a walk at another speed would differ for its speed alone."""


@dataclass(frozen=True)
class Wearer:
    """A person who walks.

    Attributes
    ----------
    name : identifier of the subject.
    policy : stored for this person, or the general one.
    mu : (14,) body parameters.
    own : devices that are part of the subject: of `[[devices]]` in its file.
    origin : what `wearer` found this person by.
    height : m.
    """

    name: str
    task: WalkingTask
    policy: Policy
    mu: Array
    own: tuple[Device, ...] = ()
    origin: str = ""
    height: float = 0.0


def wearer(name_or_path: str, fitted: Sequence[Device] = ()) -> Wearer:
    """The person of a built-in subject, a run folder, or a subject file, which walks with the
    general policy and may have `[[devices]]`. Raises SubjectError, PolicyError, and
    ConfigurationError, also if one of these or of those `fitted` replaces a part of the sound leg.
    """
    if not name_or_path.lower().endswith(".toml"):
        stored = gaitval.load_policy(name_or_path)
        check_side(stored.subject, fitted)
        place = Path(name_or_path)
        return Wearer(
            stored.subject.identifier,
            stored.corrected_task,
            stored.network,
            stored.identified,
            origin=str(place.resolve()) if place.is_dir() else name_or_path,
            height=stored.subject.height_m,
        )
    path = Path(name_or_path)
    subject = load_subject(path)
    own = devices_of({"devices": subject.devices}, str(path)) if subject.devices else ()
    check_side(subject, (*own, *fitted))
    configuration = Configuration()
    model = scale_subject(subject, symmetric=configuration.scaling.symmetric).model
    task = WalkingTask.of(model, subject.record(), configuration)
    policy = general_walker(configuration.environment, task.record, subject.leg_length_m)
    return Wearer(
        subject.identifier, task, policy, nominal_parameters(), own, name_or_path,
        subject.height_m,
    )  # fmt: skip


@dataclass(frozen=True)
class DeviceOutcome:
    """What becomes of a person without or with devices.

    Attributes
    ----------
    walk, curves : no curves if there is no complete gait cycle.
    cycles : gait cycles walked of those that were asked for.
    fell : whether the walk ended in a fall.
    held : whether the walker was held to the speed without devices, as on a treadmill.
    muscles : of the walk; None where they cannot be worked out.
    cost : metabolic rate of the walk, per kg of the person; None where muscles are not known, or
        a prosthesis has a part of a leg.
    """

    walk: DeviceWalk
    curves: WalkCurves | None
    cycles: float
    fell: bool
    held: bool = False
    muscles: MuscleGait | None = None
    cost: MetabolicCost | None = None


def slower(outcome: DeviceOutcome, without: DeviceOutcome) -> float | None:
    """Fraction by which a walk is slower than that `without` devices, negative if it is faster;
    None where either has no whole gait cycle.
    """
    if outcome.curves is None or without.curves is None:
        return None
    return 1.0 - outcome.curves.speed / without.curves.speed


def at_kept_speed(outcome: DeviceOutcome, without: DeviceOutcome) -> bool:
    """Whether the figures of a walk can be held beside those `without` devices: who walks slower
    does less work for that alone.
    """
    found = slower(outcome, without)
    return found is not None and not outcome.fell and abs(found) <= SAME_SPEED


def pace_of(walk: DeviceWalk, task: WalkingTask) -> float:
    """Mean pace of a `walk` of a `task` over that of its reference."""
    rollout = walk.rollout
    cycles = float(rollout.phase[-1] - rollout.start_phase[0])
    return cycles * task.reference.stride_time / float(rollout.time[-1])


Say = Callable[[str], None]
"""Called with a line on what is being done."""


def device_muscles(
    person: Wearer, devices: Sequence[Device], walk: DeviceWalk
) -> tuple[MuscleGait | None, MetabolicCost | None]:
    """Muscles of a `walk` with `devices`, whose torques they need not make, and what it costs; None
    where they cannot be worked out.
    """
    configuration = person.task.configuration
    rollout = walk.rollout
    lost: dict[Side, set[str]] = {}
    for device in devices:
        for side in device.sides:
            gone = {each.joint for each in device.hinges if not each.muscles}
            if gone:
                lost.setdefault(side, set()).update(gone)
    motion = walk_motion(
        rollout,
        find_cycles(rollout, configuration).first(configuration.validation.cycles),
        apply_parameters(person.task.model, person.mu),
        height=person.height,
        lost=lost,
        torques=walk.total_moments - rollout.moments,
        laden=apply_parameters(body_with(person.task.model, devices), person.mu)
        if devices
        else None,
    )
    try:
        found = muscles_of([motion])
    except GaitvalError:
        return None, None
    return found, metabolic_cost([motion], found)


def walk_without(person: Wearer, cycles: float) -> DeviceWalk:
    """The walk of a `person` without devices."""
    environment = WalkingEnvironment(person.task)
    rollout = record_rollout(
        environment, person.policy, mu=person.mu, start_phase=0.0, cycles=cycles
    )
    nothing = np.zeros((len(rollout.time), 0))
    return DeviceWalk(rollout, (), nothing, nothing, nothing, nothing, nothing)


def _outcome(
    person: Wearer, devices: Sequence[Device], walk: DeviceWalk, *, held: bool = False
) -> DeviceOutcome:
    """What a `walk` with `devices` came to."""
    rollout, task = walk.rollout, person.task
    walked, fell = float(rollout.phase[-1] - rollout.start_phase[0]), bool(rollout.fell[0])
    try:
        curves = walk_curves(walk, task.configuration, task.model.mass)
    except RecordError:
        return DeviceOutcome(walk, None, walked, fell, held)
    return DeviceOutcome(walk, curves, walked, fell, held, *device_muscles(person, devices, walk))


def outcomes(
    person: Wearer,
    devices: Sequence[Device],
    *,
    cycles: float = CYCLES,
    say: Say = lambda _: None,
) -> tuple[DeviceOutcome, DeviceOutcome]:
    """The `person` without and with `devices`, over `cycles` of each walk. `say` is told what
    begins.

    Who walks with the devices is held to the speed and cadence without them, as on the treadmill of
    most published experiments: else a device that makes a person slow would seem to save work.
    Where that makes the walker fall, and with a prosthesis, which has no such muscles, the walk is
    at the speed that comes (`DeviceOutcome.held`, `at_kept_speed`).
    """
    if not devices:
        raise ConfigurationError(
            f"{person.name}: no device. Name one, such as hip_exo, or write [[devices]] into the "
            "subject's file."
        )
    task = with_devices(person.task, devices)
    say("walking without a device")
    plain = walk_without(person, cycles)
    without = _outcome(person, (), plain)
    say("walking with the device")
    if not (without.fell or any(each.stumps for each in devices)):
        treadmill = DeviceEnvironment(task, pace=pace_of(plain, person.task))
        walk = walk_with(treadmill, person.policy, mu=person.mu, cycles=cycles)
        if not walk.rollout.fell[0]:
            return without, _outcome(person, devices, walk, held=True)
    walk = walk_with(DeviceEnvironment(task), person.policy, mu=person.mu, cycles=cycles)
    return without, _outcome(person, devices, walk)
