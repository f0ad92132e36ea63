"""A made-up gait record and walks that follow it exactly, for the tests of metrics and reports."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.configuration import Configuration, load_configuration
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, LUMBAR, SIDES
from gaitval.gait.cycle_curves import JOINT_ANGLES, JOINT_MOMENTS
from gaitval.gait.record import GaitRecord, PeriodicCurve
from gaitval.metrics.rollouts import Rollouts, compared_part, endurance
from gaitval.metrics.whole_body import record_centre_of_mass
from gaitval.model.parameters import nominal_parameters
from gaitval.model.rotations import pelvis_rotation
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.motion import trunk_upright
from gaitval.walk.simulation.rollout import Rollout

MODEL = scale_subject(load_subject("S05")).model
MASS = MODEL.mass
SPEED = 1.2
STRIDE_TIME = 1.1  # with a step of 1 ms, 1 % of the cycle is 11 samples exactly
STEP = 0.001
LEFT_PHASE = 0.48
STANCE = {"right": 0.62, "left": 0.60}
STEP_WIDTH = 0.12


def periodic(function: Callable[[np.ndarray], np.ndarray], harmonics: int = 40) -> PeriodicCurve:
    phase = np.arange(1000) / 1000
    spectrum = np.fft.rfft(function(phase)) / len(phase)
    kept = spectrum[1 : harmonics + 1]
    return PeriodicCurve(float(spectrum[0].real), tuple(2 * kept.real), tuple(-2 * kept.imag))


def _wave(seed: int, size: float) -> PeriodicCurve:
    random = np.random.default_rng(seed)
    cosine, sine = size * random.uniform(-1, 1, (2, 3)) / np.arange(1, 4)
    return PeriodicCurve(size * float(random.uniform(-1, 1)), tuple(cosine), tuple(sine))


def synthetic_record() -> GaitRecord:
    """Every curve differs from every other, left from right as well."""
    angles, moments = {}, {}
    for seed, name in enumerate(JOINT_ANGLES):
        angles[f"{name}_r"], angles[f"{name}_l"] = _wave(seed, 0.3), _wave(seed + 50, 0.3)
    for seed, name in enumerate(JOINT_MOMENTS):
        moments[f"{name}_r"], moments[f"{name}_l"] = _wave(seed + 100, 0.5), _wave(seed + 150, 0.5)
    for seed, (name, sign) in enumerate(
        (("pelvis_tilt", 1), ("pelvis_list", -1), ("pelvis_rotation", -1))
    ):
        right = _wave(seed + 200, 0.1)
        angles[f"{name}_r"] = right
        angles[f"{name}_l"] = periodic(
            lambda phase, right=right, sign=sign: sign * right(phase + LEFT_PHASE), 3
        )
    forces = {}
    for side in SIDES:
        stance, outwards = STANCE[side], 1.0 if side == "right" else -1.0
        # 26 N at both ends: above the threshold of an event, small enough for the filter
        forces[side] = (
            periodic(lambda phase, s=stance: -0.2 * np.sin(2 * np.pi * phase / s) * (phase < s)),
            periodic(lambda phase, s=stance, o=outwards: 0.05 * o * _hump(phase, s)),
            periodic(lambda phase, s=stance: 0.04 + 1.1 * _hump(phase, s)),
        )
    return GaitRecord(
        speed=SPEED,
        stride_time=STRIDE_TIME,
        left_phase=LEFT_PHASE,
        stance_fraction=STANCE,
        angles=angles,
        moments=moments,
        forces=forces,
    )


def _hump(phase: np.ndarray, stance: float) -> np.ndarray:
    return np.where(phase < stance, np.sin(np.pi * np.minimum(phase / stance, 1.0)) ** 2, 0.0)


def perfect_walk(record: GaitRecord, *, cycles: float = 6.0, start_phase: float = 0.0) -> Rollout:
    """A walk that does exactly what the record says."""
    time = STEP * np.arange(round(cycles * record.stride_time / STEP) + 1)
    phase = start_phase + time / record.stride_time
    own = {"right": phase, "left": phase - record.left_phase}
    positions = np.zeros((len(time), 31))
    moments = np.zeros((len(time), 25))
    ground = np.zeros((len(time), 2, 3))
    pressure = np.full((len(time), 2, 3), np.nan)
    pelvis = pelvis_rotation(
        *(record.angles[f"pelvis_{name}_r"](phase) for name in ("tilt", "list", "rotation"))
    )
    positions[:, :3] = Rotation.from_matrix(pelvis).as_rotvec()
    lumbar = [COORDINATES.index(name) for name in LUMBAR]
    positions[:, lumbar] = trunk_upright(pelvis)
    positions[:, 3] = record.speed * time
    positions[:, 5] = 0.85
    for column, side in enumerate(SIDES):
        for name in JOINT_ANGLES:
            key = f"{name}_{side[0]}"
            positions[:, COORDINATES.index(key)] = record.angles[key](own[side])
        for name in JOINT_MOMENTS:
            key = f"{name}_{side[0]}"
            moments[:, ACTUATED.index(key)] = record.moments[key](own[side]) * MASS
        # rounded, so that a heel strike is at its sample whatever the last bit of the phase
        at = np.round(own[side], 9)
        ground[:, column] = record.ground_reaction(side, at) * MASS * GRAVITY
        on = ground[:, column, 2] > 0
        strides = np.floor(at) + (record.left_phase if side == "left" else 0.0)
        heel_to_toe = 0.2 * (at % 1.0) / record.stance_fraction[side]
        pressure[on, column, 0] = (record.speed * record.stride_time * strides + heel_to_toe)[on]
        pressure[on, column, 1] = (-0.5 if side == "right" else 0.5) * STEP_WIDTH
        pressure[on, column, 2] = 0.0
    places = np.concatenate([record_centre_of_mass(record)[:-1]] * 2)
    percent = np.arange(len(places)) / (len(places) // 2)
    sway = [np.interp(phase % 1.0, percent, column) for column in places.T]
    velocities = np.zeros_like(positions)
    if len(time) > 1:
        velocities[:, 6:] = np.gradient(positions[:, 6:], STEP, axis=0)
    return Rollout(
        time=time,
        phase=phase,
        positions=positions,
        velocities=velocities,
        moments=moments,
        ground_reaction=ground,
        centre_of_pressure=pressure,
        free_moment=np.zeros((len(time), 2)),
        centre_of_mass=positions[:, 3:6] + np.stack(sway, axis=1),
        root_force=np.zeros((len(time), 6)),
        mu=nominal_parameters(),
        start_phase=np.array([start_phase]),
        fell=np.array([0.0]),
    )


def sharp_filter(**validation: object) -> Configuration:
    """Settings whose filter passes the record's three harmonics unchanged (to 1e-6)."""
    settings = {
        "filter_frequency": 100.0,
        "settling_cycles": 1,
        "cycles": 3,
        "start_phases": (0.0,),
    } | validation
    return load_configuration(
        settings=[
            f"validation.{name}={list(value) if isinstance(value, tuple) else value}"
            for name, value in settings.items()
        ]
    )


def walks_of(rollouts: Sequence[Rollout], configuration: Configuration) -> Rollouts:
    """What the simulation would leave of these walks, the first one being compared."""
    return Rollouts(
        compared_part(rollouts[0], configuration),
        tuple(
            endurance(rollout, configuration, engine="compiled" if number else "dart")
            for number, rollout in enumerate(rollouts)
        ),
    )
