"""Forces of both feet by their total, which the motion of the centre of mass gives (Newton's law).

What is expected of anybody is moved to the total, each foot by what people's forces do together. So
the total, which alone says nothing of how two feet share it, says most of it through other people:
forces are the mean of a Gaussian process, given the total (Rasmussen & Williams 2006, Gaussian
processes for machine learning, chapters 2 and 5: from memory), whose covariance is the mean of two:

* how forces of the built-in people differ from what the others are expected to do, each at its own
  contacts;
* how forces of people of five other laboratories differ from it (`STORE`, pooled): shod or
  barefoot, on a belt or over ground, adults and children. The forces of the built-in people alone
  begin to rise alike.

The zero moment point of the whole body, which moves from one foot to the other as the load does,
knows it less well, so it is not used (docs/notebook/estimate.md).
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from importlib import resources
from json import loads
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.gait.record import GaitRecord
from gaitval.prediction.population import with_others_kinetics
from gaitval.prediction.seen import PHASES, SAMPLES, contacts, knows_total, stance_curves

STORE: Final = "forces_elsewhere.json"
UNIT: Final = 1e-4
"""Of the whole numbers in `STORE`, body weights."""
CONTACT_TIMES: Final = np.concatenate(
    [np.arange(16) / 16, 1.0 + np.arange(28) / 28, 2.0 + np.arange(16) / 15]
)
"""(m,) instants of a stance: from landing (0) to the other foot's leaving (1), its landing (2) and
the own foot's leaving (3)."""
_TO_MIDLINE: Final = {"right": np.array([1.0, 1.0, 1.0]), "left": np.array([1.0, -1.0, 1.0])}
ELSEWHERE: Final = 0.5
"""What other laboratories count in the covariance: as much as the built-in people. Convention."""
ROUGH: Final = np.array([0.008, 0.006, 0.02])
"""Body weights (forward, sideways, up) by which a force differs beside what people have shown, as a
few people have not shown all; over `ROUGH_OVER` of the time between contacts. Convention; with half
or one and a half of it forces are as near within 2 %."""
ROUGH_OVER: Final = 0.25
NOISE: Final = np.array([0.009, 0.006, 0.013])
"""Body weights (forward, left, up) by which each harmonic of the total is off in markers of five
laboratories."""
NOISE_SCALES: Final = (0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 4.0)
"""Of which a recording's own noise takes one: the one with which its total is likeliest."""
NOISE_SPREAD: Final = 1.2
"""Standard deviation of the logarithm of that scale, before the total is seen. Convention."""
MEAN_NOISE: Final = 0.01
"""Body weights by which the mean is off: that of the mass."""
HIGHEST_HZ: Final = 8.0
"""Up to which the total is known: the low-pass of the markers."""
CORNER_HZ: Final = HIGHEST_HZ / (np.sqrt(2.0) - 1.0) ** 0.25
"""At which one of the two passes of that filter has its cut-off (`gait.filters.low_pass`)."""


