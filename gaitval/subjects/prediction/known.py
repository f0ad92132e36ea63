"""What of a person's record is known to the model in a run, and what is held out.

Everything but the comparison at the end - reference, feed-forward, reward, identification,
correction - reads the known record. By default that is the person's record. With `record.use =
"kinematics"` it has the person's angles, speed, stride time and time of left heel strike; moments,
forces and stance are those expected of anybody at this speed from other people's. With
`record.holdout` or `record.speed` it is what the person's other trials predict for another speed
(`speed`); with `record.slope` or `record.load` what is expected there (`slopes`). What is held out
is read by nothing but the comparison, which tests/workflows/test_poison.py proves with NaN in its
place.
"""

from collections.abc import Sequence
from typing import Final, Literal, NamedTuple

import numpy as np

from gaitval.configuration import RecordSettings
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.record import GaitRecord
from gaitval.subjects.prediction.slopes import ON_A_SLOPE, is_changed, on_ground
from gaitval.subjects.subject import Subject

RecordedQuantity = Literal["angles", "timing", "moments", "forces", "stance"]
QUANTITIES: Final[tuple[RecordedQuantity, ...]] = (
    "angles", "timing", "moments", "forces", "stance",
)  # fmt: skip
"""What a record consists of. Timing: speed, stride time, time of left heel strike."""

# What cameras alone record, without force plates.
KINEMATIC: Final[tuple[RecordedQuantity, ...]] = ("angles", "timing")

KINEMATIC_ACCURACY: Final = RecordAccuracy(
    sagittal=np.deg2rad(1.2),
    frontal=np.deg2rad(1.0),
    rotation=np.deg2rad(1.0),
    pelvis=np.deg2rad(1.5),
    moment=0.05,
    adduction_moment=0.05,
    forward_force=0.0045,
    sideways_force=0.0035,
    vertical_force=0.015,
    twist=5e-4,
    hip_centre=0.0,
)
"""A third of the error of the expected forces and half of that of the moments: the forces that the
recorded angles alone would give are further off than the expected ones, but the moments at given
forces depend on how this person moves. Other people's moments are about other people's hip centres,
so these are not looked for: with them the hip's moments were 0.005 Nm/kg worse."""

PREDICTED_ACCURACY: Final = RecordAccuracy(
    sagittal=np.deg2rad(0.3),
    frontal=np.deg2rad(1.2),
    rotation=np.deg2rad(1.5),
    pelvis=np.deg2rad(1.6),
    moment=0.015,
    adduction_moment=0.015,
    forward_force=0.0035,
    sideways_force=0.0025,
    vertical_force=0.006,
    twist=5e-4,
)
"""Of a record that is predicted from other trials: a quarter to a half of the prediction's own
errors near a walked speed, in all that the walk is compared in, so that the fit adds the same share
to each (docs/what-we-tried.md). Hip rotation gives way as in a record: held to 0.3 degrees, hip
flexion and pelvis moved in its place where a loaded foot would turn."""


class KnownRecord(NamedTuple):
    """The record that is known to the model, parts of which may be expected instead of recorded,
    and the accuracy with which the reference must follow it.
    """

    record: GaitRecord
    accuracy: RecordAccuracy


def quantities_recorded(subject: Subject) -> tuple[RecordedQuantity, ...]:
    """What was recorded of the person of a `subject`."""
    return QUANTITIES if subject.has_kinetics else KINEMATIC


def quantities_known(subject: Subject, settings: RecordSettings) -> tuple[RecordedQuantity, ...]:
    """The quantities of the compared record of `subject` that are known to the model in a run with
    `settings`, which say what it may use; none of it if the walk is predicted.
    """
    if is_predicted(settings):
        return ()
    return KINEMATIC if settings.use == "kinematics" else quantities_recorded(subject)


def with_expected_kinetics(subject: Subject, others: Sequence[Subject]) -> GaitRecord:
    """The record of `subject`; if it has no moments and forces, with those to expect from `others`,
    without that person. Raises SubjectError if there are too few of them.
    """
    return _of_a_trial(subject, RecordSettings(), others).record


def is_predicted(settings: RecordSettings) -> bool:
    """Whether, by `settings`, the walk is of another trial or speed than the model knows."""
    return bool(settings.holdout) or is_unrecorded(settings)


def is_unrecorded(settings: RecordSettings) -> bool:
    """Whether, by `settings`, there is no record at the speed of the walk to compare with."""
    return (settings.speed > 0.0 or is_changed(settings)) and not settings.holdout


def known_record(
    subject: Subject,
    settings: RecordSettings,
    others: Sequence[Subject],
    *,
    speed: float | None = None,
    forced: bool = False,
) -> KnownRecord:
    """The record of `subject` that is known to the model in a run with `settings`, at `speed` m/s
    instead of theirs if it is given; `forced` also at one far from every trial. `others` are people
    whose gait is known, without that person. Raises SubjectError if no trial is left, the speed is
    too far away, or there are too few others to expect kinetics from.
    """
    if is_changed(settings):
        level = settings.model_copy(update={"slope": 0.0, "cross_slope": 0.0, "load": 0.0})
        there = known_record(subject, level, others, speed=speed, forced=forced)
        return KnownRecord(on_ground(there.record, settings), ON_A_SLOPE)
    if not is_predicted(settings) and speed is None:
        return _of_a_trial(subject, settings, others)
    from gaitval.subjects.prediction.speed import at_speed, trials_known

    trials = trials_known(subject, settings.holdout or None)
    known = [_of_a_trial(trial, settings, others).record for trial in trials]
    wanted = speed or settings.speed or subject.on_trial(settings.holdout).walking_speed_m_s
    found = at_speed(subject, known, wanted, others, forced=forced)
    # One trial with expected kinetics makes the whole prediction no better than expected ones.
    fully = settings.use == "all" and all(trial.has_kinetics for trial in trials)
    return KnownRecord(found, PREDICTED_ACCURACY if fully else KINEMATIC_ACCURACY)


def _of_a_trial(
    subject: Subject, settings: RecordSettings, others: Sequence[Subject]
) -> KnownRecord:
    if settings.use == "all" and subject.has_kinetics:
        return KnownRecord(subject.record(), RecordAccuracy())
    from gaitval.subjects.prediction.population import with_others_kinetics

    return KnownRecord(with_others_kinetics(subject, others), KINEMATIC_ACCURACY)
