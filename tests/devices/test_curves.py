"""Curves of a walk: means over whole cycles, and work of each stride."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.apps.devices.curves import walk_curves
from gaitval.apps.devices.study import Wearer, walk_without
from gaitval.coordinates import ACTUATED
from gaitval.errors import RecordError
from gaitval.metrics.cycles import find_cycles
from gaitval.model.tree import ROOT_DOFS


def who(person):
    return Wearer("S05", person.task, person.policy, person.mu)


@pytest.fixture(scope="module")
def plain(person):
    return walk_without(who(person), 8.0)


def test_curves_are_means_of_whole_cycles(person, plain):
    curves = walk_curves(plain, person.task.configuration, person.task.model.mass)
    rollout, cycles = plain.rollout, find_cycles(plain.rollout, person.task.configuration)
    assert curves.cycles["right"] >= 2
    stride = person.task.reference.stride_time
    assert curves.stride_time["left"] == pytest.approx(stride, rel=0.05)
    assert 0.5 < curves.stance["right"] < 0.75
    assert 0.9 < curves.forces["right"].max() < 1.4
    threshold = person.task.configuration.contact.event_threshold
    for column, side in enumerate(("right", "left")):
        loaded = rollout.ground_reaction[:, column, 2] > threshold
        shares = [
            loaded[a:b].mean() for a, b in zip(cycles.starts[side], cycles.ends[side], strict=True)
        ]
        assert curves.stance[side] == pytest.approx(np.mean(shares), abs=0.005)
        net = curves.work["ankle_angle", side] - curves.negative_work["ankle_angle", side]
        ankle = ACTUATED.index(f"ankle_angle_{side[0]}")
        rows = slice(cycles.starts[side][0], cycles.ends[side][-1])
        power = (rollout.moments[rows, ankle] * rollout.velocities[rows, ROOT_DOFS + ankle]).sum()
        mass, step = person.task.model.mass, rollout.time[1] - rollout.time[0]
        # what the report shows is low-passed at 10 Hz, which leaves 2 % of the work out
        within = 0.02 * curves.work["ankle_angle", side]
        assert net == pytest.approx(power * step / mass / curves.cycles[side], abs=within)
        assert np.abs(curves.device["hip_flexion", side]).max() == 0.0


def test_unlike_strides_do_not_cancel_in_their_work(person, plain):
    """Power that is up in one stride and down in the next does work in both."""
    cycles = find_cycles(plain.rollout, person.task.configuration)
    knee, mass = ACTUATED.index("knee_angle_r"), person.task.model.mass
    rates = plain.rollout.velocities[:, ROOT_DOFS + knee]
    moments, squares = np.zeros_like(plain.rollout.moments), 0.0
    for sign, number in ((1.0, 0), (-1.0, 1)):
        rows = slice(cycles.starts["right"][number], cycles.ends["right"][number])
        moments[rows, knee] = sign * rates[rows]
        squares += np.sum(rates[rows] ** 2)
    rollout = replace(plain.rollout, moments=moments)
    curves = walk_curves(replace(plain, rollout=rollout), person.task.configuration, mass)
    step = rollout.time[1] - rollout.time[0]
    for work in (curves.work, curves.negative_work):
        assert work["knee_angle", "right"] * cycles.count("right") == pytest.approx(
            squares / 2 * step / mass, rel=0.1
        )


def test_no_curves_without_a_cycle(person):
    short = walk_without(who(person), 0.3)
    with pytest.raises(RecordError, match="no complete gait cycle"):
        walk_curves(short, person.task.configuration, person.task.model.mass)
