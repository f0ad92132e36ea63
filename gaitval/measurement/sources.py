"""Where the uncertainty of a recording comes from, and how large each part is.

Sizes are standard deviations. Landmarks: iliac spines are found within 15 to 20 mm by different
examiners, the others within 12 to 16 mm (root mean square of the distance; Della Croce et al. 1999,
2005, Gait Posture 21:226), which is divided among three directions. A marker on the sacrum is put
midway between the two posterior spines, so their errors average. Soft tissue: 5 to 30 mm on the
thigh, under 15 mm on the shank (Leardini et al. 2005, Gait Posture 21:212), in phase with the joint
above. Hip centres: Harrington et al. 2007 (J Biomech 40:595), 12 mm on average against imaging
(Mantovani et al. 2016). Plates: `expected.USUAL`.

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
HIP_CENTRE: Final = 0.006
"""m, each way, of the regression; of an adult."""
TISSUE: Final = {"pelvis": 0.004, "thigh": 0.010, "shank": 0.006, "foot": 0.003}
"""m per rad of the joint above, each way: all markers of a segment together; of an adult."""
TISSUE_TURN: Final = {"thigh": 0.10, "shank": 0.06}
"""rad per rad about the long axis."""
MASSES: Final = {"thigh": 0.08, "shank": 0.08, "foot": 0.12}
"""Share of a segment's mass: differences of people from regressions of it (de Leva 1996)."""
ONE_CYCLE: Final = {"angle": 0.026, "moment": 0.05, "force": 0.025}
"""rad, Nm/kg and body weights: SD between cycles where there is one only."""
NINETY: Final = 1.645
"""Half of a band of 90 %, in standard deviations."""
