"""Mean curves of one trial, as a file or a simulation has them."""

from collections.abc import Mapping
from dataclasses import dataclass

from gaitval.arrays import Array
from gaitval.coordinates import Side


@dataclass(frozen=True)
class MeanCurves:
    """Mean curves of one trial (101,), in the convention of `GaitRecord`.

    Attributes
    ----------
    angles : rad.
    moments : Nm/kg; empty if none were given.
    forces : body weights, (101, 3) of each side; empty likewise.
    seam : rows whose moments are not to be trusted.
    left_out : names of the columns that are no curves.
    """

    angles: Mapping[str, Array]
    moments: Mapping[str, Array]
    forces: Mapping[Side, Array]
    seam: tuple[int, ...] = ()
    left_out: tuple[str, ...] = ()

    def in_words(self) -> str:
        """What was read, and what was left out."""
        sides = sorted({name[-1] for name in self.angles}, reverse=True)
        both = " and ".join({"r": "right", "l": "left"}[side] for side in sides)
        kinds = [f"{len(self.angles)} angles"]
        kinds.append(f"{len(self.moments)} moments (Nm/kg)" if self.moments else "no moments")
        forces = 3 * len(self.forces)
        kinds.append(f"{forces} forces (body weights)" if forces else "no forces")
        shown = [*self.left_out[:6], *(["…"] if len(self.left_out) > 6 else [])]
        rest = f"; left out: {', '.join(shown)}" if shown else ""
        return f"{both}, {', '.join(kinds)}{rest}"
