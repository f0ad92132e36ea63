"""The walk: pushes, speeds, bodies, falls."""

import numpy as np
import pytest

from gaitval.apps.devices import of_subject
from gaitval.apps.live.doing import (
    LARGEST_PUSH,
    ChangeBody,
    PushPelvis,
    Restart,
    SetSpeed,
    SlipFoot,
    TripFoot,
    Wear,
)
from gaitval.apps.live.walk import PUSH_SECONDS, LiveWalk
from gaitval.configuration import PushSettings
from gaitval.coordinates import SIDES
from gaitval.model.parameters import PARAMETERS
from gaitval.policy.environment import WalkingEnvironment


def acted(walk, count):
    for _ in range(count):
        walk.act()
    return walk.see()


def test_it_walks_as_the_environment_does(person):
    """With one speed, no pushes and the body as scaled, it is `WalkingEnvironment`, to rounding."""
    walk = LiveWalk(person, person.speeds[0])
    environment = WalkingEnvironment(person.tasks[0].with_environment(drift_tolerance=1e3))
    nominal = walk.mu
    environment.centre(person.policy.act, nominal)
    options = {"phase": 0.0, "mu": nominal, "push": None, "noise": 0.0}
    observation, _ = environment.reset(seed=0, options=options)
    for _ in range(300):
        observation, *_ = environment.step(person.policy.act(observation))
    mine, theirs = acted(walk, 300).positions, environment.walker.state[0]
    place = slice(3, 5)  # it stands where the world begins, not where the reference does
    np.testing.assert_allclose(np.delete(mine, place), np.delete(theirs, place), rtol=0, atol=1e-9)


def test_a_push_is_its_force_for_50_ms(walk):
    acted(walk, 10)
    walk.do(PushPelvis(120.0, -60.0))
    given = np.zeros(2)
    for _ in range(20):
        given += walk.seconds * acted(walk, 1).push
    np.testing.assert_allclose(given, PUSH_SECONDS * np.array([120.0, -60.0]), rtol=1e-12)


def test_a_push_acts_in_the_next_action(walk):
    acted(walk, 5)
    walk.do(PushPelvis(100.0, 0.0))
    assert acted(walk, 1).push[0] == 100.0


def test_the_largest_push_is_the_largest_that_is_tested():
    assert PushSettings().largest == LARGEST_PUSH


def test_it_begins_at_the_speed_of_the_persons_own_trial(person):
    own = person.subject.walking_speed_m_s
    assert own == 1.12  # not the middle of what can be predicted
    assert LiveWalk(person).speed == pytest.approx(own)


def test_it_comes_to_another_speed_without_a_jump(walk, person):
    before = acted(walk, 200).positions
    walk.do(SetSpeed(person.speeds[-1]))
    steps = []
    for _ in range(400):
        now = acted(walk, 1)
        steps.append(now.positions[3] - before[3])
        before = now.positions
        assert not now.down
    assert walk.speed == pytest.approx(person.speeds[-1])
    # 3 m/s is faster than any part of a pelvis' path here: a jump would be.
    assert min(steps) > 0.0
    assert max(steps) < 3.0 * walk.seconds


def test_a_speed_beyond_the_references_is_the_last_of_them(walk, person):
    walk.do(SetSpeed(10.0))
    acted(walk, 700)
    assert walk.speed == person.speeds[-1]


def test_a_body_parameter_goes_to_its_value_within_bounds(walk):
    walk.do(ChangeBody("thigh_length", 9.0))
    walk.do(ChangeBody("friction", 0.7))
    acted(walk, 20)
    index = PARAMETERS.index("thigh_length")
    assert 1.0 < walk.mu[index] < walk.upper[index]
    seen = acted(walk, 200)
    assert seen.mu[index] == walk.upper[index]
    assert seen.mu[PARAMETERS.index("friction")] == 0.7
    assert not seen.down


def test_a_walker_that_fell_stands_up_where_it_fell(walk):
    acted(walk, 100)
    walk.do(PushPelvis(0.0, LARGEST_PUSH))
    while not walk.down:
        walk.act()
        assert walk.step < 1000
    fell = walk.see()
    walk.do(PushPelvis(0.0, LARGEST_PUSH))  # who lies on the ground is not pushed
    while walk.down:
        walk.act()
    stands = acted(walk, 1)
    assert stands.time == pytest.approx(walk.seconds)
    assert np.hypot(*(stands.positions - fell.positions)[3:5]) < 0.05
    assert not stands.push.any()
    assert not acted(walk, 300).down


