"""Stored policies, their walks, and how these compare with a record, from Python."""

import os
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from gaitval._internal.numba.one_thread import one_thread
from gaitval._internal.text.frames import NamedCurve
from gaitval.configuration import Configuration, RecordSettings
from gaitval.coordinates import SIDES
from gaitval.errors import ConfigurationError, PolicyError, RecordError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.record import LowPass, Origin
from gaitval.interface.arguments import expect, number
from gaitval.metrics.comparison import low_pass_of, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.origin import curve_origin, record_origins
from gaitval.metrics.walk_comparison import Comparison
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.study.stored_policy import StoredPolicy, stored_baseline
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_name, load_subject
from gaitval.walk.simulation.simulated_walk import SimulatedWalk

_WhichBody = Literal["nominal", "identified"]


def load_policy(subject_or_folder: str | int | Path) -> StoredPolicy:
    """A stored policy with its subject, body parameters and correction.

    Parameters
    ----------
    subject_or_folder : a subject with a stored policy (5, "S05"), a finished run folder, or a
        baseline.

    Returns
    -------
    StoredPolicy
        Its body parameters mu are (14,), in the units of `gaitval.model.parameters`.

    Raises
    ------
    PolicyError
        There is no such policy, or it is damaged or for another body.
    SubjectError
        There is no such subject.

    References
    ----------
    V. Kumar, Modelling Human Kinetics and Kinematics during Walking using Reinforcement Learning.

    Examples
    --------
    >>> import gaitval as gv
    >>> policy = gv.load_policy(5)
    >>> policy.subject.identifier, policy.identified.shape
    ('S05', (14,))
    """
    there = Path(str(subject_or_folder))
    # a folder that is called as a subject is ./5, or a Path
    is_path = isinstance(subject_or_folder, Path) or builtin_name(str(subject_or_folder)) is None
    if is_path and os.path.isdir(there):  # False as well for a name that no folder can have
        return StoredPolicy.load(there)
    subject = load_subject(subject_or_folder).model_copy(update={"devices": ()})
    identifier = subject.identifier
    folder = stored_baseline(Path("reports") / identifier, identifier)
    if folder is None:
        raise PolicyError(
            f"{identifier}: no policy is stored for this subject. Run `gaitval subject "
            f"{subject_or_folder}`, and give the run folder."
        )
    stored = StoredPolicy.load(folder)
    if stored.subject.to_toml() != subject.to_toml():
        raise PolicyError(
            f"{subject_or_folder}: the policy that is stored for {identifier}, in {folder}, is of "
            f"a person with other values. Run `gaitval subject {subject_or_folder}`, and give the "
            "run folder."
        )
    return stored


@one_thread()
def rollout(
    policy: StoredPolicy,
    *,
    cycles: float = 6.0,
    start_phase: float = 0.0,
    body: _WhichBody = "identified",
    push: tuple[float, float, float] | None = None,
) -> SimulatedWalk:
    """Let a stored policy walk in DART, without noise.

    Parameters
    ----------
    policy : of `load_policy`. Its reference motion is built by the first rollout and kept with it.
    cycles : planned length, gait cycles.
    start_phase : 0 to 1, of the right gait cycle at the start.
    body : "identified" walks with the identified mu and the corrected reference, as it is
        validated; "nominal" with neither.
    push : on the pelvis: phase at which it begins, in gait cycles; force, N; direction, rad, left
        of straight ahead. It takes `environment.push_seconds`.

    Returns
    -------
    SimulatedWalk
        T samples, SI units, radians, axes x forward, y left, z up.

    Raises
    ------
    PolicyError
        The policy does not fit the body.
    ConfigurationError
        An argument cannot be walked, such as a push after the end.

    References
    ----------
    Lee et al. (2018), DART, JOSS 3:500; Hunt and Crossley (1975), J. Appl. Mech. 42:440.

    Examples
    --------
    >>> import gaitval as gv
    >>> walk = gv.rollout(gv.load_policy(5), cycles=1)
    >>> bool(walk.fell[0]), walk.positions.shape[1]
    (False, 31)
    """
    expect("policy", policy, StoredPolicy, "what load_policy(5) returns")
    number("cycles", cycles, 0.01, 10_000.0, "gait cycles, more than 0 and at most 10,000")
    number("start_phase", start_phase, 0.0, 1.0, "a phase of the right gait cycle, 0 to 1")
    if body not in get_args(_WhichBody):
        raise ConfigurationError(f"body is {body!r}. Give {' or '.join(get_args(_WhichBody))}.")
    if push is not None:
        _check_push(push, start_phase, start_phase + cycles)
    found = record_rollout(
        WalkingEnvironment(
            policy.corrected_task if body == "identified" else policy.task, engine="dart"
        ),
        policy.network,
        mu=getattr(policy, body),
        start_phase=start_phase,
        cycles=cycles,
        push=push,
    )
    return SimulatedWalk(**vars(found), walker=policy.subject.identifier, mass_kg=policy.model.mass)


