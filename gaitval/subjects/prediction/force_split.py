"""Forces of both feet by all that markers say of them: their total, landings and angles.

What is expected of anybody is moved to what markers measure, each foot by what people's forces do
together. So the total (the motion of the centre of mass, by Newton's law), which alone says nothing
of how two feet share it, says most of it through other people. Forces are the mean of a Gaussian
process (Rasmussen & Williams 2006, Gaussian processes for machine learning, chapters 2 and 5: from
memory) of both feet's forces, the shapes of both legs' angles at contacts, and the walk's rhythm,
speed and size. Four things are measurements of it, so that none is averaged with the others
afterwards:

* the shapes of the angles, with as much noise as signal;
* stride time, speed and leg length, likewise: children and fast walkers of other laboratories load
  their feet otherwise than a line through the built-in adults has it;
* the landings of both feet, which markers say to `EVENTS.landing_error`. Who lands later than
markers say
  has forces and angles that are later there;
* the total of both forces, `SPLIT.total_late`, with every noise of `SPLIT.noise_scales` as likely
as it makes
  the total.

Its covariance is the mean of two:

* how forces and angles of the built-in people differ from what the others are expected to do, each
  at the own contacts;
* how those of people of six other laboratories differ from it (`STORE`, pooled): shod or
  barefoot, on a belt or over ground, adults and children. The forces of the built-in people alone
  begin to rise alike.

The zero moment point of the whole body, which moves from one foot to the other as the load does,
knows the split less well, so it is not used (docs/what-we-tried.md).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from json import loads
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.gait.dimensionless import speed_unit, time_unit
from gaitval.gait.events import EVENTS
from gaitval.gait.record import GaitRecord
from gaitval.subjects.prediction.deviations import SAGITTAL
from gaitval.subjects.prediction.normal_form import TO_MIDLINE
from gaitval.subjects.prediction.population import expected_record, gaits_of, other_people
from gaitval.subjects.prediction.seen import PHASES, contacts, knows_total, stance_curves
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects

STORE: Final = "forces_elsewhere.json"


@dataclass(frozen=True)
class SplitSettings:
    """How the force under both feet is split without plates."""

    unit: float = 1e-4
    """Of the whole numbers in `STORE`: body weights, rad, and as `_walk` has them."""
    of_walk: int = 3
    """Numbers of a leg that are of its force, then of its angles, then of the walk."""
    seen_noise: float = 0.04
    """Noise of each direction of the angles' shapes, and of the walk's numbers, of the variance of
    all: about as much as the signal has in one of the 27 people. Convention; with half or twice of
    it forces of laboratories that are left out are as near within 4 %."""
    farthest: float = 3.0
    """Standard deviations beyond which a number of the walk counts as no farther: what forces do
    there, nobody who is known has shown. None of the 44 people whose forces are learned from is
    there."""
    elsewhere: float = 0.5
    """What other laboratories count in the covariance: as much as the built-in people.
    Convention."""
    rough_over: float = 0.25
    noise_scales: tuple[float, float, float, float, float, float, float] = (
        0.5,
        0.7,
        1.0,
        1.4,
        2.0,
        3.0,
        4.0,
    )
    """Of that noise, which a recording may have; what the total says is their mean, each as heavy
    as it makes the total likely."""
    noise_spread: float = 1.2
    """Standard deviation of the logarithm of that scale, before the total is seen. Convention."""
    total_late: float = 0.004
    """s by which the total by plates comes later than by markers, beside the angles: mean of six
    laboratories, each as heavy (standard deviation between them 0.006): `python -m claims
    elsewhere.laboratories`."""
    mean_noise: float = 0.01
    """Body weights by which the mean is off: that of the mass."""
    highest_hz: float = 8.0
    """Up to which the total is known: the low-pass of the markers."""


SPLIT: Final = SplitSettings()

CONTACT_TIMES: Final = np.concatenate(
    [np.arange(16) / 16, 1.0 + np.arange(28) / 28, 2.0 + np.arange(16) / 15]
)
"""(m,) instants of a stance: from landing (0) to the other foot's leaving (1), its landing (2) and
the own foot's leaving (3)."""
ANGLE_TIMES: Final = np.concatenate([np.arange(24) / 8, 3.0 + np.arange(8) / 8])
"""(k,) instants of a cycle at which `SAGITTAL` angles are looked at, as `CONTACT_TIMES`; at 4 the
own foot lands again."""
_OF_FORCES: Final = 3 * len(CONTACT_TIMES)
_OF_ANGLES: Final = len(SAGITTAL) * len(ANGLE_TIMES)
LANDING_SPREAD: Final = EVENTS.landing_error / 1.96
"""Standard deviation of a landing by markers, s."""
ROUGH: Final = np.array([0.008, 0.006, 0.02])
"""Body weights (forward, sideways, up) by which a force differs beside what people have shown, as a
few people have not shown all; over `SPLIT.rough_over` of the time between contacts. Convention;
with half or one and a half of it forces are as near within 2 %."""
NOISE: Final = np.array([0.009, 0.006, 0.013])
"""Body weights (forward, left, up) by which each harmonic of the total is off in markers of five
laboratories."""
CORNER_HZ: Final = SPLIT.highest_hz / (np.sqrt(2.0) - 1.0) ** 0.25
"""At which one of the two passes of that filter has its cut-off (`gait.filters.low_pass`)."""


