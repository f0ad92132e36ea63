"""The filter and the peaks that do without SciPy's signals are SciPy's, bit for bit."""

import subprocess
import sys

import numpy as np
from scipy.signal import butter, find_peaks, sosfiltfilt

from gaitval.arrays import peaks
from gaitval.gait.second_order import both_ways, low_pass_section


def test_the_filter_is_that_of_scipy_bit_for_bit() -> None:
    chance = np.random.default_rng(0)
    for _ in range(100):
        rate = 10.0 ** chance.uniform(1.5, 3.5)
        frequency = rate * 10.0 ** chance.uniform(-3.0, -0.4)
        length = int(chance.integers(3, 500))
        padding = int(min(chance.integers(0, 200), length - 1))
        values = chance.normal(size=(length, 3)) * 10.0 ** chance.uniform(-3, 3) + chance.normal()
        theirs = butter(2, frequency, fs=rate, output="sos")
        np.testing.assert_array_equal(low_pass_section(frequency, rate), theirs[0])
        np.testing.assert_array_equal(
            both_ways(theirs[0], values, padding),
            sosfiltfilt(theirs, values, axis=0, padlen=padding),
        )


def test_peaks_are_those_of_scipy() -> None:
    chance = np.random.default_rng(1)
    for length in chance.integers(1, 30, 300):
        values = chance.integers(0, 4, length).astype(float)  # flat tops, too
        if length % 3 == 0:
            values[chance.integers(length)] = np.nan
        np.testing.assert_array_equal(peaks(values), find_peaks(values)[0])


def test_no_walk_and_no_report_loads_the_signals_and_statistics_of_scipy() -> None:
    """They took half of a second of every command."""
    program = (
        "import gaitval.gait.filters, gaitval.metrics.validation, gaitval.reporting.report, sys\n"
        "print({'scipy.signal', 'scipy.stats', 'scipy.interpolate'} & {*sys.modules} or 'none')"
    )
    found = subprocess.run(
        [sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "none"