def _check_push(push: tuple[float, float, float], start: float, end: float) -> None:
    give = "(phase in gait cycles, N, rad left of straight ahead), such as (2.5, 300.0, 0.0)"
    expect("push", push, (tuple, list, np.ndarray), give)
    if len(push) != 3:
        raise ConfigurationError(f"push has {len(push)} values. Give {give}.")
    number("push[0]", push[0], start, end, f"a phase within the walk, {start:g} to {end:g}")
    number("push[1]", push[1], 0.0, 1e4, "a force from 0 to 10,000 N")
    number("push[2]", push[2], -100.0, 100.0, "a direction in rad")


def compare(
    walk: SimulatedWalk,
    against: Subject | SimulatedWalk,
    *,
    configuration: Configuration | None = None,
) -> Comparison:
    """Mean curves of a walk against a record, or against another walk.

    Parameters
    ----------
    walk : of `rollout`, with more cycles than settle (`validation.settling_cycles`).
    against : the subject whose record it is compared with, or another walk. Moments and forces
        pass the record's own low-pass filter, or `validation.filter_frequency`.
    configuration : that the policy was validated with; the defaults when not given.

    Returns
    -------
    Comparison
        Mean curves over each side's gait cycle, 101 points: angles in deg, moments in Nm/kg,
        ground reaction in % of body weight.

    Raises
    ------
    RecordError
        A walk has no complete gait cycle after settling.

    References
    ----------
    Winter (2009), Biomechanics and Motor Control of Human Movement, section 3.4.4.2: the filter.

    Examples
    --------
    >>> import gaitval as gv
    >>> policy = gv.load_policy(5)
    >>> comparison = gv.compare(gv.rollout(policy, cycles=6), policy.subject)
    >>> comparison.rmse("knee_angle_r") < 4.0  # deg, the limit
    True
    """
    expect("walk", walk, SimulatedWalk, "what rollout(policy) returns")
    expect("against", against, (Subject, SimulatedWalk), "load_subject(5), or another walk")
    settings = Configuration() if configuration is None else configuration
    expect("configuration", settings, Configuration, "load_configuration(...), or leave it out")
    frequency = settings.validation.filter_frequency
    filters = LowPass(frequency, frequency)
    origins: tuple[Origin | None, ...]
    if isinstance(against, Subject):
        record = against.record()
        filters, curves = low_pass_of(record, frequency), recorded_curves(record)
        other, title = curves.named(), f"the record of {against.identifier}"
        found, kinds = record_origins(against, RecordSettings()), vars(curves)
        origins = tuple(curve_origin(kind, name, found) for kind in kinds for name in kinds[kind])
    else:
        other = _mean_curves(against, settings, filters)
        title = f"the walk of {against.walker}"
        origins = (None,) * len(other)
    mine = _mean_curves(walk, settings, filters)
    return Comparison(
        names=tuple(name for name, _, _ in mine),
        units=tuple(unit for _, unit, _ in mine),
        walk=np.stack([values for _, _, values in mine]),
        other=np.stack([values for _, _, values in other]),
        of=walk.walker,
        against=title,
        origins=origins,
    )


def _mean_curves(
    walk: SimulatedWalk, settings: Configuration, filters: LowPass
) -> list[NamedCurve]:
    cycles = find_cycles(walk, settings)
    if not all(cycles.count(side) for side in SIDES):
        raise RecordError(
            f"The walk of {walk.walker} has no complete gait cycle of both feet after the "
            f"{settings.validation.settling_cycles} that settle. Ask for more cycles."
        )
    curves = simulated_curves(walk, cycles, mass=walk.mass_kg, filters=filters)
    return [(name, unit, values.mean(axis=0)) for name, unit, values in curves.named()]
