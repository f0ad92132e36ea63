"""Shipped: whether a hip exoskeleton that acts on the unusual helps people to recover from pushes.

    python -m experiments.recovery_help --search S05              # gains, 15 min
    python -m experiments.recovery_help S02 S05 S08               # without and with them

The device has the motors of `hip_exo`, turned to abduct the hips. Its controller (`Unusual`) knows
how fast the hip usually moves at each phase, and acts on the difference. Its gains are searched on
one person with two aims, to survive and to need few steps; the others and the forces at which they
fall have no part in it. A person does not learn the device here: the policy stays.
"""

import argparse
import json
import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import cma
import numpy as np

from gaitval.apps.devices.study import Wearer, wearer
from gaitval.apps.devices.walking import DeviceEnvironment, with_devices
from gaitval.artefacts import read_json, write_json
from gaitval.metrics.balance_walk import BalanceWalk, walked
from gaitval.metrics.foot_placement import placements, steps_to_recover
from gaitval.metrics.push_recovery import Push, without_drift
from gaitval.model.devices.controllers import Measured
from gaitval.model.devices.device import Device, load_devices
from gaitval.model.parameters import apply_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout

TARGET: Final = Path(__file__).parent.parent / "reports" / "robustness" / "recovery_help.json"
SEARCHED: Final = (0.0, 0.25, 0.5, 0.75)
TESTED: Final = (0.125, 0.375, 0.625, 0.875)
"""Phases of the gait cycle of pushes in the search, and of those that are told."""
SETTLING, AFTER = 3.0, 4.0
"""Gait cycles before a push, and after it."""
STEP: Final = 25.0
"""N, between the pushes of which the largest is told."""
HARDER: Final = (-50.0, 50.0, 100.0, 200.0)
"""N, from the largest push that is survived without the device, of those in the search."""
FALL: Final = 10.0
"""Steps that a fall counts in the search."""
UNIT: Final = 2.0
"""Nms/rad, of the gains in the search."""
GENERATIONS, POPULATION = 5, 6


class Unusual:
    """Torque along what the hip's speed is unlike at this phase, with a gain for each state of the
    foot, Nms/rad.
    """

    def __init__(self, swinging: float, standing: float) -> None:
        self.gains, self.most = (swinging, standing), 17.5
        self.usual, self.seen = np.zeros(50), np.zeros(50)

    def torque(self, measured: Measured) -> float:
        """Nm; nothing before it knows two strides."""
        if math.isnan(measured.phase):
            return 0.0
        at = int(50.0 * measured.phase) % 50
        away = measured.speed - self.usual[at]
        known = self.seen[at] >= 8.0  # four actions a stride and place
        if not known or abs(away) < 0.3:
            self.seen[at] += 1.0
            self.usual[at] += away / min(self.seen[at], 20.0)
        gain = self.gains[measured.loaded]
        return max(-self.most, min(self.most, gain * away)) if known else 0.0


def abducting(device: Device) -> Device:
    """A hip exoskeleton whose motors abduct."""
    hinges = tuple(each.model_copy(update={"joint": "hip_adduction"}) for each in device.hinges)
    return device.model_copy(update={"name": "hip_abduction_exo", "hinges": hinges})