class ForcesElsewhere(NamedTuple):
    """Of people of other laboratories.

    Attributes
    ----------
    spread : (2s, 2s) covariance of how they differ, as `difference` has it.
    late : s, as `SPLIT.total_late`.
    """

    spread: Array
    late: float


class _Leg(NamedTuple):
    """Of a foot over the right cycle: (n, m) force at each of `PHASES` by those at
    `CONTACT_TIMES`, and signs (3,) that make it the force in the world.
    """

    spread: Array
    signs: Array


def at_contacts(record: GaitRecord) -> Array:
    """(2, m, 3) body weights, forward, to the midline and up: forces of both feet of a `record` at
    `CONTACT_TIMES`.
    """
    found = []
    for side in SIDES:
        phase = np.interp(CONTACT_TIMES, np.arange(4), _of_stance(record, side))
        found.append(record.ground_reaction(side, phase) * TO_MIDLINE[side])
    return np.array(found)


def _contacts(record: GaitRecord, side: Side) -> Array:
    """Phases (5,) of times 0 to 4; where there is no double support it takes no time."""
    return np.maximum.accumulate(np.maximum(contacts(record, side), 0.0))


def _of_stance(record: GaitRecord, side: Side) -> Array:
    """Phases (4,) of `CONTACT_TIMES` 0 to 3."""
    return _contacts(record, side)[:4]


def _shapes(record: GaitRecord, side: Side, phases: Array) -> Array:
    """(k, 3) rad, `SAGITTAL` angles of a leg at `phases` (k,) less their means."""
    curves = [record.angles[f"{name}_{side[0]}"](phases % 1.0) for name in SAGITTAL]
    angles = np.stack(curves, axis=1)
    return np.asarray(angles - angles.mean(axis=0))


def angles_at_contacts(record: GaitRecord) -> Array:
    """(2, k, 3) rad: `_shapes` of both legs of a `record` at `ANGLE_TIMES`."""
    found = []
    for side in SIDES:
        phases = np.interp(ANGLE_TIMES, np.arange(5), _contacts(record, side))
        found.append(_shapes(record, side, phases))
    return np.array(found)


@cache
def _typical() -> tuple[float, float]:
    """Mean speed, in units of the leg, and leg length, m, of the built-in people."""
    people = builtin_subjects()
    speeds = [each.walking_speed_m_s / speed_unit(each.leg_length_m) for each in people]
    return float(np.mean(speeds)), float(np.mean([each.leg_length_m for each in people]))


def _walk(record: GaitRecord, expected: GaitRecord, leg_length: float) -> Array:
    """(3,) by which a `record`, on legs of `leg_length` (m), is another walk: stride time, in units
    of the leg, less what is `expected` at its speed; speed, likewise, and leg length less the
    built-in people's means.
    """
    speed, length = _typical()
    longer = (record.stride_time - expected.stride_time) / time_unit(leg_length)
    return np.array([longer, record.speed / speed_unit(leg_length) - speed, leg_length - length])


