"""How far the joints of a measured person go: farther than the walker's, `coordinates.RANGES`."""

from typing import Final

from gaitval.coordinates import RANGES

MEASURED_RANGES: Final[dict[str, tuple[float, float]]] = RANGES | {
    name: (-0.44, RANGES[name][1]) for name in ("knee_angle_r", "knee_angle_l")
}
"""Ranges within which markers are followed, rad: a knee may hyperextend by 25 degrees. Hypermobile
people's do by more than 10 (Beighton et al. 1973, Ann Rheum Dis 32:413), and those of a child of
McGill by 15 in standing; the rest is for paresis and for landmarks, which move the zero."""