def test_it_starts_again_where_it_is(walk):
    before = acted(walk, 150)
    walk.do(Restart())
    after = acted(walk, 1)
    assert after.phase < 0.05
    assert np.hypot(*(after.positions - before.positions)[3:5]) < 0.05


def test_the_line_follows_a_walker_that_is_pushed_aside(walk):
    """Far from its line a walker would see what no policy learned."""
    acted(walk, 100)
    for _ in range(4):
        walk.do(PushPelvis(0.0, 150.0))
        acted(walk, 150)
    assert not walk.down
    assert walk.see().positions[4] > 0.0


def test_nothing_but_what_is_done_changes_the_walk(person):
    first, second = (LiveWalk(person, person.speeds[1]) for _ in range(2))
    for walk in (first, second):
        acted(walk, 30)
        walk.do(PushPelvis(50.0, 50.0))
        acted(walk, 30)
        walk.see()
    assert first.digest == second.digest
    second.do(PushPelvis(1e-9, 0.0))
    assert acted(first, 5).step == acted(second, 5).step
    assert first.digest != second.digest


def tables(*names):
    return of_subject.tables(names)


def test_a_device_that_is_taken_off_leaves_the_person_as_before(person):
    """It is put on and taken off in standing; without it the walk is the one without devices."""
    fitted = LiveWalk(person, person.speeds[1], tables("backpack"))
    bare = LiveWalk(person, person.speeds[1])
    assert fitted.device_on
    assert fitted.weight > bare.weight + 50.0
    with_it = acted(fitted, 300)
    assert not with_it.down
    fitted.do(Wear(False))
    assert (fitted.device_on, fitted.weight) == (False, bare.weight)
    mine, theirs = acted(fitted, 300).positions, acted(bare, 300).positions
    np.testing.assert_allclose(np.delete(mine, [3, 4]), np.delete(theirs, [3, 4]), atol=1e-9)
    place = fitted.see().positions[3]
    fitted.do(Wear(True))
    assert fitted.see().positions[3] == pytest.approx(place, abs=1e-9), "where it was taken off"


@pytest.mark.parametrize("name", ["hip_exo", "above_knee"])
def test_devices_walk_quicker_and_twice_the_same(person, name):
    seen = []
    for _ in range(2):
        walk = LiveWalk(person, person.speeds[1], tables(name))
        acted(walk, 100)
        walk.do(SetSpeed(person.speeds[-1]))
        walk.do(ChangeBody("damping", 1.0))
        acted(walk, 200)
        seen.append(walk.digest)
    assert seen[0] == seen[1]
    assert np.isfinite(walk.see().positions).all()


def test_without_devices_there_is_nothing_to_put_on(walk):
    acted(walk, 5)
    before = walk.see().cycles
    walk.do(Wear(True))
    assert not walk.device_on
    assert walk.see().cycles == before > 0.0


# ---- Slips and trips. ----


def until_level(walk, longest=400):
    """The walk after each action, until nothing is planned any longer."""
    seen = []
    while walk._environment.undermined and len(seen) < longest:
        seen.append(acted(walk, 1))
    return seen


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_foot_slips_where_it_lands_next_and_has_its_grip_again(walk, side):
    acted(walk, 30)
    walk.do(SlipFoot(side))
    until_level(walk)
    environment = walk._environment
    assert 0.0 < environment.slid < 0.5
    assert environment.ended > environment.began
    assert (environment.ground.grip_right, environment.ground.grip_left) == (1.0, 1.0)
    assert environment.planned is None


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_foot_is_stopped_in_its_swing_and_goes_on(walk, side):
    column = SIDES.index(side)
    acted(walk, 30)
    walk.do(TripFoot(side))
    environment, stopped = walk._environment, []
    while environment.undermined and walk.step < 400:
        seen = acted(walk, 1)
        if environment.ground.wall_side == column:
            stopped.append(seen.force[column, 0])
    assert min(stopped) < -20.0  # N, backwards, by the wall
    assert environment.ended - environment.began == pytest.approx(0.1, abs=0.01)
    assert environment.ground.wall_side == -1


def test_who_stands_up_again_does_so_on_level_ground(walk):
    acted(walk, 30)
    walk.do(TripFoot("right"))
    walk.do(Restart())
    assert not walk._environment.undermined
    assert walk._environment.ground.wall_side == -1


def test_another_body_does_not_end_a_slip(walk):
    acted(walk, 30)
    walk.do(SlipFoot("right"))
    while walk._environment.planned is None:
        acted(walk, 1)
    name, value = "friction", 0.65
    walk.do(ChangeBody(name, value))
    acted(walk, 1)
    assert walk._environment.ground.grip_right < 1.0
    assert walk._environment.ground.law is walk._environment.walker.law
