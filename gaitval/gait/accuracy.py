"""How close a motion should stay to each recorded quantity.

The numbers are chosen by walks (docs/what-we-tried.md), not by fits: forces that
are held more tightly give nearer references, which walkers follow less well.
"""

from typing import NamedTuple

import numpy as np


class RecordAccuracy(NamedTuple):
    """Departures from a record that weigh the same in a fit: angles in rad, moments in Nm/kg,
    forces in body weights (BW).
    """

    sagittal: float = np.deg2rad(1.0)
    frontal: float = np.deg2rad(1.2)
    """Hip adduction."""
    rotation: float = np.deg2rad(1.5)
    """Hip rotation, less tightly than what was seen better: it is what gives way where a loaded
    foot would turn on the ground. Skin shows a knee's rotations to within 4.4 degrees in the mean
    (Benoit et al. 2006, Gait Posture 24:152, abstract). The model's leg turns about its axis at the
    hip alone: where only the foot is held, it turns as the recorded hip, knee and ankle do together
    (docs/what-we-tried.md). What fits of nine people choose for the tenth, 1 degree, is better
    by 1 % of their sum of squares, and lets a foot of one of them snap round on its ball."""
    pelvis: float = np.deg2rad(1.1)
    moment: float = 0.025
    adduction_moment: float = 0.04
    """Held as tightly as the others, and the frontal angles a little less: with 0.10 (and 0.9
    degrees) the hip adduction moments of fits were 0.06 Nm/kg off, twice as far as now, and nothing
    else was nearer."""
    forward_force: float = 0.0068
    sideways_force: float = 0.005
    vertical_force: float = 0.0095
    twist: float = 1.9e-4
    """m²/s, of a loaded foot's twist (`walking_laws.FOOT`) from none, for each body weight that it
    carries: that of a foot which turns at 2 to 3 degrees/s, with which friction gives a free moment
    of 2e-3 BW m. Of 1 to 3e-3 fits of nine people choose that for the tenth in nine of ten cases.
    The free moment itself was held before: friction that slides gives no more of it, so a foot of
    S06 spun on its ball by 200 degrees/s at no cost (docs/what-we-tried.md)."""
    flexion_moments: float | None = None
    """Of hip and knee in the sagittal plane, where it is not that of the ankle (`moment`)."""
    hip_centre: float = 0.02
    """m, forward and sideways, of the hip centres that the moments are about. Regressions from
    markers miss them by 2 to 3 cm, functional methods by 1 (Leardini et al. 1999, J Biomech 32:99,
    from memory)."""
    ankle_power: float = 0.11
    """Of the ankles' power in the sagittal plane, as a share of its root mean square over the cycle
    and both sides: 0.1 W/kg in adults at their own speed (0.92 W/kg; Bovi et al. 2011, Gait Posture
    33:6, supplement). Moments and angles that are within their accuracies leave it free by three
    times as much, and the ankles then did a third more positive work than recorded. Not in W/kg for
    all: what is 4 % of a usual push is 15 % of that of a person who walks at 0.5 m/s."""
