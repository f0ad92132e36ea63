"""Masses and proportions of a child's segments (Jensen 1986), in the place of an adult's."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

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
