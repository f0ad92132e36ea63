"""Shipped: teaches the general policy where to place its feet, in reports/general.

Reinforcement rewards a walk near the reference, and pushes that are survived. Where a foot lands
after a push was never asked: pushed to the side, the shipped policy swung its leg too far, by an
eighth to a quarter of what the extrapolated centre of mass had moved, further across than away
(docs/what-we-tried.md). People keep their distance from it (Hof et al. 2010). So the policy is
its own teacher (Ross et al. 2011, DAgger): it walks thirty virtual people, and is
pushed; what it would do is what it should, but for the swinging leg's hip adduction, which is
corrected by the foot's distance from where it keeps that from the extrapolated centre of mass. All
other actions, and those of undisturbed walking, are lessons to stay as they are.

    python -m experiments.placing_feet                          # 15 min
    python -m experiments.placing_feet --try                    # laws on others, without teaching
"""

import argparse
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.delayed_policy import Teacher, seen_undelayed, taught
from experiments.general_policy import (
    PUSHES,
    TARGET,
    VIRTUAL,
    VIRTUAL_SEED,
    built_in,
    virtual_task_of,
)
from gaitval._internal.io.artefacts import read_json, write_json
from gaitval._internal.numba.lanes import WIDTH
from gaitval.apps.balance.compared import Pushes
from gaitval.apps.balance.experiment import TestedWalker, pushed, sideways_pushes
from gaitval.apps.balance.study import FORCES, PHASES
from gaitval.arrays import Array
from gaitval.configuration import Configuration, load_configuration
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, SIDES
from gaitval.metrics.balance_walk import OUTWARD
from gaitval.metrics.push_recovery import Push
from gaitval.metrics.pushed_steps import forces_of
from gaitval.model.parameters import nominal_parameters
from gaitval.model.tree import centres_of_mass
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import ACTION_ORDER, ACTION_SIGNS, OBSERVED, is_mirrored
from gaitval.policy.storage import Policy, load_start, save_policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.study.inputs import POLICY_FILES
from gaitval.subjects.subject_file import BUILTIN
from gaitval.walk.simulation.servo import closed_cycle
from gaitval.walk.simulation.tables import read_row
from gaitval.walk.simulation.walker import WalkingTask

ACTIONS: Final = 1200
"""Of each of eight walkers of a task, in all rounds together."""
ROUNDS: Final = 12
STEPS: Final = (300, 10000)
"""Of the optimiser in each round but the last, and in that."""
RATES: Final = (5e-4, 3e-5)
_LOADED: Final = 0.02
"""Body weights; a foot that carries more is on the ground."""
_LATE: Final = 0.15
"""s after its usual heel strike up to which a foot still swings."""
_SEED: Final = 4711
"""Of the virtual people on whom laws are tried; nothing learns on them."""

_ADDUCTION: Final = tuple(ACTUATED.index(f"hip_adduction_{side[0]}") for side in SIDES)
_FEET, _PLACE, _GROUND, _SPEED = (
    OBSERVED[name].start
    for name in ("feet", "pelvis_position", "ground_reaction", "centre_of_mass_velocity")
)


class Law(NamedTuple):
    """How the hip of a swinging leg answers the foot's distance from its place.

    Attributes
    ----------
    gain : angle by which the target is moved, over that by which the foot is off as seen from the
        hip.
    seconds : before its usual heel strike, from which a foot is corrected; after two fifths of
        them fully.
    ahead : s, by which the foot's place is foreseen from how it moves.
    most : m, that count of a foot that is further off, as one of a body that falls is.
    """

    gain: float = 5.0
    seconds: float = 0.3
    ahead: float = 0.1
    most: float = 0.04


class _Usual(NamedTuple):
    """What an environment's reference does.

    Attributes
    ----------
    aside : (N + 1, 2) of the centre of mass over the cycle, its place to the left, m, and its
        velocity, m/s.
    rate : 1/s, of the pendulum.
    strikes : phases of the right and the left heel strike.
    seconds : of the cycle.
    leg : m.
    """

    aside: Array
    rate: float
    strikes: tuple[float, float]
    seconds: float
    leg: float

    @classmethod
    def of(cls, environment: WalkingEnvironment) -> "_Usual":
        targets, task = environment.yardstick.targets, environment.task
        centre, seconds = targets.centre_of_mass, task.reference.stride_time
        place = centre[:-1, 1]
        velocity = 0.5 * (np.roll(place, -1) - np.roll(place, 1)) * len(place) / seconds
        loaded = targets.ground_reaction[:-1, 2::3] > _LOADED
        return cls(
            closed_cycle(np.stack([place, velocity], axis=1)),
            math.sqrt(GRAVITY / float(centre[:, 2].mean())),
            (_landing(loaded[:, 0]), _landing(loaded[:, 1])),
            seconds,
            task.model.leg_length,
        )


