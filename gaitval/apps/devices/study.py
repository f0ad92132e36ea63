"""A person without and with devices, by each assumption on how the person adapts."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import gaitval
from gaitval.apps.devices.adaptation import kinematics_kept, walk_without
from gaitval.apps.devices.curves import WalkCurves, walk_curves
from gaitval.apps.devices.device_walk import DeviceWalk
from gaitval.apps.devices.learning import EFFORT, adapt
from gaitval.apps.devices.scores import RolloutScore, score_rollout
from gaitval.apps.devices.sound_leg import check_side
from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices
from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.coordinates import Side
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ConfigurationError, GaitvalError, RecordError
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.walk_muscles import walk_motion
from gaitval.model.devices.composite import fitted as body_with
from gaitval.model.devices.device import Device, devices_of
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.musculature.gait import MuscleGait, muscles_of
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.storage import Policy
from gaitval.quantities.metabolic_cost import MetabolicCost, metabolic_cost
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import WalkingTask
from gaitval.study.stored_policy import general_walker

CYCLES: Final = 20.0
"""Gait cycles of each walk."""
_Push = tuple[float, float, float]
"""Phase, force N and direction rad."""


def pushes_of(force: float) -> tuple[_Push, ...]:
    """Eight pushes of `force` N, one from each direction at changing phases."""
    return tuple((2.0 + 0.25 * (k % 4), force, 2.0 * math.pi * k / 8) for k in range(8))


PUSHES: Final = tuple(push for force in (100.0, 200.0, 300.0) for push in pushes_of(force))
"""Those that are tried."""
PROSTHETIC_EFFORT: Final = 1.0
"""Times the cost of the moments in an ordinary training that one with a prosthesis has: to walk at
all comes before ease."""
SAME_SPEED: Final = 0.01
"""Fraction by which a walk may be slower or faster than that without and counts as of one speed.
Positive work of a walk at another speed would differ for its speed alone."""
AFTER: Final = 5.0
"""Gait cycles that a push must be survived for."""


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
    """

    name: str
    task: WalkingTask
    policy: Policy
    mu: Array
    own: tuple[Device, ...] = ()
    origin: str = ""
    height: float | None = None


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
    """What becomes of a person by one assumption.

    Attributes
    ----------
    assumption : `without` devices, or how the person adapts.
    walk, curves : None if there is no complete gait cycle.
    cycles : gait cycles walked of those that were asked for.
    fell : whether the walk ended in a fall.
    survived : of `PUSHES`; None where nothing can fall.
    held : whether the walker was held to the speed without devices, as on a treadmill.
    muscles : of the walk; None where they cannot be worked out.
    cost : metabolic rate of the walk, per kg of the person; None where muscles are not known, or
        a prosthesis has a part of a leg.
    """

    assumption: str
    walk: DeviceWalk
    curves: WalkCurves | None
    cycles: float
    fell: bool
    survived: int | None
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


def pushes_survived(environment: WalkingEnvironment, policy: Policy, mu: Array) -> int:
    """How many of `PUSHES` a walker survives."""
    return sum(not pushed(environment, policy, mu, push).fell for push in PUSHES)


def pushed(environment: WalkingEnvironment, policy: Policy, mu: Array, push: _Push) -> RolloutScore:
    """A walk until `AFTER` gait cycles after a push."""
    seconds = (push[0] + AFTER) * environment.task.reference.stride_time
    return score_rollout(environment, policy, mu=mu, start_phase=0.0, seconds=seconds, push=push)


def device_muscles(
    person: Wearer, devices: Sequence[Device], walk: DeviceWalk, own: Array | None
) -> tuple[MuscleGait | None, MetabolicCost | None]:
    """Muscles of a `walk` with `devices`, whose torques they need not make, and what it costs; None
    where they cannot be worked out. `own` (T, 25) Nm are moments to take for the muscles', as for
    `walk_curves`.
    """
    if person.height is None:
        return None, None
    configuration = person.task.configuration
    rollout = walk.rollout
    made = rollout.moments if own is None else own
    lost: dict[Side, set[str]] = {}
    for device in devices:
        for side in device.sides:
            gone = {each.joint for each in device.hinges if not each.muscles}
            if gone:
                lost.setdefault(side, set()).update(gone)
    motion = walk_motion(
        replace(rollout, moments=made),
        find_cycles(rollout, configuration).first(configuration.validation.cycles),
        apply_parameters(person.task.model, person.mu),
        height=person.height,
        lost=lost,
        torques=walk.total_moments - made,
        laden=apply_parameters(body_with(person.task.model, devices), person.mu)
        if devices
        else None,
    )
    try:
        found = muscles_of([motion])
    except GaitvalError:
        return None, None
    return found, metabolic_cost([motion], found)


