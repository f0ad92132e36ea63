"""A virtual person: a body drawn from the prior, walked, measured with a laboratory's errors.

The body is that of a built-in subject as scaled, changed by parameters mu that are drawn from the
prior of how it was measured; so the subject's own scaling has the errors that scaling has. It
walks with the general policy, which was trained on other bodies and has not seen this one, near a
reference made for it. The mean curves of the walk get errors of markers, joint centres and plates
as in `configuration.NoiseSettings`, and become an ordinary subject, which knows nothing of mu.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import Configuration, NoiseSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.datasets.gait_values import gait_values
from gaitval.datasets.subject import Subject, make_subject
from gaitval.errors import GaitvalError
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.cycle_curves import FORCES, JOINT_MOMENTS, PELVIS_ANGLES, Curves
from gaitval.gait.mean_curves import MeanCurves
from gaitval.gait.plate_correction import SHIFT_SIGNS
from gaitval.gait.record import RECORDED_ANGLES, FittedCurve, PeriodicCurve
from gaitval.gait.sampling import SAMPLES
from gaitval.identification.body_fit import angle_sd
from gaitval.identification.prior import prior_sd
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.cycles import find_cycles, walking_speed
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.reference.dynamic_fit import INFERENCE, Accuracy, fitted
from gaitval.reference.motion import build_reference
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.walker import WalkingTask


@dataclass(frozen=True)
class VirtualPeople:
    """How virtual people are drawn."""

    widest: float = 2.5
    """SDs at which draws are cut off."""
    stature_sd: float = 0.04
    """SD of a factor on all lengths: stature of adults of one sex, 39 mm per metre (ANSUR II,
    Gordon et al. 2014)."""
    build_sd: float = 0.1
    """SD of a factor on the mass at a given stature."""
    loaded: float = 0.2
    """Body weights from which on the error of a force is whole."""
    # Cycles of the walk that are averaged.
    cycles: int = 20
    fixed: float = 1e-4
    """rad, SD of the lean of the trunk about the drawn one: it is a trait of the person and must
    not give way to the moments."""


VIRTUAL: Final = VirtualPeople()

_OWN_KINETICS: Final = RecordAccuracy(
    frontal=np.deg2rad(0.9),
    rotation=np.deg2rad(0.9),
    moment=0.15,
    adduction_moment=0.2,
    forward_force=0.02,
    sideways_force=0.015,
    vertical_force=0.05,
    twist=5e-4,
    hip_centre=0.0,
)
"""Moments and forces are those that this body needs for its motion, within the scatter between
people: a body that is made to walk with another's moments shows nothing of its own."""
_PERCENT: Final = np.linspace(0.0, 1.0, SAMPLES)


class VirtualError(GaitvalError):
    """A virtual person does not walk."""


@dataclass(frozen=True)
class VirtualPerson:
    """A virtual person.

    Attributes
    ----------
    subject : what a laboratory would know of them.
    truth : (14,) mu of the body that walked, relative to the subject's scaling.
    """

    subject: Subject
    truth: Array


def drawn_parameters(sd: Array, random: np.random.Generator) -> Array:
    """Mu (14,) drawn with the generator `random` from the prior, cut off at `VIRTUAL.widest`;
    damping and friction stay positive. `sd` (14,) are standard deviations about the nominal
    parameters, see `identification.prior`.
    """
    while True:
        z = random.standard_normal(len(sd))
        mu = nominal_parameters() + sd * z
        # All are drawn again if one is rejected, so that the accepted ones stay independent.
        if np.abs(z).max() <= VIRTUAL.widest and mu[0] >= 0.0 and mu[1] >= 0.4:
            return np.asarray(mu)


def on_legs(person: Subject, leg: float, size: float) -> Subject:
    """The gait of `person` on legs of a length, m, which are `size` times as long: without
    dimension the same, so speed and times go with the root of the size, and moments, Nm/kg, with
    the size (Hof 1996).
    """

    def larger(curve: FittedCurve) -> FittedCurve:
        cosine, sine = (tuple(size * each for each in part) for part in (curve.cosine, curve.sine))
        return curve.model_copy(update={"mean": size * curve.mean, "cosine": cosine, "sine": sine})

    moments = {name: larger(curve) for name, curve in person.gait.moments.items()}
    return person.model_copy(
        update={
            "leg_length_m": leg,
            "walking_speed_m_s": person.walking_speed_m_s * size**0.5,
            "stride_time_s": person.stride_time_s * size**0.5,
            "gait": person.gait.model_copy(update={"moments": moments}),
        }
    )


