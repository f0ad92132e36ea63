"""Shipped: trains the policy that feels its body late, reports/general/delayed.

What joints and feet tell is 50 ms old, what the balance organ tells 100 ms, what is seen 150 ms,
all with noise. It is told its own actions of the last 150 ms, from which it can foresee what they
do: a forward model, as people are thought to have one in the cerebellum. The general policy would
fall within a second; it is the teacher, on the same people (Ross et al. 2011, DAgger): the new one
walks, the teacher, who feels the body as it is, says what it would do, and that is learned. Trained
on by reinforcement as the general one was, it stood pushes as well and walked less exactly
(docs/what-we-tried.md), so it is not.

    python -m experiments.delayed_policy                 # 10 min
"""

import argparse
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from experiments.general_policy import (
    PUSHES,
    SPEEDS,
    VIRTUAL,
    VIRTUAL_SEED,
    all_tasks,
)
from experiments.general_policy import TARGET as GENERAL
from gaitval._internal.io.artefacts import value_hash, write_json
from gaitval._internal.numba.lanes import WIDTH
from gaitval.configuration import EnvironmentSettings, load_configuration
from gaitval.policy.observation import MIRROR_ORDER, MIRROR_SIGNS, OBSERVED, is_mirrored
from gaitval.policy.senses import windows
from gaitval.policy.storage import NETWORK, Policy, description, load_start, save_policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.study.inputs import POLICY_FILES
from gaitval.study.stored_policy import DELAYED
from gaitval.subjects.subject_file import BUILTIN
from gaitval.walk.simulation.walker import WalkingTask

TARGET: Final = GENERAL / DELAYED
SETTINGS: Final = (
    "environment.observation_delays=[0.05, 0.1, 0.15]",
    "environment.observation_noise=0.01",
    "environment.action_memory=0.15",
)
SHARES: Final = (0.7, 0.4, 0.2, *[0.0] * 9)
"""Of the teacher's action in what is done, by round of teaching."""
ACTIONS: Final = 900
"""Of each of eight walkers of a task, in all rounds together."""
STEPS: Final = (400, 8000)
"""Of the optimiser in each round but the last, and in that."""
RATES: Final = (1e-3, 1e-4)
BATCH: Final = 512


def with_memory(policy: Policy, environment: EnvironmentSettings) -> Policy:
    """The `policy` with room for the past actions that it is told in an `environment`; it does not
    use them yet.
    """
    tensors = dict(policy.tensors)
    count, action = windows(environment), OBSERVED["action"]
    for name in ("observation_mean", "observation_variance"):
        each = tensors[name]
        tensors[name] = np.concatenate([each, *[each[action]] * count])
    for name in ("mlp_extractor.policy_net.0.weight", "mlp_extractor.value_net.0.weight"):
        each = tensors[name]
        width = (action.stop - action.start) * count
        tensors[name] = np.pad(each, [(0, 0), (0, width)])
    return Policy(tensors, policy.about)


Teacher = Callable[[], NDArray[np.float32]]
"""What the walkers of a group should do where they are, (8, A)."""


def seen_undelayed(group: WalkingGroup) -> NDArray[np.float32]:
    """(8, size) what a policy would see that feels its body as it is."""
    rows = []
    for environment in group.environments:
        seen = environment.episode.observation
        if environment.yardstick.mirrors and is_mirrored(environment.walker.phase):
            seen = MIRROR_SIGNS * seen[MIRROR_ORDER]
        rows.append(seen.astype(np.float32))
    return np.array(rows)


def _undelayed(policy: Policy, group: WalkingGroup) -> Teacher:
    """Who does as the `policy`, without delay."""
    return lambda: policy.act(seen_undelayed(group))


class _Lessons:
    """What was told and what the teacher would have done."""

    def __init__(self) -> None:
        self.told: list[NDArray[np.float32]] = []
        self.done: list[NDArray[np.float32]] = []

    def walk(
        self,
        group: WalkingGroup,
        told: NDArray[np.float32],
        teacher: Teacher,
        learner: Policy,
        share: float,
        actions: int,
    ) -> int:
        """Falls in so many `actions` of a `group`, with a `share` of the teacher's."""
        falls = 0
        for _ in range(actions):
            right = np.clip(teacher(), -4.0, 4.0)
            self.told.append(told.copy())
            self.done.append(right)
            mixed = share * right + (1.0 - share) * learner.act(told)
            _, fell = group.step(mixed.astype(np.float32), told)
            over = [each.counted() for each in group.environments]
            falls += int(fell.sum())
            for e in np.flatnonzero(fell | over).tolist():
                told[e] = group.reset(e)
        return falls


