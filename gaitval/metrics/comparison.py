"""Compare simulated curves over the gait cycle with the recorded ones."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES, Side
from gaitval.gait.record import RECORDED_ANGLES, GaitRecord, LowPass
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.cycles import GaitCycles, cut, filtered
from gaitval.model.rotations import pelvis_angles
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.walker import WalkingTask

JOINT_ANGLES = RECORDED_ANGLES
PELVIS_ANGLES: tuple[str, ...] = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
JOINT_MOMENTS: tuple[str, ...] = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")
FORCES: tuple[str, ...] = ("forward", "medial", "vertical")
"""Components of the ground reaction; positive means the same on both feet."""

_SUFFIX: Mapping[Side, str] = {"right": "r", "left": "l"}


@dataclass(frozen=True)
class Curves:
    """Curves over each side's own gait cycle, by name with `_r` or `_l`.

    The last axis of all arrays has the 101 samples of the cycle; simulated ones are (n, 101) for n
    cycles, recorded ones (101,).

    Attributes
    ----------
    angles : rad, `JOINT_ANGLES` and `PELVIS_ANGLES`, signs of `GaitRecord`.
    moments : Nm/kg, `JOINT_MOMENTS`, positive where they would increase their coordinate.
    forces : body weights, `FORCES`, ground reaction on the foot.
    """

    angles: dict[str, Array]
    moments: dict[str, Array]
    forces: dict[str, Array]


@dataclass(frozen=True)
class CurveError:
    """How a mean simulated curve differs from the recorded one, in the curve's unit.

    Attributes
    ----------
    rmse : root mean square over the 101 samples.
    peak_error : the largest difference, simulated less recorded, with its sign.
    peak_percent : where it is, % of the gait cycle.
    bias : mean difference.
    correlation : Pearson's; None if one of the curves is constant.
    """

    rmse: float
    peak_error: float
    peak_percent: int
    bias: float
    correlation: float | None


def low_pass_of(record: GaitRecord, filter_frequency: float) -> LowPass:
    """The filter for simulated moments and forces: the record's own, so that like is compared with
    like, or `filter_frequency` (Hz) if that is unknown.
    """
    return record.low_pass or LowPass(filter_frequency, filter_frequency)


def curves_of(task: WalkingTask, rollout: Rollout, cycles: GaitCycles) -> Curves:
    """`simulated_curves` of a task's walk, filtered as its record is."""
    frequency = task.configuration.validation.filter_frequency
    filters = low_pass_of(task.record, frequency)
    return simulated_curves(rollout, cycles, mass=task.model.mass, filters=filters)


def simulated_curves(
    rollout: Rollout, cycles: GaitCycles, *, mass: float, filters: LowPass
) -> Curves:
    """Curves of every gait cycle that is kept of a rollout.

    Angles are as simulated; moments and forces are filtered with zero lag before they are cut.

    Parameters
    ----------
    mass : kg, of the model; moments are divided by it, forces by mass x `GRAVITY`.
    filters : see `low_pass_of`.
    """
    moments, forces = filtered(rollout, filters)
    pelvis = pelvis_angles(Rotation.from_rotvec(rollout.positions[:, :3]).as_matrix())
    curves = Curves({}, {}, {})
    for column, side in enumerate(SIDES):
        starts, ends = cycles.starts[side], cycles.ends[side]
        suffix, mirror = _SUFFIX[side], 1.0 if side == "right" else -1.0
        for name in JOINT_ANGLES:
            angle = rollout.positions[:, COORDINATES.index(f"{name}_{suffix}")]
            curves.angles[f"{name}_{suffix}"] = cut(angle, starts, ends)
        for index, name in enumerate(PELVIS_ANGLES):
            sign = 1.0 if name == "pelvis_tilt" else mirror
            curves.angles[f"{name}_{suffix}"] = cut(sign * pelvis[:, index], starts, ends)
        for name in JOINT_MOMENTS:
            moment = moments[:, ACTUATED.index(f"{name}_{suffix}")] / mass
            curves.moments[f"{name}_{suffix}"] = cut(moment, starts, ends)
        # the midline is to the left of the right foot
        medial = np.array([1.0, mirror, 1.0])
        force = cut(forces[:, column] * medial / (mass * GRAVITY), starts, ends)
        for index, name in enumerate(FORCES):
            curves.forces[f"{name}_{suffix}"] = force[..., index]
    return curves


def recorded_curves(record: GaitRecord) -> Curves:
    """The record's curves at the same 101 points, names and signs as `simulated_curves`."""
    phase = np.linspace(0.0, 1.0, SAMPLES)
    curves = Curves({}, {}, {})
    for side in SIDES:
        suffix, mirror = _SUFFIX[side], 1.0 if side == "right" else -1.0
        for name in (*JOINT_ANGLES, *PELVIS_ANGLES):
            curves.angles[f"{name}_{suffix}"] = record.angles[f"{name}_{suffix}"](phase)
        for name in JOINT_MOMENTS:
            curves.moments[f"{name}_{suffix}"] = record.moments[f"{name}_{suffix}"](phase)
        # phase 1 is the next heel strike, the same instant of the cycle as phase 0
        force = record.ground_reaction(side, phase % 1.0) * np.array([1.0, mirror, 1.0])
        for index, name in enumerate(FORCES):
            curves.forces[f"{name}_{suffix}"] = force[:, index]
    return curves


def rms(difference: Array) -> float:
    """Root mean square of the difference of two curves (101,)."""
    return float(np.sqrt(np.mean(difference**2)))


def compare_curve(simulated: Array, recorded: Array) -> CurveError | None:
    """Error of the mean of `simulated` (n, 101) relative to `recorded` (101,); None without
    cycles.
    """
    if len(simulated) == 0:
        return None
    mean = simulated.mean(axis=0)
    difference = mean - recorded
    peak = int(np.argmax(np.abs(difference)))
    varies = np.ptp(mean) > 0 and np.ptp(recorded) > 0
    return CurveError(
        rmse=rms(difference),
        peak_error=float(difference[peak]),
        peak_percent=peak,
        bias=float(difference.mean()),
        correlation=float(np.corrcoef(mean, recorded)[0, 1]) if varies else None,
    )