def _seen(record: GaitRecord, expected: GaitRecord, leg_length: float) -> Array:
    """(2, s - `_OF_FORCES`) what markers see differ: angles of both legs, and the walk."""
    angles = angles_at_contacts(record) - angles_at_contacts(expected)
    walk = np.tile(_walk(record, expected, leg_length), (2, 1))
    return np.concatenate([angles.reshape(2, -1), walk], axis=1)


def difference(record: GaitRecord, expected: GaitRecord, leg_length: float) -> Array:
    """(2, s) by which a `record`, on legs of `leg_length` (m), differs from what is `expected` of
    anybody, each at its own contacts: of each leg `_OF_FORCES` numbers of `at_contacts`,
    `_OF_ANGLES` of `angles_at_contacts`, and `SPLIT.of_walk` of `_walk`, the same of both legs.
    """
    even = replace(expected, left_phase=0.5)
    forces = at_contacts(record) - at_contacts(even)
    return np.concatenate([forces.reshape(2, -1), _seen(record, even, leg_length)], axis=1)


def together(differences: Sequence[Array], weights: Iterable[float]) -> Array:
    """(2s, 2s) second moment of `differences` (2, s), n with weights; a person and the mirror image
    count alike.
    """
    each = np.array(differences)
    both = np.concatenate([each, each[:, ::-1]]).reshape(2 * len(each), -1)
    weight = np.tile(np.array([*weights], float), 2)
    return np.asarray((both.T * (weight / weight.sum())) @ both)


@cache
def forces_elsewhere() -> ForcesElsewhere:
    """Pooled, those that come with the package (experiments/forces_elsewhere.py)."""
    text = (resources.files("gaitval.subjects.prediction") / STORE).read_text(encoding="utf-8")
    stored: dict[str, Any] = loads(text)
    shapes = SPLIT.unit * np.array(stored["shapes"], float)
    return ForcesElsewhere(shapes.T @ shapes, SPLIT.total_late)


@cache
def _built_in(without: str) -> Array:
    """(2s, 2s) of the built-in people but the one called `without`, each as heavy as another."""
    people = [each for each in builtin_subjects() if each.person != without]
    gaits, found, weights = [gaits_of(each) for each in people], [], []
    for i, person in enumerate(people):
        trials = [person, *(person.on_trial(each.name) for each in person.trials)]
        others = [*gaits[:i], *gaits[i + 1 :]]
        found += [
            difference(each.record(), expected_record(each, others), each.leg_length_m)
            for each in trials
        ]
        weights += [1.0 / len(trials)] * len(trials)
    return together(found, weights)


def _rough() -> Array:
    """(2s, 2s) of what nobody has shown of forces: smooth, and little where a foot lands and
    leaves.
    """
    apart = CONTACT_TIMES[:, None] - CONTACT_TIMES
    end = np.clip(0.3 + np.minimum(CONTACT_TIMES, 3.0 - CONTACT_TIMES) / 0.15, 0.0, 1.0)
    smooth = np.exp(-0.5 * np.square(apart / SPLIT.rough_over)) * np.outer(end, end)
    one = np.einsum("ij,cd->icjd", smooth, np.diag(ROUGH**2)).reshape(_OF_FORCES, -1)
    return np.kron(np.eye(2), np.pad(one, (0, _OF_ANGLES + SPLIT.of_walk)))


def covariance(person: str, elsewhere: Array) -> Array:
    """(2s, 2s) by which forces and angles of anybody but `person` differ from what is expected;
    `elsewhere` of people of other laboratories.
    """
    known = any(each.person == person for each in builtin_subjects())
    at_home = _built_in(person if known else "")
    return (1.0 - SPLIT.elsewhere) * at_home + SPLIT.elsewhere * elsewhere + _rough()