def taught(
    tasks: Sequence[WalkingTask],
    teacher: Policy,
    say: Callable[[str], None],
    *,
    teaches: Callable[[Policy, WalkingGroup], Teacher] = _undelayed,
    actions: int = ACTIONS,
    shares: Sequence[float] = SHARES,
    steps: tuple[int, int] = STEPS,
    rates: tuple[float, float] = RATES,
    seed: int = 0,
) -> Policy:
    """The `teacher`'s policy for who feels as these `tasks` do, as it `teaches` each group; eight
    of each walk `actions`.
    """
    learner = with_memory(teacher, tasks[0].configuration.environment)
    layers = [torch.tensor(learner.tensors[name], requires_grad=True) for name in NETWORK]
    optimiser = torch.optim.Adam(layers, lr=rates[0])
    mean, deviation = learner.tensors["observation_mean"], learner.deviation
    groups = [WalkingGroup([task] * WIDTH) for task in tasks]
    teachers = [teaches(teacher, group) for group in groups]
    told = [
        np.array([group.reset(e, seed=seed + WIDTH * g + e) for e in range(WIDTH)])
        for g, group in enumerate(groups)
    ]
    lessons, random = _Lessons(), np.random.default_rng(seed)
    for number, share in enumerate(shares):
        began = time.monotonic()
        falls = sum(
            lessons.walk(group, seen, each, learner, share, max(1, actions // len(shares)))
            for group, each, seen in zip(groups, teachers, told, strict=True)
        )
        walked = time.monotonic() - began
        x = np.clip((np.concatenate(lessons.told) - mean) / deviation, -10.0, 10.0)
        inputs = torch.tensor(x.astype(np.float32))
        wanted = torch.tensor(np.concatenate(lessons.done))
        losses, last = [], number == len(shares) - 1
        count = steps[last]
        for step in range(count):
            if last:
                rate = rates[0] + step / count * (rates[1] - rates[0])
                optimiser.param_groups[0]["lr"] = rate
            rows = torch.from_numpy(random.integers(0, len(inputs), BATCH))
            h = inputs[rows]
            for weight, bias in ((0, 1), (2, 3)):
                h = torch.tanh(h @ layers[weight].T + layers[bias])
            loss = ((h @ layers[4].T + layers[5] - wanted[rows]) ** 2).mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            losses.append(float(loss.detach()))
        tensors = dict(learner.tensors)
        tensors |= {n: t.detach().numpy().copy() for n, t in zip(NETWORK, layers, strict=True)}
        learner = Policy(tensors, learner.about)
        learned = time.monotonic() - began - walked
        say(
            f"round {number + 1} of {len(shares)}: {falls} falls, loss "
            f"{np.mean(losses[-100:]):.4f}, {len(inputs)} lessons, {walked:.0f} s + {learned:.0f} s"
        )
    configuration = tasks[0].configuration
    return Policy(
        learner.tensors, description(configuration, {"general": True}, sum(map(len, lessons.told)))
    )


def about(subjects: Sequence[str], policy: Policy, start: Policy) -> dict[str, Any]:
    """What the policy was trained with, and what that training started from."""
    return {
        "subjects": list(subjects),
        "told": "kinematics",
        "speeds": list(SPEEDS),
        "virtual": {"around each": VIRTUAL, "seed": VIRTUAL_SEED},
        "lessons": {"rounds": len(SHARES), "actions": ACTIONS},
        "samples": policy.about["samples"],
        "start": value_hash(start.about["configuration"]),
    }


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", default=list(BUILTIN), help="default: all built in")
    parser.add_argument("--actions", type=int, default=ACTIONS, help="default: %(default)s")
    parser.add_argument("--out", type=Path, default=TARGET)
    parser.add_argument("--workers", type=int, default=2, help="default: %(default)s")
    arguments = parser.parse_args()
    environments = (len(SPEEDS) + VIRTUAL) * len(arguments.subjects)
    configuration = load_configuration(
        settings=[
            f"training.environments={environments}",
            "record.use=kinematics",
            *PUSHES,
            *SETTINGS,
        ]
    )
    tasks = all_tasks(arguments.subjects, configuration, tuple(BUILTIN), arguments.workers)
    start = load_start(GENERAL, load_configuration().environment)
    # Every other one acts as quickly as a walk that is judged, the others as in training.
    slower = configuration.training.steps_per_action
    mixed = [
        task.with_environment(steps_per_action=slower) if number % 2 else task
        for number, task in enumerate(tasks)
    ]
    policy = taught(mixed, start, partial(print, flush=True), actions=arguments.actions)
    save_policy(policy, arguments.out)
    write_json(arguments.out / "about.json", about(arguments.subjects, policy, start))
    print(f"{arguments.out}: {', '.join(POLICY_FILES)}")


if __name__ == "__main__":
    main()
