"""How the whole body and its support move: centre of mass, loading of the feet, and how far ahead
of the ankle the ground reaction acts.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.gait.record import GaitRecord
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.comparison import rms
from gaitval.metrics.cycles import GaitCycles, cut
from gaitval.metrics.tolerances import Measure, measured
from gaitval.simulation.rollout import Rollout

AXES: Final = ("forward", "left", "up")

LOADING: Final = slice(0, 31)
"""% of a side's cycle in which its vertical force has its first peak."""

FLAT: Final = slice(12, 53)
"""% of a side's cycle in which the ankle's moment is the ground's: the foot is loaded and its own
weight and inertia add less than a millimetre."""


def record_centre_of_mass(record: GaitRecord) -> Array:
    """Path (101, 3) m of the centre of mass over the right cycle of `record`, less its mean and
    steady travel: the acceleration from the ground reaction, integrated twice as a periodic series.
    """
    count = SAMPLES - 1
    phase = np.arange(count) / count
    # each foot's force is stored over its own cycle; both are summed at the same instant
    own = {"right": phase, "left": phase - record.left_phase}
    force = sum(
        (record.ground_reaction(side, np.mod(own[side], 1.0)) for side in SIDES),
        start=np.zeros((count, 3)),
    )
    # scaled to a mean of one body weight, as steady walking needs: force over mass, m/s²
    spectrum = np.fft.rfft(GRAVITY * force / force[:, 2].mean(), axis=0)
    turns = 2.0 * np.pi * np.arange(len(spectrum)) / record.stride_time
    # integrating e^(iwt) twice divides by -w²; gravity and the mean position are the constant term
    spectrum[1:] /= -(turns[1:, None] ** 2)
    spectrum[0] = 0.0
    path = np.fft.irfft(spectrum, count, axis=0)
    return np.concatenate([path, path[:1]])


def walked_centre_of_mass(rollout: Rollout, cycles: GaitCycles) -> Array | None:
    """As `record_centre_of_mass`, mean over the right `cycles` of `rollout`; None without any."""
    if cycles.count("right") == 0:
        return None
    paths = cut(rollout.centre_of_mass, cycles.starts["right"], cycles.ends["right"])
    # the straight line from the start to the end of each cycle; the rest is periodic
    travel = np.linspace(0.0, 1.0, SAMPLES)[:, None] * (paths[:, -1:] - paths[:, :1])
    path = (paths - travel).mean(axis=0)
    return np.asarray(path - path[:-1].mean(axis=0))


def pressure_arm(moment: Array, force: Array) -> Array:
    """How far ahead of the ankle the ground reaction acts on a foot, m, at `FLAT`: the
    plantarflexion moment (-`moment`, (101,) Nm/kg) over the vertical `force` (101,), body weights.
    """
    return np.asarray(-moment[FLAT] / (GRAVITY * force[FLAT]))


def whole_body_measures(
    path: Array | None, expected: Array, walked: Mapping[str, Array], recorded: Mapping[str, Array]
) -> list[Measure]:
    """Centre of mass, mm RMS by axis; first peak of the vertical force, % of body weight, and how
    far ahead of the ankle the ground pushes, mm RMS, by side.

    Parameters
    ----------
    path, expected : (101, 3) m, `walked_centre_of_mass` and `record_centre_of_mass`; without a
        path there is no cycle.
    walked, recorded : (101,) mean curves `vertical_r`, body weights, and `ankle_angle_r`, Nm/kg,
        likewise left.
    """
    measures = [
        measured(
            "centre_of_mass_rmse",
            axis,
            None if path is None else 1e3 * rms(path[:, i] - expected[:, i]),
        )
        for i, axis in enumerate(AXES)
    ]
    for side in SIDES:
        force, ankle = f"vertical_{side[0]}", f"ankle_angle_{side[0]}"
        peak = arm = None
        if force in walked:
            first = walked[force][LOADING].max() - recorded[force][LOADING].max()
            peak = 100.0 * abs(float(first))
            arm = 1e3 * rms(
                pressure_arm(walked[ankle], walked[force])
                - pressure_arm(recorded[ankle], recorded[force])
            )
        measures.append(measured("loading_peak_error", side, peak))
        measures.append(measured("pressure_arm_rmse", side, arm))
    return measures