def _landing(loaded: NDArray[np.bool_]) -> float:
    """Phase at the end of the longest time off the ground."""
    count = len(loaded)
    strikes = np.flatnonzero(loaded & ~np.roll(loaded, 1))
    lifts = np.flatnonzero(~loaded & np.roll(loaded, 1))
    flights = ((strikes[:, None] - lifts) % count).min(axis=1)
    return float(strikes[flights.argmax()] / count)


class PlacingFeet:
    """A teacher: a `policy` whose feet keep their distance from the extrapolated centre of mass as
    the `law` says; of the walkers of one `group`.
    """

    def __init__(self, policy: Policy, law: Law, group: WalkingGroup) -> None:
        self.policy, self.law, self.group = policy, law, group
        self._usual = [_Usual.of(each) for each in group.environments]
        self._before: list[tuple[float, Array] | None] = [None] * len(self._usual)

    def __call__(self) -> NDArray[np.float32]:
        """(8, A) what to do where the walkers are."""
        actions = self.policy.act(seen_undelayed(self.group))
        for e, environment in enumerate(self.group.environments):
            angles = self._angles(e, environment) / environment.constants.action_scale
            mirrored = environment.yardstick.mirrors and is_mirrored(environment.walker.phase)
            for place, angle in zip(_ADDUCTION, angles.tolist(), strict=True):
                if mirrored:
                    actions[e, ACTION_ORDER[place]] += ACTION_SIGNS[place] * angle
                else:
                    actions[e, place] += angle
        return actions

    def _angles(self, e: int, environment: WalkingEnvironment) -> Array:
        """(2,) rad, to be added to the right and the left hip's adduction."""
        usual, law = self._usual[e], self.law
        phase, seen = environment.walker.phase, environment.episode.observation
        off, before = self._off(e, environment), self._before[e]
        self._before[e] = phase, off
        step = environment.walker.action_seconds
        # An episode that began since goes on elsewhere.
        follows = before is not None and 0.0 <= phase - before[0] < 2.0 * step / usual.seconds
        angles = np.zeros(2)
        if before is None or not follows:
            return angles
        rate = (off - before[1]) / step
        for side in range(2):
            late = _LATE / usual.seconds
            left = ((usual.strikes[side] - phase + late) % 1.0 - late) * usual.seconds
            if seen[_GROUND + 3 * side + 2] > _LOADED or left > law.seconds:
                continue
            share = min(1.0, (law.seconds - left) / (0.4 * law.seconds))
            away = min(max(off[side] + law.ahead * rate[side], -law.most), law.most)
            # Abduction moves a foot outward.
            angles[side] = law.gain * share * OUTWARD[side] * away / usual.leg
        return angles

    def _off(self, e: int, environment: WalkingEnvironment) -> Array:
        """(2,) m, by how much the right and the left foot are further to the left of the
        extrapolated centre of mass than in the reference.
        """
        usual, walker = self._usual[e], environment.walker
        seen, place = environment.episode.observation, np.empty(2)
        read_row(usual.aside, walker.phase, place)
        centre = centres_of_mass(walker.tree, walker.state[:1])[0, 1] - place[0]
        moving = seen[_SPEED + 1] - place[1]
        feet = seen[[_FEET + 1, _FEET + 4]] + seen[_PLACE + 1]
        return np.asarray(feet - centre - moving / usual.rate)


class _Corrected(Policy):
    """A policy that walks as the teacher of its group says."""

    teacher: Teacher

    def act(self, observation: NDArray[Any]) -> NDArray[np.float32]:
        """As `Policy.act`; of the eight of the group with the law."""
        return self.teacher() if len(observation) == WIDTH else super().act(observation)


class GainTrial(NamedTuple):
    """How a walker places its feet after the sideways pushes of `gaitval perturb`.

    Attributes
    ----------
    offset : m, 95 % of the changes of the next foot's distance from the extrapolated centre of
        mass.
    falls : of as many `pushes`.
    """

    offset: float
    falls: int
    pushes: int


