"""Where a hip joint centre is in the pelvis, by regressions on what markers show of it.

Axes of the pelvis (x forward, y left, z up), origin midway between the ASIS, metres, right hip.

| name | x | lateral | up | found in |
|---|---|---|---|---|
| harrington | -0.24 PD - 9.9 mm | 0.33 PW + 7.3 mm | -0.30 PW - 10.9 mm | MRI of 32 people [1] |
| bell | -0.22 PW | 0.36 PW | -0.30 PW | X-rays of adults [2] |
| hara | 11 mm - 0.063 LL | 8 mm + 0.086 LL | -9 mm - 0.078 LL | CT of 157 people [3] |
| davis | C cos t sin b - D cos b | PW / 2 - C sin t | -C cos t cos b - D sin b | Plug-in Gait [6] |
| rajagopal2016 | -0.337 PD | 0.301 PW | -0.400 PW | OpenSim's generic model [4] |
| gait2392 | -0.333 PW | 0.326 PW | -0.394 PW | OpenSim's older one [5] |

PW is the distance between the ASIS, PD that between the middle of the ASIS and of the PSIS, LL from
the ASIS to the medial malleolus; C is 0.115 LL - 15.3 mm, D is 0.1288 LL - 48.56 mm and a marker's
radius, t is 28.4 and b 18 degrees; Plug-in Gait takes LL from a tape. Of OpenSim's models hips and
spines are where their own markers have them, and the pelvis is scaled as their set-ups do:
Rajagopal's by PD along and by PW across and up, Gait2392's by PW.

1. Harrington et al. 2007, J Biomech 40:595-602, the regressions on one variable.
2. Bell et al. 1989, Hum Mov Sci 8:3-16, abstract: 22 % back, 14 % inwards of the ASIS, 30 % down.
3. Hara et al. 2016, Sci Rep 6:37707, abstract; the numbers as public programs have them.
4. Rajagopal et al. 2016, IEEE Trans Biomed Eng 63:2068-2079; `Rajagopal2016.osim`.
5. opensim-models, Gait2392_Simbody and the marker set of its set-up.
6. Davis et al. 1991, Hum Mov Sci 10:575-587, as the manual of Visual3D has it (Helen Hayes pelvis).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.conventions import GENERIC

MARKER_RADIUS: Final = 0.007
"""m, of the markers on the spines, as Plug-in Gait has it if nothing is said."""


@dataclass(frozen=True)
class PelvisSize:
    """What the regressions go by, m.

    Attributes
    ----------
    width : between the ASIS.
    depth : between the middle of the ASIS and of the PSIS.
    leg : from the ASIS to the medial malleolus, mean of both sides.
    """

    width: float
    depth: float
    leg: float


def hip_joint_centre(pelvic_width: float, pelvic_depth: float) -> Array:
    """Right hip joint centre from the middle of the ASIS, m, in the pelvis axes (x forward, y left,
    z up), shape (3,); mirror y for the left one.

    `pelvic_width` PW is the distance between the ASIS, `pelvic_depth` PD that between the middle of
    the ASIS and of the PSIS, m. Harrington et al. (2007) J Biomech 40:595-602, the regressions on
    one variable, in mm: x = -0.24 PD - 9.9, up = -0.30 PW - 10.9, lateral = 0.33 PW + 7.3.
    """
    return np.array(
        [
            -0.24 * pelvic_depth - 0.0099,
            -(0.33 * pelvic_width + 0.0073),
            -0.30 * pelvic_width - 0.0109,
        ]
    )


def _harrington(pelvis: PelvisSize) -> Array:
    return hip_joint_centre(pelvis.width, pelvis.depth)


def _bell(pelvis: PelvisSize) -> Array:
    return pelvis.width * np.array([-0.22, -(0.50 - 0.14), -0.30])


def _hara(pelvis: PelvisSize) -> Array:
    return np.array(
        [0.011 - 0.063 * pelvis.leg, -(0.008 + 0.086 * pelvis.leg), -0.009 - 0.078 * pelvis.leg]
    )


def _davis(pelvis: PelvisSize) -> Array:
    away, theta, beta = 0.115 * pelvis.leg - 0.0153, np.radians(28.4), np.radians(18.0)
    behind = 0.1288 * pelvis.leg - 0.04856 + MARKER_RADIUS
    return np.array(
        [
            away * np.cos(theta) * np.sin(beta) - behind * np.cos(beta),
            -(0.5 * pelvis.width - away * np.sin(theta)),
            -away * np.cos(theta) * np.cos(beta) - behind * np.sin(beta),
        ]
    )


def _rajagopal(pelvis: PelvisSize) -> Array:
    own, place = _generic("rajagopal2016")
    across = pelvis.width / own.width
    return np.asarray(place * [pelvis.depth / own.depth, across, across])


def _gait2392(pelvis: PelvisSize) -> Array:
    own, place = _generic("gait2392")
    return np.asarray(place * pelvis.width / own.width)


def _generic(name: str) -> tuple[PelvisSize, Array]:
    """The pelvis of a generic model, and its right hip in the axes of its spines."""
    asis, rear, hip = GENERIC[name]
    forward = np.array([asis[0] - rear[0], 0.0, asis[2] - rear[2]])
    depth = float(np.linalg.norm(forward))
    forward /= depth
    there = np.array(hip) - [asis[0], 0.0, asis[2]]
    place = np.array([forward @ there, there[1], np.cross(forward, [0.0, 1.0, 0.0]) @ there])
    return PelvisSize(2.0 * abs(asis[1]), depth, np.nan), place


REGRESSIONS: Final[Mapping[str, Callable[[PelvisSize], Array]]] = {
    "harrington": _harrington,
    "bell": _bell,
    "hara": _hara,
    "davis": _davis,
    "rajagopal2016": _rajagopal,
    "gait2392": _gait2392,
}
HARRINGTON: Final = "harrington"
"""What is taken if nothing is said."""
TITLES: Final = {
    "harrington": "Harrington",
    "bell": "Bell",
    "hara": "Hara",
    "davis": "Davis, as in Plug-in Gait",
    "rajagopal2016": "OpenSim's Rajagopal 2016",
    "gait2392": "OpenSim's Gait2392",
}


def hip_centre(name: str, pelvis: PelvisSize) -> Array:
    """(3,) m, the right hip by the regression of this `name`; mirror y for the left one."""
    return np.asarray(REGRESSIONS[name](pelvis))
