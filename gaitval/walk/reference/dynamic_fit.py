"""A reference motion that obeys Newton's laws and stays close to everything recorded.

A motion with exactly the recorded angles needs other forces and moments than the recorded ones: the
model is not the body, the mean recorded vertical force is not one body weight, and a force plate
that is two centimetres out of place changes the moments of its leg by 0.2 Nm/kg (`plates`). So a
policy has to choose what to follow. This fit finds the best compromise beforehand.
Of the periodic motions without a residual force on the pelvis it is the one whose deviations from
the recorded angles, moments and ground reaction, each divided by the required accuracy
(`Accuracy`), have the smallest sum of squares. The walk is always compared with the record, never
with the fit.

The unknowns are harmonics of all 31 coordinates, and nothing else. The ground's forces follow from
the motion by the contact law of the simulation (`walking_laws`), so the motion is one that the
simulated body walks without help: started on it, with its moments fed forward and no policy, the
body carries itself through the next step with forces within about 1 % of body weight of the fit's
(tested). A millimetre of the sole is a sixth of the body weight, so forces may not be unknowns of
their own beside the motion: with references made in that way, earlier walkers oscillated.

Gauss-Newton solves it, first with little weight on Newton's laws, because the recorded angles alone
press the feet centimetres into the ground.

It is long because one problem is set up, linearised and solved here, from one set of unknowns.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from gaitval._internal.numba.one_thread import one_thread
from gaitval.arrays import Array, Flags
from gaitval.configuration import ContactSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, LUMBAR, SIDES
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.plate_correction import SHIFT_SIGNS
from gaitval.gait.record import GaitRecord
from gaitval.kinetics.inverse.motion_rates import cardan_coordinates, root_states
from gaitval.model.body import BodyModel
from gaitval.model.parameters import NOMINAL_FRICTION
from gaitval.model.tree import ROOT_DOFS, Tree, tree_arrays
from gaitval.walk.contact.law import ContactLaw, contact_law
from gaitval.walk.reference.harmonic_square import harmonic_square
from gaitval.walk.reference.hip_moments import HIP_SIGNS
from gaitval.walk.reference.motion import (
    FEED_FORWARD,
    MOTION,
    ReferenceMotion,
    build_reference,
    moved,
    side_phase,
    spectral_rate,
)
from gaitval.walk.reference.steady_trunk import SHAKING, steady_amplitude
from gaitval.walk.reference.walking_laws import (
    FOOT,
    FOOT_NUMBERS,
    INPUTS,
    OUTPUTS,
    POWER,
    TRUNK,
    walking_laws,
)


@dataclass(frozen=True)
class DynamicFitSettings:
    """How a reference is made to obey the laws of motion."""

    instants: int = 160
    """Instants of the cycle at which Newton's equations must hold, 6 to 8 ms apart."""
    smooth_harmonic: int = 12
    """Up to this harmonic a coordinate may change by its whole accuracy, beyond it by as much as
    gives the same acceleration."""
    roughness: float = 2.0
    most_steps: int = 40
    eases: tuple[float, float, float] = (0.1, 0.3, 1.0)
    """Weights of Newton's laws on the pelvis, one after the other."""
    easy_transition: float = 0.2
    """m/s, of `ContactSettings.transition_velocity` at first."""
    smallest_gain: float = 3e-3
    """Relative decrease of the sum of squares at which the Gauss-Newton steps end ..."""
    near_gain: float = 1e-3
    """... and of those that begin near the end, which are short."""
    most_damping: float = 1e4
    least_load: float = 0.3
    """BW that a foot carries from where on it should not twist: with less it is landing or
    leaving."""
    least_power: float = 0.03
    """W/kg, root mean square of an ankle's power below which its share says nothing: that of people
    who walk on their heels and do not push at all (Bovi et al. 2011, Gait Posture 33:6,
    supplement)."""
    toe_moment: float = 0.13
    toe_moment_sd: float = 0.04
    """Nm/kg, largest moment at the metatarsophalangeal joints in 22 adults walking barefoot (Kim et
    al. 2012, Int J Precis Eng Manuf 13:1481, abstract). Nothing that is compared with a record
    depends on it: walkers of fits without it braked with their toes, by up to 0.44 Nm/kg, what
    their ankles pushed too much, or had toes that took up nothing."""
    swing_clearance: float = 0.012
    """m below the lowest point of a swinging sole; people have about 13 mm (Winter 1992, from
    memory), and a policy that is given less lifts its feet more than the reference, which delays
    heel strike."""
    common: int = 7
    """Unknowns that are the same at all instants, see `Solution`; those of the hip centres."""
    no_shift: float = 1e-7
    """m, standard deviation of a shift that is not to be found."""
    varied_step: float = 1e-3
    """Step of the central differences by the numbers that the body depends on, in their units."""
    stance_edge: float = 0.04
    """Fraction of the cycle before and after swing in which the foot may still be near the
    ground."""


