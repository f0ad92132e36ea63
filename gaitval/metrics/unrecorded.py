"""What no record tells of a walk, and must be humanly plausible all the same: arms and ringing.

A walker is free to use what is not compared with a record. These measures show where it does.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, ARM, LEG, SIDES
from gaitval.metrics.cycles import GaitCycles, step_of
from gaitval.metrics.tolerances import Measure
from gaitval.simulation.rollout import Rollout

RINGING_HZ = (12.0, 25.0)
"""Above what walking itself puts into the ground reaction (99 % of it is below 10 to 15 Hz:
Antonsson and Mann 1985, J Biomech 18:39), below the impact of the heel."""

_SHOULDER = ("arm_flex", "arm_add", "arm_rot")


@dataclass(frozen=True)
class Unrecorded:
    """Of the compared gait cycles; None where there are none.

    Attributes
    ----------
    shoulder_rms, shoulder_peak : Nm, by side: size of the moment (3,) at the shoulder.
    arm_work : positive work of both arms' joints over that of both legs', %.
    ringing : RMS of both feet's vertical force together in the band `RINGING_HZ`, unfiltered
        otherwise, % of body weight.
    """

    shoulder_rms: dict[str, float | None]
    shoulder_peak: dict[str, float | None]
    arm_work: float | None
    ringing: float | None

    def measures(self) -> list[Measure]:
        """The values as they are judged."""
        return [
            *(Measure("shoulder_moment_rms", side, self.shoulder_rms[side]) for side in SIDES),
            *(Measure("shoulder_moment_peak", side, self.shoulder_peak[side]) for side in SIDES),
            Measure("arm_work_share", "walk", self.arm_work),
            Measure("force_ringing", "walk", self.ringing),
        ]


NOTHING: Final = Unrecorded(dict.fromkeys(SIDES), dict.fromkeys(SIDES), None, None)
"""Without a gait cycle."""


def unrecorded(rollout: Rollout, cycles: GaitCycles, *, mass: float) -> Unrecorded:
    """Arms and ringing of the compared cycles of a walk.

    Parameters
    ----------
    mass : kg, of the model.
    """
    if cycles.count("right") == 0:
        return NOTHING
    rows = cycles.rows()
    moment = {
        side: np.linalg.norm(rollout.moments[rows][:, _columns(_SHOULDER, side)], axis=1)
        for side in SIDES
    }
    arms, legs = (
        sum(_positive_work(rollout, rows, _columns(names, side)) for side in SIDES)
        for names in (ARM, LEG)
    )
    return Unrecorded(
        shoulder_rms={side: float(np.sqrt(np.mean(each**2))) for side, each in moment.items()},
        shoulder_peak={side: float(each.max()) for side, each in moment.items()},
        arm_work=100.0 * arms / legs if legs > 0.0 else None,
        ringing=100.0 * force_ringing(rollout, rows) / (mass * GRAVITY),
    )


def _columns(names: tuple[str, ...], side: str) -> list[int]:
    return [ACTUATED.index(f"{name}_{side[0]}") for name in names]


def _positive_work(rollout: Rollout, rows: slice, columns: list[int]) -> float:
    """J, of joints' positive power over some rows."""
    rates = rollout.velocities[rows, 6:][:, columns]
    power = rollout.moments[rows][:, columns] * rates
    return float(np.clip(power, 0.0, None).sum() * step_of(rollout))


def force_ringing(rollout: Rollout, rows: slice) -> float:
    """RMS, N, of the vertical ground reaction of both feet together in the band `RINGING_HZ`.

    By Parseval's theorem, from the spectrum of whole gait cycles, so that no filter has a say.
    """
    both: Array = rollout.ground_reaction[rows, :, 2].sum(axis=1)
    spectrum = np.abs(np.fft.rfft(both - both.mean())) / len(both)
    frequency = np.fft.rfftfreq(len(both), step_of(rollout))
    band = (frequency >= RINGING_HZ[0]) & (frequency <= RINGING_HZ[1])
    return float(np.sqrt(2.0 * np.sum(spectrum[band] ** 2)))
