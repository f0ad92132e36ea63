"""Measures without a record that must still be humanly plausible: arms, trunk, step width, ringing.

A walker is free to use what is not compared with a record. These measures show where it does.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, ARM, LEG, LUMBAR, SIDES
from gaitval.metrics.cycles import GaitCycles, cut, step_of
from gaitval.metrics.tolerances import Measure, measured
from gaitval.model.ground import LEVEL, Ground
from gaitval.model.rotations import pelvis_angles
from gaitval.walk.simulation.rollout import Rollout

RINGING_HZ = (12.0, 25.0)
"""Above what walking itself puts into the ground reaction (99 % of it is below 10 to 15 Hz:
Antonsson and Mann 1985, J Biomech 18:39), below the impact of the heel."""

_SHOULDER = ("arm_flex", "arm_add", "arm_rot")

_LUMBAR = [ACTUATED.index(name) for name in LUMBAR]

TRUNK: Final[Mapping[str, tuple[float, float]]] = {
    "tilt": (4.0, 1.8),
    "lean": (3.3, 1.4),
    "turn": (6.9, 2.9),
    "mean tilt": (0.0, 3.6),
}
"""Degrees: range of the trunk's angles in the room over a gait cycle, mean and standard deviation
of 20 healthy adults; and of their mean forward tilt from upright (Chung et al. 2010, J Neuroeng
Rehabil 7:9, table 2)."""

STEP_WIDTH: Final = (0.140, 0.031)
"""Leg lengths: mean and standard deviation of healthy adults at their own speed, which changes it
little (J Neuroeng Rehabil 2012;9:69, table 1)."""


UNRECORDED: Final = (
    *(("shoulder_moment_rms", side) for side in SIDES),
    *(("shoulder_moment_peak", side) for side in SIDES),
    ("arm_work_share", "walk"),
    ("force_ringing", "walk"),
    *(("trunk_motion", name) for name in TRUNK),
    ("lumbar_moment_peak", "walk"),
)
"""Measure and target of what `unrecorded` gives: the size (3,) of the moment at each shoulder; the
positive work of both arms' joints over that of both legs'; RMS of both feet's vertical force
together in the band `RINGING_HZ`, unfiltered otherwise; standard deviations between people by which
the range of the trunk's tilt, lean and turn is above their mean (0: not above), and its mean tilt
is away from upright; and the largest size of the moment (3,) at the lumbar joint."""


def unrecorded(
    rollout: Rollout, cycles: GaitCycles, *, mass: float, ground: Ground = LEVEL
) -> list[Measure]:
    """`UNRECORDED` of the compared `cycles` of `rollout`, by a model of `mass` kg on a `ground`;
    without values if there are none.
    """
    if cycles.count("right") == 0:
        return [measured(*each, None) for each in UNRECORDED]
    rows = cycles.rows()
    shoulders = [
        np.linalg.norm(rollout.moments[rows][:, _columns(_SHOULDER, side)], axis=1)
        for side in SIDES
    ]
    arms, legs = (
        sum(_positive_work(rollout, rows, _columns(names, side)) for side in SIDES)
        for names in (ARM, LEG)
    )
    values = (
        *(float(np.sqrt(np.mean(each**2))) for each in shoulders),
        *(float(each.max()) for each in shoulders),
        100.0 * arms / legs if legs > 0.0 else None,
        100.0 * force_ringing(rollout, rows) / (mass * GRAVITY),
        *_trunk(rollout, cycles, ground),
        float(np.linalg.norm(rollout.moments[rows][:, _LUMBAR], axis=1).max() / mass),
    )
    return [measured(*each, value) for each, value in zip(UNRECORDED, values, strict=True)]


def trunk_angles(positions: Array, ground: Ground = LEVEL) -> Array:
    """Forward tilt, lean to the left and turn to the left (T, 3) deg of the trunk in a room whose z
    is up, from the coordinates `positions` (T, 31) on a `ground`.
    """
    pelvis = Rotation.from_rotvec(positions[:, :3])
    # The lumbar joint turns about -y, x and z of the pelvis in this order.
    lumbar = Rotation.from_euler("YXZ", positions[:, 6:][:, _LUMBAR] * np.array([-1.0, 1.0, 1.0]))
    # List is positive where the right side is up, so the trunk leans to the left.
    return np.asarray(
        np.rad2deg(pelvis_angles(ground.from_level.T @ (pelvis * lumbar).as_matrix()))
    )


def _trunk(rollout: Rollout, cycles: GaitCycles, ground: Ground) -> list[float]:
    """Of each of `TRUNK`."""
    angles = cut(
        trunk_angles(rollout.positions, ground), cycles.starts["right"], cycles.ends["right"]
    ).mean(axis=0)
    (*ranges, (upright, between)) = TRUNK.values()
    return [
        *(
            max(0.0, float((np.ptp(each) - mean) / sd))
            for each, (mean, sd) in zip(angles.T, ranges, strict=True)
        ),
        abs(float(angles[:, 0].mean()) - upright) / between,
    ]


def step_width_measure(
    width: float | None, leg_length: float, recorded: float | None = None
) -> Measure:
    """How far the step `width` is off: from the person's own where it was `recorded`, else, in SDs
    between people, from their mean at `leg_length`. All in m.
    """
    if recorded is not None:
        away = None if width is None else 100.0 * abs(width - recorded)
        return measured("step_width_error", "walk", away)
    mean, sd = STEP_WIDTH
    value = None if width is None else abs(width / leg_length - mean) / sd
    return measured("step_width", "walk", value)


def _columns(names: tuple[str, ...], side: str) -> list[int]:
    return [ACTUATED.index(f"{name}_{side[0]}") for name in names]


def _positive_work(rollout: Rollout, rows: slice, columns: list[int]) -> float:
    """J, of joints' positive power over some rows."""
    # the first six coordinates are those of the free pelvis, which has no moment
    rates = rollout.velocities[rows, 6:][:, columns]
    power = rollout.moments[rows][:, columns] * rates
    return float(np.clip(power, 0.0, None).sum() * step_of(rollout))


def force_ringing(rollout: Rollout, rows: slice) -> float:
    """RMS, N, of the vertical ground reaction of both feet in `rows` of `rollout` in the band
    `RINGING_HZ`: by Parseval's theorem from the spectrum of whole gait cycles, so without a filter.
    """
    both: Array = rollout.ground_reaction[rows, :, 2].sum(axis=1)
    spectrum = np.abs(np.fft.rfft(both - both.mean())) / len(both)
    frequency = np.fft.rfftfreq(len(both), step_of(rollout))
    band = (frequency >= RINGING_HZ[0]) & (frequency <= RINGING_HZ[1])
    # rfft keeps positive frequencies only; the negative ones have the same power
    return float(np.sqrt(2.0 * np.sum(spectrum[band] ** 2)))