DYNAMIC_FIT: Final = DynamicFitSettings()


class LawAccuracy(NamedTuple):
    """How well the laws of motion hold."""

    residual: float = 0.002
    """BW and BW m; residual force and moment on the pelvis, which nothing exerts."""
    clearance: float = 0.002
    """m, by which the swinging foot misses `DYNAMIC_FIT.swing_clearance`."""


class ConventionAccuracy(NamedTuple):
    """Departures from its convention of what was not recorded, rad, m."""

    subtalar: float = np.deg2rad(3.5)
    toes: float = np.deg2rad(10.0)
    flat_toes: float = np.deg2rad(5.0)
    """Of the toes while the foot stands flat, when they lie on the ground: what the spheres sink in
    under body weight, 6 mm, over the length of the toes. Held by no more than when they swing, toes
    lifted by 20 degrees more, which turned the ball that belongs to them against the foot."""
    arms: float = np.deg2rad(0.3)
    """Arms may not do what trunk and legs should: with 8 degrees their moments were ten times as
    large as in people, and the forces no better; with 1 degree shoulders still peaked at 19 Nm."""
    trunk: float = np.deg2rad(1.5)
    """Of the trunk's rotation from its mean lean; in walking people it tilts through 4, leans
    through 3 and turns through 7 degrees (Chung et al. 2010, J Neuroeng Rehabil 7:9, table 2)."""
    lean: float = np.deg2rad(3.6)
    """Mean forward lean of the trunk: the standard deviation between people (ibid.)."""
    lumbar: float = np.deg2rad(10.0)
    """Of each harmonic; the trunk's rotation is what limits the lumbar joint."""
    translation: float = 0.03
    toe_moment: float = DYNAMIC_FIT.toe_moment_sd
    """Nm/kg, of the moment at the toes from what is expected of people (`_toe_moment`)."""
    toe_excess: float = 0.015
    """Nm/kg, of what of it is beyond the mean and a standard deviation of people, which costs as
    well."""
    subtalar_moment: float = 0.1
    rotation_moment: float = 0.3
    """Nm/kg, of the moments at the subtalar joints and about the thighs' axes from none."""
    steady_moment: float = 0.05
    """Nm/kg, of each harmonic from `steady_trunk.FROM_HZ` on of what bends the upper body, and of
    the same turns of pelvis and arms. Fits of a quarter to twice of it follow the record alike."""


class Accuracy(NamedTuple):
    """Departures that weigh the same."""

    record: RecordAccuracy = RecordAccuracy()
    laws: LawAccuracy = LawAccuracy()
    convention: ConventionAccuracy = ConventionAccuracy()
    mean_lean: float = 0.0
    """Mean forward lean of the trunk from which `convention.lean` is counted, rad."""


INFERENCE = Accuracy(
    record=RecordAccuracy(
        sagittal=np.deg2rad(1.2),
        frontal=np.deg2rad(1.0),
        rotation=np.deg2rad(1.0),
        pelvis=np.deg2rad(1.5),
        moment=0.06,
        adduction_moment=0.15,
        forward_force=0.010,
        sideways_force=0.0075,
        vertical_force=0.010,
        twist=np.inf,
        hip_centre=0.0,
        ankle_power=np.inf,
    ),
    convention=ConventionAccuracy(
        subtalar=np.deg2rad(3.0),
        toes=np.deg2rad(5.0),
        arms=np.deg2rad(1.0),
        toe_moment=np.inf,
        toe_excess=np.inf,
        subtalar_moment=np.inf,
        rotation_moment=np.inf,
        steady_moment=np.inf,
    ),
)
"""What the identification, the search for shifted plates and virtual people were calibrated with:
how well these things are known, not what walks best. Joint centres are unknowns of the
identification itself."""


_HIPS = slice(3, 7)

_TOES = [COORDINATES.index(f"mtp_angle_{side}") for side in "rl"]


Bodies = Callable[[Array], tuple[Tree, ContactLaw]]
"""The body and the contact law that belong to `Solution.common`."""


