"""How gaits differ from what is expected of anybody at their speed: in angles, kinetics, mechanics
and the body's levers.
"""

from collections.abc import Sequence
from dataclasses import replace
from importlib import resources
from json import loads
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.cycle_curves import FORCES, JOINT_MOMENTS, Curves, recorded_curves
from gaitval.gait.record import RECORDED_ANGLES, GaitRecord
from gaitval.subjects.prediction.body import pelvic_width, step_width
from gaitval.subjects.prediction.normal_form import (
    SAMPLES,
    NormalForm,
    moment_units,
    normal_form,
    symmetric,
)
from gaitval.subjects.prediction.population import expected
from gaitval.subjects.subject import Subject

KINETICS: Final = tuple(
    [("moments", name) for name in JOINT_MOMENTS] + [("forces", name) for name in FORCES]
)
"""Order of all arrays of kinetics, which are in the units of a `NormalForm`: see `units`."""
_LEG: Final = (*RECORDED_ANGLES, "pelvis_tilt", "pelvis_list", "pelvis_rotation")
SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")
OTHER: Final = ("hip_adduction", "hip_rotation", "pelvis_tilt", "pelvis_list", "pelvis_rotation")
"""The angles that are looked at; subtalar angles are mostly where markers were put on the foot."""
UNIT: Final = 1e-5
"""Of the whole numbers in `fits.json`, of `units`."""


class DeviationTrial(NamedTuple):
    """A gait, and what mechanics says of it.

    Attributes
    ----------
    gait : as recorded.
    fit : (2, 7, n) `KINETICS` of the dynamic fit to its angles, less those it began from; right
        and left side, each over its own cycle.
    step_width, pelvic_width : as `gaitval.subjects.prediction.body` has them; NaN if unknown.
    person : as `Subject.person`.
    """

    gait: NormalForm
    fit: Array
    step_width: float = float("nan")
    pelvic_width: float = float("nan")
    person: str = ""

    @property
    def ankle_angles(self) -> Array:
        """(2, n) rad, right and left."""
        return angles_of(self.gait, ("ankle_angle",))[:, 0]


class Deviation(NamedTuple):
    """What of a gait is not what is expected of anybody at its speed.

    Attributes
    ----------
    sagittal, other : (2, 3, n) and (2, 5, n) rad, `SAGITTAL` and `OTHER` angles.
    stride_time : without dimension.
    kinetics : (2, 7, n).
    fit : (2, 7, n), as `DeviationTrial.fit`.
    usual : (2, 7, n) kinetics expected of anybody.
    step_width : share by which the steps are wider than expected of anybody; 0 if unknown.
    pelvic_width : m by which the pelvis is wider than the others' mean; 0 if unknown.
    """

    sagittal: Array
    other: Array
    stride_time: float
    kinetics: Array
    fit: Array
    usual: Array
    step_width: float
    pelvic_width: float


def units(leg_length: float) -> Array:
    """(7, 1) Nm/kg or body weights that one of each of `KINETICS` is on legs of a length, m."""
    moments = moment_units(leg_length)[: len(JOINT_MOMENTS)]
    return np.concatenate([moments, np.ones((len(FORCES), 1))])


def kinetics_of(gait: NormalForm) -> Array:
    """(2, 7, n) `KINETICS` of a gait."""
    moments = gait.moments.reshape(2, len(JOINT_MOMENTS), SAMPLES)
    return np.concatenate([moments, gait.forces.transpose(0, 2, 1)], axis=1)


def kinetics_of_curves(curves: Curves, leg_length: float) -> Array:
    """(2, 7, n) `KINETICS` of `curves` at 101 points, the last of which is the first again, on legs
    of a length, m.
    """
    both = [[getattr(curves, kind)[f"{name}_{s}"][:-1] for kind, name in KINETICS] for s in "rl"]
    return np.array(both) / units(leg_length)


def fit_of(curves: Curves, record: GaitRecord, leg_length: float) -> Array:
    """(2, 7, n) `KINETICS` of a dynamic fit's `curves` less those of the `record` it began from, on
    legs of a length, m.
    """
    target = recorded_curves(record)
    return kinetics_of_curves(curves, leg_length) - kinetics_of_curves(target, leg_length)


def angles_of(gait: NormalForm, names: Sequence[str]) -> Array:
    """(2, k, n) rad, the k angles `names` of a gait, right and left."""
    angles = gait.angles.reshape(2, len(_LEG), SAMPLES)
    return np.asarray(angles[:, [_LEG.index(name) for name in names]])


def usual_gait(people: Sequence[Sequence[DeviationTrial]], speed: float) -> NormalForm:
    """What is expected of anybody at a dimensionless `speed`, by the trials of `people`."""
    return symmetric(expected([[trial.gait for trial in each] for each in people], speed))


def _usual_step_width(people: Sequence[Sequence[DeviationTrial]], speed: float) -> float:
    # All numbers of a gait are expected in the same way, so the width may take the place of one.
    gaits = [[replace(t.gait, stride_time=t.step_width) for t in each] for each in people]
    return expected(gaits, speed).stride_time


def deviation(trial: DeviationTrial, people: Sequence[Sequence[DeviationTrial]]) -> Deviation:
    """How a `trial` differs from what is expected of anybody, by `people`: the trials of everybody
    else, the own first. Its kinetics may be unknown: then so are those of the result.
    """
    usual = usual_gait(people, trial.gait.speed)
    expected_kinetics = kinetics_of(usual)
    wider = trial.step_width / _usual_step_width(people, trial.gait.speed) - 1.0
    pelvis = trial.pelvic_width - float(np.mean([person[0].pelvic_width for person in people]))
    return Deviation(
        angles_of(trial.gait, SAGITTAL) - angles_of(usual, SAGITTAL),
        angles_of(trial.gait, OTHER) - angles_of(usual, OTHER),
        trial.gait.stride_time - usual.stride_time,
        kinetics_of(trial.gait) - expected_kinetics,
        trial.fit,
        expected_kinetics,
        float(np.nan_to_num(wider)),
        float(np.nan_to_num(pelvis)),
    )


def deviations(people: Sequence[Sequence[DeviationTrial]]) -> list[list[Deviation]]:
    """Of every trial of everybody among `people`, each from what the others are expected to do."""
    return [
        [deviation(trial, [*people[:i], *people[i + 1 :]]) for trial in each]
        for i, each in enumerate(people)
    ]


def stored_fits() -> dict[str, Array]:
    """The fits of the built-in people's trials, by "S05 T05" (experiments/estimate_fits.py)."""
    text = (resources.files("gaitval.subjects.prediction") / "fits.json").read_text(
        encoding="utf-8"
    )
    return {name: UNIT * np.array(values, float) for name, values in loads(text).items()}


def trial_of(subject: Subject, record: GaitRecord, fit: Array) -> DeviationTrial:
    """The trial of a `subject` whose angles and times are those of `record`."""
    gait = normal_form(record, subject.leg_length_m)
    width = pelvic_width(subject)
    return DeviationTrial(gait, fit, step_width(subject, record), width, subject.person)


def learned_from(subject: Subject, others: Sequence[Subject]) -> list[list[DeviationTrial]]:
    """All trials of all `others` whose fits are stored, without the person of `subject`."""
    fits, people = stored_fits(), []
    for other in others:
        if subject.is_person_of(other):
            continue
        trials = [other, *(other.on_trial(each.name) for each in other.trials)]
        known = [(t, fits.get(f"{other.identifier} {t.trial}")) for t in trials]
        gaits = [trial_of(t, t.record(), fit) for t, fit in known if fit is not None]
        if gaits:
            people.append(gaits)
    return people