def _late(record: GaitRecord, usual: GaitRecord, foot: Side) -> Array:
    """(2s,) by which forces and angles differ where a `foot` lands `LANDING_SPREAD` later than in
    the `record`; angles as `usual`.
    """
    late = LANDING_SPREAD / record.stride_time
    forces, when, moved = at_contacts(record), np.arange(-1, 5), []
    for later in (late, -late):
        found = []
        for i, side in enumerate(SIDES):
            # the own foot left before it landed, too
            seen, even = (
                np.append(each[3] - 1.0, each)
                for each in (_contacts(record, side), _contacts(usual, side))
            )
            true = seen.copy()
            true[[1, 5] if side == foot else [3]] += later
            true = np.maximum.accumulate(true)
            at, bent = (
                np.interp(np.interp(times, when, seen), true, when)
                for times in (CONTACT_TIMES, ANGLE_TIMES)
            )
            force = [np.interp(at, CONTACT_TIMES, each) for each in forces[i].T]
            angles = _shapes(usual, side, np.interp(bent, when, even))
            found.append(
                np.concatenate(
                    [np.stack(force, axis=1).ravel(), angles.ravel(), np.zeros(SPLIT.of_walk)]
                )
            )
        moved.append(np.concatenate(found))
    return np.asarray(0.5 * (moved[0] - moved[1]))


class _Known(NamedTuple):
    """Of forces at contacts before their total is seen: how their mean (6m,) differs from what is
    expected, and their covariance (6m, 6m).
    """

    mean: Array
    spread: Array


