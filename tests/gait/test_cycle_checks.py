"""Cycles with gaps or with an odd double support, at their limits."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.coordinates import SIDES
from gaitval.gait.cycle_checks import without_gaps, without_odd_support
from gaitval.gait.cycles import GaitCycle

TIME = np.arange(401) / 100.0


def cycles(count=3, side="right", support=0.12, first=0.0):
    """Strides of 1 s, one after the other."""
    return tuple(
        GaitCycle(
            side=side, start=first + i, toe_off=first + i + 0.62, end=first + i + 1.0,
            opposite_toe_off=first + i + support, opposite_strike=first + i + 0.5,
            kinematics_valid=True, kinetics_valid=True, reasons=("known before",),
        )
        for i in range(count)
    )  # fmt: skip


def seen_but(begin, end):
    seen = np.ones(len(TIME), dtype=bool)
    seen[round(100 * begin) : round(100 * end)] = False
    return seen


@pytest.mark.parametrize(("frames", "valid"), [(10, True), (11, False)])
def test_a_gap_longer_than_is_bridged(frames, valid):
    seen = seen_but(1.4, 1.4 + frames / 100.0)
    found = without_gaps(cycles(), TIME, seen, longest_gap_s=0.1)
    assert [cycle.kinematics_valid for cycle in found] == [True, valid, True]
    assert [cycle.kinetics_valid for cycle in found] == [True, valid, True]
    assert found[0] == cycles()[0]
    if not valid:
        assert found[1].reasons == (
            "known before",
            "the markers do not show the pelvis and the right leg at 1.400-1.500 s",
        )


def test_a_gap_counts_in_every_cycle_that_it_touches_and_all_are_named():
    seen = seen_but(0.95, 1.15) & seen_but(1.5, 1.7)
    found = without_gaps(cycles(), TIME, seen, longest_gap_s=0.1)
    assert [len(cycle.reasons) for cycle in found] == [2, 3, 1]
    assert "at 0.950-1.140 s" in found[0].reasons[1]
    assert "at 1.500-1.690 s" in found[1].reasons[2]
    # The end of a stride at 1.00 s is a sample of its curve, and so is the start of the next.
    for begin, end, touched in ((0.8, 1.0, [True, False]), (0.8, 1.01, [True, True]),
                                (1.01, 1.2, [False, True]), (1.0, 1.2, [True, True])):  # fmt: skip
        found = without_gaps(cycles(2), TIME, seen_but(begin, end), longest_gap_s=0.1)
        assert [not cycle.kinematics_valid for cycle in found] == touched, (begin, end)


def test_the_length_of_a_gap_is_by_the_rate_of_the_markers():
    slow = TIME * 2.0  # 50 Hz
    seen = seen_but(1.4, 1.48)  # 8 frames: 0.16 s here
    assert not without_gaps(cycles(), slow, seen, longest_gap_s=0.1)[2].kinematics_valid
    assert without_gaps(cycles(), TIME, seen, longest_gap_s=0.1)[1].kinematics_valid


def both(right, left):
    return {
        side: tuple(
            replace(cycle, opposite_toe_off=cycle.start + support)
            for cycle, support in zip(cycles(len(supports), side), supports, strict=True)
        )
        for side, supports in zip(SIDES, (right, left), strict=True)
    }


def odd(right, left):
    found = without_odd_support(both(right, left))
    return [[not cycle.kinematics_valid for cycle in found[side]] for side in SIDES]


@pytest.mark.parametrize(
    ("share", "out"), [(0.21, False), (0.23, True), (0.03, False), (0.01, True)]
)
def test_a_double_support_a_tenth_of_the_cycle_off_the_median(share, out):
    assert odd([0.12, share, 0.12], [0.12, 0.12]) == [[False, out, False], [False, False]]
    assert odd([0.12, 0.12], [0.12, share, 0.12]) == [[False, False], [False, out, False]]


def test_the_reason_says_both_shares():
    found = without_odd_support(both([0.12, 0.3, 0.12], [0.13, 0.13]))["right"][1]
    assert not found.kinetics_valid
    assert found.reasons[0] == "known before"
    assert (
        "for 30 % of it after its heel strike, but for 13 % in the trial's median"
        in (found.reasons[1])
    )


def test_sides_of_a_patient_may_differ_and_of_two_cycles_none_is_judged():
    assert odd([0.05, 0.05, 0.05], [0.25, 0.25]) == [[False] * 3, [False] * 2]
    assert odd([0.05, 0.3], []) == [[False, False], []]
    assert odd([0.12, 0.12], [0.3]) == [[False, False], [True]], "alone on its side"


def test_an_unknown_toe_off_is_no_odd_one_and_counts_for_no_other():
    nan = float("nan")
    assert odd([0.12, nan, 0.12], [0.12]) == [[False, False, False], [False]]
    assert odd([0.05, 0.3], [nan, nan]) == [[False, False], [False, False]]
    assert odd([0.3, nan], [0.12, 0.12]) == [[True, False], [False, False]]
