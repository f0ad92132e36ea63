"""Heel bounces, transients and where the feet stand."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import MASS, MODEL, STANCE, perfect_walk, sharp_filter, synthetic_record

from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.foot_contact import EARLY, foot_contacts, heel_of
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames

RECORD = synthetic_record()


def _standing():
    """A body that stands still while its feet are loaded in turn as in walking."""
    walk = perfect_walk(RECORD, cycles=5.5)
    positions = np.zeros_like(walk.positions)
    positions[:, 3:6] = 1.0, 2.0, 0.9
    return replace(walk, positions=positions)


def _contacts(walk):
    cycles = find_cycles(walk, sharp_filter()).first(3)
    return foot_contacts(walk, cycles, MODEL, threshold=20.0), cycles


def test_feet_stand_where_their_heels_are():
    walk = _standing()
    walk.positions[:, 3] = 1.2 * walk.time
    contacts, cycles = _contacts(walk)
    for side in SIDES:
        starts, ends = cycles.starts[side], cycles.ends[side]
        flat = starts + np.round(0.3 * STANCE[side] * (ends - starts)).astype(int)
        ankle = segment_frames(MODEL, walk.positions[flat])[:, SEGMENTS.index(f"foot_{side[0]}")]
        behind = ankle[:, 0, 3] - contacts[side].places[:, 0]
        np.testing.assert_allclose(behind, -heel_of(MODEL, side)[0], atol=3e-3)


def test_bounces_are_counted_in_early_stance_only():
    walk = _standing()
    ground = walk.ground_reaction.copy()
    cycles = find_cycles(walk, sharp_filter()).first(3)
    start, end = int(cycles.starts["right"][0]), int(cycles.ends["right"][0])
    stance = STANCE["right"] * (end - start)
    for share in (0.05, 0.10, 0.5):
        begin = start + round(share * stance)
        ground[begin : begin + 8, 0] = 0.0
    contact = _contacts(replace(walk, ground_reaction=ground))[0]
    assert contact["right"].bounces.tolist() == [2.0, 0.0, 0.0]
    assert contact["left"].bounces.tolist() == [0.0, 0.0, 0.0]
    assert contact["right"].contact().bounces_per_stance == pytest.approx(2 / 3)


def test_a_loss_of_contact_counts_where_it_begins():
    """One that begins in early stance and ends after it is a bounce."""
    walk = _standing()
    ground = walk.ground_reaction.copy()
    cycles = find_cycles(walk, sharp_filter()).first(3)
    starts, ends = cycles.starts["right"], cycles.ends["right"]
    for cycle, shift in ((0, -4), (1, 4)):
        length = STANCE["right"] * (ends[cycle] - starts[cycle])
        begin = int(starts[cycle]) + round(EARLY * length) + shift
        ground[begin : begin + 8, 0] = 0.0
    contact = _contacts(replace(walk, ground_reaction=ground))[0]
    assert contact["right"].bounces.tolist() == [1.0, 0.0, 0.0]


def test_a_transient_is_seen_unfiltered():
    walk = _standing()
    ground = walk.ground_reaction.copy()
    cycles = find_cycles(walk, sharp_filter()).first(3)
    for start in cycles.starts["left"]:
        ground[start + 12, 1, 2] = 1.7 * MASS * GRAVITY
    contact = _contacts(replace(walk, ground_reaction=ground))[0]
    assert contact["left"].contact().transient_peak == pytest.approx(170.0)
    assert contact["right"].contact().transient_peak < 100.0


def test_a_walk_without_a_cycle_has_no_stance():
    found = _contacts(perfect_walk(RECORD, cycles=0.4))[0]["right"].contact()
    assert (found.stances, found.bounces_per_stance, found.transient_peak) == (0, None, None)