def of_another_size(person: Subject, random: np.random.Generator) -> Subject:
    """Somebody who walks as `person` does but is taller or shorter, heavier or lighter, by size and
    build drawn with the generator `random`. The body is known by stature and mass alone; further
    trials are left out.
    """
    z = np.clip(random.standard_normal(2), -VIRTUAL.widest, VIRTUAL.widest)
    size = float(1.0 + VIRTUAL.stature_sd * z[0])
    # At equal body mass index the mass grows with the square of the stature.
    mass = person.mass_kg * (size**2 * float(1.0 + VIRTUAL.build_sd * z[1]))
    values = {"height_m": person.height_m * size, "mass_kg": mass, "trials": ()}
    larger = on_legs(person.by_stature(), person.leg_length_m * size, size)
    return larger.model_copy(update=values)


def virtual_person(
    number: int, seed: int, person: Subject, policy: Policy, configuration: Configuration
) -> VirtualPerson:
    """The virtual person of this `number` and `seed`, which are together the seed of all random
    numbers, drawn around the scaled body and record of `person`. `policy`, `reports/general`, walks
    it; `configuration` has settings of contact, simulation, cycles and noise. Raises VirtualError
    if they fall.
    """
    random = np.random.default_rng([seed, number])
    truth = drawn_parameters(prior_sd(person), random)
    task, walk = walked(number, seed, person, truth, policy, configuration, random)
    curves, values = seen(walk, task, truth[0])
    noisy = with_errors(curves, values["left_phase"], configuration.noise, random)
    subject = as_subject(f"V{seed}_{number:03d}", person, noisy, values)
    return VirtualPerson(subject, truth)


def walked(
    number: int,
    seed: int,
    person: Subject,
    truth: Array,
    policy: Policy,
    configuration: Configuration,
    random: np.random.Generator,
) -> tuple[WalkingTask, Rollout]:
    """The walk of a body that is `truth` away from a person's, near a reference made for it.

    Parameters
    ----------
    number, seed : of the virtual person, for the message of an error.
    person : whose scaled body is changed and whose record is walked.
    truth : (14,) mu of the body.
    policy : that walks it.
    configuration : settings of contact, simulation and validation.
    random : generator, from which the lean of the trunk is drawn.

    Returns
    -------
    The task, and `VIRTUAL.cycles` cycles and more of walking with the compiled engine.

    Raises
    ------
    VirtualError : it falls.
    """
    scaled = scale_subject(person, symmetric=configuration.scaling.symmetric).model
    body = apply_parameters(scaled, truth)
    record, contact = person.record(), configuration.contact
    initial = build_reference(record, body, contact)
    accuracy = Accuracy(
        record=_OWN_KINETICS,
        convention=INFERENCE.convention._replace(lean=VIRTUAL.fixed),
        mean_lean=INFERENCE.convention.lean * random.standard_normal(),
    )
    reference = fitted(initial, record, body, contact, accuracy)
    task = WalkingTask(body, record, reference, configuration)
    walking = nominal_parameters()
    # Lengths and joints are in `body` already; damping and friction act in the simulation.
    walking[:2] = truth[:2]
    settling = configuration.validation.settling_cycles
    walk = record_rollout(
        WalkingEnvironment(task),
        policy,
        mu=walking,
        start_phase=0.0,
        cycles=settling + VIRTUAL.cycles + 2,
    )
    if walk.fell[0]:
        raise VirtualError(f"virtual person {number} of seed {seed} falls.")
    return task, walk


def seen(walk: Rollout, task: WalkingTask, damping: float) -> tuple[Curves, dict[str, Any]]:
    """Mean curves of a walk, SI units, and its timing; `walk` and `task` are as `walked` returns
    them. A laboratory's moments are those of inverse dynamics, so they contain the passive ones,
    with the `damping` of the body that walked, Nms/rad.
    """
    configuration = task.configuration
    cycles = find_cycles(walk, configuration).first(VIRTUAL.cycles)
    net = replace(walk, moments=walk.moments - damping * walk.velocities[:, 6:])
    each = curves_of(task, net, cycles)
    mean = Curves(
        **{
            kind: {name: curve.mean(axis=0) for name, curve in getattr(each, kind).items()}
            for kind in ("angles", "moments", "forces")
        }
    )
    step = float(walk.time[1] - walk.time[0])
    starts = {side: cycles.starts[side] for side in SIDES}
    # Starts and ends are numbers of physics steps.
    stride = float(np.mean(cycles.ends["right"] - starts["right"])) * step
    left = np.array(
        [starts["left"][starts["left"] > first][0] - first for first in starts["right"][:-1]]
    )
    speed = walking_speed(walk, cycles)
    assert speed is not None
    return mean, {
        "walking_speed_m_s": speed,
        "stride_time_s": stride,
        "left_phase": float(left.mean()) * step / stride,
    }


