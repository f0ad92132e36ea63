"""Constants of physics and of units, each once."""

from typing import Final

GRAVITY = 9.81
"""m/s², along -z, of every simulation and every inverse dynamics."""

STANDARD_GRAVITY: Final = 9.80665
"""m/s², standard gravity (3rd CGPM, 1901), of which a kilogram-force is made. Records of forces in
body weights are in it."""

POUND: Final = 0.45359237
"""kg, international pound (1959)."""