def tried(
    task: WalkingTask, policy: Policy, law: Law | None = None, *, phases: int = PHASES
) -> GainTrial:
    """A `task` walked with a `policy`, pushed at so many `phases`; corrected by the `law`, if one
    is given.
    """
    mu = nominal_parameters() if task.reference_mu is None else task.reference_mu
    corrected = _Corrected(policy.tensors, policy.about)
    walker = TestedWalker.of(task, policy if law is None else corrected, mu)
    if law is not None:
        object.__setattr__(corrected, "teacher", PlacingFeet(policy, law, walker.together))
    forces = forces_of(task.configuration.pushes, task.model.mass, FORCES)
    plain = next(pushed(walker, [Push(0.0, 0.0, 0.0)]))
    walks = list(pushed(walker, sideways_pushes(forces, phases)))
    found = Pushes.of(plain, walks, task.configuration.environment.push_seconds).answers()
    sizes = [abs(float(each.offset[1])) for each in found]
    return GainTrial(
        float(np.percentile(sizes, 95.0)), sum(each.fell for each in walks), len(walks)
    )


def virtual_people(
    subjects: Sequence[str],
    numbers: Sequence[int],
    configuration: Configuration,
    workers: int,
    seed: int = VIRTUAL_SEED,
) -> list[WalkingTask]:
    """Tasks of the virtual people with these `numbers` around each of the `subjects`."""
    wanted = built_in(subjects, numbers, configuration, tuple(BUILTIN))
    with ProcessPoolExecutor(workers) as pool:
        return list(pool.map(partial(virtual_task_of, seed=seed), wanted))


def about(known: dict[str, Any], policy: Policy, law: Law) -> dict[str, Any]:
    """What the policy was trained with: what was `known` of its start, and these lessons."""
    lessons = {"rounds": ROUNDS, "actions": ACTIONS, **law._asdict()}
    return {**known, "placing feet": {**lessons, "samples": policy.about["samples"]}}


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", default=list(BUILTIN), help="default: all built in")
    parser.add_argument("--actions", type=int, default=ACTIONS, help="default: %(default)s")
    parser.add_argument("--start", type=Path, default=TARGET, help="default: the general policy")
    parser.add_argument("--out", type=Path, default=TARGET)
    parser.add_argument("--workers", type=int, default=2, help="default: %(default)s")
    parser.add_argument("--try", dest="only_tried", action="store_true")
    arguments = parser.parse_args()
    configuration = load_configuration(settings=["record.use=kinematics", *PUSHES])
    start = load_start(arguments.start, load_configuration().environment)
    if arguments.only_tried:
        _try(
            virtual_people(arguments.subjects, [0], configuration, arguments.workers, _SEED), start
        )
        return
    tasks = virtual_people(arguments.subjects, range(VIRTUAL), configuration, arguments.workers)
    policy = placed(tasks, start, actions=arguments.actions)
    known = read_json(arguments.start / "about.json")
    save_policy(policy, arguments.out)
    write_json(arguments.out / "about.json", about(known, policy, Law()))
    print(f"{arguments.out}: {', '.join(POLICY_FILES)}")


def placed(
    tasks: Sequence[WalkingTask], start: Policy, law: Law | None = None, *, actions: int = ACTIONS
) -> Policy:
    """The `start`, taught on these `tasks` to place its feet as the `law` says."""
    # Every other one acts as quickly as a walk that is judged, the others as in training.
    slower = tasks[0].configuration.training.steps_per_action
    mixed = [
        task.with_environment(steps_per_action=slower) if number % 2 else task
        for number, task in enumerate(tasks)
    ]
    return taught(
        mixed,
        start,
        partial(print, flush=True),
        teaches=lambda policy, group: PlacingFeet(policy, law or Law(), group),
        actions=actions,
        shares=[0.0] * ROUNDS,
        steps=STEPS,
        rates=RATES,
    )


def _try(tasks: Sequence[WalkingTask], policy: Policy) -> None:
    laws = [None, *(Law(gain=gain) for gain in (3.0, 5.0, 8.0))]
    for law in laws:
        found = [tried(task, policy, law) for task in tasks]
        print(
            f"{law}: 95 % within {', '.join(f'{1e3 * each.offset:.1f}' for each in found)} mm; "
            f"{sum(each.falls for each in found)} of {sum(each.pushes for each in found)} fell",
            flush=True,
        )


if __name__ == "__main__":
    main()
