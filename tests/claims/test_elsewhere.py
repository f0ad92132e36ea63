"""How much later one cycle's curves are than another's."""

import numpy as np
import pytest

from claims.elsewhere import later


@pytest.mark.parametrize("seconds", [-0.012, 0.0, 0.0045])
def test_curves_that_come_later_are_found_so(seconds: float) -> None:
    stride, phase = 1.1, np.arange(200) / 200

    def curves(late: float) -> np.ndarray:
        turns = 2.0 * np.pi * (phase - late / stride)
        return np.stack([np.sin(turns) + 0.3 * np.cos(4.0 * turns), np.cos(2.0 * turns)], axis=1)

    assert later(curves(seconds), curves(0.0), stride) == pytest.approx(seconds, abs=1e-6)
