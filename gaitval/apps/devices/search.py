"""Strategies: a search over the parameters of a controller for one person (CMA-ES).

The controller is a spline of the phase with two bumps, of eight parameters: phase, rise and fall
time and torque of each. `aim.Aim` says what is to be small. Limits of comfort: the motor's
torque, the rate of the torque, and angles of the joint within those that the person has without the
device, and some more. A search that is ended goes on from its last generation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import cma
import numpy as np

from gaitval.apps.devices.adaptation import walk_without
from gaitval.apps.devices.curves import JOINTS, WalkCurves, joints_rate, walk_curves
from gaitval.apps.devices.study import AFTER, Say, Wearer, pace_of, pushed, pushes_of
from gaitval.apps.devices.walking import DeviceEnvironment, DeviceTask, walk_with, with_devices
from gaitval.arrays import Array
from gaitval.artefacts import read_json, value_hash, write_json
from gaitval.coordinates import SIDES
from gaitval.errors import ArtefactError, ConfigurationError, RecordError
from gaitval.model.devices.aim import Aim
from gaitval.model.devices.controllers import PhaseSpline
from gaitval.model.devices.device import Device
from gaitval.model.urdf import model_hash
from gaitval.policy.environment import WalkingEnvironment

CYCLES: Final = 12.0
FORCES: Final = (150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 500.0, 600.0, 800.0)
"""N; a search for stability pushes as hard as makes the person fall half of the times."""
LEAST: Final = 0.02
"""Of what an aim is without the device, in its unit: that of a walk which has nothing to gain."""
POPULATION: Final = 12
STATE: Final = "search.json"
_LOW: Final = np.array([0.0, 0.08, 0.08, -1.0] * 2)
_HIGH: Final = np.array([1.0, 0.40, 0.40, 1.0] * 2)
_START: Final = np.array([0.12, 0.20, 0.16, -0.4, 0.62, 0.16, 0.20, 0.4])
"""Phase, rise, fall, and torque as a part of the motor's, of both bumps."""


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    Attributes
    ----------
    device, aim : that it was for; the device has the best `PhaseSpline` now, and no search.
    bumps : of the best `PhaseSpline`.
    best, without : the aim with it and without the device.
    walks, generations : that the search took.
    """

    device: Device
    aim: Aim
    bumps: tuple[tuple[float, float, float, float], ...]
    best: float
    without: float
    walks: int
    generations: int


def spline_of(x: Array, torque: float) -> PhaseSpline:
    """The controller of parameters `x` (8,) for a motor of `torque` Nm."""
    x = np.clip(x, _LOW, _HIGH)
    bumps = [
        (float(at % 1.0), float(rise), float(fall), float(share * torque))
        for at, rise, fall, share in x.reshape(2, 4)
    ]
    return PhaseSpline(bumps=tuple(bumps))


def steepest(spline: PhaseSpline, stride_time: float) -> float:
    """Nm/s, the largest rate of a spline's torque: 1.5 peaks in a rise or fall."""
    return sum(1.5 * abs(peak) / (min(rise, fall) * stride_time) for _, rise, fall, peak in
               spline.bumps)  # fmt: skip


def with_controller(device: Device, joint: str, spline: PhaseSpline) -> Device:
    """A device whose motor at a joint has another controller."""
    hinges = tuple(
        hinge.model_copy(update={"controller": spline}) if hinge.joint == joint else hinge
        for hinge in device.hinges
    )
    return device.model_copy(update={"hinges": hinges})


def value(aim: Aim, curves: WalkCurves) -> float:
    """What an aim other than `pushes` is in a walk, in its unit."""
    if aim.quantity == "work":
        return sum(curves.work[aim.joint, side] for side in SIDES)
    if aim.quantity == "moment":
        return sum(float(np.abs(curves.own[aim.joint, side]).max()) for side in SIDES)
    if aim.quantity == "legs":
        return sum(curves.work.values())
    if aim.quantity == "cost":
        return joints_rate(curves)
    return asymmetry(curves)


