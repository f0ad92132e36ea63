"""Where the uncertainty of a recording comes from, and how large each part is.

Sizes are standard deviations. Landmarks: iliac spines are found within 15 to 20 mm by different
examiners, the others within 12 to 16 mm (root mean square of the distance; Della Croce et al. 1999,
2005, Gait Posture 21:226), which is divided among three directions. A marker on the sacrum is put
midway between the two posterior spines, so their errors average. Soft tissue: 5 to 30 mm on the
thigh, under 15 mm on the shank (Leardini et al. 2005, Gait Posture 21:212), in phase with the joint
above. Plates: `kinds.KINDS`.

Hip centres: a regression on bones is 12.3 ± 5.9 mm from that in 67 CT images, and the flesh over
the spines, on which the markers are, is 9.7 ± 7.0 and 19.6 ± 10.9 mm thick (Mantovani et al. 2016,
Gait Posture 44:48). Which regression is a choice, and the band of 90 % of a moment holds the curve
by each. Ankle centres have three places in the literature, each with a third of the weight: the
middle of the malleoli, which is taken; 2.7 % of the shank below it (radiographs of 30 children,
Bruening et al. 2008, Clin Biomech 23:1299, abstract); and 7 % of the foot's length before it
(functional, 23 adults, Salami et al. 2020, Gait Posture 77:95, abstract).

These are of adults. A landmark is an area of bone of which an examiner chooses a point, skin slides
as far as the limb below it is thick, and a regression misses by a share of the pelvis: all grow
with the body, so lengths are for a stature of `ADULT` and go with the person's (`of_stature`).
"""

from typing import Final

ADULT: Final = 1.70
"""m, of the people of these studies: adults, men and women."""


def of_stature(height_m: float) -> float:
    """By how much the lengths of this module are larger in a person of `height_m`."""
    return height_m / ADULT


LANDMARKS: Final = {
    "ASIS": 0.009,
    "PSIS": 0.009,
    "Sacrum": 0.0064,
    "Knee": 0.008,
    "Knee.Medial": 0.008,
    "Ankle": 0.006,
    "Ankle.Medial": 0.006,
    "Heel": 0.006,
    "MT1": 0.006,
    "MT2": 0.006,
    "MT5": 0.006,
}
"""m, each way, by landmark without its side; of an adult."""
HIP_CENTRE: Final = 0.0079
"""m, each way, of the regression, √((12.3² + 5.9²) / 3) mm; of an adult."""
FLESH: Final = {"ASIS": 0.0070, "PSIS": -0.0109, "Sacrum": -0.0109}
"""m, forward, of both sides together: SD of the thickness of what is between marker and bone."""
ANKLE_CENTRES: Final = ((0.0, -0.027), (0.07, 0.0))
"""Other places of the ankle's centre than the middle of the malleoli: forward, share of the foot's
length, and up, share of the shank's."""
TISSUE: Final = {"pelvis": 0.004, "thigh": 0.010, "shank": 0.006, "foot": 0.003}
"""m per rad of the joint above, each way: all markers of a segment together; of an adult."""
TISSUE_TURN: Final = {"thigh": 0.10, "shank": 0.06}
"""rad per rad about the long axis."""
MASSES: Final = {"thigh": 0.18, "shank": 0.09, "foot": 0.30}
"""Share of a segment's mass: RMS of three tables (de Leva 1996; Dempster in Winter 2009; OpenSim's
Rajagopal 2016) about the first, which is taken: of the body's mass 14.2, 10.0, 12.3 % a thigh,
4.3, 4.65, 4.9 % a shank, 1.4, 1.45, 2.1 % a foot. People of one table differ by less."""
INERTIAS: Final = {"shank": 0.22}
"""Share of the moment of inertia at the same mass: radii of gyration of .255 (de Leva) and .29
(OpenSim) of its length, likewise."""
PLATE_GAIN: Final = 0.015
"""Share, of the forces of a plate: beside the weight of the person, which is as little known."""
ONE_CYCLE: Final = {"angle": 0.026, "moment": 0.05, "force": 0.025}
"""rad, Nm/kg and body weights: SD between cycles where there is one only."""
NINETY: Final = 1.645
"""Half of a band of 90 %, in standard deviations."""
