"""A warning of which one is certain refuses the trial, and says how to go on."""

from dataclasses import replace

import pytest

from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag, refuse_certain, told_once


def test_the_last_plate_cannot_be_left_out():
    wrong = QualityFlag("check", "plate 2", 1.0, 0.0, "1", "is wrong", certain=True, plate="2")
    refuse_certain("walk.c3d", [replace(wrong, certain=False)], plates=1)
    for plates, ways in (
        (2, ("--plate 2=none", "--kinematics-only")),
        (1, ("--kinematics-only",)),
    ):
        with pytest.raises(RecordError, match=r"walk\.c3d: the forces cannot be right") as caught:
            refuse_certain("walk.c3d", [wrong], plates=plates)
        assert caught.value.goes_on == ways


def test_what_one_cause_does_in_every_trial_is_told_once():
    def turned(plate, value):
        words = f"turns the foot outwards ({value:.1f} mm): the wrong sign"
        return QualityFlag("turned", f"plate {plate}", value, 2.0, "mm", words, plate=plate)

    heel = QualityFlag("moved", "RHEE", 30.0, 20.0, "mm", "is 30 mm higher")
    other = QualityFlag("moved", "LHEE", 25.0, 20.0, "mm", "is 25 mm higher")
    dead = turned("2", 3.0)
    dead = replace(dead, message="the vertical force hardly changes")
    given = [
        ("one.c3d", turned("1", 4.0)), ("two.c3d", turned("1", 6.5)), ("two.c3d", turned("2", 5.0)),
        ("one.c3d", heel), ("one.c3d", other), ("two.c3d", replace(heel, value=33.0)),
        ("two.c3d", dead),
    ]  # fmt: skip
    first, right, left, last = told_once(given)
    assert first[0] == "two.c3d"
    assert first[1].value == 6.5
    for there in ("6.5 mm", "plate 1 in one.c3d", "plate 2 in two.c3d"):
        assert there in first[1].message
    assert (right[0], right[1].where, right[1].value) == ("two.c3d", "RHEE", 33.0)
    assert "one.c3d" in right[1].message
    assert left == ("one.c3d", other)
    assert last == ("two.c3d", dead)
