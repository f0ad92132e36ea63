"""The numbers of `gaitval judge` that decide what is said; limits of verdicts are in
`tolerances.toml`.
"""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class JudgeLimits:
    """What is said from which size on, with units."""

    root_step: float = 1e-5
    """rad or m, of the differences that the velocities of the root are taken from."""
    pelvis_depth: float = 0.1
    """m. The stand-ins for the spines of the pelvis are this far before and behind the hips."""
    other_belt: float = 0.3
    """m/s, by which the belt may differ from the feet that stand on it."""
    other_foot: float = 0.5
    """Share of a plate's impulse on the other foot from which external loads have their feet
    wrong."""
    same_time: float = 1e-4
    """s. Times of frames in two files that are this close are the same frame."""
    slowest_rate: float = 10.0
    """Hz. No motion capture is so slow."""
    least_rows: int = 3
    """Of a table over time: accelerations need three."""
    least_swing: float = 0.1
    """rad or Nm/kg, standard deviation over the cycle under which a curve has no sign to
    compare."""
    edge: float = 0.05
    """Markers show an event up to this much early or late (`gait.events`: 18 to 54 ms): so far from
    a stance beside the plates, its force may be missing."""
    smallest_share: float = 0.01
    """Of healthy people's ankle moment: one of less has no size to compare."""
    nudge: float = 0.05
    """rad, by which a coordinate is moved to see what it does."""
    about_the_axis: float = 0.6
    """Of a turn that must be about the expected axis: hips and knees of models are a few degrees
    off, ankles up to 30 degrees, subtalar joints up to 45."""


LIMITS: Final = JudgeLimits()
