"""Published body proportions: de Leva's and Jensen's inertia parameters and Winter's lengths.

de Leva, P. (1996) Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters,
J Biomech 29:1223-1230, Table 4. The fractions are as tabulated (CC BY 4.0) in the course
notes of Duarte and Watanabe; the mean lengths agree with the alternative end points of the
same table (equal radii of gyration in mm), which a test checks.

Jensen, R. K. (1986) Body segment mass, radius and radius of gyration proportions of children,
J Biomech 19:359-368: linear regressions on age, of 12 boys from 4 to 15 years, each seen in three
years. Girls are not in it; nor are children under 4, who are given the proportions of 4 years.

Winter, D. A. (2009) Biomechanics and Motor Control of Human Movement, 4th ed., Fig. 4.1
(after Drillis and Contini, 1966): segment lengths as fractions of stature.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

JENSEN_YEARS: Final = (4.0, 15.0)
"""Ages of Jensen's boys; beyond them the proportions of the nearest age are taken."""
JENSEN_MASS: Final[dict[str, tuple[float, float]]] = {
    "head": (-0.0114, 0.2376),
    "trunk": (-0.0006, 0.4246),
    "upper arm": (0.00084, 0.0220),
    "forearm": (0.00018, 0.01469),
    "hand": (-0.00003, 0.00898),
    "thigh": (0.00364, 0.06634),
    "shank": (0.00122, 0.03809),
    "foot": (0.00015, 0.0187),
}
"""Fraction of body mass: slope per year of age, and intercept (Jensen 1986)."""
JENSEN_RADII: Final[dict[str, tuple[tuple[float, float], tuple[float, float]]]] = {
    "upper arm": ((-0.00028, 0.557), (-0.00098, 0.640)),
    "thigh": ((-0.00115, 0.4758), (-0.00133, 0.5536)),
    "shank": ((-0.003, 0.4526), (-0.00224, 0.5307)),
    "foot": ((-0.00186, 0.4351), (-0.00203, 0.5022)),
}
"""Distance of the centre of mass from the proximal end, and radius of gyration about a transverse
axis there, as fractions of the length: likewise. Of the segments whose end points are de Leva's;
trunk, head, forearm and hand keep his."""

Sex = Literal["F", "M"]


@dataclass(frozen=True)
class Proportions:
    """One segment of de Leva's table.

    Attributes
    ----------
    length : mean length between the end points, m.
    mass : fraction of body mass.
    centre_of_mass : distance from the first end point, fraction of the length.
    sagittal, transverse, longitudinal : radii of gyration about axes through the centre of mass,
        fraction of the length. The sagittal axis runs from back to front and the transverse axis
        from side to side (the trunk is wider than deep, so its radius about the sagittal axis is
        the larger one); the longitudinal axis joins the end points.
    """

    length: float
    mass: float
    centre_of_mass: float
    sagittal: float
    transverse: float
    longitudinal: float


DE_LEVA: Final[dict[Sex, dict[str, Proportions]]] = {
    "F": {
        "head": Proportions(0.2437, 0.0668, 0.4841, 0.271, 0.295, 0.261),
        "upper trunk": Proportions(0.2280, 0.1545, 0.5050, 0.466, 0.314, 0.449),
        "middle trunk": Proportions(0.2053, 0.1465, 0.4512, 0.433, 0.354, 0.415),
        "lower trunk": Proportions(0.1815, 0.1247, 0.4920, 0.433, 0.402, 0.444),
        "upper arm": Proportions(0.2751, 0.0255, 0.5754, 0.278, 0.260, 0.148),
        "forearm": Proportions(0.2643, 0.0138, 0.4559, 0.261, 0.257, 0.094),
        "hand": Proportions(0.0780, 0.0056, 0.7474, 0.531, 0.454, 0.335),
        "thigh": Proportions(0.3685, 0.1478, 0.3612, 0.369, 0.364, 0.162),
        "shank": Proportions(0.4386, 0.0481, 0.4352, 0.267, 0.263, 0.092),
        "foot": Proportions(0.2283, 0.0129, 0.4014, 0.299, 0.279, 0.139),
    },
    "M": {
        "head": Proportions(0.2429, 0.0694, 0.5002, 0.303, 0.315, 0.261),
        "upper trunk": Proportions(0.2421, 0.1596, 0.5066, 0.505, 0.320, 0.465),
        "middle trunk": Proportions(0.2155, 0.1633, 0.4502, 0.482, 0.383, 0.468),
        "lower trunk": Proportions(0.1457, 0.1117, 0.6115, 0.615, 0.551, 0.587),
        "upper arm": Proportions(0.2817, 0.0271, 0.5772, 0.285, 0.269, 0.158),
        "forearm": Proportions(0.2689, 0.0162, 0.4574, 0.276, 0.265, 0.121),
        "hand": Proportions(0.0862, 0.0061, 0.7900, 0.628, 0.513, 0.401),
        "thigh": Proportions(0.4222, 0.1416, 0.4095, 0.329, 0.329, 0.149),
        "shank": Proportions(0.4403, 0.0433, 0.4395, 0.251, 0.246, 0.102),
        "foot": Proportions(0.2581, 0.0137, 0.4415, 0.257, 0.245, 0.124),
    },
}
"""End points: head VERT-CERV, upper trunk CERV-XYPH, middle trunk XYPH-OMPH, lower trunk
OMPH-MIDH, upper arm SJC-EJC, forearm EJC-WJC, hand WJC-MET3, thigh HJC-KJC, shank KJC-AJC,
foot HEEL-TTIP (de Leva's names)."""

