"""The low-pass filters: gain, lag, ends and gaps."""

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.gait.filters import low_pass, low_pass_simulated


@pytest.mark.parametrize("order", [2, 4, 8])
@pytest.mark.parametrize(("rate", "cutoff"), [(100.0, 6.0), (150.0, 20.0), (2000.0, 6.0)])
def test_the_stated_cutoff_is_that_of_the_whole_filter_and_has_no_lag(
    rate: float, cutoff: float, order: int
) -> None:
    time = np.arange(0.0, 40.0 / cutoff, 1.0 / rate)
    angle = 2.0 * np.pi * cutoff * time
    filtered = low_pass(np.sin(angle), rate=rate, cutoff_hz=cutoff, order=order)
    middle = slice(len(time) // 4, 3 * len(time) // 4)
    parts = np.linalg.lstsq(
        np.stack([np.sin(angle), np.cos(angle)], axis=1)[middle], filtered[middle], rcond=None
    )[0]
    # the definition of the cut-off: half the power, and a zero-lag filter has no cosine part
    assert parts[0] == pytest.approx(1.0 / np.sqrt(2.0), abs=2e-3)
    assert parts[1] == pytest.approx(0.0, abs=2e-3)


def test_low_pass_keeps_constants_and_filters_blocks_between_gaps_alone() -> None:
    random = np.random.default_rng(0)
    values = random.normal(size=(200, 2, 3))
    values[80:90, 1, 2] = np.nan
    filtered = low_pass(values, rate=100.0, cutoff_hz=6.0)
    assert np.isnan(filtered[80:90, 1, 2]).all()
    assert np.isfinite(filtered).sum() == values.size - 10
    for block in (slice(0, 80), slice(90, 200)):
        alone = low_pass(values[block, 1, 2], rate=100.0, cutoff_hz=6.0)
        np.testing.assert_allclose(filtered[block, 1, 2], alone, atol=1e-12)
    np.testing.assert_allclose(low_pass(np.full(50, 3.0), rate=100.0, cutoff_hz=6.0), 3.0)


@pytest.mark.parametrize(
    ("samples", "rate", "cutoff", "message"),
    [(100, 10.0, 6.0, "than 12 Hz"), (100, 12.0, 6.0, "than 12 Hz"), (5, 100.0, 6.0, "too short")],
)
def test_low_pass_refuses_what_it_cannot_filter(
    samples: int, rate: float, cutoff: float, message: str
) -> None:
    with pytest.raises(RecordError, match=message):
        low_pass(np.zeros(samples), rate=rate, cutoff_hz=cutoff)


@pytest.mark.parametrize("frequency", [1.0, 5.0, 10.0, 20.0])
def test_the_filter_has_the_gain_of_its_transfer_function_and_no_lag(frequency):
    step, cut_off = 0.001, 10.0
    time = step * np.arange(8000)
    wave = np.sin(2 * np.pi * frequency * time)
    inner = slice(2000, 6000)  # a whole number of periods, away from the ends
    filtered = low_pass_simulated(wave, step=step, frequency=cut_off)[inner]
    # two passes of a second-order Butterworth filter (bilinear transform, prewarped)
    single_pass = cut_off / (np.sqrt(2) - 1) ** 0.25
    ratio = np.tan(np.pi * frequency * step) / np.tan(np.pi * single_pass * step)
    gain = 1 / (1 + ratio**4)
    np.testing.assert_allclose(filtered, gain * wave[inner], atol=1e-6)
    if frequency == cut_off:
        assert gain == pytest.approx(np.sqrt(0.5), abs=1e-3)


def test_the_filter_takes_walks_of_a_few_samples():
    for length in (0, 1, 2, 5):
        assert low_pass_simulated(
            np.ones((length, 3)), step=0.001, frequency=10.0
        ) == pytest.approx(np.ones((length, 3)))