def _outcome(
    person: Wearer,
    devices: Sequence[Device],
    assumption: str,
    walk: DeviceWalk,
    survived: int | None,
    own: Array | None = None,
    *,
    held: bool = False,
) -> DeviceOutcome:
    """What a `walk` by an `assumption` came to; `own` as for `device_muscles`."""
    rollout, task = walk.rollout, person.task
    try:
        curves = walk_curves(walk, task.configuration, task.model.mass, own)
    except RecordError:
        curves = None
    walked = float(rollout.phase[-1] - rollout.start_phase[0])
    worn = () if assumption == "without" else devices
    muscles, cost = (None, None) if curves is None else device_muscles(person, worn, walk, own)
    return DeviceOutcome(
        assumption, walk, curves, walked, bool(rollout.fell[0]), survived, held, muscles, cost
    )


def outcomes(
    person: Wearer,
    devices: Sequence[Device],
    *,
    samples: int,
    cycles: float = CYCLES,
    say: Say = lambda _: None,
) -> tuple[list[DeviceOutcome], Policy | None]:
    """The `person` without and with `devices`, and the policy that has learned them, over `cycles`
    of each walk. `samples` are of the learned adaptation; none is made for 0. `say` is told what
    begins.

    Who walks with the devices is held to the speed and cadence without them, as on the treadmill of
    most published experiments: else a device that makes a person slow would seem to save work.
    Where that makes the walker fall, and with a prosthesis, which has no such muscles, the walk is
    at the speed that comes (`DeviceOutcome.held`, `at_kept_speed`). Pushes are at the speed that
    comes: who is pushed on the ground may take a longer step.
    """
    if not devices:
        raise ConfigurationError(
            f"{person.name}: no device. Name one, such as hip_exo, or write [[devices]] into the "
            "subject's file."
        )
    task = with_devices(person.task, devices)
    environment = DeviceEnvironment(task)
    say("walking without a device")
    plain = walk_without(task, person.policy, person.mu, cycles)
    stumps = any(each.stumps for each in devices)
    pace = None if stumps or plain.rollout.fell[0] else pace_of(plain, person.task)
    found = partial(_outcome, person, devices)

    def walked(assumption: str, policy: Policy) -> DeviceOutcome:
        survived = pushes_survived(environment, policy, person.mu)
        if pace is not None:
            treadmill = DeviceEnvironment(task, pace=pace)
            walk = walk_with(treadmill, policy, mu=person.mu, cycles=cycles)
            if not walk.rollout.fell[0]:
                return found(assumption, walk, survived, held=True)
        walk = walk_with(environment, policy, mu=person.mu, cycles=cycles)
        return found(assumption, walk, survived)

    bare = WalkingEnvironment(person.task)
    results = [found("without", plain, pushes_survived(bare, person.policy, person.mu))]
    say("what is left for the muscles if the motion is kept")
    kept = kinematics_kept(environment, plain.rollout)
    results.append(found("kinematics kept", kept.walk, None, kept.own))
    say("walking with the device, the person's control kept")
    results.append(walked("moments kept", person.policy))
    if not samples:
        return results, None
    say("learning to walk with the device")
    learned = adapt(
        task,
        person.policy,
        samples=samples,
        effort=PROSTHETIC_EFFORT if stumps else EFFORT,
        pace=pace,
        on_progress=lambda done, total, length: say(
            f"learning: {min(100, 100 * done // total)} %"
            + ("" if length is None else f", episodes of {length:.1f} gait cycles")
        ),
    )
    results.append(walked("learned", learned))
    return results, learned