def _before_total(
    record: GaitRecord,
    usual: GaitRecord,
    leg_length: float,
    spread: Array,
    *,
    angles: bool = True,
) -> _Known:
    """What landings, and `angles` and walk, of a `record` on legs of `leg_length` (m) say of forces
    that are distributed with the covariance `spread` (2s, 2s) about it; what is expected of anybody
    is `usual`.
    """
    for foot in SIDES:
        late = _late(record, usual, foot)
        spread = spread + np.outer(late, late)
    is_force = np.arange(len(spread)) % (len(spread) // 2) < _OF_FORCES
    forces = spread[np.ix_(is_force, is_force)]
    if not angles:
        return _Known(np.zeros(len(forces)), forces)
    own, both = spread[np.ix_(~is_force, ~is_force)], spread[np.ix_(~is_force, is_force)]
    # every angle, and every number of the walk, in units of how much people differ in it
    by_leg = np.diag(own).reshape(2, -1).mean(axis=0)
    angle = by_leg[:_OF_ANGLES].reshape(-1, len(SAGITTAL)).mean(axis=0)
    walk = by_leg[_OF_ANGLES:]
    of_all = np.append(np.tile(_OF_ANGLES * angle, len(ANGLE_TIMES)), SPLIT.of_walk * walk)
    noise = 2.0 * SPLIT.seen_noise * np.diag(np.tile(of_all, 2))
    seen = _seen(record, usual, leg_length)
    far = SPLIT.farthest * np.sqrt(walk)
    seen[:, _OF_ANGLES:] = np.clip(seen[:, _OF_ANGLES:], -far, far)
    weights = np.linalg.solve(own + noise, both)
    return _Known(weights.T @ seen.ravel(), forces - both.T @ weights)


def with_total(
    record: GaitRecord,
    subject: Subject,
    elsewhere: ForcesElsewhere | None = None,
    *,
    angles: bool = True,
) -> GaitRecord:
    """The `record` with the forces that are likeliest where their total is what the motion of the
    centre of mass of `subject` needs, if that is known; by people `elsewhere`, else those that come
    with the package. `angles` and walk are looked at, too, unless the forces of the `record` are by
    them.
    """
    total = subject.gait.total_force
    if total is None or not knows_total(subject):
        return record
    own = {"right": PHASES, "left": (PHASES - record.left_phase) % 1.0}
    forces = np.array([record.ground_reaction(side, own[side]) for side in SIDES])
    others = forces_elsewhere() if elsewhere is None else elsewhere
    when = (PHASES - others.late / record.stride_time) % 1.0
    needed = np.stack([each.periodic()(when) for each in (total.forward, total.left, total.up)])
    legs = [_leg(record, side) for side in SIDES]
    usual = expected_record(subject, other_people(subject, builtin_subjects()))
    spread = covariance(subject.person, others.spread)
    known = _before_total(record, usual, subject.leg_length_m, spread, angles=angles)
    moved = _given_total(forces, needed.T, legs, known, record)
    curves = {}
    for side, force in zip(SIDES, moved, strict=True):
        later = record.left_phase if side == "left" else 0.0
        x, closed = np.append(PHASES, 1.0), np.vstack([force, force[:1]])
        rows = np.stack([np.interp((PHASES + later) % 1.0, x, each) for each in closed.T], axis=1)
        curves[side] = stance_curves(rows, record.stance_fraction[side])
    return replace(record, forces=curves)


def _leg(record: GaitRecord, side: Side) -> _Leg:
    own = PHASES if side == "right" else (PHASES - record.left_phase) % 1.0
    on = _of_stance(record, side)
    when = np.interp(own, on, np.arange(4))
    hats = np.array([np.interp(when, CONTACT_TIMES, one) for one in np.eye(len(CONTACT_TIMES))]).T
    return _Leg(hats * (own <= on[-1])[:, None], TO_MIDLINE[side])


def _given_total(
    forces: Array, needed: Array, legs: Sequence[_Leg], known: _Known, record: GaitRecord
) -> Array:
    """(2, n, 3) forces, given their total `needed` (n, 3), by what is expected, `forces`, and how
    they differ from it at contacts by what else is `known`; no foot pulls.
    """
    count, samples = len(CONTACT_TIMES), len(PHASES)
    by_leg = np.zeros((2, samples, 3, 2, count, 3))
    for i, leg in enumerate(legs):
        for c in range(3):
            by_leg[i, :, c, i, :, c] = leg.spread * leg.signs[c]
    flat = by_leg.reshape(2, samples, 3, -1)
    frequency = np.arange(samples // 2 + 1) / record.stride_time
    gain = 1.0 / (1.0 + (frequency / CORNER_HZ) ** 4)
    kept = int(SPLIT.highest_hz * record.stride_time)

    def harmonics(values: Array, gain: Array) -> Array:
        """Amplitudes (2k + 1, ...) of the mean, and of cosines and sines to `SPLIT.highest_hz`."""
        found = (np.fft.rfft(values, axis=0).T * gain).T[: kept + 1] * 2.0 / samples
        found[0] *= 0.5
        return np.concatenate([found.real, found[1:].imag])

    seen, lacks, noise = [], [], []
    for c in range(3):
        seen.append(harmonics(flat[:, :, c].sum(axis=0), gain))
        expected = harmonics(forces[..., c].sum(axis=0), gain)
        lacks.append(harmonics(needed[:, c], np.ones_like(gain)) - expected)
        noise.append(np.append(SPLIT.mean_noise, np.full(2 * kept, NOISE[c])) ** 2)
    saw = np.concatenate(seen)
    common = known.spread @ saw.T
    still = np.concatenate(lacks) - saw @ known.mean
    weights = _by_likelihood(saw @ common, np.concatenate(noise), still)
    moved = forces + flat @ (known.mean + common @ weights)
    moved[..., 2] = np.maximum(moved[..., 2], 0.0)
    return np.asarray(moved)


def _by_likelihood(signal: Array, noise: Array, lacks: Array) -> Array:
    """(k,) C⁻¹ y of what is lacking, y (k,), with C = `signal` (k, k) + the variances `noise` (k,)
    times the square of a scale: the mean of `SPLIT.noise_scales`, each as heavy as it makes y
    likely.
    """
    solved, likely = [], []
    for scale in SPLIT.noise_scales:
        inside = signal + np.diag(scale**2 * noise)
        solved.append(np.linalg.solve(inside, lacks))
        fits = -0.5 * float(np.linalg.slogdet(inside)[1] + lacks @ solved[-1])
        likely.append(fits - 0.5 * (np.log(scale) / SPLIT.noise_spread) ** 2)
    return np.asarray(np.average(solved, axis=0, weights=np.exp(np.array(likely) - max(likely))))
