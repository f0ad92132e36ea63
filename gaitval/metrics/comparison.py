"""Compare simulated curves over the gait cycle with the recorded ones."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES
from gaitval.gait.cycle_curves import FORCES, JOINT_ANGLES, JOINT_MOMENTS, PELVIS_ANGLES, Curves
from gaitval.gait.record import GaitRecord, LowPass
from gaitval.metrics.curve_results import CurveError, HipCentre, HipCentres
from gaitval.metrics.cycles import GaitCycles, cut, filtered
from gaitval.metrics.typed import number
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.rotations import foot_angles, pelvis_angles
from gaitval.model.tree import segment_frames
from gaitval.walk.reference.hip_moments import HIP_SIGNS, about_model, about_record
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.walker import WalkingTask


def rmse_of(error: CurveError | None) -> float | None:
    """The RMSE of `error`, in the unit of its curve; None where there was no cycle."""
    return None if error is None else error.rmse


def low_pass_of(record: GaitRecord, filter_frequency: float) -> LowPass:
    """The filter for simulated moments and forces: that of `record`, so that like is compared with
    like, or `filter_frequency` (Hz) if that is unknown.
    """
    return record.low_pass or LowPass(filter_frequency, filter_frequency)


def curves_of(task: WalkingTask, rollout: Rollout, cycles: GaitCycles) -> Curves:
    """`simulated_curves` of the `cycles` of a `rollout`, filtered as the record of `task` is."""
    frequency = task.configuration.validation.filter_frequency
    filters = low_pass_of(task.record, frequency)
    return simulated_curves(rollout, cycles, mass=task.model.mass, filters=filters)


def simulated_curves(
    rollout: Rollout, cycles: GaitCycles, *, mass: float, filters: LowPass
) -> Curves:
    """Curves of each of the `cycles` of a `rollout`.

    Angles are as simulated; moments and forces are filtered with zero lag (`filters`, see
    `low_pass_of`) before they are cut, and divided by `mass` (kg, of the model) and mass x
    `GRAVITY`. Moments of the hips are about the record's hip centres, as the record's are.
    """
    columns = [ACTUATED.index(f"{name}_{side[0]}") for side in SIDES for name in JOINT_MOMENTS]
    moments, forces = filtered(rollout, filters, columns)
    pelvis = pelvis_angles(Rotation.from_rotvec(rollout.positions[:, :3]).as_matrix())
    curves = Curves({}, {}, {})
    for column, side in enumerate(SIDES):
        starts, ends = cycles.starts[side], cycles.ends[side]
        suffix, mirror = side[0], 1.0 if side == "right" else -1.0
        for name in JOINT_ANGLES:
            angle = rollout.positions[:, COORDINATES.index(f"{name}_{suffix}")]
            curves.angles[f"{name}_{suffix}"] = cut(angle, starts, ends)
        for index, name in enumerate(PELVIS_ANGLES):
            # list and rotation change sign with the side, so that a symmetric gait has equal curves
            sign = 1.0 if name == "pelvis_tilt" else mirror
            curves.angles[f"{name}_{suffix}"] = cut(sign * pelvis[:, index], starts, ends)
        for name in JOINT_MOMENTS:
            moment = moments[:, columns.index(ACTUATED.index(f"{name}_{suffix}"))]
            vertical = forces[:, column, 2]
            moment = about_record(moment, name, rollout.hip_centre[column], vertical) / mass
            curves.moments[f"{name}_{suffix}"] = cut(moment, starts, ends)
        # the midline is to the left of the right foot
        medial = np.array([1.0, mirror, 1.0])
        force = cut(forces[:, column] * medial / (mass * GRAVITY), starts, ends)
        for index, name in enumerate(FORCES):
            curves.forces[f"{name}_{suffix}"] = force[..., index]
    return curves


def foot_progression(rollout: Rollout, cycles: GaitCycles, model: BodyModel) -> dict[str, Array]:
    """`foot_angles`' progression (n, 101) rad of both feet of `model`: `rollout`'s `cycles`."""
    found = {}
    frames = segment_frames(model, rollout.positions)[:, :, :3, :3]
    for side in SIDES:
        angle = foot_angles(frames[:, SEGMENTS.index(f"foot_{side[0]}")], side)[:, 2]
        found[f"foot_progression_{side[0]}"] = cut(angle, cycles.starts[side], cycles.ends[side])
    return found


def mean_of_all(values: Iterable[float | None]) -> float | None:
    """The mean of `values`; None without any, or where one of them is not known: a mean over fewer
    could not be compared with another of all.
    """
    found = list(values)
    known = [each for each in found if each is not None]
    return float(np.mean(known)) if known and len(known) == len(found) else None


def rms(difference: Array) -> float:
    """Root mean square of the difference of two curves (101,)."""
    return float(np.sqrt(np.mean(difference**2)))


def compare_curve(simulated: Array, recorded: Array) -> CurveError | None:
    """Error of the mean of `simulated` (n, 101) from `recorded` (101,); None without cycles."""
    if len(simulated) == 0:
        return None
    mean = simulated.mean(axis=0)
    difference = mean - recorded
    peak = int(np.argmax(np.abs(difference)))
    # the correlation with a constant is 0/0
    varies = np.ptp(mean) > 0 and np.ptp(recorded) > 0
    return CurveError(
        rmse=number(rms(difference)),
        peak_error=number(difference[peak]),
        peak_percent=peak,
        bias=number(difference.mean()),
        correlation=number(np.corrcoef(mean, recorded)[0, 1]) if varies else None,
    )


def hip_centres(places: Array, walked: Curves, recorded: Curves) -> HipCentres | None:
    """Where the record's hip centres are (`places` (2, 2) m, `ReferenceMotion.hip_centre`), and the
    errors of the moments about the model's own; None if they are the model's own, or a side has no
    complete gait cycle. `walked` and `recorded` are mean curves (101,): moments Nm/kg, those walked
    about `places`; forces body weights.
    """
    names = [f"{name}_{side[0]}" for side in SIDES for name in HIP_SIGNS]
    if not np.any(places) or any(name not in walked.moments for name in names):
        return None
    own, found = about_model(walked, places).moments, {}
    for (forward, outward), side in zip(places, SIDES, strict=True):
        errors = {
            name: rms(own[f"{name}_{side[0]}"] - recorded.moments[f"{name}_{side[0]}"])
            for name in HIP_SIGNS
        }
        found[side] = HipCentre(
            forward=float(forward), outward=float(outward), rmse_about_model=errors
        )
    return HipCentres(right=found["right"], left=found["left"])


def multiple_correlation(curves: Sequence[Array]) -> float | None:
    """Coefficient of multiple correlation of repeated `curves` (101,); None where it is not
    defined.

    Kadaba et al. 1989, J Orthop Res 7:849, within a day: 1 less the variance about the mean curve
    over the variance about the grand mean, and its square root.
    """
    values = np.array(curves)
    count, samples = values.shape
    # over the degrees of freedom: a mean per point is estimated, and then one grand mean
    about_curve = np.sum((values - values.mean(axis=0)) ** 2) / (samples * (count - 1))
    about_all = np.sum((values - values.mean()) ** 2) / (samples * count - 1)
    if about_all == 0.0 or about_curve > about_all:
        return None
    return float(np.sqrt(1.0 - about_curve / about_all))
