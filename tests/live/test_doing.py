"""What can be done, from JSON that nobody vouches for."""

import pytest

from gaitval.apps.live.doing import (
    ChangeBody,
    Clock,
    PushPelvis,
    Restart,
    SetSpeed,
    SlipFoot,
    TripFoot,
    Wear,
    doing_of,
    values_of,
)
from gaitval.errors import RecordError


@pytest.mark.parametrize(
    "doing",
    [
        PushPelvis(100.0, -50.0),
        SetSpeed(1.2),
        ChangeBody("friction", 0.7),
        Restart(),
        Clock(0.0),
        Clock(0.25),
        Wear(True),
        Wear(False),
        SlipFoot("left"),
        TripFoot("right"),
    ],
)
def test_what_is_written_is_read(doing):
    assert doing_of(values_of(doing), "here") == doing


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (None, "does nothing"),
        ([], "does nothing"),
        ({"do": "fly"}, "does nothing"),
        ({"do": ["push"]}, "does nothing"),
        ({"do": "push", "forward": 1.0}, "takes forward, left"),
        ({"do": "push", "forward": 1.0, "left": 0.0, "up": 1.0}, "takes forward, left"),
        ({"do": "push", "forward": "1", "left": 0.0}, "no number"),
        ({"do": "push", "forward": True, "left": 0.0}, "no number"),
        ({"do": "push", "forward": float("nan"), "left": 0.0}, "finite"),
        ({"do": "push", "forward": 10**400, "left": 0.0}, "finite"),
        ({"do": "push", "forward": 1e300, "left": 1e300}, "more than 1200 N"),
        ({"do": "speed", "value": float("inf")}, "finite"),
        ({"do": "body", "name": "head", "value": 1.0}, "no body parameter"),
        ({"do": "body", "name": [], "value": 1.0}, "no body parameter"),
        ({"do": "clock", "rate": -1.0}, "rate is -1"),
        ({"do": "clock", "rate": 2.0}, "rate is 2"),
        ({"do": "restart", "now": 1}, "takes nothing"),
        ({"do": "device", "on": 1.0}, "give true or false"),
        ({"do": "device"}, "takes on"),
        ({"do": "slip"}, "takes side"),
        ({"do": "slip", "side": "both"}, "right or left"),
        ({"do": "trip", "side": ["right"]}, "right or left"),
    ],
)
def test_what_cannot_be_done_is_refused(values, message):
    with pytest.raises(RecordError, match=message):
        doing_of(values, "the page")
