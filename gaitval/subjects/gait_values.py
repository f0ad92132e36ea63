"""What a subject takes from the mean curves of a trial."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from scipy.optimize import minimize_scalar

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.mean_curves import (
    ANGLE_TOLERANCE,
    TOLERANCES,
    MeanCurves,
    fit_curve,
    fit_force,
    mean_vertical_force,
    stance_fraction,
)
from gaitval.gait.record import PeriodicCurve
from gaitval.gait.sampling import SAMPLES
from gaitval.subjects.stored_gait import Forces, Gait, StanceFraction

_PHASE: Final = np.arange(SAMPLES) / (SAMPLES - 1)

PELVIS_MISMATCH: Final = float(np.radians(2.0))
"""rad, root-mean-square. Both sides' curves describe one pelvis; the ten agree within 0.16°."""

_STEP: Final = (0.4, 0.6)
"""A step is about half a stride."""
UNEQUAL_STEPS: Final = (0.25, 0.75)
"""Where the left heel strikes if not there: after a stroke one step may last twice the other. No
wider, for the shape of a pelvis repeats every half stride."""
_END: Final = 1e-3


def left_phase(angles: Mapping[str, PeriodicCurve]) -> tuple[float, float]:
    """Phase of the right cycle at left heel strike, from the pelvis' curves in `angles` (rad); and
    the root-mean-square difference of the worst curve at this phase, rad.

    The pelvis is one body, so its tilt over the left cycle is its tilt over the right cycle,
    shifted in time; list and rotation are too, with the sign changed. The phase is the shift with
    the smallest sum of squared differences, each curve less its mean (the means differ by the
    markers' asymmetry, below 0.25°).
    """
    phase = np.arange(200) / 200

    def differences(shift: float) -> Array:
        return np.stack(
            [
                angles[f"{name}_r"](phase)
                - angles[f"{name}_r"].mean
                - sign * (angles[f"{name}_l"](phase - shift) - angles[f"{name}_l"].mean)
                for name, sign in (("pelvis_tilt", 1), ("pelvis_list", -1), ("pelvis_rotation", -1))
            ]
        )

    def least(low: float, high: float) -> float:
        best = minimize_scalar(
            lambda shift: float(np.sum(differences(shift) ** 2)),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 1e-7},
        )
        return float(best.x)

    found = least(*_STEP)
    if not _within(found, _STEP):
        found = least(*UNEQUAL_STEPS)
    mismatch = np.sqrt(np.mean(differences(found) ** 2, axis=1)).max()
    return found, float(mismatch)


def _within(phase: float, bounds: tuple[float, float]) -> bool:
    """Whether a minimum at `phase` is one, and not an end of its `bounds`."""
    return bounds[0] + _END < phase < bounds[1] - _END


def gait_values(curves: MeanCurves, where: str, stance: float | None = None) -> dict[str, Any]:
    """The values of a subject, or of one of its trials, that follow from mean curves; `stance` is
    the stance fraction, where there are no forces to find it from.

    Raises RecordError, which says `where`, if right and left `curves` are of two pelves, or noisy.
    """
    angles = {
        name: fit_curve(name, _PHASE, values, ANGLE_TOLERANCE, where)
        for name, values in curves.angles.items()
    }
    left, mismatch = left_phase({name: curve.periodic() for name, curve in angles.items()})
    if mismatch > PELVIS_MISMATCH:
        raise RecordError(
            f"{where}: the pelvis curves of right and left differ by {np.degrees(mismatch):.1f}° "
            "however they are shifted, which is impossible for one pelvis. Own side up and own "
            "side forward are positive on both sides. Are the sides of some columns exchanged, or "
            "is the sign of one side changed?"
        )
    if not _within(left, UNEQUAL_STEPS):
        raise RecordError(
            f"{where}: the pelvis curves of right and left do not show when the left foot strikes: "
            f"they agree best at {100 * left:.0f} % of the right cycle or beyond. Does every curve "
            "go from heel strike to heel strike of its own side?"
        )
    found: dict[str, Any] = {"left_phase": left}
    if not curves.forces:
        if stance is None:
            raise RecordError(
                f"{where}: there are no forces to show when the feet leave the ground. Give "
                "--stance, the stance fraction of the gait cycle (about 0.62), or forces."
            )
        both = StanceFraction(right=stance, left=stance)
        return found | {"stance_fraction": both, "gait": Gait(samples=SAMPLES, angles=angles)}
    # Rows where the source's own filter leaves an edge are left out of the fit of moments.
    trusted = np.delete(np.arange(SAMPLES), curves.seam)
    ends = {side: stance_fraction(curves.forces[side][:, 2]) for side in SIDES}
    fitted = {side: fit_force(curves.forces[side], ends[side], where) for side in SIDES}
    return found | {
        "mean_vertical_force": mean_vertical_force(curves.forces),
        "stance_fraction": StanceFraction(right=ends["right"], left=ends["left"]),
        "gait": Gait(
            samples=SAMPLES,
            angles=angles,
            moments={
                name: fit_curve(
                    name, _PHASE[trusted], values[trusted], TOLERANCES.moment_tolerance, where
                )
                for name, values in curves.moments.items()
            },
            forces=Forces(right=fitted["right"], left=fitted["left"]),
        ),
    }
