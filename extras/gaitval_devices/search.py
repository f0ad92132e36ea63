"""Strategies: a search over the parameters of a controller for one person (CMA-ES).

The controller is a spline of the phase with two bumps, of eight parameters: phase, rise and fall
time and torque of each. The aim is the positive work, or the largest moment, of the muscles of a
joint. Limits of comfort: the motor's torque, the rate of the torque, and angles of the joint within
those that the person has without the device, and some more. A search that is ended goes on from
its last generation.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final, Literal

import cma
import numpy as np

from gaitval import file_gate
from gaitval.arrays import Array
from gaitval.artefacts import write_json
from gaitval.coordinates import SIDES
from gaitval.errors import ArtefactError, ConfigurationError, RecordError
from gaitval_devices.adaptation import walk_without
from gaitval_devices.controllers import PhaseSpline
from gaitval_devices.curves import WalkCurves, walk_curves
from gaitval_devices.device import Device
from gaitval_devices.study import Wearer
from gaitval_devices.walking import DeviceEnvironment, walk_with, with_devices

CYCLES: Final = 12.0
GENERATIONS: Final = 25
POPULATION: Final = 12
STATE: Final = "search.json"
LARGEST: Final = 10_000_000
_LOW: Final = np.array([0.0, 0.08, 0.08, -1.0] * 2)
_HIGH: Final = np.array([1.0, 0.40, 0.40, 1.0] * 2)
_START: Final = np.array([0.12, 0.20, 0.16, -0.4, 0.62, 0.16, 0.20, 0.4])
"""Phase, rise, fall, and torque as a part of the motor's, of both bumps."""


@dataclass(frozen=True)
class Aim:
    """What is to be small.

    Attributes
    ----------
    joint : whose muscles.
    quantity : `work`, their positive work a stride, or `moment`, their largest moment; both sides.
    torque_rate : Nm/s, most that is comfortable.
    range_rad : rad, by which the joint may leave the range of the walk without the device.
    """

    joint: str
    quantity: Literal["work", "moment"] = "work"
    torque_rate: float = 300.0
    range_rad: float = 0.17

    def of(self, curves: WalkCurves) -> float:
        """J/kg or Nm/kg, both sides' sum."""
        if self.quantity == "work":
            return sum(curves.work[self.joint, side] for side in SIDES)
        return sum(float(np.abs(curves.own[self.joint, side]).max()) for side in SIDES)


@dataclass(frozen=True)
class Found:
    """What a search found.

    Attributes
    ----------
    bumps : of the best `PhaseSpline`.
    best, without : the aim with it and without the device.
    walks, generations : that the search took.
    """

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


def search_spline(
    person: Wearer,
    device: Device,
    aim: Aim,
    folder: Path,
    *,
    seed: int = 0,
    generations: int = GENERATIONS,
    on_generation: Callable[[int, float], None] = lambda *_: None,
) -> Found:
    """Search the two bumps that make `aim` smallest, the person's control kept.

    Parameters
    ----------
    folder : keeps the state after each generation.
    on_generation : called with the generation and the best value so far.

    Raises
    ------
    ConfigurationError : the device has no motor at the joint.
    """
    motor = next((h.motor for h in device.hinges if h.joint == aim.joint and h.motor), None)
    if motor is None:
        raise ConfigurationError(
            f"{device.name}: no motor at {aim.joint}, so there is nothing to search. Give a device "
            "with one, or another joint."
        )
    mass, stride = person.task.model.mass, person.task.reference.stride_time
    bare = with_devices(person.task, [device])
    plain = walk_curves(
        walk_without(bare, person.policy, person.mu, CYCLES), bare.configuration, mass
    )
    without = aim.of(plain)
    lowest = min(plain.angles[aim.joint, side].min() for side in SIDES) - aim.range_rad
    highest = max(plain.angles[aim.joint, side].max() for side in SIDES) + aim.range_rad

    def cost(x: Array) -> float:
        spline = spline_of(x, motor.torque)
        outside = float(np.sum(np.maximum(_LOW - x, 0.0) + np.maximum(x - _HIGH, 0.0)))
        rough = max(0.0, steepest(spline, stride) / aim.torque_rate - 1.0)
        worn = with_controller(device, aim.joint, spline)
        environment = DeviceEnvironment(replace(bare, devices=(worn,)))
        walk = walk_with(environment, person.policy, mu=person.mu, cycles=CYCLES)
        try:
            curves = walk_curves(walk, bare.configuration, mass)
        except RecordError:
            curves = None
        if curves is None or walk.rollout.fell[0]:
            return 10.0 - float(walk.rollout.phase[-1]) / CYCLES
        beyond = 0.0
        for side in SIDES:
            angle = curves.angles[aim.joint, side]
            beyond += max(0.0, lowest - angle.min()) + max(0.0, angle.max() - highest)
        return aim.of(curves) / without + rough + 10.0 * beyond + outside

    return _searched(
        cost, Path(folder), seed, generations, motor.torque, without, on_generation, asdict(aim)
    )


def _searched(
    cost: Callable[[Array], float],
    folder: Path,
    seed: int,
    generations: int,
    torque: float,
    without: float,
    on_generation: Callable[[int, float], None],
    about: dict[str, object],
) -> Found:
    """CMA-ES in units of an eighth of each parameter's range, from a stored state if there is one.

    The state is what was asked and answered: the generations so far are given again to a new search
    of the same seed, which so comes to the same place.
    """
    path = Path(folder) / STATE
    history = _history(path, about, seed)
    unit = (_HIGH - _LOW) / 8.0
    options = {"popsize": POPULATION, "seed": seed + 1, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(_START / unit, 1.0, options)
    for generation in range(generations):
        asked = strategy.ask()
        if generation < len(history):
            answers = history[generation]
        else:
            answers = [cost(np.asarray(x) * unit) for x in asked]
            history.append(answers)
            Path(folder).mkdir(parents=True, exist_ok=True)
            write_json(path, {"about": about, "seed": seed, "answers": history})
        strategy.tell(asked, answers)
        on_generation(generation + 1, float(min(min(row) for row in history)))
    best = np.asarray(strategy.result.xbest) * unit
    return Found(
        spline_of(best, torque).bumps,
        float(strategy.result.fbest) * without,
        without,
        POPULATION * len(history),
        len(history),
    )


def _history(path: Path, about: dict[str, object], seed: int) -> list[list[float]]:
    """Answers of the generations so far. Raises ArtefactError if they are of another search."""
    if not path.is_file():
        return []
    try:
        state = json.loads(file_gate.read_text(path, ArtefactError, largest=LARGEST))
        same = state["about"] == about and state["seed"] == seed
        answers = [[float(each) for each in row] for row in state["answers"]]
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path}: not the state of a search ({error!r}). Delete it to search anew."
        ) from None
    if not same:
        raise ArtefactError(
            f"{path}: the state of a search for another aim or seed. Give another folder, or "
            "delete it to search anew."
        )
    return answers
