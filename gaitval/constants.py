"""Physical constants and units, each defined once."""

from typing import Final

GRAVITY: Final = 9.81
"""m/s², along -z, in every simulation and all inverse dynamics; a model's weight in N is its mass
times this. (OpenSim's default is 9.80665 m/s².)"""

STANDARD_GRAVITY: Final = 9.80665
"""m/s², standard gravity (3rd CGPM, 1901), which defines the kilogram-force: a measured force in N
divided by (a person's mass times this) is in a `GaitRecord`'s body weights. Plates weigh a person
under local gravity, which no file states.

It is 0.034 % less than `GRAVITY`. Wherever record and model are compared, a body weight of the
record is taken as a body weight of the model (mass times `GRAVITY`), so a force in N from plates
becomes 0.034 % larger on its way to a simulation: less than a hundredth of the tolerance on the
vertical force. Both stay as they are, because stored policies and baselines were made with them."""

POUND: Final = 0.45359237
"""kg, international pound (1959)."""

LARGEST_SIZE: Final = 1e12
"""Of a number that is read, in whatever unit: nothing that is measured or walks is larger."""
