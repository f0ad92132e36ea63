"""What a policy is told of its body: how late, with what noise, and what it did meanwhile."""

import numpy as np
import pytest

from gaitval.configuration import EnvironmentSettings
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import (
    ACTION_ORDER,
    ACTION_SIGNS,
    MIRROR_ORDER,
    MIRROR_SIGNS,
    OBSERVED,
    PARTS,
)
from gaitval.policy.senses import PATHS, Senses, observation_size, path_places
from gaitval.policy.walking_group import WalkingGroup

ACTION = 0.01
DELAYS = (0.05, 0.1, 0.15)
RANDOM = np.random.default_rng(0)


def senses(**settings):
    return Senses(EnvironmentSettings(**settings), ACTION)


def told(each, steps, *, mirrored=lambda n: False):
    """Of `steps` in which all numbers of the body are the step's, and so are the actions."""
    return [
        each.told(np.full(126, float(n)), np.full(26, float(n)), mirrored(n), RANDOM)
        for n in range(steps)
    ]


def test_every_part_is_felt_by_one_path_or_known():
    felt = [name for path in PATHS for name in path]
    assert len(felt) == len(set(felt))
    known = {each.name for each in PARTS} - set(felt)
    assert known == {"phase", "parameters", "waves", "speed", "action"}


def test_each_path_is_as_late_as_its_delay_and_what_is_known_is_of_now():
    each = senses(observation_delays=DELAYS)
    rows = told(each, 40)
    paths = path_places(126)
    for n, row in enumerate(rows):
        for places, late in zip(paths, (5, 10, 15), strict=True):
            assert set(row[places]) == {max(0, n - late)}
        known = np.setdiff1d(np.arange(126), np.concatenate(paths))
        assert set(row[known]) == {n}
    each.forget()
    assert set(told(each, 1)[0]) == {0.0}


def test_past_actions_are_means_over_windows_and_nothing_was_done_before_the_start():
    each = senses(action_memory=0.15)
    assert observation_size(EnvironmentSettings(action_memory=0.15)) == 126 + 3 * 26
    rows = told(each, 30)
    for n, ages in enumerate(((0, 5), (5, 10), (10, 15))):
        window = rows[-1][126 + 26 * n : 126 + 26 * (n + 1)]
        expected = np.mean([29 - age for age in range(*ages)])
        assert window == pytest.approx(expected)
    # two steps after the start: actions 1 and 2, in a window of five
    assert rows[2][126:152] == pytest.approx(3 / 5)
    assert rows[2][152:] == pytest.approx(0.0)


def test_noise_is_on_what_is_felt_and_as_large_as_it_says():
    each = senses(observation_noise=0.02, action_memory=0.05)
    random = np.random.default_rng(1)
    rows = np.array([each.told(np.zeros(126), np.zeros(26), False, random) for _ in range(400)])
    felt = np.concatenate(path_places(126))
    assert rows[:, felt].std(axis=0) == pytest.approx(0.02, rel=0.2)
    assert not rows[:, np.setdiff1d(np.arange(152), felt)].any()


def test_in_the_mirror_what_was_felt_before_is_mirrored_too():
    body, action = RANDOM.normal(size=(2, 126)), RANDOM.normal(size=26)
    each = senses(observation_delays=(ACTION,) * 3, action_memory=0.05)
    each.told(body[0], action, False, RANDOM)
    found = each.told(body[1], action, True, RANDOM)
    plain = senses(observation_delays=(ACTION,) * 3, action_memory=0.05)
    plain.told(body[0], action, False, RANDOM)
    straight = plain.told(body[1], action, False, RANDOM)
    assert found[:126] == pytest.approx(MIRROR_SIGNS * straight[:126][MIRROR_ORDER], abs=1e-6)
    assert found[126:] == pytest.approx(ACTION_SIGNS * straight[126:][ACTION_ORDER], abs=1e-6)
    assert not np.allclose(found, straight)


def test_who_feels_at_once_is_told_the_body_as_it_is():
    each = senses()
    assert each.immediate
    body = RANDOM.normal(size=126)
    assert np.array_equal(each.told(body, np.zeros(26), False, RANDOM), body.astype(np.float32))
    assert not senses(action_memory=0.05).immediate
    assert not senses(observation_noise=0.01).immediate


def test_a_group_is_told_what_each_walker_alone_is(task):
    late = task.with_environment(observation_delays=DELAYS, action_memory=0.1)
    group, alone = WalkingGroup([late] * 8), WalkingEnvironment(late)
    options = {"phase": 0.1, "mu": None, "push": None, "noise": 0.0}
    options["mu"] = 0.5 * (alone._lower + alone._upper) + alone._shift
    told = np.array([group.reset(e, seed=0, options=options) for e in range(8)])
    single = alone.reset(seed=0, options=options)[0]
    assert told.shape == (8, 126 + 2 * 26)
    random = np.random.default_rng(3)
    for _ in range(25):
        action = random.normal(0.0, 0.1, 26).astype(np.float32)
        group.step(np.tile(action, (8, 1)), told)
        single = alone.step(action)[0]
        assert np.allclose(told, single, atol=1e-5)
    assert OBSERVED["action"].stop == 126


def test_settings_without_nerves_are_written_as_before_there_were_any():
    names = {"observation_delays", "observation_noise", "action_memory"}
    assert not names & set(EnvironmentSettings().model_dump(mode="json"))
    late = EnvironmentSettings(observation_delays=DELAYS, action_memory=0.15)
    written = late.model_dump(mode="json")
    assert names & set(written) == {"observation_delays", "action_memory"}
    assert EnvironmentSettings(**written) == late
