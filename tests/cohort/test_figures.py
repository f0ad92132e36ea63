"""Figures of a cohort show each record where it is."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import same_color
from seen_figures import figure_of

from gaitval.apps.cohort.figures import SEX_COLOURS, by_speed_age_sex, parameter_distributions
from gaitval.reporting.figures import RECORD_SHADE


def test_each_record_is_drawn_at_its_speed_age_and_sex() -> None:
    rows = pd.DataFrame(
        {
            "name": ["one"] * 8 + ["two"] * 8,
            "unit": ["deg"] * 8 + [""] * 8,
            "value": np.arange(16.0) ** 1.5,
            "speed": np.linspace(0.8, 1.6, 16),
            "age": np.linspace(20.0, 70.0, 16),
            "sex": ["F", "M"] * 8,
        }
    )
    figure = figure_of(lambda: by_speed_age_sex(rows, ["one", "two"], figure_name="a"))
    panels = np.reshape(figure.axes, (2, 3))
    labels = [axes.get_xlabel() for axes in panels[-1]]
    assert labels == ["Speed, m/s", "Age, years", "Sex"]
    for row, (name, label) in zip(panels, (("one", "one, °"), ("two", "two")), strict=True):
        assert row[0].get_ylabel() == label
        for sex, colour in SEX_COLOURS.items():
            some = rows[(rows["name"] == name) & (rows["sex"] == sex)]
            for axes, across in zip(row, ("speed", "age", None), strict=True):
                circles = [each for each in axes.lines if each.get_marker() == "o"]
                (dots,) = [each for each in circles if same_color(each.get_color(), colour)]
                np.testing.assert_array_equal(dots.get_ydata(), some["value"])
                if across:
                    np.testing.assert_array_equal(dots.get_xdata(), some[across])
                else:
                    words = [each.get_text() for each in axes.get_xticklabels()]
                    own = axes.get_xticks()[words.index({"F": "women", "M": "men"}[sex])]
                    assert np.abs(dots.get_xdata() - own).max() < 0.2
                assert axes.get_xlim()[0] < axes.get_xlim()[1]
                assert axes.get_ylim()[0] < axes.get_ylim()[1]
        bars = [each for each in row[2].lines if len(each.get_xdata()) == 2]
        medians = [e.get_ydata()[0] for e in bars if same_color(e.get_color(), "#1a1a1a")]
        by_sex = rows[rows["name"] == name].groupby("sex")["value"].median()
        np.testing.assert_allclose(medians, [by_sex["F"], by_sex["M"]])


def test_parameters_that_records_determine_are_in_prior_sd_and_no_others_are_drawn() -> None:
    rows = pd.DataFrame(
        {
            "parameter": ["a_b", "a_b", "c"],
            "mean": [1.5, 0.5, 3.0],
            "nominal": [1.0, 1.0, 2.0],
            "prior_sd": [0.25, 0.25, 2.0],
            "verdict": ["identified", "weak", "not identified"],
        }
    )
    (axes,) = figure_of(lambda: parameter_distributions(rows, figure_name="a")).axes
    names = [each.get_text() for each in axes.get_yticklabels()]
    assert names == ["a b"]
    found = [(x, names[int(y)]) for each in axes.lines for x, y in each.get_xydata()]
    assert found == [(2.0, "a b")]
    assert all(str(each.get_markerfacecolor()) != "none" for each in axes.lines)
    (band,) = [each for each in axes.patches if same_color(each.get_facecolor()[:3], RECORD_SHADE)]
    assert (band.get_x(), band.get_width()) == pytest.approx((-1.0, 2.0))
