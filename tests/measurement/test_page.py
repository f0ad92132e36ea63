"""The page of an import has the bands and their sources."""

import numpy as np
import pytest
from seen_figures import bands, figure_of, forward, lines

from gaitval.configuration import ProcessingSettings
from gaitval.reporting.figures import COLOURS
from gaitval.session.importing.importing import work_out
from gaitval.session.measurement.page import (
    SHOWN,
    UNITS,
    draw_bands,
)


@pytest.fixture(scope="module")
def found(sample_request):
    return work_out(sample_request, ProcessingSettings())


def test_each_sagittal_curve_has_a_row_with_its_sources(found):
    rows = found.measurement.band_rows()
    assert [row.unit for row in rows] == 6 * ["°"] + 6 * ["Nm/kg"] + 4 * ["mm"]
    knee = next(row for row in rows if row.curve == "Knee, angle, right")
    assert 1.0 < knee.half < 8.0
    assert knee.unit == "°"
    shares = [float(part.split(" %")[0]) for part in knee.sources.split("; ")]
    assert shares == sorted(shares, reverse=True)


def test_bands_are_drawn_as_wide_as_they_are_each_side_in_its_colour():
    step = np.arange(101.0)
    given = {
        f"{kind}_{joint}_{side}": (step + 10 * j + 100 * s + 1000 * k, 10.0 + step / 5 + s)
        for k, kind in enumerate(UNITS)
        for j, joint in enumerate(SHOWN)
        for s, side in enumerate("rl")
    }
    figure = figure_of(lambda: draw_bands(given))
    panels = np.reshape(figure.axes, (len(UNITS), len(SHOWN)))
    for row, kind in zip(panels, UNITS, strict=True):
        assert row[0].get_ylabel() == f"{kind}, {UNITS[kind][1]}"
        for axes, joint in zip(row, SHOWN, strict=True):
            assert forward(axes)
            for side, colour in COLOURS.items():
                mean, half = given[f"{kind}_{joint}_{side[0]}"]
                (line,) = lines(axes, colour)
                np.testing.assert_array_equal(line.T, [step, mean])
                (band,) = bands(axes, colour)
                np.testing.assert_allclose(
                    band.T, np.array([step, mean - half, mean + half])[:, ::2]
                )
    shown = [axes.get_title(loc="left") for axes in panels[0]]
    assert shown == ["Hip flexion", "Knee flexion", "Ankle dorsiflexion"]
    turned = figure_of(lambda: draw_bands(given, extensor_positive=True)).axes[len(SHOWN) + 1]
    assert turned.get_title(loc="left") == "Knee extension"
    (line,) = lines(turned, COLOURS["right"])
    np.testing.assert_array_equal(line[:, 1], -given["moment_knee_angle_r"][0])
