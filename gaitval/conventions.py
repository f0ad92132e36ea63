"""Conventions of angles: what each calls zero, and by how much it differs from gaitval's.

A joint angle is the turn between two sets of axes, and nobody's are given by nature. gaitval has
those of the ISB: a pelvis whose ASIS and PSIS are level has no tilt (Wu et al. 2002, J Biomech
35:543-548), thigh and shank go from joint centre to joint centre, and a foot flat on the ground
below an upright shank has an ankle of zero. Others call another pose zero:

| convention | pelvis tilt, hip flexion | because |
|---|---|---|
| isb | 0 | gaitval's own |
| plug-in-gait | 0 | its pelvis has the same plane (Davis et al. 1991); its hips are elsewhere |
| rajagopal2016 | -5.9° | in the model's zero its PSIS are 17 mm above its ASIS, 165 mm behind |
| gait2392 | -3.2° | its sacral marker is 10 mm above the ASIS', 180 mm behind |

The offset is that of the models' own markers: OpenSim moves the markers on the model to where the
person's are in standing, but those of the spines weigh most there. Another marker set has another:
in Rajagopal's own set-up for scaling it is 2.7°, and his walk shows 2.7°. So a convention may also
be given as a number: the forward tilt, in degrees, of the plane of the spines' markers in the
model's zero.
"""

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

from gaitval._internal.text.any_case import as_known
from gaitval.errors import ConfigurationError

_Point = tuple[float, float, float]


class GenericPelvis(NamedTuple):
    """Right ASIS, right PSIS or sacrum, and right hip of a generic model in its own pelvis, m, x
    forward, y left, z up, where its marker set has them.
    """

    asis: _Point
    rear: _Point
    hip: _Point

    @property
    def level(self) -> float:
        """rad, forward tilt of the plane through the spines in the model's zero."""
        return float(math.atan2(self.rear[2] - self.asis[2], self.asis[0] - self.rear[0]))


GENERIC: Final = {
    "rajagopal2016": GenericPelvis(
        (0.0095, -0.1285, 0.0181), (-0.1550, -0.0450, 0.0350), (-0.0563, -0.0773, -0.0785)
    ),
    "gait2392": GenericPelvis(
        (0.0200, -0.1280, 0.0300), (-0.1600, 0.0, 0.0400), (-0.0707, -0.0835, -0.0661)
    ),
}
"""`Rajagopal2016.osim` with its markers RASI, RPSI, and Gait2392 with R.ASIS, V.Sacral of its
set-up for scaling; both of opensim-models."""


@dataclass(frozen=True)
class Convention:
    """What an angle is called zero by.

    Attributes
    ----------
    title : for people.
    pelvis : rad, forward tilt of the plane of ASIS and PSIS in its zero.
    source : who has it.
    """

    name: str
    title: str
    pelvis: float
    source: str

    def offset(self, angle: str) -> float:
        """rad, to be added to gaitval's `angle` (`hip_flexion_r`, `pelvis_tilt`, …)."""
        joint = angle[:-2] if angle.endswith(("_r", "_l")) else angle
        # Its pelvis' axes are turned back by `pelvis` against ours: tilt and flexion are less by
        # that, and the trunk leans as much less forward of it.
        signs = {"pelvis_tilt": -1.0, "hip_flexion": -1.0}
        return signs.get(joint, 0.0) * self.pelvis


CONVENTIONS: Final = {
    each.name: each
    for each in (
        Convention("isb", "ISB", 0.0, "Wu et al. 2002, J Biomech 35:543-548"),
        Convention("plug-in-gait", "Plug-in Gait", 0.0, "Davis et al. 1991, Hum Mov Sci 10:575"),
        Convention(
            "rajagopal2016",
            "OpenSim, Rajagopal 2016",
            GENERIC["rajagopal2016"].level,
            "Rajagopal et al. 2016, IEEE Trans Biomed Eng 63:2068",
        ),
        Convention(
            "gait2392",
            "OpenSim, Gait2392",
            GENERIC["gait2392"].level,
            "opensim-models, Gait2392_Simbody",
        ),
    )
}
OWN: Final = "isb"
"""That of all files and of the body."""
LARGEST: Final = 30.0
"""Degrees, of a tilt that is given as a number."""


def convention_of(name: str) -> Convention:
    """The convention of this name, or of a number of degrees (see above); ConfigurationError if
    there is none.
    """
    if (known := as_known(name, CONVENTIONS)) in CONVENTIONS:
        return CONVENTIONS[known]
    try:
        tilt = float(name)
    except ValueError:
        tilt = math.nan
    if not abs(tilt) <= LARGEST:
        raise ConfigurationError(
            f"{name}: no convention of angles. There are {', '.join(CONVENTIONS)}; or give the "
            "forward tilt, in degrees, of the plane of the spines' markers in your model's zero, "
            f"between -{LARGEST:g} and {LARGEST:g}."
        )
    return Convention(name, f"a pelvis tilted by {tilt:g}°", math.radians(tilt), "as given")


def beside(convention: Convention) -> list[tuple[str, float]]:
    """Titles of the conventions in which pelvis tilt and hip flexion are others than in this one,
    and by how many degrees they are more.
    """
    apart = {
        each.title: math.degrees(convention.pelvis - each.pelvis) for each in CONVENTIONS.values()
    }
    return [(title, more) for title, more in apart.items() if abs(more) >= 0.05]