def asymmetry(curves: WalkCurves) -> float:
    """Mean symmetry index (Robinson, Herzog and Nigg 1987): the difference of the sides over their
    mean, of stance, largest vertical force, and positive work of the muscles of the leg.
    """
    pairs = [
        [curves.stance[side] for side in SIDES],
        [float(curves.forces[side].max()) for side in SIDES],
        [sum(curves.work[joint, side] for joint in JOINTS) for side in SIDES],
    ]
    return float(np.mean([2.0 * abs(a - b) / max(a + b, 1e-9) for a, b in pairs]))


def lost_after_pushes(environment: WalkingEnvironment, person: Wearer, force: float) -> float:
    """Part of the `AFTER` strides after each of the `pushes_of` a `force` of N that the person has
    fallen before.
    """
    lost = []
    for push in pushes_of(force):
        walk = pushed(environment, person.policy, person.mu, push)
        # A walk may be slower than its reference, and is not shorter for that.
        lost.append(1.0 - min(max(walk.cycles - push[0], 0.0) / AFTER, 1.0) if walk.fell else 0.0)
    return float(np.mean(lost))


def search_spline(
    person: Wearer,
    device: Device,
    aim: Aim,
    folder: Path,
    *,
    others: Sequence[Device] = (),
    on_generation: Callable[[int, float], None] = lambda *_: None,
) -> SearchResult:
    """Search the two bumps of a `device` on a `person` that make `aim` smallest, the person's
    control kept. `folder` keeps the state after each generation; `others` are devices that the
    person wears beside this one, and without it. `on_generation` is called with the generation and
    the best value so far, over that without.

    Raises ConfigurationError if the device has no motor at the joint, RecordError if the person
    falls without the device.
    """
    motor = device.motor(aim.joint)
    if motor is None:
        raise ConfigurationError(
            f"{device.name}: no motor at {aim.joint}, so there is nothing to search. Give a device "
            "with one, or another joint."
        )
    mass, stride = person.task.model.mass, person.task.reference.stride_time
    task = with_devices(person.task, [device, *others])
    plain, bare, pace = _without(person, task, others)
    if any(each.stumps for each in (device, *others)):
        pace = None  # as in `outcomes` of study.py
    force = 0.0
    if aim.quantity == "pushes":
        shares = ((each, lost_after_pushes(bare, person, each)) for each in FORCES)
        force, without = next((found for found in shares if found[1] >= 0.5), (FORCES[-1], LEAST))
    else:
        without = max(value(aim, plain), LEAST)
    lowest = min(plain.angles[aim.joint, side].min() for side in SIDES) - aim.range_rad
    highest = max(plain.angles[aim.joint, side].max() for side in SIDES) + aim.range_rad

    def cost(x: Array) -> float:
        spline = spline_of(x, motor.torque)
        outside = float(np.sum(np.maximum(_LOW - x, 0.0) + np.maximum(x - _HIGH, 0.0)))
        rough = max(0.0, steepest(spline, stride) / aim.torque_rate - 1.0)
        fitted = with_controller(device, aim.joint, spline)
        worn = replace(task, devices=(fitted, *others))
        # else the strategy that slows the person most would be the best
        environment = DeviceEnvironment(worn, pace=pace)
        walk = walk_with(environment, person.policy, mu=person.mu, cycles=CYCLES)
        try:
            curves = walk_curves(walk, task.configuration, mass)
        except RecordError:
            curves = None
        if curves is None or walk.rollout.fell[0]:
            return 10.0 - float(walk.rollout.phase[-1]) / CYCLES
        beyond = 0.0
        for side in SIDES:
            angle = curves.angles[aim.joint, side]
            beyond += max(0.0, lowest - angle.min()) + max(0.0, angle.max() - highest)
        if aim.quantity == "pushes":
            now = lost_after_pushes(DeviceEnvironment(worn), person, force)
        else:
            now = value(aim, curves)
        return now / without + rough + 10.0 * beyond + outside

    about = _asked(person, (device, *others), aim, pace)
    x, best, history = _searched(cost, Path(folder), aim, about, on_generation)
    spline = spline_of(x, motor.torque)
    tuned = with_controller(device, aim.joint, spline).model_copy(update={"search": None})
    count = len(history)
    return SearchResult(
        tuned, aim, spline.bumps, best * without, without, POPULATION * count, count
    )


