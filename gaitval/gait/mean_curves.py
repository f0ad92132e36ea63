"""Turn mean curves of a gait (101 rows, 0 to 100 % of the cycle) into a subject's periodic curves.

Tolerances are in the curve's unit. A curve that even `HARMONICS_CAP` harmonics miss by more than
`TOLERANCES.refused` tolerances is refused as noisy; what they miss by is stored with the curve.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError
from gaitval.gait.record import FittedCurve, Force, fit_periodic

ANGLE_TOLERANCE: Final = float(np.radians(0.3))
"""rad. Small compared with the 5° above which a change between sessions is detectable (Wilken
2012)."""


@dataclass(frozen=True)
class CurveTolerances:
    """How closely a mean curve must be represented."""

    moment_tolerance: float = 0.02
    """Nm/kg, about 1 % of the largest moment."""
    force_tolerance: float = 0.01
    """Body weights."""
    refused: float = 3.0
    """Tolerances: some mean forces jump at toe-off by a little more than one, and are good
    curves."""
    stance_threshold: float = 0.03
    """Body weights of vertical force at which stance ends: 20 N, the usual threshold, at 68 kg."""


TOLERANCES: Final = CurveTolerances()


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
    warnings : a sentence on each thing that may be wrong.
    notes : in what the file differed from the table that is asked for.
    """

    angles: Mapping[str, Array]
    moments: Mapping[str, Array]
    forces: Mapping[Side, Array]
    seam: tuple[int, ...] = ()
    left_out: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

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
        return "; ".join((f"{both}, {', '.join(kinds)}{rest}", *self.notes))


def stance_fraction(vertical: Array) -> float:
    """Fraction of the cycle until the `vertical` force (101,), body weights and zero in swing,
    falls to `TOLERANCES.stance_threshold` after its peak, linear between rows; a foot that drags in
    swing may load the plate once more.
    """
    # The rows before the next heel strike belong to it, so they are not searched.
    # The force falls through the threshold between this row and the next, on a straight line.
    peak = int(np.argmax(vertical[:90]))
    under = np.flatnonzero(vertical[peak:90] < TOLERANCES.stance_threshold)
    last = peak + int(under[0]) - 1 if len(under) else 89
    above, below = vertical[last], vertical[last + 1]
    return float(last + (above - TOLERANCES.stance_threshold) / (above - below)) / 100


def mean_vertical_force(forces: Mapping[Side, Array]) -> float:
    """Mean of right + left vertical force over the gait cycle, body weights; 1 in every periodic
    motion. `forces` of each foot are (101, 3) body weights, forward, left, up.
    """
    # Row 100 is row 0 of the next cycle; without it every instant counts once.
    return float(sum(forces[side][:100, 2].mean() for side in SIDES))


def fit_curve(
    name: str, phase: Array, values: Array, tolerance: float, path: Path | str
) -> FittedCurve:
    """Fit one mean curve of `values` (n,) at `phase` (n,) in 0…1 of the gait cycle, with the fewest
    harmonics that are within `tolerance`, in their unit; see `fit_periodic`. `name` and `path` are
    for the message of the RecordError if `HARMONICS_CAP` harmonics leave more than
    `TOLERANCES.refused` tolerances.
    """
    curve, residual = fit_periodic(phase, values, tolerance)
    if residual > TOLERANCES.refused * tolerance:
        raise RecordError(
            f"{path}: with {len(curve.cosine)} harmonics the curve of {name} still has an error "
            f"of {residual:.3g} (allowed {TOLERANCES.refused * tolerance:.3g}): it is noisy or "
            "jumps. Give "
            "more cycles or another trial, or filter it."
        )
    return FittedCurve.fitted((curve, residual))


def fit_force(force: Array, stance: float, path: Path | str) -> Force:
    """Fit one foot's ground reaction, `force` (101, 3) body weights, forward, left, up, over its
    `stance` (`stance_fraction`). Raises RecordError as `fit_curve`, which names `path`.

    Swing is not fitted: a series that also had to be zero there would need over 40 harmonics and
    would ring at heel strike and toe-off.
    """
    if force[100, 2] == 0.0 < force[0, 2]:
        # over ground the next landing is beside the plates; it is the same instant of the cycle
        force = np.vstack([force[:100], force[:1]])
    elif (
        np.abs(force[100] - force[0]).max() > 2.0 * TOLERANCES.refused * TOLERANCES.force_tolerance
    ):
        # two strikes that were timed samples apart: no closed curve is near both
        ends = 0.5 * (force[:1] + force[100:])
        force = np.vstack([ends, force[1:100], ends])
    # Stance, and the strike that ends the cycle: the same instant as row 0, it closes the curve.
    rows = np.append(np.arange(int(stance * 100) + 1), 100)
    forward, left, up = (
        fit_curve(
            f"ground reaction {axis}", rows / 100, force[rows, i], TOLERANCES.force_tolerance, path
        )
        for i, axis in enumerate(("forward", "left", "up"))
    )
    return Force(forward=forward, left=left, up=up)
