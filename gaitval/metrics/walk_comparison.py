"""Mean curves of a walk beside those of a record or of another walk."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from gaitval._internal.text.display import Saved
from gaitval._internal.text.frames import curve_frame, sourced_frame
from gaitval.arrays import Array
from gaitval.coordinates import split_side
from gaitval.errors import RecordError
from gaitval.gait.record import Origin
from gaitval.metrics.comparison import rms
from gaitval.metrics.origin import is_judged


@dataclass(frozen=True, repr=False)
class Comparison(Saved):
    """Mean curves of a walk and of what it is compared with.

    Attributes
    ----------
    names : of the curves, with the suffix of their side: n.
    units : of each: deg, Nm/kg, % BW.
    walk, other : (n, 101) over each side's gait cycle.
    of, against : who walked, and what that is compared with.
    origins : where the other curve comes from, one a name: "recorded", "mirrored" or "expected";
        None where it is another walk. A difference from what was not recorded is a distance, not
        an error.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    walk: Array
    other: Array
    of: str
    against: str
    origins: tuple[Origin | None, ...] = ()

    def title(self) -> str:
        """What is compared, and what of it is no error because it was not recorded."""
        other = sorted({str(each) for each in self.origins if not is_judged(each)})
        reasons = f"; {', '.join(other)} curves: distance, not an error" if other else ""
        return f"Walk of {self.of} against {self.against}: RMSE{reasons}"

    def overview(self) -> pd.DataFrame:
        """RMSE of each quantity, by side."""
        frame = curve_frame(
            (name, unit, np.array([self.rmse(name)]))
            for name, unit in zip(self.names, self.units, strict=True)
        )
        table = frame.pivot_table("value", ["quantity", "unit"], "side", sort=False)
        found = table.reset_index()[["quantity", "right", "left", "unit"]]
        if all(map(is_judged, self.origins)):
            return found
        sides: dict[str, dict[str, str]] = {}
        for name, origin in zip(self.names, self.origins, strict=True):
            if not is_judged(origin):
                side, quantity = split_side(name)
                sides.setdefault(quantity, {})[side] = str(origin)
        reasons = [sides.get(name, {}) for name in found["quantity"]]
        return found.assign(
            not_recorded=[", ".join(f"{side}: {why}" for side, why in e.items()) for e in reasons]
        )

    def rmse(self, name: str) -> float:
        """Root mean square difference of the curve `name`, in its unit. Raises RecordError."""
        if name not in self.names:
            raise RecordError(f"There is no curve {name!r}. There are {', '.join(self.names)}.")
        i = self.names.index(name)
        return rms(self.walk[i] - self.other[i])

    def to_frame(self) -> pd.DataFrame:
        """Both curves, tidy, with a column `source` that says whose each row is."""
        sources = {f"walk of {self.of}": self.walk, self.against: self.other}
        return sourced_frame(
            {
                source: zip(self.names, self.units, curves, strict=True)
                for source, curves in sources.items()
            }
        )
