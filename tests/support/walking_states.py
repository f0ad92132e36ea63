"""States of the walking environment, for the tests of what it observes, rewards and ends on."""

import numpy as np


def restless(environment, seed, **options):
    """Reset and three random actions: a state away from the reference. Returns what the last
    step returned, and the action that has entered by then."""
    environment.reset(seed=seed, options={"push": None, **options})
    random, entered = np.random.default_rng(seed), np.zeros(26)
    for _ in range(3):
        action = random.normal(0.0, 0.5, 26).astype(np.float32)
        result = environment.step(action)
        entered += environment.entering * (action - entered)
    return (*result, entered)


def reference_at(task, phase, table):
    """A reference table (N, …) at a phase, linear between its samples, with the travel."""
    count = len(table)
    place = (phase % 1.0) * count
    row, part = int(place), place % 1.0
    stride = task.reference.speed * task.reference.stride_time
    ahead = table[(row + 1) % count].copy()
    travel = np.zeros(ahead.shape)
    if ahead.shape == (31,):
        travel[3] = stride
    elif ahead.shape[-1] == 3:
        travel[..., 0] = stride
    if row + 1 == count:
        ahead = ahead + travel
    return (1 - part) * table[row] + part * ahead + np.floor(phase) * travel


def put(environment, monkeypatch, *, q=None, qd=None, perfect=True):
    """Make the next step lead to a given state with the reference's mean forces and moments."""
    walker, task = environment.walker, environment.task

    def step(offset, root_force, recording, *, pace):
        del offset, root_force, recording
        walker.phase += walker.action_seconds / task.reference.stride_time
        walker.state[0] = reference_at(task, walker.phase, task.reference.positions)
        rates = np.concatenate([task.reference.velocities, task.reference.velocities[:1]])
        place = walker.phase % 1.0 * 1024
        walker.state[1] = rates[int(place)] + place % 1.0 * (
            rates[int(place) + 1] - rates[int(place)]
        )
        if q is not None:
            walker.state[0] += q
        if qd is not None:
            walker.state[1] += qd
        if perfect:
            middle = walker.phase - 0.5 * walker.action_seconds / task.reference.stride_time
            place = middle % 1.0 * 1024
            row, part = int(place), place % 1.0
            for target, table in (
                (walker.mean_ground_reaction, task.reference.ground_reaction * walker.weight),
                (walker.mean_moments, task.reference.moments),
            ):
                target[:] = (1 - part) * table[row] + part * table[(row + 1) % 1024]
        walker.mean_square_moments[:] = 100.0

    monkeypatch.setattr(walker, "step", step)