class Problem(NamedTuple):
    """The fit of one record; T instants, n numbers of a coordinate's series, C of `common`.

    Attributes
    ----------
    bodies : the body may depend on `Solution.common`.
    varied : the numbers of `common` that it depends on.
    path : three (T, 31): coordinates of the motion to change and their first two rates, without
        the forward travel but with its speed.
    rates : (24,) angular frequency of each harmonic, 1/s.
    series : three (T, n), `_series`.
    target, weight : (T, 52) of the numbers of `walking_laws`.
    lever : (T, 52, C) by how much a unit of `Solution.common` lowers each target.
    swinging : (T, 2) bool, the foot must clear the ground.
    clearance_weight : weight of missing it.
    penalty, miss : (31, R, n), (31, R): the residuals that are linear in a coordinate's series are
        penalty @ change + miss.
    prior : (C,) 1 / standard deviation that `Solution.common` has beforehand, about zero.
    toe_most, toe_excess : Nm, a moment at the toes from which on it costs as well, and the weight
        of what is beyond.
    """

    bodies: Bodies
    varied: tuple[int, ...]
    path: tuple[Array, Array, Array]
    rates: Array
    series: tuple[Array, Array, Array]
    target: Array
    weight: Array
    lever: Array
    swinging: Flags
    clearance_weight: float
    penalty: Array
    miss: Array
    prior: Array
    toe_most: float = np.inf
    toe_excess: float = 0.0


class Solution(NamedTuple):
    """What a fit found.

    Attributes
    ----------
    change : (31, n) series of the changes of the coordinates.
    common : (C,) what is the same at all instants; first by how much the centre of pressure of the
        right and of the left plate is too far forward, m (zero unless asked for), the mean forward
        lean of the trunk, rad, and where the record's right and left hip centre lies, as
        `ReferenceMotion.hip_centre`, m.
    covariance : (C, C) of `common`, linearised; each curve's deviation counts as a single error of
        its accuracy, constant over the cycle. (0, 0) if it was not asked for.
    cost : sum of squares of all residuals.
    """

    change: Array
    common: Array
    covariance: Array
    cost: float


def _series(phase: Array, stride_time: float) -> tuple[Array, Array, Array]:
    """Harmonics 0 to `MOTION.harmonics` (T, n) with their first and second rates in time."""
    k = 2.0 * np.pi * np.arange(1, MOTION.harmonics + 1)
    angle = np.outer(phase, k)
    one = np.ones((len(phase), 1))
    return (
        np.hstack([one, np.cos(angle), np.sin(angle)]),
        np.hstack([0.0 * one, -k * np.sin(angle), k * np.cos(angle)]) / stride_time,
        np.hstack([0.0 * one, -(k**2) * np.cos(angle), -(k**2) * np.sin(angle)]) / stride_time**2,
    )


