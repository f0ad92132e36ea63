"""Centre of pressure in the footprint, heel bounces, transients and where the feet stand."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import MASS, MODEL, STANCE, perfect_walk, sharp_filter, synthetic_record

from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.foot_contact import EARLY, Stances, foot_contacts, outline
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import nominal_parameters
from gaitval.model.tree import segment_frames

RECORD = synthetic_record()
LENGTH = outline(MODEL, "right").length
HEADING = np.deg2rad(20.0)
MU = nominal_parameters()


def _standing(*, heading: float = 0.0):
    """A body that stands still and turned while its feet are loaded in turn as in walking; the
    centre of pressure goes from the heel's edge to the toes' at constant speed."""
    walk = perfect_walk(RECORD, cycles=5.5)
    positions = np.zeros_like(walk.positions)
    positions[:, 2] = heading
    positions[:, 3:6] = 1.0, 2.0, 0.9
    frames = segment_frames(MODEL, positions[:1])[0]
    pressure = np.full_like(walk.centre_of_pressure, np.nan)
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    for column, side in enumerate(SIDES):
        phase = np.round(walk.phase - (RECORD.left_phase if side == "left" else 0.0), 9) % 1.0
        share = np.minimum(phase / STANCE[side], 1.0)
        foot = frames[SEGMENTS.index(f"foot_{side[0]}")]
        heel = foot[:2, 3] + turn @ outline(MODEL, side).heel[:2]
        ahead = np.outer(share * LENGTH, turn[:, 0])
        inwards = (0.01 if side == "right" else -0.01) * turn[:, 1]
        on = walk.ground_reaction[:, column, 2] > 0.0
        pressure[on, column, :2] = (heel + ahead + inwards)[on]
    return replace(walk, positions=positions, centre_of_pressure=pressure)


def _contacts(walk):
    cycles = find_cycles(walk, sharp_filter()).first(3)
    return foot_contacts(walk, cycles, MODEL, threshold=20.0), cycles


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("heading", [0.0, HEADING])
def test_the_path_is_that_under_the_foot_whatever_its_heading(side, heading):
    contact = _contacts(_standing(heading=heading))[0][side]
    assert contact.path.shape == (3, 101, 2)
    # a stance ends within two samples of the record's
    np.testing.assert_allclose(
        contact.path[..., 0], np.tile(np.linspace(0, 1, 101), (3, 1)), atol=5e-3
    )
    np.testing.assert_allclose(contact.path[..., 1], 0.01 / LENGTH, atol=1e-9)
    message = contact.contact().as_dict()
    assert message["progress"] == pytest.approx({"10": 10.0, "50": 50.0, "90": 90.0}, abs=0.5)
    assert message["path"]["across"]["sd"] == pytest.approx(np.zeros(101), abs=1e-9)


def test_the_outline_is_the_foot_from_heel_to_toes():
    right, left = (outline(MODEL, side) for side in SIDES)
    assert right.length == pytest.approx(0.152 * 1.53, abs=0.02)  # Drillis and Contini 1966
    np.testing.assert_allclose(right.centres, left.centres, atol=1e-12)
    assert (right.centres[:, 0] - right.radii).min() == pytest.approx(0.0, abs=1e-12)
    assert (right.centres[:, 0] + right.radii).max() == pytest.approx(1.0)


def test_means_and_deviations_over_the_stances_by_hand():
    """Of 0.1, 0.2 and 0.6 foot lengths along: mean 30 %, SD (n - 1) the root of 0.07; across a
    tenth of them, to the other side."""
    sizes = np.array([0.1, 0.2, 0.6])[:, None] * np.ones(101)
    stances = Stances(
        places=np.zeros((3, 2)),
        path=np.stack([sizes, -0.1 * sizes], axis=2),
        bounces=np.array([0.0, 1.0, 0.0]),
        transient=np.array([0.9, 1.1, 1.3]),
        outline=outline(MODEL, "right"),
    )
    found = stances.contact()
    for curve, factor in ((found.path.along, 1.0), (found.path.across, -0.1)):
        np.testing.assert_allclose(curve.mean, factor * 30.0)
        np.testing.assert_allclose(curve.sd, abs(factor) * 100.0 * np.sqrt(0.07))
    assert (found.stances, found.bounces_per_stance) == (3, pytest.approx(1.0 / 3.0))
    assert found.transient_peak == pytest.approx(110.0)
    one = replace(stances, path=stances.path[:1]).contact()
    assert one.path.along.sd is None


def test_a_longer_foot_is_measured_in_its_own_length():
    mu = MU.copy()
    mu[2] = 1.05
    longer = replace(_standing(), mu=mu)
    contact = _contacts(longer)[0]["right"]
    assert contact.outline.length > LENGTH
    assert np.ptp(contact.path[0, :, 0]) < 0.99


def test_feet_stand_where_their_heels_are():
    walk = _standing()
    walk.positions[:, 3] = 1.2 * walk.time
    contacts, cycles = _contacts(walk)
    for side in SIDES:
        starts, ends = cycles.starts[side], cycles.ends[side]
        flat = starts + np.round(0.3 * STANCE[side] * (ends - starts)).astype(int)
        ankle = segment_frames(MODEL, walk.positions[flat])[:, SEGMENTS.index(f"foot_{side[0]}")]
        behind = ankle[:, 0, 3] - contacts[side].places[:, 0]
        np.testing.assert_allclose(behind, -outline(MODEL, side).heel[0], atol=3e-3)


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


def test_a_walk_without_a_cycle_has_no_path():
    contact = _contacts(perfect_walk(RECORD, cycles=0.4))[0]["right"]
    message = contact.contact().as_dict()
    assert message["stances"] == 0
    assert message["path"]["along"] == {"mean": None, "sd": None}
    assert message["progress"]["50"] is None
