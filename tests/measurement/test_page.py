"""The page of an import has the bands, their sources, and how the session fits its noise model."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.configuration import ProcessingSettings
from gaitval.importing.importing import work_out
from gaitval.importing.summary import summary_of
from gaitval.measurement.estimate import LEAST_SCALE
from gaitval.measurement.page import GROUPS, FitRow, fits
from gaitval.reporting.recording_report import _drawings


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


def test_bands_are_drawn(found):
    draw = _drawings(summary_of(found))["drawings"]["bands"]
    assert draw().startswith("<svg")


def test_a_sound_session_fits_and_a_strange_one_is_said_not_to(found):
    rows = {row.name: row for row in found.measurement.fits}
    assert set(rows) == {*GROUPS} - {"forces in standing"}  # which the sample has not
    assert sum(row.count for row in rows.values()) == len(found.measurement.seen.data.kind)
    assert all(0.05 < row.ratio < 3.0 for row in rows.values())
    assert FitRow("x", 9, 4.0).said
    assert not FitRow("x", 9, 1.0).said


def test_white_data_of_the_model_have_a_ratio_of_one(found):
    seen = replace(found.measurement.seen, found=())
    random = np.random.default_rng(391)
    lower = np.tril(seen.model.factor[0])
    of_all = []
    for _ in range(40):
        rest = lower @ random.standard_normal(len(lower))
        drawn = replace(seen, model=replace(seen.model, rest=rest))
        of_all.append([row.ratio for row in fits(drawn)][:4])
    scale = max(seen.model.left, LEAST_SCALE)
    np.testing.assert_allclose(np.mean(of_all, axis=0), scale, rtol=0.2)
