"""A warning of which one is certain refuses the trial, and says how to go on."""

from dataclasses import replace

import pytest

from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag, refuse_certain


def test_the_last_plate_cannot_be_left_out():
    wrong = QualityFlag("check", "plate 2", 1.0, 0.0, "1", "is wrong", certain=True, plate="2")
    refuse_certain("walk.c3d", [replace(wrong, certain=False)], plates=1)
    for plates, ways in (
        (2, ("--no-plate 2", "--kinematics-only")),
        (1, ("--kinematics-only",)),
    ):
        with pytest.raises(RecordError, match=r"walk\.c3d: the forces cannot be right") as caught:
            refuse_certain("walk.c3d", [wrong], plates=plates)
        assert caught.value.goes_on == ways
