"""The plates under a standing person show the body's weight, and which plate shows too much."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from gaitval.constants import STANDARD_GRAVITY
from gaitval.mocap.recording import Plate, Recording
from gaitval.session.measurement import standing
from gaitval.session.measurement.standing import KINDS, StandingForces, standing_of, with_plates

MASS = 60.0
WEIGHT = MASS * STANDARD_GRAVITY
NAMES = ("mass", "gain 1", "cross-talk x 1", "tilt left", "offset z 1", "delay")
CORNERS = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.0], [0.5, 0.0, 0.0]])


def plate(name, share, *, corners=CORNERS, count=200):
    force = np.tile([0.0, 0.0, share * WEIGHT], (count, 1))
    nothing = np.zeros((count, 3))
    return Plate(name, corners, force, nothing, nothing, nothing)


def recording(*plates, source="standing.c3d"):
    return Recording(source, "project", (), np.zeros((20, 0, 3)), 100.0, 0.0, plates, 1000.0)


class Request:
    static = "standing.c3d"
    mass_kg = MASS
    static_time = None
    stands_in_walk = False
    plate = ()


@dataclass(frozen=True)
class Session:
    standing: Recording
    walking: tuple[Recording, ...] = ()
    axes: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(rotation=np.eye(3)))


def test_a_fault_of_a_plate_is_what_it_adds_to_the_weight():
    share = {"1": np.array([0.0, 0.0, 0.6]), "2": np.array([0.0, 0.0, 0.4])}
    sound = StandingForces({name: each * WEIGHT for name, each in share.items()}, True)
    wrong = {name: each * WEIGHT for name, each in share.items()}
    wrong["1"] = 1.1 * wrong["1"] + 0.02 * wrong["1"][2] * np.array([1.0, 0.0, 0.0])
    before, after = (
        one.rows(WEIGHT, NAMES, ("1", "2")) for one in (sound, StandingForces(wrong, True))
    )
    assert [kind for kind, *_ in before] == [*KINDS]
    for (_, value, _, effects), (_, changed, *_) in zip(before, after, strict=True):
        assert value == pytest.approx(0.0)
        faults = np.array([0.0, 0.1, 0.02, 0.0, 0.0, 0.0])
        assert changed - value == pytest.approx(float(effects @ faults), abs=0.002)
        assert effects[NAMES.index("delay")] == 0.0


def test_the_mass_that_is_given_stands_against_the_weight():
    vertical = StandingForces({"1": np.array([0.0, 0.0, WEIGHT])}, False).rows(
        1.05 * WEIGHT, NAMES, "1"
    )
    ((kind, value, _, effects),) = vertical  # where the axes of the walk point is not known
    assert kind == KINDS[2]
    assert value == pytest.approx(0.05 * effects[NAMES.index("mass")], rel=0.06)


def test_what_a_plate_that_nobody_walks_on_may_be_off_widens_the_errors():
    both = StandingForces({name: np.array([0.0, 0.0, 0.5 * WEIGHT]) for name in "12"}, True)
    (*_, sure), (*_, less) = (both.rows(WEIGHT, NAMES, walked) for walked in ("12", "1"))
    assert sure[2] < less[2]


@pytest.mark.parametrize(
    ("plates", "stands"),
    [
        ((plate("1", 0.5), plate("2", 0.5)), {"1", "2"}),
        ((plate("1", 1.0), plate("2", -0.01)), {"1"}),
        ((plate("1", 0.5),), None),  # one foot is beside the plates
        ((plate("1", 0.0),), None),
    ],
)
def test_only_who_stands_on_plates_and_nowhere_else_counts(plates, stands):
    found = standing_of(Request, Session(recording(*plates)))
    assert (None if found is None else {*found.force}) == stands


def test_who_steps_on_and_off_does_not_stand():
    stepping = plate("1", 1.0)
    stepping = replace(stepping, force=stepping.force * np.linspace(0.7, 1.3, 200)[:, None])
    assert standing_of(Request, Session(recording(stepping))) is None


def test_plates_are_turned_as_those_of_the_walk(monkeypatch):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    walk = recording(plate("1", 1.0)).turned(turn)
    pushing = replace(plate("1", 1.0), force=np.tile([30.0, 0.0, WEIGHT], (200, 1)))
    monkeypatch.setattr(standing, "read_recording", lambda _: recording(pushing))

    (found,) = with_plates(Request, Session(recording(), (walk,))).standing.plates
    np.testing.assert_allclose(found.force[0], [0.0, 30.0, WEIGHT], atol=1e-9)


def test_the_plates_are_of_the_same_window_as_the_markers(monkeypatch):
    """Somebody holds a bag until 0.1 s; standing is looked at after that."""
    fixed = plate("1", 1.0)
    fixed.force[:100, 2] *= 1.14
    whole = recording(fixed)
    monkeypatch.setattr(standing, "read_recording", lambda _: whole)

    class Late(Request):
        static_time = (0.12, 0.18)

    still = recording().between(Late.static_time, "static_time")
    session = Session(still, (whole,))
    (found,) = with_plates(Late, session).standing.plates
    assert len(found.force) == 70  # of seven frames
    assert standing_of(Late, session).force["1"][2] == pytest.approx(WEIGHT)