class _Leg(NamedTuple):
    """Of a foot over the right cycle: (`SAMPLES`, m) force at each phase by those at
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
        found.append(record.ground_reaction(side, phase) * _TO_MIDLINE[side])
    return np.array(found)


def _of_stance(record: GaitRecord, side: Side) -> Array:
    """Phases (4,) of `CONTACT_TIMES` 0 to 3; where there is no double support it takes no time."""
    return np.maximum.accumulate(np.maximum(contacts(record, side)[:4], 0.0))


def difference(record: GaitRecord, expected: GaitRecord) -> Array:
    """(2, m, 3) by which the forces of a `record` differ from what is `expected` of anybody, each
    at its own contacts.
    """
    return at_contacts(record) - at_contacts(replace(expected, left_phase=0.5))


def together(differences: Sequence[Array], weights: Iterable[float]) -> Array:
    """(6m, 6m) second moment of `differences` (2, m, 3), n with weights; a person and the mirror
    image count alike.
    """
    each = np.array(differences)
    both = np.concatenate([each, each[:, ::-1]]).reshape(2 * len(each), -1)
    weight = np.tile(np.array([*weights], float), 2)
    return np.asarray((both.T * (weight / weight.sum())) @ both)


@cache
def elsewhere() -> Array:
    """(6m, 6m) of people of other laboratories, pooled (experiments/forces_elsewhere.py)."""
    text = (resources.files("gaitval.prediction") / STORE).read_text(encoding="utf-8")
    stored: dict[str, Any] = loads(text)
    shapes = UNIT * np.array(stored["shapes"], float)
    return np.asarray(shapes.T @ shapes)


@cache
def _built_in(without: str) -> Array:
    """(6m, 6m) of the built-in people but the one called `without`, each as heavy as another."""
    people, found, weights = builtin_subjects(), [], []
    for person in (each for each in people if each.person != without):
        trials = [person, *(person.on_trial(each.name) for each in person.trials)]
        found += [difference(t.record(), with_others_kinetics(t, people)) for t in trials]
        weights += [1.0 / len(trials)] * len(trials)
    return together(found, weights)


def _rough() -> Array:
    """(6m, 6m) of what nobody has shown: smooth, and little where a foot lands and leaves."""
    apart = CONTACT_TIMES[:, None] - CONTACT_TIMES
    end = np.clip(0.3 + np.minimum(CONTACT_TIMES, 3.0 - CONTACT_TIMES) / 0.15, 0.0, 1.0)
    smooth = np.exp(-0.5 * np.square(apart / ROUGH_OVER)) * np.outer(end, end)
    one = np.einsum("ij,cd->icjd", smooth, np.diag(ROUGH**2)).reshape(3 * len(end), -1)
    return np.kron(np.eye(2), one)


def covariance(person: str, others: Array | None = None) -> Array:
    """(6m, 6m) by which forces of anybody but `person` differ from what is expected; `others` of
    other laboratories, else those that come with the package.
    """
    pooled = elsewhere() if others is None else others
    return (1.0 - ELSEWHERE) * _built_in(person) + ELSEWHERE * pooled + _rough()


def with_total(record: GaitRecord, subject: Subject, others: Array | None = None) -> GaitRecord:
    """The `record` with the forces that are likeliest where their total is what the motion of the
    centre of mass of `subject` needs, if that is known; `others` as `covariance` has them.
    """
    total = subject.gait.total_force
    if total is None or not knows_total(subject):
        return record
    own = {"right": PHASES, "left": (PHASES - record.left_phase) % 1.0}
    forces = np.array([record.ground_reaction(side, own[side]) for side in SIDES])
    needed = np.stack([each.periodic()(PHASES) for each in (total.forward, total.left, total.up)])
    legs = [_leg(record, side) for side in SIDES]
    moved = _given_total(forces, needed.T, legs, covariance(subject.person, others), record)
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
    return _Leg(hats * (own <= on[-1])[:, None], _TO_MIDLINE[side])


def _given_total(
    forces: Array, needed: Array, legs: Sequence[_Leg], spread: Array, record: GaitRecord
) -> Array:
    """(2, n, 3) forces, given their total `needed` (n, 3), by what is expected, `forces`, and how
    people differ from it at contacts, `spread` (6m, 6m); no foot pulls.
    """
    count = len(CONTACT_TIMES)
    by_leg = np.zeros((2, SAMPLES, 3, 2, count, 3))
    for i, leg in enumerate(legs):
        for c in range(3):
            by_leg[i, :, c, i, :, c] = leg.spread * leg.signs[c]
    flat = by_leg.reshape(2, SAMPLES, 3, -1)
    frequency = np.arange(SAMPLES // 2 + 1) / record.stride_time
    gain = 1.0 / (1.0 + (frequency / CORNER_HZ) ** 4)
    kept = int(HIGHEST_HZ * record.stride_time)

    def harmonics(values: Array, gain: Array) -> Array:
        """Amplitudes (2k + 1, ...) of the mean, and of cosines and sines to `HIGHEST_HZ`."""
        found = (np.fft.rfft(values, axis=0).T * gain).T[: kept + 1] * 2.0 / SAMPLES
        found[0] *= 0.5
        return np.concatenate([found.real, found[1:].imag])

    seen, lacks, noise = [], [], []
    for c in range(3):
        seen.append(harmonics(flat[:, :, c].sum(axis=0), gain))
        expected = harmonics(forces[..., c].sum(axis=0), gain)
        lacks.append(harmonics(needed[:, c], np.ones_like(gain)) - expected)
        noise.append(np.append(MEAN_NOISE, np.full(2 * kept, NOISE[c])) ** 2)
    saw = np.concatenate(seen)
    common = spread @ saw.T
    weights = _likeliest(saw @ common, np.concatenate(noise), np.concatenate(lacks))
    moved = forces + flat @ (common @ weights)
    moved[..., 2] = np.maximum(moved[..., 2], 0.0)
    return np.asarray(moved)


def _likeliest(signal: Array, noise: Array, lacks: Array) -> Array:
    """(k,) C⁻¹ y of what is lacking, y (k,), with C = `signal` (k, k) + the variances `noise` (k,)
    times the square of the scale of `NOISE_SCALES` that y is likeliest with.
    """
    best, found = -np.inf, lacks
    for scale in NOISE_SCALES:
        inside = signal + np.diag(scale**2 * noise)
        solved: Array = np.linalg.solve(inside, lacks).astype(float)
        likely = -0.5 * float(np.linalg.slogdet(inside)[1] + lacks @ solved)
        likely -= 0.5 * (np.log(scale) / NOISE_SPREAD) ** 2
        if likely > best:
            best, found = likely, solved
    return found
