"""What the user says of the force plates."""

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.recording import Plate, Recording
from gaitval.session.stated_plates import with_stated_plates

ZERO = np.zeros((60, 3))
RECORDING = Recording(
    "walk.c3d", "laboratory", (), np.empty((6, 0, 3)), 100.0,
    plates=(Plate("1", np.zeros((4, 3)), ZERO, ZERO, ZERO),),
)  # fmt: skip


def test_a_plate_is_of_a_foot_or_is_left_out():
    assert with_stated_plates(RECORDING, [("1", "left"), ("1", "left")]).plates[0].foot == "left"
    assert with_stated_plates(RECORDING, [("1", "none")]).plates == ()


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ([("3", "none")], "--plate 3=none: there is no such plate; the trial has 1"),
        ([("1", "left"), ("1", "right")], "--plate 1=right and --plate 1=left"),
    ],
)
def test_what_cannot_be_said_of_a_plate_is_refused(stated, words):
    with pytest.raises(RecordError, match=words):
        with_stated_plates(RECORDING, stated)
