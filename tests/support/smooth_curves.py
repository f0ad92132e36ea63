"""Smooth random curves."""

import numpy as np
from scipy.ndimage import gaussian_filter1d


def smooth_curves(count, width, seed):
    """Gaussian curves (count, 101) with a full width at half maximum, %, of their kernel."""
    noise = np.random.default_rng(seed).standard_normal((count, 301))
    curves = gaussian_filter1d(noise, width / np.sqrt(8.0 * np.log(2.0)), axis=1)[:, 100:201]
    return curves / curves.std()
