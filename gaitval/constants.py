"""Constants of physics and of units, each once."""

from typing import Final

GRAVITY: Final = 9.81
"""m/s², along -z, of every simulation and every inverse dynamics; where a model's weight in N is
asked for, it is its mass times this. (OpenSim's default is 9.80665 m/s².)"""

STANDARD_GRAVITY: Final = 9.80665
"""m/s², standard gravity (3rd CGPM, 1901), of which a kilogram-force is made: a measured force in
N over a person's mass times this is a `GaitRecord`'s body weight. Plates weigh a person where they
stand, and no file says how strong gravity is there.

It is 0.034 % less than `GRAVITY`. A body weight of a record is taken for a body weight of the model
(mass times `GRAVITY`) wherever the two are compared, so a force in N that came from plates is made
0.034 % larger on its way to a simulation: less than a hundredth of what is tolerated of the
vertical force. Both stay as they are, since stored policies and baselines were made with them."""

POUND: Final = 0.45359237
"""kg, international pound (1959)."""
