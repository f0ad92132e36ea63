import numpy as np
import pytest
from smooth_curves import smooth_curves

from gaitval.metrics.cycle_changes import differing_curves, new_in_strides, stride_correlation

NAMES = tuple(f"angles/{joint}_{side}" for joint in ("hip", "knee", "ankle") for side in "rl")


def cycles(count: int, seed: int) -> dict[str, np.ndarray]:
    """Curves of one side hang together, as those of one stride do."""
    found = {}
    for number, side in enumerate("rl"):
        shared = smooth_curves(count, 15.0, 1000 * seed + number)
        for each, name in enumerate(n for n in NAMES if n[-1] == side):
            own = smooth_curves(count, 15.0, 1000 * seed + 10 + 10 * number + each)
            found[name] = 0.6 * shared + 0.8 * own
    return found


def test_a_person_is_called_changed_by_chance_as_often_as_said():
    """Of 100 pairs of sessions of one distribution 5 % may be, for all curves together: 5 ± 6.5 %
    (3 SD). With a threshold for each curve it would be a quarter."""
    wrong = 0
    for seed in range(100):
        found = differing_curves(cycles(7, 2 * seed), cycles(7, 2 * seed + 1), permutations=100)
        wrong += any(each.regions for each in found.curves.values())
    assert wrong / 100 <= 0.115


def persistent(count: int, seed: int, correlation: float) -> dict[str, np.ndarray]:
    """`cycles` with that correlation of each with the next, the first as varied as the rest."""
    found = cycles(count, seed)
    for strides in found.values():
        for i in range(1, count):
            new = np.sqrt(1.0 - correlation**2) * strides[i]
            strides[i] = correlation * strides[i - 1] + new
    return found


def false_alarms(pairs: int, count: int, correlation: float) -> float:
    """Share of pairs of sessions without a change in which any curve is called changed."""
    wrong = 0
    for seed in range(pairs):
        sessions = (persistent(count, 2 * seed + 500 + i, correlation) for i in (0, 1))
        found = differing_curves(*sessions, permutations=60)
        wrong += any(each.regions for each in found.curves.values())
    return wrong / pairs


def test_strides_that_hang_together_are_no_change():
    """Of 60 pairs 5 % may be called changed, ± 3 SD. A test of independent strides calls 55 %."""
    assert false_alarms(60, 10, 0.4) <= 0.135


@pytest.mark.slow
@pytest.mark.parametrize(("count", "correlation"), [(6, 0.4), (10, 0.2), (20, 0.0), (20, 0.4)])
def test_false_alarms_are_five_in_a_hundred_however_strides_hang_together(count, correlation):
    """5 ± 2 %, and 2 SD of 400 pairs."""
    assert false_alarms(400, count, correlation) == pytest.approx(0.05, abs=0.02 + 0.022)


@pytest.mark.parametrize("correlation", [0.0, 0.2, 0.4])
def test_the_correlation_of_strides_is_found(correlation):
    """Of 10 strides their own mean takes away 0.1 and a third of it; the estimate gives it back."""
    found = [
        stride_correlation([persistent(10, 2 * seed + i, correlation) for i in (0, 1)])
        for seed in range(40)
    ]
    assert np.mean(found) == pytest.approx(correlation, abs=0.06)


def test_what_strides_bring_new_keeps_their_mean_and_forgets_the_stride_before():
    """Each is half of the one before and 3 more: all about 6, and new are only the steps."""
    strides = np.array([[6.0], [8.0], [5.0]])
    np.testing.assert_allclose(new_in_strides(strides, 0.5), [[10.0], [2.0]])
    np.testing.assert_allclose(new_in_strides(np.full((4, 2), 6.0), 0.5), 6.0)
    assert new_in_strides(strides, 0.0) is strides


def test_the_curve_that_changed_is_found_and_no_other():
    before, after = cycles(10, 1), cycles(10, 2)
    after["angles/knee_l"][:, 55:76] += 3.5
    found = differing_curves(before, after, permutations=500)
    (region,) = found.curves["angles/knee_l"].regions
    assert abs(region.first - 55) <= 4
    assert abs(region.last - 75) <= 4
    assert region.p <= 0.01
    assert not any(each.regions for name, each in found.curves.items() if name != "angles/knee_l")
    assert (found.curves["angles/knee_l"].t[60:70] > 0.0).all()


def test_an_offset_is_found_by_the_mean_over_the_cycle():
    """Points alternate, so none shows the offset, and the mean over the cycle does."""
    random = np.random.default_rng(0)
    before, after = ({name: random.normal(size=(8, 101)) for name in NAMES} for _ in range(2))
    after["angles/hip_r"] += 0.5
    found = differing_curves(before, after, permutations=500).curves["angles/hip_r"]
    assert [(each.first, each.last) for each in found.regions] == [(0, 100)]
    assert np.abs(found.t[-1]) > np.abs(found.t[:-1]).max()


@pytest.mark.parametrize(("before", "after"), [(3, 3), (2, 4), (2, 2)])
def test_too_few_cycles_find_nothing(before, after):
    """3 and 3 cycles have 20 labellings, 2 of which are as extreme: p is .1 at best."""
    many = {name: values + 50.0 for name, values in cycles(after, 6).items()}
    found = differing_curves(cycles(before, 5), many)
    assert found.threshold is None
    assert found.permutations == 0
    assert not any(each.regions for each in found.curves.values())


def test_what_one_session_lacks_is_not_tested():
    before, after = cycles(6, 7), cycles(6, 8)
    del after["angles/hip_r"]
    before["angles/knee_r"] = before["angles/knee_r"][:1]
    found = differing_curves(before, after, permutations=100)
    assert "angles/hip_r" not in found.curves
    assert "angles/knee_r" not in found.curves


def test_equal_sessions_do_not_differ():
    same = cycles(6, 9)
    found = differing_curves(same, same, permutations=100)
    assert not any(each.regions for each in found.curves.values())
