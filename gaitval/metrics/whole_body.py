"""How the whole body moves: the path of its centre of mass."""

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
from gaitval.model.ground import LEVEL, Ground
from gaitval.walk.simulation.rollout import Rollout

AXES: Final = ("forward", "left", "up")


def record_centre_of_mass(record: GaitRecord, ground: Ground = LEVEL) -> Array:
    """Path (101, 3) m of the centre of mass over the right cycle of `record`, in the axes of its
    `ground`, less its mean and steady travel: the acceleration from the ground reaction, integrated
    twice as a periodic series.
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
    spectrum = np.fft.rfft(GRAVITY * force / (force @ ground.up).mean(), axis=0)
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


def centre_of_mass_measures(path: Array | None, expected: Array) -> list[Measure]:
    """Distance of the centre of mass from where it was, mm RMS by axis: of the `path` (101, 3) m of
    `walked_centre_of_mass`, None without a cycle, from `expected` of `record_centre_of_mass`.
    """
    away = [None] * 3 if path is None else [1e3 * rms(each) for each in (path - expected).T]
    return [measured("centre_of_mass_rmse", *each) for each in zip(AXES, away, strict=True)]