PAIRED: Final = ("upper arm", "forearm", "hand", "thigh", "shank", "foot")
"""Segments that occur on both sides."""

SHOULDER_HEIGHT: Final[dict[Sex, float]] = {"F": 0.4979, "M": 0.5155}
"""Mean height of the shoulder joints above the hip joints, MIDS-MIDH, m (de Leva, Table 4)."""

STATURE: Final[dict[Sex, float]] = {"F": 1.735, "M": 1.741}
"""Mean stature of de Leva's subjects, m (Table 4)."""

WINTER: Final[dict[str, float]] = {
    "thigh": 0.245,
    "shank": 0.246,
    "foot": 0.152,
    "ankle height": 0.039,
}
"""Segment length as a fraction of stature."""

SHOULDER_HALF_WIDTH: Final = 0.100
"""Shoulder joint to midline as a fraction of stature: 0.170 m in the 1.70 m tall model of
Rajagopal et al. (2016)."""

TOES_MASS: Final = 0.138
"""Fraction of the foot's mass in the toes: 0.2166 of 1.5666 kg in Rajagopal et al. (2016)."""


ADULT_YEARS: Final = 16.0
"""From this age on de Leva's table is used, before it Jensen's regressions."""


def body_proportions(sex: Sex, age_years: float | None = None) -> Mapping[str, Proportions]:
    """The segments of a person of a `sex`: de Leva's, or of a child of `age_years` with Jensen's
    masses, and his centres of mass and radii of gyration where he has the same end points
    (`children.JENSEN_RADII`).

    A child's trunk is divided, and the radii about the other axes follow, as de Leva has them.
    """
    table = DE_LEVA[sex]
    if age_years is None or age_years >= ADULT_YEARS:
        return table
    return child_proportions(table, age_years)


def mass_fractions(sex: Sex, age_years: float | None = None) -> dict[str, float]:
    """Mass of each segment of `body_proportions` for a `sex` and `age_years` as a fraction of body
    mass, rescaled so that the whole body's fractions add up to one (as tabulated: 0.9999 for women,
    1 for men).
    """
    table = body_proportions(sex, age_years)
    total = math.fsum(p.mass * (2 if name in PAIRED else 1) for name, p in table.items())
    return {name: p.mass / total for name, p in table.items()}


def mean_length(sex: Sex, segment: str, stature: float) -> float:
    """de Leva's mean length of a `segment` for this `sex`, m, in proportion to `stature` (m)."""
    return DE_LEVA[sex][segment].length * stature / STATURE[sex]


def inertia_tensor(
    proportions: Proportions,
    mass: float,
    length: float,
    axes: tuple[str, str, str] = ("sagittal", "transverse", "longitudinal"),
) -> NDArray[np.float64]:
    """Inertia about the centre of mass, kg m², shape (3, 3), diagonal in the segment's axes, of a
    segment of `mass` (kg) and `length` (m) with the radii of gyration of `proportions`.

    `axes` names the anatomical axis along x, y and z; the default is for a segment whose long axis
    is vertical.
    """
    radii = np.array([getattr(proportions, axis) for axis in axes])
    # Tabulated radii are fractions of the segment's length: I = m (r l)².
    return np.asarray(np.diag(mass * (radii * length) ** 2))


def shifted_inertia(mass: float, offset: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inertia, kg m², shape (3, 3), that a mass (kg) at `offset` (3,) m from a point adds about
    that point (parallel axis theorem).
    """
    return np.asarray(mass * (offset @ offset * np.eye(3) - np.outer(offset, offset)))


def child_proportions(table: Mapping[str, Any], age_years: float) -> dict[str, Any]:
    """The segments of a child of `age_years` from those of an adult (`table`), both as
    `anthropometry.Proportions`; see `anthropometry.body_proportions`.
    """
    age = min(max(age_years, JENSEN_YEARS[0]), JENSEN_YEARS[1])

    def at(line: tuple[float, float]) -> float:
        return line[0] * age + line[1]

    trunk = math.fsum(each.mass for name, each in table.items() if name.endswith("trunk"))
    child = {}
    for name, each in table.items():
        if name.endswith("trunk"):
            child[name] = replace(each, mass=at(JENSEN_MASS["trunk"]) * each.mass / trunk)
            continue
        child[name] = replace(each, mass=at(JENSEN_MASS[name]))
        if name in JENSEN_RADII:
            centre, radius = map(at, JENSEN_RADII[name])
            # About the centre of mass instead of the proximal end: k² - c².
            transverse = math.sqrt(radius**2 - centre**2)
            child[name] = replace(
                child[name],
                centre_of_mass=centre,
                transverse=transverse,
                sagittal=transverse * each.sagittal / each.transverse,
            )
    return child
