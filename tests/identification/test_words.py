"""Sentences on a body: their numbers, and what they say of legs that differ."""

from dataclasses import replace

import pytest
from body_result import MODEL, made_up

from gaitval.identification.body_words import sentences, walker_words
from gaitval.identification.shared_errors import SHARED


def test_the_legs_are_said_in_centimetres_before_and_after():
    message = sentences(made_up(0.5, 0.009), MODEL)
    length = 100 * MODEL.leg_length
    assert f"Legs: {1.01 * length:.1f} ± " in message
    assert f"scaled: {length:.1f} ± " in message
    assert "left leg is longer by 10 ± 4 mm: within what people's legs differ" in message
    assert "next to nothing" not in message


def test_a_record_that_tells_nothing_is_said_to():
    assert "the record adds next to nothing" in sentences(made_up(0.95, 0.0), MODEL)


@pytest.mark.parametrize(("difference", "shown"), [(-0.001, "−1"), (0.0, "0"), (0.004, "4")])
def test_a_side_is_named_only_where_the_record_knows_it(difference, shown):
    """1 ± 4 mm is either side's; 1.645 SD leave 5 % to the other one."""
    message = sentences(made_up(0.5, difference), MODEL)
    assert "leg is longer" not in message
    text = f"Whether the legs differ in length cannot be seen (left less right {shown} ± 4 mm)."
    assert text in message


def test_legs_that_differ_are_said_with_what_else_it_may_be():
    message = sentences(made_up(0.5, -0.022), MODEL)
    assert "The right leg is longer by 25 ± 4 mm: more than people's legs differ" in message
    assert "hip centre" in message


def test_a_record_that_does_not_fit_says_so_and_changes_nothing():
    odd = replace(made_up(0.5, 0.009), cost=SHARED.largest_deviance + 214.0)
    message = sentences(odd, MODEL)
    assert f"{odd.cost:.0f}" in message
    assert f"{SHARED.largest_deviance:.0f}" in message
    assert f"{100 * MODEL.leg_length:.1f} cm" in message
    assert "±" not in message
    assert not odd.fits


def test_goodness_of_fit_and_the_walker_s_body_are_said():
    found = made_up(0.5, 0.009)
    assert f"deviance {found.cost:.0f}, at most {SHARED.largest_deviance:.0f}" in sentences(
        found, MODEL
    )
    assert "equal legs" in walker_words(found=True, two_legs=False)
    assert "legs that differ" in walker_words(found=True, two_legs=True)
    assert "as scaled" in walker_words(found=False, two_legs=True)