def _resampled(values: Array, count: int) -> Array:
    """One cycle of samples (N, …) at `count` equally spaced phases, by its Fourier series."""
    terms = min(len(values), count) // 2
    spectrum = np.fft.rfft(values, axis=0)[:terms]
    padded = np.zeros((count // 2 + 1, *values.shape[1:]), dtype=complex)
    # The highest harmonics are cut off where there are fewer instants than samples; `irfft` divides
    # by the new count, hence the factor.
    padded[:terms] = spectrum
    return np.asarray(np.fft.irfft(padded, count, axis=0) * (count / len(values)))


def _coordinate_accuracy(accuracy: Accuracy) -> Array:
    """Accuracy (31,) of every coordinate."""
    kinds = {
        "hip_flexion": accuracy.record.sagittal,
        "knee_angle": accuracy.record.sagittal,
        "ankle_angle": accuracy.record.sagittal,
        "hip_adduction": accuracy.record.frontal,
        "hip_rotation": accuracy.record.rotation,
        "subtalar_angle": accuracy.convention.subtalar,
        "mtp_angle": accuracy.convention.toes,
        "lumbar": accuracy.convention.lumbar,
    }
    scales = [accuracy.record.pelvis] * 3 + [accuracy.convention.translation] * 3
    for name in ACTUATED:
        joint = "lumbar" if name in LUMBAR else name.rpartition("_")[0]
        scales.append(kinds.get(joint, accuracy.convention.arms))
    return np.array(scales)


def _penalties(
    accuracy: Accuracy, departure: Array, series: Array, steady: Array, flat: Flags
) -> tuple[Array, Array]:
    """Rows (31, R, n) and constants (31, R) of the residuals that are linear in the unknowns:
    departures of the coordinates, of which the initial motion has `departure` (T, 31) from the
    record, and roughness of their change, which trunk and arms hold closer: to the amplitudes
    `steady` (H,) rad, infinite where they are free. The trunk is held instead of the lumbar
    coordinates, of which only the change is kept small. The toes are held closer where the right
    and the left foot stand `flat` (T, 2).
    """
    instants, terms = series.shape
    # Mean, cosines, sines: the order of a series' columns.
    harmonic = np.concatenate([[0], np.tile(np.arange(1, MOTION.harmonics + 1), 2)])
    high = harmonic > DYNAMIC_FIT.smooth_harmonic
    # Acceleration grows with the square of the harmonic.
    roughness = np.diag(
        DYNAMIC_FIT.roughness * high * (harmonic / DYNAMIC_FIT.smooth_harmonic) ** 2
    )
    closer = np.diag(np.concatenate([[0.0], np.tile(1.0 / steady, 2)]))
    penalty = np.zeros((len(COORDINATES), instants + terms, terms))
    miss = np.zeros(penalty.shape[:2])
    # A sum over instants divided by their number: the mean square does not depend on how many there
    # are.
    norm = 1.0 / np.sqrt(instants)
    for k, wanted in enumerate(_coordinate_accuracy(accuracy)):
        penalty[k, instants:] = roughness / wanted
        if k in SHAKING:
            penalty[k, instants:] = np.maximum(penalty[k, instants:], closer)
        if COORDINATES[k] in LUMBAR:
            penalty[k, instants:] += np.diag(1.0 / wanted * ~high)
        else:
            held = np.full(instants, wanted)
            if k in _TOES:
                held[flat[:, _TOES.index(k)]] = accuracy.convention.flat_toes
            penalty[k, :instants] = series / held[:, None] * norm
            miss[k, :instants] = departure[:, k] / held * norm
    return penalty, miss


def moment_accuracy(accuracy: RecordAccuracy, name: str) -> float:
    """Nm/kg, of the moment of `name`, one of `FEED_FORWARD`."""
    if name == "hip_adduction":
        return accuracy.adduction_moment
    if name == "ankle_angle" or accuracy.flexion_moments is None:
        return accuracy.moment
    return accuracy.flexion_moments


def _toe_moment(load: Array, extension: Array) -> Array:
    """Nm/kg (T,), what is expected of the toes: the moment of a spring whose force the foot's
    `load` presses on, as large as people's at its largest. Negative resists `extension`, rad.
    """
    shape = np.maximum(load, 0.0) * np.maximum(extension, 0.0)
    return -DYNAMIC_FIT.toe_moment * shape / max(float(shape.max()), DYNAMIC_FIT.no_shift)


def _hold_unrecorded(
    target: Array,
    weights: Array,
    wanted: Accuracy,
    mass: float,
    i: int,
    extension: Array,
) -> None:
    """Target and weights (T, 52) of moments that no record has, of the right (`i` 0) or the left
    (1) leg of a body of `mass` kg, whose toes are extended by `extension` (T,) rad.
    """
    side, accuracy = SIDES[i][0], wanted.convention
    load = target[:, FOOT + FOOT_NUMBERS * i + 2] / (mass * GRAVITY)
    for name, moment, size in (
        ("mtp_angle", _toe_moment(load, extension), accuracy.toe_moment),
        ("subtalar_angle", 0.0, accuracy.subtalar_moment),
        ("hip_rotation", 0.0, accuracy.rotation_moment),
    ):
        row = COORDINATES.index(f"{name}_{side}")
        target[:, row] = mass * moment
        weights[:, row] = 1.0 / (size * mass)
    # Friction turns a foot back by as much as it is loaded: the same turning weighs the same.
    held = load > DYNAMIC_FIT.least_load
    twist = FOOT + FOOT_NUMBERS * i + 7
    weights[held, twist] = 1.0 / (wanted.record.twist * load[held] * mass * GRAVITY)


def fit_problem(
    reference: ReferenceMotion,
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings,
    accuracy: Accuracy,
    shift_sd: float,
) -> Problem:
    """The fit of a record as a least-squares problem, for `solve_problem`.

    It is long because target, weight and lever of a number stand beside each other.

    Parameters
    ----------
    reference : of `walk.reference.motion.build_reference`, from `record`.
    record : angles, moments, forces and timing of one gait cycle.
    model : the scaled body.
    contact : the contact law; its friction is the nominal one.
    accuracy : deviations of equal weight.
    shift_sd : m, SD beforehand of how far the centre of pressure of each plate is too far forward;
        0: it is right.
    """
    body = tree_arrays(model), contact_law(contact, NOMINAL_FRICTION)
    weight = model.mass * GRAVITY
    time = record.stride_time
    phase = np.arange(DYNAMIC_FIT.instants) / DYNAMIC_FIT.instants
    path = tuple(_resampled(values, DYNAMIC_FIT.instants) for values in _path(reference, record))
    series = _series(phase, time)
    departure = np.concatenate([np.zeros(ROOT_DOFS), reference.offsets])

    # Rounded, so that an instant at the edge of stance is treated the same on both sides.
    own = np.column_stack([np.mod(side_phase(record, side, phase).round(9), 1.0) for side in SIDES])
    ends = np.array([record.stance_fraction[side] for side in SIDES])
    force = [record.ground_reaction(side, own[:, i]) for i, side in enumerate(SIDES)]
    # No periodic motion has another mean force against gravity than one body weight.
    level = sum((each @ model.ground.up).mean() for each in force)

    target = np.zeros((DYNAMIC_FIT.instants, OUTPUTS))
    # An upright trunk leans in the axes of a slope.
    target[:, TRUNK] = Rotation.from_matrix(model.ground.from_level).as_rotvec()
    target[:, TRUNK.start + 1] += accuracy.mean_lean
    weights = np.zeros((DYNAMIC_FIT.instants, OUTPUTS))
    lever = np.zeros((DYNAMIC_FIT.instants, OUTPUTS, DYNAMIC_FIT.common))
    # Element 1 of the trunk's rotation vector is its turn about y, the forward lean; the lean that
    # is common to all instants is subtracted from it.
    lever[:, TRUNK.start + 1, 2] = -1.0
    weights[:, :ROOT_DOFS] = 1.0 / (accuracy.laws.residual * weight)
    weights[:, TRUNK] = 1.0 / accuracy.convention.trunk
    wanted = accuracy.record
    sizes = np.array([wanted.forward_force, wanted.sideways_force, wanted.vertical_force])
    for i, side in enumerate(SIDES):
        place = FOOT + FOOT_NUMBERS * i
        # In N of the model's weight, scaled to a mean of one body weight.
        target[:, place : place + 3] = weight * force[i] / level
        weights[:, place : place + 3] = 1.0 / (sizes * weight)
        for name in FEED_FORWARD:
            row = COORDINATES.index(f"{name}_{side[0]}")
            size = moment_accuracy(wanted, name)
            weights[:, row] = 1.0 / (size * model.mass)
            target[:, row] = record.moments[f"{name}_{side[0]}"](own[:, i]) * model.mass
            # A plate that is shifted forward changes a sagittal moment by the vertical force times
            # the shift.
            lever[:, row, i] = SHIFT_SIGNS.get(name, 0.0) * target[:, place + 2]
        _hold_unrecorded(target, weights, accuracy, model.mass, i, path[0][:, _TOES[i]])
        power = record.moments[f"ankle_angle_{side[0]}"](own[:, i])
        power *= record.angles[f"ankle_angle_{side[0]}"].derivative(own[:, i]) / time
        target[:, POWER.start + i] = power * model.mass
        # Moments are compared about the record's hip centre: see `hip_moments.about_record`.
        for column, (name, sign) in enumerate(HIP_SIGNS.items()):
            row = COORDINATES.index(f"{name}_{side[0]}")
            lever[:, row, _HIPS.start + 2 * i + column] = sign * target[:, place + 2]

    pushes = max(
        float(np.sqrt(np.mean(target[:, POWER] ** 2))), DYNAMIC_FIT.least_power * model.mass
    )
    weights[:, POWER] = 1.0 / (wanted.ankle_power * pushes)

    shift, hip = max(shift_sd, DYNAMIC_FIT.no_shift), max(wanted.hip_centre, DYNAMIC_FIT.no_shift)
    norm = 1.0 / np.sqrt(DYNAMIC_FIT.instants)
    rates = np.array(2.0 * np.pi / time * np.arange(1.0, MOTION.harmonics + 1))
    steady = steady_amplitude(model, rates, accuracy.convention.steady_moment)
    departures = np.broadcast_to(departure, path[0].shape)
    flat = (own <= ends) & (path[0][:, _TOES] < accuracy.convention.flat_toes)
    penalty, miss = _penalties(accuracy, departures, series[0], steady, flat)
    return Problem(
        bodies=lambda _: body,
        varied=(),
        path=(path[0], path[1], path[2]),
        rates=rates,
        series=series,
        target=target,
        weight=weights * norm,
        lever=lever,
        swinging=(own > ends + DYNAMIC_FIT.stance_edge) & (own < 1.0 - DYNAMIC_FIT.stance_edge),
        clearance_weight=norm / accuracy.laws.clearance,
        penalty=penalty,
        miss=miss,
        prior=1.0 / np.array([*[shift] * 2, accuracy.convention.lean, *[hip] * 4]),
        toe_most=(DYNAMIC_FIT.toe_moment + DYNAMIC_FIT.toe_moment_sd) * model.mass,
        toe_excess=norm / (accuracy.convention.toe_excess * model.mass),
    )


def _path(reference: ReferenceMotion, record: GaitRecord) -> tuple[Array, Array, Array]:
    """Coordinates (N, 31) with the pelvis' Cardan angles first and without the forward travel, and
    their first two rates, with its speed.
    """
    whole = cardan_coordinates(reference.positions)
    whole[:, 3] -= reference.speed * reference.stride_time * reference.phase
    rates = spectral_rate(whole) / record.stride_time
    second = spectral_rate(rates) / record.stride_time
    rates[:, 3] += record.speed
    return whole, rates, second


def weighted_laws(
    problem: Problem, change: Array, common: Array, ease: float, slope: Array | None = None
) -> tuple[Array, Array]:
    """Weighted residuals of the numbers of `walking_laws` of a `problem`, and the weights, (T, 52)
    each, with the series `change` (31, n) of the coordinates and `common` (C,) as in `Solution`;
    `ease`, 0 to 1, is the weight of Newton's laws on the pelvis. `slope` (T, 52, 93) out:
    derivatives before weighting; not computed if left out.
    """
    out = walking_laws(*problem.bodies(common), _motion(problem, change), slope)
    weight = problem.weight.copy()
    weight[:, :ROOT_DOFS] *= ease
    residual = out - problem.target + problem.lever @ common
    for i in range(2):
        height = FOOT + FOOT_NUMBERS * i + 6
        # One-sided: only a swinging foot that is too low counts, so the residual is continuous but
        # its slope jumps.
        low = problem.swinging[:, i] & (out[:, height] < DYNAMIC_FIT.swing_clearance)
        weight[low, height] = problem.clearance_weight
        residual[low, height] = out[low, height] - DYNAMIC_FIT.swing_clearance
        # Likewise what of a moment at the toes is more than people's; it is added to the residual
        # from what is expected, so that one number stays one residual.
        toes = _TOES[i]
        beyond = np.minimum(out[:, toes] + problem.toe_most, 0.0)
        weighted = residual[:, toes] * weight[:, toes] + beyond * problem.toe_excess
        weight[beyond < 0.0, toes] += problem.toe_excess
        held = weight[:, toes] > 0.0
        residual[held, toes] = weighted[held] / weight[held, toes]
    return residual * weight, weight


def _motion(problem: Problem, change: Array) -> Array:
    """Coordinates, rates and second rates (T, 93) of the changed motion."""
    parts = [
        path + part @ change.T for path, part in zip(problem.path, problem.series, strict=True)
    ]
    return np.hstack(parts)


def levers(problem: Problem, change: Array, common: Array) -> Array:
    """Derivatives (T, 52, C) of the residuals by `common` (C,), as in `Solution`, before weighting,
    at the series `change` (31, n) of the coordinates; only the numbers in `varied` of the `problem`
    need differences.
    """
    lever = problem.lever
    if problem.varied:
        lever, motion = lever.copy(), _motion(problem, change)
        for index in problem.varied:
            away = np.zeros(len(common))
            # The whole body is built again on either side: a length changes inertia, joints and
            # contact.
            away[index] = DYNAMIC_FIT.varied_step
            above, below = (
                walking_laws(*problem.bodies(common + sign * away), motion) for sign in (1, -1)
            )
            lever[:, :, index] += (above - below) / (2.0 * DYNAMIC_FIT.varied_step)
    return lever


def linear_terms(problem: Problem, change: Array) -> Array:
    """The residuals (31, R) of a `problem` that are linear in the series `change` (31, n) of the
    coordinates.
    """
    return np.asarray(np.einsum("krn,kn->kr", problem.penalty, change) + problem.miss)


def _cost(problem: Problem, change: Array, common: Array, ease: float) -> float:
    residual, _ = weighted_laws(problem, change, common, ease)
    linear = linear_terms(problem, change)
    prior = problem.prior * common
    return float(np.sum(residual**2) + np.sum(linear**2) + np.sum(prior**2))


class Linearised(NamedTuple):
    """The weighted residuals of the laws near a solution.

    Attributes
    ----------
    residual : (T, 52).
    slope : (T, 52, 93) derivatives by coordinates, rates and second rates at the instant.
    lever : (T, 52, C) derivatives by `Solution.common`.
    """

    residual: Array
    slope: Array
    lever: Array


def linearised(problem: Problem, change: Array, common: Array, ease: float) -> Linearised:
    """The residuals of `weighted_laws` with their derivatives; `problem`, `change`, `common` and
    `ease` are as there.
    """
    slope = np.zeros((DYNAMIC_FIT.instants, OUTPUTS, INPUTS))
    residual, weight = weighted_laws(problem, change, common, ease, slope)
    slope *= weight[:, :, None]
    lever = levers(problem, change, common) * weight[:, :, None]
    return Linearised(residual, slope, lever)


def normal_equations(
    problem: Problem, change: Array, common: Array, laws: Linearised
) -> tuple[Array, Array]:
    """Matrix (U, U) and gradient (U,) of half the sum of squares of a `problem`; U = 31 n + C.
    `laws` are linearised at the series `change` (31, n) of the coordinates and `common` (C,), as in
    `Solution`.

    The Jacobian is the derivative by coordinates and rates at an instant times the series.
    """
    residual, slope, lever = laws
    dofs, terms = change.shape
    size = dofs * terms
    count = len(common)
    matrix = np.zeros((size + count, size + count))
    harmonic_square(slope, problem.rates, matrix[:size, :size])
    # By the inputs of an instant first, then by the unknowns.
    # The residual as a further column beside the lever: one product gives the gradient and the
    # mixed block.
    right = np.concatenate([residual[:, :, None], lever], axis=2)
    by_input = (slope.transpose(0, 2, 1) @ right).reshape(DYNAMIC_FIT.instants, 3, dofs, 1 + count)
    by_unknown = sum(
        np.tensordot(series, by_input[:, order], axes=(0, 0))
        for order, series in enumerate(problem.series)
    )  # (n, 31, 1 + C)
    across = np.transpose(by_unknown, (1, 0, 2)).reshape(size, 1 + count)
    gradient = np.concatenate([across[:, 0], np.einsum("toi,to->i", lever, residual)])
    matrix[:size, size:], matrix[size:, :size] = across[:, 1:], across[:, 1:].T
    flat = lever.reshape(-1, count)
    matrix[size:, size:] = flat.T @ flat

    linear = linear_terms(problem, change)
    for k in range(dofs):
        rows = slice(k * terms, (k + 1) * terms)
        matrix[rows, rows] += problem.penalty[k].T @ problem.penalty[k]
        gradient[rows] += problem.penalty[k].T @ linear[k]
    matrix[size:, size:] += np.diag(problem.prior**2)
    gradient[size:] += problem.prior**2 * common
    return matrix, gradient


@one_thread()
def solve_problem(
    problem: Problem,
    *,
    start: tuple[Array, Array] | None = None,
    smallest_gain: float = DYNAMIC_FIT.smallest_gain,
    with_covariance: bool = True,
) -> Solution:
    """The change and `common` of a `problem` with the least sum of squares, by damped Gauss-Newton
    steps from `start`, both near the solution; else from zero, with little weight on Newton's laws
    at first. They end at a relative decrease of the sum of `smallest_gain`. The covariance, if
    `with_covariance`, takes as long as two steps.
    """
    dofs, terms = len(COORDINATES), problem.series[0].shape[1]
    count = len(problem.prior)
    change, common = start or (np.zeros((dofs, terms)), np.zeros(count))
    damping = 1e-4
    cost = np.inf
    for ease in DYNAMIC_FIT.eases[-1:] if start else DYNAMIC_FIT.eases:
        cost = _cost(problem, change, common, ease)
        for _ in range(DYNAMIC_FIT.most_steps):
            laws = linearised(problem, change, common, ease)
            matrix, gradient = normal_equations(problem, change, common, laws)
            damped = np.empty_like(matrix)
            before = cost
            while damping < DYNAMIC_FIT.most_damping:
                np.copyto(damped, matrix)
                # Levenberg-Marquardt with Marquardt's scaling: damping in proportion to the
                # diagonal, whose elements have different units. Every (n + 1)-th element of the
                # flat matrix is on the diagonal.
                damped.flat[:: len(damped) + 1] *= 1.0 + damping
                try:
                    # The transpose of a symmetric matrix is laid out as LAPACK wants it.
                    factor = cho_factor(damped.T, overwrite_a=True, check_finite=False)
                    step = cho_solve(factor, gradient, check_finite=False)
                except LinAlgError:
                    damping *= 10.0
                    continue
                size = len(step) - count
                tried = change - step[:size].reshape(dofs, terms), common - step[size:]
                tried_cost = _cost(problem, *tried, ease)
                if tried_cost < cost:
                    (change, common), cost = tried, tried_cost
                    # Less damping after a step that helped, more after one that did not.
                    damping = max(0.2 * damping, 1e-8)
                    break
                damping = max(8.0 * damping, 1e-6)
            if before - cost < smallest_gain * cost:
                break
        damping = 1e-4
    if not with_covariance:
        return Solution(change, common, np.empty((0, 0)), cost)
    laws = linearised(problem, change, common, DYNAMIC_FIT.eases[-1])
    matrix, _ = normal_equations(problem, change, common, laws)
    # The last block of the inverse: the motion is integrated out, not held.
    columns = np.eye(len(matrix))[:, -count:]
    covariance = cho_solve(cho_factor(matrix), columns)[-count:]
    return Solution(change, common, covariance, cost)


def solve(
    reference: ReferenceMotion,
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings,
    accuracy: Accuracy | None = None,
    *,
    shift_sd: float = 0.0,
    near: ReferenceMotion | None = None,
    with_covariance: bool = True,
) -> Solution:
    """The fit's unknowns; `fitted` makes a motion of them.

    Parameters
    ----------
    reference : of `walk.reference.motion.build_reference`, from `record`.
    record : angles, moments, forces and timing of one gait cycle.
    model : the scaled body.
    contact : the contact law; its friction is the nominal one.
    accuracy : deviations of equal weight.
    shift_sd : m, what is known beforehand of how far the centre of pressure of each plate is too
        far forward; 0: it is right.
    near : the fit of the same record to a similar body, to begin with. That takes a third of the
        steps, and ends no further from the record (docs/speed.md).
    with_covariance : as for `solve_problem`.
    """
    problem = fit_problem(reference, record, model, contact, accuracy or Accuracy(), shift_sd)
    if near is None:
        softer = problem._replace(bodies=_with_softer_friction(problem, contact))
        found = solve_problem(softer, with_covariance=False)
        return solve_problem(
            problem, start=(found.change, found.common), with_covariance=with_covariance
        )
    common = np.zeros(DYNAMIC_FIT.common)
    common[_HIPS] = near.hip_centre.ravel()
    start = near.change.copy(), common
    return solve_problem(
        problem, start=start, smallest_gain=DYNAMIC_FIT.near_gain, with_covariance=with_covariance
    )


def _with_softer_friction(problem: Problem, contact: ContactSettings) -> Bodies:
    """What a `problem` of this body and contact begins with: friction that needs more slip. From
    far away, feet that slip more than friction needs are as good as feet that hold.
    """
    law = contact_law(with_softer_friction(contact), NOMINAL_FRICTION)
    return lambda common: (problem.bodies(common)[0], law)


def with_softer_friction(contact: ContactSettings) -> ContactSettings:
    """The same `contact`, whose friction needs a slip of at least `DYNAMIC_FIT.easy_transition`."""
    soft = max(DYNAMIC_FIT.easy_transition, contact.transition_velocity)
    return contact.model_copy(update={"transition_velocity": soft})


def fitted(
    reference: ReferenceMotion,
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings,
    accuracy: Accuracy | None = None,
    near: ReferenceMotion | None = None,
) -> ReferenceMotion:
    """The motion near `reference` that obeys the laws of motion and of contact; `record`, `model`,
    `contact`, `accuracy` and `near` are as `solve` takes them.

    Its `moments` are the net joint moments that it needs, for all joints. Its `ground_reaction` is
    that of the contact law, with a mean of one body weight.
    """
    solution = solve(reference, record, model, contact, accuracy, near=near, with_covariance=False)
    return motion_of(solution, reference, record, model, contact)


def motion_of(
    solution: Solution,
    reference: ReferenceMotion,
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings,
) -> ReferenceMotion:
    """The motion of a `solution` of the fit that began with `reference`; `record`, `model` and
    `contact` are as `solve` takes them.
    """
    change = solution.change.T
    whole, rates, second = _path(reference, record)
    series = _series(reference.phase, record.stride_time)
    parts = [
        path + part @ change for path, part in zip((whole, rates, second), series, strict=True)
    ]
    out = walking_laws(tree_arrays(model), contact_law(contact, NOMINAL_FRICTION), np.hstack(parts))
    positions, velocities = parts[0].copy(), parts[1].copy()
    root = np.empty((len(positions), 3, 3))
    # From Cardan angles and their rates to the root's rotation vector and angular velocity; the
    # second rates are not needed.
    turned, turning = (np.ascontiguousarray(part[:, :3]) for part in parts[:2])
    root_states(turned, turning, np.zeros_like(turned), root)
    positions[:, :3], velocities[:, :3] = root[:, 0], root[:, 1]
    positions[:, 3] += record.speed * record.stride_time * reference.phase
    feet = out[:, FOOT:].reshape(len(out), 2, FOOT_NUMBERS)
    return replace(
        moved(reference, model, positions, velocities),
        moments=out[:, ROOT_DOFS : TRUNK.start],
        ground_reaction=feet[..., :3] / (model.mass * GRAVITY),
        offsets=reference.offsets + change[0, ROOT_DOFS:],
        hip_centre=solution.common[_HIPS].reshape(2, 2),
        change=solution.change,
    )


def consistent_reference(
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings | None = None,
    accuracy: RecordAccuracy | None = None,
    near: ReferenceMotion | None = None,
) -> ReferenceMotion:
    """Reference motion of a record on a scaled model: built from the record, then `fitted`.

    Parameters
    ----------
    record : angles, moments, forces and timing of one gait cycle.
    model : the scaled body.
    contact : the contact law; the default configuration's if not given.
    accuracy : how closely the record is followed; that of a record with the person's own kinetics
        if not given.
    near : that of the same record on a similar body, if there is one; see `solve`.
    """
    contact = contact or ContactSettings()
    wanted = Accuracy(record=accuracy or RecordAccuracy())
    built = build_reference(record, model, contact)
    return fitted(built, record, model, contact, wanted, near)
