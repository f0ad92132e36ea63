"""The phase of the gait cycle as a device knows it: from its own foot switch."""

import math


class PhaseEstimate:
    """Counts time since the last heel strike in parts of the stride time so far.

    The foot switch closes at `threshold` N and opens at half of it. The stride time is a running
    mean of the last strides, as in Zhang et al. 2017; before the first whole stride it is the one
    that the device was set to.

    Parameters
    ----------
    threshold : N.
    stride_time : s, that the device is set to.

    Attributes
    ----------
    loaded : whether the switch is closed.
    phase : 0 to 1; NaN until a heel strike was seen. It waits at 1 for a strike that is late.
    stride_time : s.
    """

    NEW = 0.5
    """Weight of the last stride in the running mean."""
    PLAUSIBLE = (0.6, 1.6)
    """Strides outside this, of the stride time so far, are a stumble, and change nothing."""
    SWING = 0.15
    """The switch must have been open for this part of a stride, or it has only bounced."""

    def __init__(self, threshold: float, stride_time: float) -> None:
        self._threshold = threshold
        self.stride_time = stride_time
        self.loaded = False
        self.phase = math.nan
        self._struck = math.nan
        self._opened = math.nan

    def start(self, load: float) -> None:
        """Switch the device on while the foot carries `load` N."""
        self.loaded = load >= self._threshold

    def see(self, time: float, load: float) -> None:
        """A measurement of the `load` N on the foot at a `time` s."""
        if self.loaded:
            if load < 0.5 * self._threshold:
                self.loaded, self._opened = False, time
        elif load >= self._threshold:
            self.loaded = True
            # Without an opening that it saw, the device was switched on in swing.
            if not time - self._opened < self.SWING * self.stride_time:
                self._strike(time)
        if not math.isnan(self._struck):
            self.phase = min((time - self._struck) / self.stride_time, 1.0)

    def _strike(self, time: float) -> None:
        stride = time - self._struck
        low, high = (part * self.stride_time for part in self.PLAUSIBLE)
        if low <= stride <= high:
            self.stride_time += self.NEW * (stride - self.stride_time)
        self._struck = time
