"""The labelled body: each marker where it is, right on the right side of the picture."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.colors import to_hex
from seen_figures import figure_of

from gaitval.scaling.markers.draft import Draft
from gaitval.scaling.markers.picture import CONTRADICTED, SURE, UNSURE, draw


def test_every_marker_is_drawn_where_it_stands_with_its_name_and_certainty(
    drafted: Draft, tmp_path: Path
) -> None:
    first, *rest = drafted.guesses
    drafted = replace(drafted, guesses=(replace(first, named=False), *rest))
    figure = figure_of(lambda: draw(drafted, tmp_path / "a.svg", "a person"))
    behind, beside = figure.axes
    at = np.array([guess.at for guess in drafted.guesses])
    for axes, title, across in (
        (behind, "from behind", -at[:, 1]),  # the person's right is on the right
        (beside, "from the right", at[:, 0]),
    ):
        assert axes.get_title() == title
        (dots,) = [each for each in axes.collections if len(each.get_offsets()) == len(at)]
        np.testing.assert_allclose(dots.get_offsets(), np.column_stack([across, at[:, 2]]))
        expected = [
            CONTRADICTED if guess.named is False else SURE if guess.used else UNSURE
            for guess in drafted.guesses
        ]
        assert [to_hex(each) for each in dots.get_facecolors()] == expected
        messages = {each.get_text(): each.xy for each in axes.texts}
        for guess, place in zip(drafted.guesses, dots.get_offsets(), strict=True):
            label = "?" if guess.site is None else guess.site.label
            np.testing.assert_allclose(
                messages[f"{guess.name}: {label} {guess.certainty:.0%}"], place
            )
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        assert left < right
        assert low < high
    words = figure.get_suptitle()
    assert words.startswith("a person")
    for colour, meaning, hue in (
        ("blue", "used", SURE), ("orange", "less certain", UNSURE),
        ("red", "its name says another place", CONTRADICTED),
    ):  # fmt: skip
        assert f"{colour}: {meaning}" in words
        strongest = int(np.argmax([int(hue[k : k + 2], 16) for k in (1, 3, 5)]))
        assert strongest == (2 if colour == "blue" else 0)