def _wave(mean: float, sd: Array, random: np.random.Generator) -> PeriodicCurve:
    """An error over the cycle whose cosines and sines have these SDs (H,)."""
    cosine, sine = (sd * random.standard_normal(len(sd)) for _ in range(2))
    return PeriodicCurve(mean, tuple(cosine), tuple(sine))


def with_errors(
    curves: Curves,
    left_phase: float,
    noise: NoiseSettings,
    random: np.random.Generator,
) -> Curves:
    """The true `curves` (101,) each, angles rad, moments Nm/kg, forces body weights, as a
    laboratory would measure them, with errors of the standard deviations `noise`, drawn with the
    generator `random` per curve, plate and joint centre. `left_phase` is the phase of left heel
    strike in the right cycle.

    Right and left curves of the pelvis are of one pelvis, and so is its error. A plate that is out
    of place and a joint centre that is in the wrong place change moments by the vertical force
    times that distance.
    """
    sd = angle_sd(noise)
    harmonics = (len(sd) - 1) // 2
    found = Curves({}, {}, {})

    def angle_error() -> PeriodicCurve:
        return _wave(sd[0] * random.standard_normal(), sd[1 : 1 + harmonics], random)

    for name in RECORDED_ANGLES:
        for side in SIDES:
            key = f"{name}_{side[0]}"
            found.angles[key] = curves.angles[key] + angle_error()(_PERCENT)
    for name in PELVIS_ANGLES:
        error = angle_error()
        # Seen from the left, list and rotation have the other sign, and the cycle starts at left
        # heel strike.
        sign = 1.0 if name == "pelvis_tilt" else -1.0
        found.angles[f"{name}_r"] = curves.angles[f"{name}_r"] + error(_PERCENT)
        left = sign * error(_PERCENT + left_phase)
        found.angles[f"{name}_l"] = curves.angles[f"{name}_l"] + left
    # a curve is worth `independent` numbers: so many cosines and sines of equal size
    count = max(1, round(noise.independent / 2))

    def wave_error(size: float) -> Array:
        return _wave(0.0, np.full(count, size / np.sqrt(count)), random)(_PERCENT)

    sizes = dict(
        zip(FORCES, (noise.forward_force, noise.medial_force, noise.vertical_force), strict=True)
    )
    for side in SIDES:
        vertical = curves.forces[f"vertical_{side[0]}"]
        # a plate without a foot on it shows none
        loaded = np.clip(vertical / VIRTUAL.loaded, 0.0, 1.0)
        plate = noise.plate * random.standard_normal()
        for name in JOINT_MOMENTS:
            key = f"{name}_{side[0]}"
            size = noise.adduction_moment if name == "hip_adduction" else noise.moment
            centre = noise.joint_centre * random.standard_normal()
            away = SHIFT_SIGNS.get(name, 0.0) * plate + SHIFT_SIGNS.get(name, 1.0) * centre
            # m x body weights x g is Nm/kg.
            wrong = away * vertical * GRAVITY + wave_error(size)
            found.moments[key] = curves.moments[key] + wrong
        for name in FORCES:
            key = f"{name}_{side[0]}"
            found.forces[key] = curves.forces[key] + loaded * wave_error(sizes[name])
    return found


def as_subject(name: str, person: Subject, curves: Curves, values: Mapping[str, Any]) -> Subject:
    """An ordinary subject `name` (V1_003 of person 3 of seed 1) of these `curves` (101,) each, rad,
    Nm/kg and body weights, with the standing measurements of `person` and the timing `values`, as
    `seen` returns it.
    """
    forces = {}
    for side in SIDES:
        forward, medial, up = (curves.forces[f"{name}_{side[0]}"] for name in FORCES)
        # Curves count towards the midline, a record to the left.
        left = medial if side == "right" else -medial
        forces[side] = np.column_stack([forward, left, up])
    mean = MeanCurves(angles=curves.angles, moments=curves.moments, forces=forces, seam=())
    where = f"virtual person {name}"
    found = gait_values(mean, where)
    kept = ("sex", "age_years", "mass_kg", "height_m", "leg_length_m", "markers", "tape",
            "measurements")  # fmt: skip
    own = {name: getattr(person, name) for name in kept}
    about = {
        "identifier": name,
        "person": name,
        "trial": "T01",
        "laboratory": "virtual",
        "source": f"{name.replace('_', '-')} T01",
        "citation": f"A virtual person of gaitval, around {person.source}: {person.citation}",
        "licence": person.licence,
    }
    return make_subject(own | about | dict(values) | found, where)
