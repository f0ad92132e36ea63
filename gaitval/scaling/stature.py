"""The mean body of a stature: lengths in the proportions of WBDS and Winter, without markers.

`scaling.tape` has the table of the lengths, and puts measured ones in their place.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.scaling.anthropometry import WINTER
from gaitval.scaling.hip_regressions import hip_joint_centre
from gaitval.scaling.measurements import Limbs, Measurements


@dataclass(frozen=True)
class MeanBody:
    """Means of the ten built-in subjects, as fractions of stature but where said otherwise."""

    thigh: float = 0.2284
    shank: float = 0.2282
    """Distances between joint centres / stature, means of the ten built-in subjects (WBDS, by
    markers); 1 SD 0.012 and 0.008, of the sum 3.6 %. Winter's 0.245 and 0.246 (Drillis and Contini)
    are longer than every one of them."""
    pelvis_width: float = 0.158
    """Distance between the ASIS / stature, mean of the ten built-in subjects (WBDS); 1 SD 0.019.
    Winter's 0.191 is the width across the hips, not between the spines."""
    ankle_factor: float = 1.18
    """Height of the ankle joint / Winter's 0.039 of stature, mean of the same subjects; 1 SD 0.06.
    Winter's is the height of cadavers' lateral malleoli."""
    pelvic_tilt: float = np.radians(13.4)
    """Forward tilt of the plane of the ASIS and PSIS in standing, rad; mean of the same subjects, 1
    SD 5.7 degrees."""


MEAN_BODY: Final = MeanBody()


FOOT: Final = {
    "heel": (-0.188, -0.026, 0.204),
    "MT1": (0.552, 0.136, 0.168),
    "MT5": (0.452, -0.188, 0.126),
}
"""Heel, and markers on the first and fifth metatarsal heads, as fractions of foot length: forward
of the ankle joint, towards the midline, above the floor. Means over the same subjects' 20 feet; 1
SD at most 0.03."""

STATURE_SD: Final = "SD 14-21 mm (ANSUR II)"
"""Uncertainty of thigh and shank lengths given the stature: standard deviations about the
regressions on stature of ANSUR II (Gordon et al. 2014)."""

FRACTIONS: Final = {
    "hip_height": MEAN_BODY.thigh
    + MEAN_BODY.shank
    + WINTER["ankle height"] * MEAN_BODY.ankle_factor,
    "thigh": MEAN_BODY.thigh,
    "shank": MEAN_BODY.shank,
    "ankle_height": WINTER["ankle height"] * MEAN_BODY.ankle_factor,
    "foot": WINTER["foot"],
    "pelvis_width": MEAN_BODY.pelvis_width,
}
"""Mean of each measure, as a fraction of stature."""

SOURCES: Final = {
    "thigh": f"stature as in WBDS; {STATURE_SD}",
    "shank": f"stature as in WBDS; {STATURE_SD}",
    "foot": "stature",
    "ankle height": "stature, ankle of WBDS",
}
"""How each length of the mean body was found."""


def mean_lengths(height_m: float) -> dict[str, float]:
    """Mean of each measure of `FRACTIONS` at a stature of `height_m`, m."""
    return {name: fraction * height_m for name, fraction in FRACTIONS.items()}


def measurements_of_lengths(
    lengths: Mapping[str, float], sources: Mapping[str, str]
) -> Measurements:
    """A body of the measures of `FRACTIONS` (`lengths`, m), the same on both sides; `sources` says
    how each was found.
    """
    leg = _leg(lengths)
    return Measurements(
        right=leg,
        left=leg,
        # Harrington's width does not depend on the depth of the pelvis, which no tape measures.
        hip_half_width=float(-hip_joint_centre(lengths["pelvis_width"], 0.0)[1]),
        hip_height=lengths["hip_height"],
        pelvic_tilt=float(MEAN_BODY.pelvic_tilt),
        sources=dict(sources),
    )


def _leg(used: Mapping[str, float]) -> Limbs:
    foot, ankle = used["foot"], used["ankle_height"]
    heel, first, fifth = (np.array(FOOT[name]) * foot for name in ("heel", "MT1", "MT5"))
    floor = np.array([0.0, 0.0, ankle])
    return Limbs(
        thigh=used["thigh"],
        shank=used["shank"],
        ankle_height=ankle,
        heel=heel - floor,
        metatarsals=np.stack([first, fifth]) - floor,
    )
