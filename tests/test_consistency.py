"""Causes of a contradiction: their probabilities, against those of a table worked out by hand."""

import numpy as np
import pytest

from gaitval.consistency import OTHER, SOUND, WIDEST, Change, log_likelihood, weigh

SIGN = Change("sign", "the sign is the other", 0.1, "Change the sign")
LATE = [Change("late", f"it is {ms} ms late", 0.1, "Shift it") for ms in (10, 20)]
LOOK = Change("look", "a marker moved", 0.1, "Look at it", alters=False)


def _verdict(sign=100.0, late=(100.0, 100.0), sound=100.0, *more, count=4):
    tried = [(SIGN, sign), *zip(LATE, late, strict=True), *more]
    squares = [(change, log_likelihood(square, count)) for change, square in tried]
    other = log_likelihood(sound, count, WIDEST)
    return weigh(squares, log_likelihood(sound, count), other)


def test_probabilities_are_those_of_bayes():
    """Prior times likelihood, by hand; the two delays share one prior."""
    found = _verdict(sign=4.0, late=(5.0, 7.0), sound=6.0)
    wide = np.mean(np.exp([-3.0 * 30.0 ** (-2 * x) - 4 * x * np.log(30.0)
                           for x in np.linspace(0, 1, 200)]))  # fmt: skip
    by_hand = {
        "sign": 0.1 * np.exp(-2.0),
        "late": 0.1 * 0.5 * (np.exp(-2.5) + np.exp(-3.5)),
        SOUND.name: 0.78 * np.exp(-3.0),
        OTHER.name: 0.02 * wide,
    }
    total = sum(by_hand.values())
    for name, value in by_hand.items():
        assert found.probability(name) == pytest.approx(value / total, rel=1e-9)
    assert sum(each.probability for each in found.causes) == pytest.approx(1.0)
    assert [each.probability for each in found.causes] == sorted(
        (each.probability for each in found.causes), reverse=True
    )


def test_the_likeliest_parameter_is_told():
    assert "20 ms" in str(_verdict(late=(9.0, 2.0)))


def test_sound_data_are_not_accused():
    found = _verdict(sound=4.0)
    assert found.sound > 0.9
    assert not found.named
    assert str(found) == found.remedy == ""


def test_what_no_change_explains_is_something_else_without_advice():
    found = _verdict(sign=400.0, late=(300.0, 350.0), sound=500.0)
    assert found.named[0].change is OTHER
    assert found.remedy == ""


def test_two_that_fit_alike_are_both_named_and_nothing_is_advised():
    found = _verdict(sign=3.0, late=(3.0, 3.0))
    assert {each.change.name for each in found.named} == {"sign", "late"}
    assert "cannot tell" in str(found)
    assert found.remedy == ""


@pytest.mark.parametrize(("rival", "advised"), [(60.0, True), (7.5, False)])
def test_advice_that_alters_data_needs_more_certainty_than_a_name(rival, advised):
    found = _verdict(sign=3.0, late=(rival, rival))
    assert [each.change for each in found.named] == [SIGN]
    assert bool(found.remedy) is advised
    looked = _verdict(100.0, (7.5, 7.5), 100.0, (LOOK, 3.0))
    assert looked.named[0].change is LOOK
    assert looked.remedy == "Look at it"


def test_priors_leave_room_for_none():
    with pytest.raises(ValueError, match="leave room"):
        weigh([(Change("a", "a", 0.99), 0.0)], 0.0, 0.0)
