"""Pushes as ensembles: what counts as survived, and that starts differ."""

from types import SimpleNamespace

import numpy as np
import pytest

from gaitval.metrics import push_ensembles as module
from gaitval.metrics.push_ensembles import NOISE, STARTS, Ensemble, Ensembles, starts_of
from gaitval.metrics.push_recovery import Push, PushTrial, largest_survived

STRIDE = 1.1


@pytest.mark.parametrize(
    ("stood", "survived", "everyone", "torn"),
    [
        (5, True, True, False),
        (4, True, False, True),
        (3, False, False, True),
        (0, False, False, False),
    ],
)
def test_four_of_five_survive_a_push_and_all_the_largest(stood, survived, everyone, torn):
    found = Ensemble(Push(0.0, 0.0, 1.0), (True,) * stood + (False,) * (STARTS - stood))
    assert (found.survived, found.all_survived, found.torn) == (survived, everyone, torn)


def test_starts_differ_by_micrometres_and_milliseconds():
    trial = PushTrial(None, np.zeros(14), Push(0.25, 1.0, 200.0), 3, 5.0)
    starts = starts_of(trial, STRIDE)
    assert len({each.seed for each in starts}) == STARTS
    assert {each.noise for each in starts} == {NOISE}
    begins = np.array([each.push.phase for each in starts]) * STRIDE
    assert np.diff(begins) == pytest.approx(0.002)
    assert begins.mean() == pytest.approx(0.25 * STRIDE)
    assert all(each.settings()["noise"] == each.start()["noise"] == NOISE for each in starts)
    assert trial.settings()["noise"] == 0.0


class Pool:
    """Walkers that survive up to a force that depends on the start."""

    def __init__(self):
        self.asked = []

    def each_together(self, function, groups):
        for group in groups:
            assert len({each.seed for each in group}) == 1, "eight walks of one start"
            self.asked += group
            yield [each.push.force <= (330.0 if each.seed else 260.0) for each in group]


def ensembles(pool):
    task = SimpleNamespace(
        reference=SimpleNamespace(stride_time=STRIDE),
        configuration=SimpleNamespace(
            validation=SimpleNamespace(settling_cycles=3), pushes=SimpleNamespace(cycles=5.0)
        ),
    )
    return Ensembles(pool, task, None, np.zeros(14))


def test_the_largest_push_is_that_up_to_which_every_start_survives():
    pool = Pool()
    tried = ensembles(pool)
    found = largest_survived(
        tried.survived, [0.0], [0.0], step=100.0, resolution=25.0, ceiling=1200.0
    )
    assert found == 250.0  # one start falls from 260 N on, though four survive up to 330 N
    assert [each.survived for each in tried.of([Push(0.0, 0.0, 300.0), Push(0.0, 0.0, 400.0)])] == [
        True, False,
    ]  # fmt: skip
    assert module.ENOUGH == 4


def test_the_largest_push_is_walked_again_from_starts_that_it_was_not_found_with():
    pool = Pool()
    tried = ensembles(pool)
    push = Push(0.25, 0.0, 300.0)
    tried.of([push])
    own = {each.seed for each in pool.asked}
    pool.asked.clear()
    (again,) = tried.from_others([push])
    assert len(again.stood) == module.OTHERS == len({each.seed for each in pool.asked} - own)
    begins = STRIDE * (np.array([each.push.phase for each in pool.asked]) - 0.25)
    assert begins.min() == pytest.approx(-0.004)
    assert begins.max() == pytest.approx(0.004)
    assert tried.known.keys() == {push}
    assert tried.known[push].torn
    found = module.RobustPushes((), (), np.zeros((0, 0)), (), (again, Ensemble(push, (False,) * 3)))
    assert found.flipped == (3, module.OTHERS + 3)


def test_each_push_is_walked_once():
    pool = Pool()
    tried = ensembles(pool)
    pushes = [Push(0.0, 0.1 * n, 100.0) for n in range(11)]
    assert all(each.all_survived for each in tried.of(pushes + pushes))
    assert tried.of(pushes)[0].push == pushes[0]
    assert len(pool.asked) == STARTS * len(pushes)
