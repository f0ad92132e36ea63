"""Shipped: whether a hip exoskeleton that acts on the unusual helps people to recover from pushes.

    python -m experiments.recovery_help --search S02 S04          # gains
    python -m experiments.recovery_help S01 S05 S08               # without, worn and off, with it

The device is `hip_exo`, with a second motor of its kind at each hip that abducts. Its computer
(`Unusual`) knows how fast each hip usually abducts at each phase. A standing leg that leans over
faster than usual says that the body falls to a side: then the other leg, in its swing, is lifted,
and moved to where the body falls. Pushed people who fall do so over a foot that came down too early
and too near (docs/what-we-tried.md). Its two gains are searched on some people with two aims, to
survive and to need few steps; those whom it is told of, and the phases at which they are pushed,
have no part in it. They walk from five starts that differ by micrometres and milliseconds. A person
does not learn the device here: the policy stays.
"""

import argparse
import copy
import itertools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import cma
import numpy as np
from numpy.typing import NDArray

from gaitval.apps.devices.study import Wearer, wearer
from gaitval.apps.devices.walking import DeviceEnvironment, with_devices
from gaitval.arrays import Array
from gaitval.artefacts import read_json, write_json
from gaitval.coordinates import SIDES, opposite
from gaitval.metrics.balance_walk import BalanceWalk, walked
from gaitval.metrics.foot_placement import placements, steps_to_recover
from gaitval.metrics.push_ensembles import APART, NOISE, STARTS
from gaitval.metrics.push_recovery import Push, largest_survived, without_drift
from gaitval.model.devices.controllers import Controller, Measured
from gaitval.model.devices.device import Device, load_devices
from gaitval.model.parameters import apply_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import rollout_of
from gaitval.simulation.walker import Trajectory

TARGET: Final = Path(__file__).parent.parent / "reports" / "robustness" / "recovery_help.json"
SEARCHED: Final = (0.0, 0.25, 0.5, 0.75)
TESTED: Final = (0.125, 0.375, 0.625, 0.875)
"""Phases of the gait cycle of pushes in the search, and of those that are told."""
ASIDE: Final = (0.5 * math.pi, -0.5 * math.pi)
"""Directions of the pushes, rad."""
SETTLING, AFTER = 3.0, 4.0
"""Gait cycles before a push, and after it."""
BEFORE: Final = 0.02
"""Gait cycles before a push, at which walks are no longer one."""
STEP, RESOLUTION, CEILING = 100.0, 25.0, 1000.0
"""N, of `largest_survived`."""
HARDER: Final = (100.0,)
"""N, from the largest push that is survived without the device, of those in the search."""
FALL: Final = 10.0
"""Steps that a fall counts in the search."""
UNIT: Final = 30.0
"""Nms/rad, of the gains in the search."""
GENERATIONS, POPULATION = 3, 4


class Unusual:
    """The computer of both hips: by how much each leg abducts faster than is usual at its phase,
    rad/s, and two gains, Nms/rad, by which the other leg, in its swing, is lifted and moved aside.
    """

    def __init__(self, lift: float, aside: float) -> None:
        self.lift, self.aside = lift, aside
        self.usual = {side: np.zeros((2, 50)) for side in SIDES}
        self.leaning = dict.fromkeys(SIDES, 0.0)

    def abduction(self, measured: Measured) -> float:
        """Nm; notes what is unusual. Nothing before it knows two strides."""
        if math.isnan(measured.phase):
            return 0.0
        mean, seen = self.usual[measured.side][:, int(50.0 * measured.phase) % 50].tolist()
        away, known = measured.speed - mean, seen >= 8.0  # four actions a stride and place
        if not known or abs(away) < 0.3:
            seen += 1.0
            mean += away / min(seen, 20.0)
            self.usual[measured.side][:, int(50.0 * measured.phase) % 50] = mean, seen
        self.leaning[measured.side] = away if known and measured.loaded else 0.0
        return 0.0 if measured.loaded else self.aside * self.leaning[opposite(measured.side)]

    def flexion(self, measured: Measured) -> float:
        """Nm; up to 0.15 rad/s, which was chosen, nothing is unusual."""
        unusual = abs(self.leaning[opposite(measured.side)]) - 0.15
        return 0.0 if measured.loaded else self.lift * max(unusual, 0.0)


class _Motor:
    """What commands one motor."""

    def __init__(self, torque: Callable[[Measured], float]) -> None:
        self.torque = torque


def two_motors(device: Device) -> Device:
    """A hip exoskeleton with a second motor of its kind, which abducts, before the first."""
    (hinge,) = device.hinges
    second = hinge.model_copy(update={"joint": "hip_adduction"})
    return device.model_copy(update={"name": "recovery_exo", "hinges": (second, hinge)})