def _asked(
    person: Wearer, devices: Sequence[Device], aim: Aim, pace: float | None
) -> dict[str, object]:
    """What a stored state of a search is of: another one must not go on from it."""
    reference = person.task.reference
    return {
        **aim.model_dump(exclude={"generations"}),
        "person": person.name,
        "speed": "kept" if pace is not None else "free",
        # One name may be of several walkers: trained again, corrected, with another body.
        "walker": value_hash(
            [
                *(person.policy.key, person.mu.tolist(), model_hash(person.task.model)),
                *(reference.positions.tolist(), reference.stride_time),
            ]
        ),
        "devices": value_hash([each.model_dump(mode="json") for each in devices]),
    }


def tuned(
    person: Wearer, devices: Sequence[Device], folder: Path, *, say: Say = lambda _: None
) -> tuple[list[Device], list[SearchResult]]:
    """The devices as the person wears them: those with a `search` have the torque that it found. In
    `folder` each search has its state. Raises ConfigurationError, RecordError, ArtefactError.
    """
    fitted, found = list(devices), []
    for k, device in enumerate(fitted):
        if (aim := device.search) is None:
            continue

        def shown(generation: int, best: float, aim: Aim = aim, name: str = device.name) -> None:
            if generation % 5 == 0 or generation == aim.generations:
                say(f"search for {name}, generation {generation}: {aim.quantity} is {best:.2f} of"
                    " what it is without the device")  # fmt: skip

        others = [each for each in fitted if each is not device]
        state = folder / f"search-{device.name}"
        found.append(search_spline(person, device, aim, state, others=others, on_generation=shown))
        fitted[k] = found[-1].device
    return fitted, found


def _without(
    person: Wearer, task: DeviceTask, others: Sequence[Device]
) -> tuple[WalkCurves, WalkingEnvironment, float | None]:
    """Curves of the person without the device that is searched for, where to be pushed so, and the
    pace of that walk.
    """
    mass = person.task.model.mass
    if others:
        bare = DeviceEnvironment(with_devices(person.task, others))
        walk = walk_with(bare, person.policy, mu=person.mu, cycles=CYCLES)
        return walk_curves(walk, task.configuration, mass), bare, pace_of(walk, person.task)
    walk = walk_without(task, person.policy, person.mu, CYCLES)
    curves = walk_curves(walk, task.configuration, mass)
    return curves, WalkingEnvironment(person.task), pace_of(walk, person.task)


def _searched(
    cost: Callable[[Array], float],
    folder: Path,
    aim: Aim,
    about: dict[str, object],
    on_generation: Callable[[int, float], None],
) -> tuple[Array, float, list[list[float]]]:
    """CMA-ES in units of an eighth of each parameter's range, from a stored state if there is one:
    the best parameters, their cost, and the costs of each generation.

    The state is what was asked and answered: the generations so far are given again to a new search
    of the same seed, which so comes to the same place.
    """
    path = folder / STATE
    history = _history(path, about)
    unit = (_HIGH - _LOW) / 8.0
    options = {"popsize": POPULATION, "seed": aim.seed + 1, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(_START / unit, 1.0, options)
    for generation in range(aim.generations):
        candidates = strategy.ask()
        if generation < len(history):
            answers = history[generation]
        else:
            answers = [cost(np.asarray(x) * unit) for x in candidates]
            history.append(answers)
            folder.mkdir(parents=True, exist_ok=True)
            write_json(path, {"about": about, "answers": history})
        strategy.tell(candidates, answers)
        on_generation(generation + 1, float(min(min(row) for row in history)))
    return np.asarray(strategy.result.xbest) * unit, float(strategy.result.fbest), history


def _history(path: Path, about: dict[str, object]) -> list[list[float]]:
    """Answers of the generations so far. Raises ArtefactError if they are of another search."""
    if not path.is_file():
        return []
    try:
        state = read_json(path, "Delete it to search anew")
        same = state["about"] == about
        answers = [[float(each) for each in row] for row in state["answers"]]
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path}: not the state of a search ({error!r}). Delete it to search anew."
        ) from None
    if not same:
        raise ArtefactError(
            f"{path}: the state of a search for another person, walker, device, aim or seed. Give "
            "another folder, or delete it to search anew."
        )
    return answers
