"""Spin and lean of a whole body that turns as one, and steps from forces."""

import numpy as np
import pytest

from gaitval.metrics.balance_walk import _lean, angular_momentum, steps_of
from gaitval.model.tree import segment_frames, tree_arrays

STEP, RATE = 0.001, 0.7


def turning(model, axis):
    """Poses of a stiff body that turns about a world axis through its pelvis, and moves ahead."""
    q = np.zeros((5, 31))
    q[:, axis] = RATE * STEP * np.arange(-2, 3)
    q[:, 3], q[:, 5] = 1.3 * STEP * np.arange(5), 0.9
    return segment_frames(model, q)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_angular_momentum_of_a_stiff_body_is_its_inertia_times_its_rate(task, axis):
    frames = turning(task.model, axis)
    found = angular_momentum(task.model, frames, STEP)[2]
    # the whole body's inertia about its centre of mass, straight up
    tree = tree_arrays(task.model)
    places = frames[2, :, :3, 3] + np.einsum(
        "sij,sj->si", frames[2, :, :3, :3], tree.centre_of_mass
    )
    away = places - tree.mass @ places / tree.mass.sum()
    own = np.einsum("sij,sjk,slk->il", frames[2, :, :3, :3], tree.inertia, frames[2, :, :3, :3])
    whole = own + np.einsum("s,si,si->", tree.mass, away, away) * np.eye(3)
    whole -= np.einsum("s,si,sj->ij", tree.mass, away, away)
    assert found == pytest.approx(RATE * whole[:, axis], rel=1e-5, abs=1e-6)
    assert found[axis] > 0.0  # about y: pitching forward


def test_a_trunk_leans_forward_and_to_the_left_with_positive_signs(task):
    frames = turning(task.model, 1)
    lean = _lean(frames[:, 0, :3, :3])
    assert lean[:, 0] == pytest.approx(RATE * STEP * np.arange(-2, 3))
    rolled = _lean(turning(task.model, 0)[:, 0, :3, :3])
    assert rolled[:, 1] == pytest.approx(-RATE * STEP * np.arange(-2, 3))  # rolling to the right


def test_steps_are_heel_strikes_of_both_feet_in_order():
    vertical = np.zeros((1000, 2))
    for first in (0, 500):
        vertical[first + 100 : first + 400, 0] = 700.0
        vertical[max(0, first - 150) : first + 150, 1] = 700.0
        vertical[first + 350 : first + 500, 1] = 700.0
    found = steps_of(vertical, step=0.002, threshold=20.0)
    assert [(each.side, each.strike) for each in found] == [
        ("right", 100), ("left", 350), ("right", 600), ("left", 850)
    ]  # fmt: skip
    assert [each.lift for each in found] == [0, 150, 400, 650]
    assert [each.column for each in found] == [0, 1, 0, 1]