def motors_of(computer: Unusual) -> Iterator[Controller]:
    """Those of `two_motors`, in the order in which they are made: right and left of each hinge."""
    for torque in (computer.abduction, computer.flexion):
        yield from (_Motor(torque), _Motor(torque))


class Tried:
    """A person who is pushed, without the device or with gains.

    All walks of one start are one until they are pushed: it is walked once, and what follows is
    walked from copies, so that no walk knows of another.

    Parameters
    ----------
    person : who.
    gains : of the device; None without it.
    start : number of one of the starts of an ensemble; None of the start without noise.
    """

    def __init__(
        self, person: Wearer, gains: Sequence[float] | None, start: int | None = None
    ) -> None:
        task = without_drift(person.task)
        self._person, self._start = person, start
        self._body = apply_parameters(task.model, person.mu)
        self._environment: WalkingEnvironment = WalkingEnvironment(task)
        if gains is not None:
            worn = two_motors(load_devices("hip_exo")[0])
            motors = motors_of(Unusual(*gains))
            self._environment = DeviceEnvironment(with_devices(task, [worn], lambda: next(motors)))
        self._settled: dict[float, tuple[WalkingEnvironment, NDArray[np.float32]]] = {}
        self._plain: dict[float, BalanceWalk | None] = {}

    def _shared(self) -> dict[int, object]:
        """What copies have in common, as `copy.deepcopy` takes it."""
        walker = self._environment.walker
        devices = [each.device for each in getattr(walker, "fitted", ())]
        same = [walker.task, self._environment.yardstick, *devices]
        return {id(each): each for each in same}

    def _settle(self) -> None:
        """Walk, and keep copies just before each of the phases at which people are pushed."""
        environment, person = self._environment, self._person
        environment.centre(person.policy.act, person.mu, key=person.policy.key)
        noise = 0.0 if self._start is None else NOISE
        options = {"phase": 0.0, "mu": person.mu, "push": None, "noise": noise}
        told, _ = environment.reset(seed=self._start or 0, options=options)
        for phase in sorted((*SEARCHED, *TESTED)):
            while environment.walker.phase < SETTLING + phase - BEFORE:
                told, _, fell, _, _ = environment.step(person.policy.act(told))
                if fell:
                    return
            self._settled[phase] = copy.deepcopy(environment, self._shared()), told

    def _walked(
        self, phase: float, push: Push | None, recording: Trajectory | None = None
    ) -> tuple[WalkingEnvironment, bool]:
        """The walker `AFTER` cycles after this phase, or where it fell; and whether it did."""
        if not self._settled:
            self._settle()
        if phase not in self._settled:  # it fell before
            return self._environment, True
        settled, told = self._settled[phase]
        environment = copy.deepcopy(settled, self._shared())
        if push is not None:
            late = 0.0 if self._start is None else APART * (self._start - 0.5 * (STARTS - 1))
            begins = SETTLING + phase + late / self._person.task.reference.stride_time
            environment._push = begins, push.force, push.direction
        ends, fell = SETTLING + phase + AFTER, False
        while not fell and environment.walker.phase < ends:
            told, _, fell, _, _ = environment.step(self._person.policy.act(told), recording)
        return environment, bool(fell)

    def stands(self, push: Push) -> bool:
        """Whether a push is survived."""
        return not self._walked(push.phase, push)[1]

    def _balance(self, phase: float, push: Push | None) -> BalanceWalk | None:
        """None if it fell."""
        task, slowest = self._person.task, self._environment.constants.slowest_pace
        longest = (AFTER + 2.0 * BEFORE) * task.reference.stride_time / slowest
        recording = Trajectory(math.ceil(longest / self._environment.walker.physics_step))
        environment, fell = self._walked(phase, push, recording)
        if fell:
            return None
        rollout = rollout_of(recording.steps(), environment.walker, SETTLING + phase, fell)
        return walked(rollout, self._body, threshold=task.configuration.contact.event_threshold)

    def _usual(self, phase: float) -> BalanceWalk | None:
        if phase not in self._plain:
            self._plain[phase] = self._balance(phase, None)
        return self._plain[phase]

    def steps(self, push: Push) -> float:
        """Steps until recovered; `FALL` if it falls, half of that if it does not recover."""
        plain, walk = self._usual(push.phase), self._balance(push.phase, push)
        if plain is None or walk is None:
            return FALL
        # What was walked before the push is too short for a mean height.
        walk = replace(walk, pendulum=plain.pendulum)
        seconds = self._person.task.configuration.environment.push_seconds
        needed = steps_to_recover(list(placements(walk, plain, ends=seconds)), (1,))
        return 0.5 * FALL if needed is None else float(needed)