class Tried:
    """A person who is pushed, without the device or with gains.

    Parameters
    ----------
    person : who.
    gains : of the device; None without it.
    """

    def __init__(self, person: Wearer, gains: Sequence[float] | None) -> None:
        task = without_drift(person.task)
        self._person, self._body = person, apply_parameters(task.model, person.mu)
        self.environment: WalkingEnvironment = WalkingEnvironment(task)
        if gains is not None:
            device = abducting(load_devices("hip_exo")[0])
            worn = with_devices(task, [device], own=partial(Unusual, *gains))
            self.environment = DeviceEnvironment(worn)
        self._plain: BalanceWalk | None = None

    def walk(self, push: Push | None) -> BalanceWalk:
        """A walk with a push, or without."""
        phase = SETTLING + (1.0 if push is None else push.phase)
        rollout = record_rollout(
            self.environment,
            self._person.policy,
            mu=self._person.mu,
            start_phase=0.0,
            cycles=phase + AFTER,
            push=push and (phase, push.force, push.direction),
        )
        threshold = self._person.task.configuration.contact.event_threshold
        return walked(rollout, self._body, threshold=threshold)

    def steps(self, push: Push) -> float:
        """Steps until recovered; `FALL` if it falls, half of that if it does not recover."""
        walk = self.walk(push)
        if walk.fell:
            return FALL
        if self._plain is None:
            self._plain = self.walk(None)
        seconds = self._person.task.configuration.environment.push_seconds
        needed = steps_to_recover(list(placements(walk, self._plain, ends=seconds)), (1,))
        return 0.5 * FALL if needed is None else float(needed)

    def largest(self, phase: float, direction: float, ceiling: float = 1000.0) -> float:
        """N, the largest push up to which every one is survived."""
        force = 100.0
        while force < ceiling and not self.walk(Push(phase, direction, force + STEP)).fell:
            force += STEP
        return force


def sides() -> tuple[float, float]:
    """Directions, rad."""
    return 0.5 * math.pi, -0.5 * math.pi


def searched(name: str, say: Callable[[str], None]) -> list[float]:
    """The gains, Nms/rad, with which a person needs the fewest steps."""
    person = wearer(name)
    alone = Tried(person, None)
    pushes = [
        Push(phase, direction, alone.largest(phase, direction) + more)
        for phase in SEARCHED
        for direction in sides()
        for more in HARDER
    ]

    def cost(gains: Sequence[float] | None) -> float:
        tried = Tried(person, gains)
        return float(np.mean([tried.steps(each) for each in pushes]))

    say(f"without: {cost(None):.2f}; worn, off: {cost([0.0, 0.0]):.2f}")
    options = {"popsize": POPULATION, "seed": 1, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy([1.0, 1.0], 1.5, options)
    for _ in range(GENERATIONS):
        asked = strategy.ask()
        answers = [cost([UNIT * each for each in one]) for one in asked]
        strategy.tell(asked, answers)
        pairs = zip(asked, answers, strict=True)
        say(", ".join(f"{UNIT * a[0]:.1f} {UNIT * a[1]:.1f}: {b:.2f}" for a, b in pairs))
    return [UNIT * float(each) for each in strategy.result.xbest]


def helped(name: str, gains: Sequence[float]) -> dict[str, Any]:
    """Largest pushes of a person without the device, with it off, and with it, N, and the change
    from the first to the last, %: mean and SD of the cases.
    """
    person = wearer(name)
    cases = [(phase, direction) for phase in TESTED for direction in sides()]
    found = {}
    worn_so = {"without": None, "off": [0.0] * len(gains), "with": list(gains)}
    for key, worn in worn_so.items():
        tried = Tried(person, worn)
        found[key] = [tried.largest(*case) for case in cases]
    before, after = (np.array(found[key]) for key in ("without", "with"))
    change = 100.0 * (after / before - 1.0)
    spread = {"mean": float(change.mean()), "sd": float(change.std(ddof=1))}
    return {**found, "change_percent": spread}


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("people", nargs="*")
    parser.add_argument("--search", metavar="PERSON")
    parser.add_argument("--out", type=Path, default=TARGET)
    arguments = parser.parse_args()
    stored: dict[str, Any] = read_json(arguments.out) if arguments.out.exists() else {}
    began = time.monotonic()
    if arguments.search:
        say = partial(print, flush=True)
        gains = searched(arguments.search, say)
        stored |= {"searched_on": arguments.search, "gains_nms_rad": gains, "people": {}}
        write_json(arguments.out, stored)
    for name in arguments.people:
        stored["people"][name] = helped(name, stored["gains_nms_rad"])
        write_json(arguments.out, stored)
        print(name, json.dumps(stored["people"][name]), flush=True)
    print(f"{arguments.out}, {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
