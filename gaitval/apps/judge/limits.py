"""The numbers of `gaitval judge` that decide what is said; limits of verdicts are in
`tolerances.toml`.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np


@dataclass(frozen=True)
class JudgeLimits:
    """What is said from which size on, with units."""

    root_step: float = 1e-5
    """rad or m, of the differences that the velocities of the root are taken from."""
    weakest_muscle: float = 5.0
    """N. In every walk some muscle pulls with hundreds."""
    force_delay: int = 4
    """% of the cycle by which force follows the electromyogram."""
    muscle_on: float = 0.25
    """Of its largest activation, above which a muscle is on."""
    farthest_root: float = 20.0
    """m. No walk is recorded so far from the origin."""
    joint_moves: float = float(np.deg2rad(15.0))
    """rad. A leg's joint that moves by this much moves."""
    beyond_range: float = float(np.deg2rad(15.0))
    """rad. Models' zeros differ: so far beyond `RANGES` an angle may be that of a sound person."""
    pelvis_depth: float = 0.1
    """m. The stand-ins for the spines of the pelvis are this far before and behind the hips."""
    other_belt: float = 0.3
    """m/s, by which the belt may differ from the feet that stand on it."""
    other_foot: float = 0.5
    """Share of a plate's impulse on the other foot from which external loads have their feet
    wrong."""
    farthest_marker: float = 0.3
    """m. A larger RMS error over all markers is a unit's, or that of a model that is not posed."""
    same_time: float = 1e-4
    """s. Times of frames in two files that are this close are the same frame."""
    slowest_rate: float = 10.0
    """Hz. No motion capture is so slow."""
    least_rows: int = 3
    """Of a table over time: accelerations need three."""
    fastest_knee: float = 1500.0
    """deg/s, of which one sample in a hundred is more: a walker's knee swings at 400, a sprinter's
    at 1200."""
    noisy_moments: float = 0.5
    """Off the mean of the frames beside, as a share of the standard deviation of a moment:
    0.05 in walking at 100 Hz."""
    still_knee: float = float(np.deg2rad(5.0))
    """rad. In a walk every knee moves by more."""
    points_away: float = 0.5
    """Of forces and levers, correlation about zero: in a walk forces point to the centre of
    mass."""
    said: float = 3.0
    """Standard deviations from which something is said."""
    patients_beyond: float = 2.0
    """Times these that a patient may be off."""
    sole: float = 0.015
    """m, of the origins of heel or toes of models above the sole."""
    least_swing: float = 0.1
    """rad or Nm/kg, standard deviation over the cycle under which a curve has no sign to
    compare."""
    edge: float = 0.05
    """Markers show an event up to this much early or late (`gait.events`: 18 to 54 ms): so far from
    a stance beside the plates, its force may be missing."""
    log_agrees: float = 1e-3
    """m. Marker errors that differ more from the log are of other markers, weights or another
    model."""
    smallest_share: float = 0.01
    """Of healthy people's ankle moment: one of less has no size to compare."""
    usual_factor: float = 3.0
    """No walk has an ankle moment so many times larger or smaller than healthy people's at its
    speed and a shape like theirs; the units are further apart."""
    nudge: float = 0.05
    """rad, by which a coordinate is moved to see what it does."""
    about_the_axis: float = 0.6
    """Of a turn that must be about the expected axis: hips and knees of models are a few degrees
    off, ankles up to 30 degrees, subtalar joints up to 45."""


LIMITS: Final = JudgeLimits()