def largest(tried: Tried, phases: Sequence[float]) -> Array:
    """(P, 2) N, the largest pushes at these `phases` to the left and right up to which every tested
    one is survived.
    """
    return largest_survived(
        lambda pushes: [tried.stands(push) for push in pushes],
        phases,
        ASIDE,
        step=STEP,
        resolution=RESOLUTION,
        ceiling=CEILING,
    )


def searched(names: Sequence[str], say: Callable[[str], None]) -> list[float]:
    """The gains, Nms/rad, with which these people need the fewest steps."""
    people = [wearer(name) for name in names]
    pushes = []
    for person in people:
        alone = largest(Tried(person, None), SEARCHED)
        pushes.append(
            [
                Push(phase, direction, float(force) + more)
                for phase, row in zip(SEARCHED, alone, strict=True)
                for direction, force in zip(ASIDE, row, strict=True)
                for more in HARDER
            ]
        )

    def cost(gains: Sequence[float] | None) -> float:
        found = []
        for person, own in zip(people, pushes, strict=True):
            tried = Tried(person, gains)
            found += [tried.steps(push) for push in own]
        return float(np.mean(found))

    say(f"without: {cost(None):.2f}; worn, off: {cost([0.0, 0.0]):.2f}")
    options = {"popsize": POPULATION, "seed": 1, "verbose": -9, "bounds": [0.0, None]}
    strategy = cma.CMAEvolutionStrategy([2.0, 1.0], 0.7, options)
    for _ in range(GENERATIONS):
        asked = strategy.ask()
        answers = [cost([UNIT * each for each in one]) for one in asked]
        strategy.tell(asked, answers)
        pairs = zip(asked, answers, strict=True)
        say(", ".join(f"{UNIT * a[0]:.1f} {UNIT * a[1]:.1f}: {b:.2f}" for a, b in pairs))
    return [UNIT * float(each) for each in strategy.result.xbest]


def survived(person: Wearer, gains: Sequence[float] | None, start: int) -> list[float]:
    """Largest pushes of a person with these `gains`, or without the device, from one start of an
    ensemble, N, in the order of `TESTED` and `ASIDE`.
    """
    return [float(each) for each in largest(Tried(person, gains, start), TESTED).ravel()]


def change(without: Sequence[Sequence[float]], worn: Sequence[Sequence[float]]) -> dict[str, float]:
    """By how much largest pushes grow, %, from as many starts (rows) of an ensemble as both have:
    those that all of them survive, their mean over the cases, and of the single cases mean, SD and
    median; and the SD between starts of the mean over cases.
    """
    count = min(len(without), len(worn))
    before, after = np.array(without[:count]), np.array(worn[:count])
    each = 100.0 * (after.min(axis=0) / before.min(axis=0) - 1.0)
    starts = 100.0 * (after.mean(axis=1) / before.mean(axis=1) - 1.0)
    found = {
        "starts": count,
        "of_mean": 100.0 * (after.min(axis=0).mean() / before.min(axis=0).mean() - 1.0),
        "mean": each.mean(),
        "sd": each.std(ddof=1),
        "median": np.median(each),
        "sd_of_starts": starts.std(ddof=1) if count > 1 else 0.0,
    }
    return {name: float(value) for name, value in found.items()}


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("people", nargs="*")
    parser.add_argument("--search", metavar="PERSON", nargs="+")
    parser.add_argument("--out", type=Path, default=TARGET)
    arguments = parser.parse_args()
    stored: dict[str, Any] = read_json(arguments.out) if arguments.out.exists() else {}
    began = time.monotonic()
    if arguments.search:
        say = partial(print, flush=True)
        gains = searched(arguments.search, say)
        stored = {"searched_on": arguments.search, "gains_nms_rad": gains, "people": {}}
        write_json(arguments.out, stored)
    gains = stored["gains_nms_rad"]
    people = {name: wearer(name) for name in arguments.people}
    worn_so = {"without": None, "with": gains, "off": [0.0] * len(gains)}
    for start, (name, person) in itertools.product(range(STARTS), people.items()):
        own = stored["people"].setdefault(name, {key: [] for key in worn_so})
        for key, worn in worn_so.items():
            if len(own[key]) == start:  # else it was interrupted after this one
                own[key].append(survived(person, worn, start))
                if key != "without":
                    own[f"change_{key}_percent"] = change(own["without"], own[key])
                write_json(arguments.out, stored)
                print(name, start, key, own[key][-1], flush=True)
    print(f"{arguments.out}, {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
