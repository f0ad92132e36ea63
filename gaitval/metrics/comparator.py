"""What the walks of a run are measured against."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.coordinates import Side
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.gait.record import GaitRecord
from gaitval.metrics.acceptance import Baselines, known_to
from gaitval.metrics.baselines import predicted_parts
from gaitval.metrics.curve_results import KINDS, Kind, RecordResult, by_kind
from gaitval.metrics.origin import record_origins
from gaitval.metrics.other_trials import repeats
from gaitval.metrics.recorded import recorded_part
from gaitval.metrics.walk_muscles import lost_joints
from gaitval.model.body import BodyModel
from gaitval.subjects.prediction.known import is_predicted
from gaitval.subjects.prediction.slopes import body_without

if TYPE_CHECKING:
    from gaitval.subjects.subject import Subject


@dataclass(frozen=True)
class Comparator:
    """What the walks of a run are measured against.

    Attributes
    ----------
    record : with which they are compared.
    curves : of the record, rad, Nm/kg and body weights.
    recorded : its part of `metrics.json`.
    model, leg_length : the body before mu; m.
    person : the same without what the person carries.
    height : of the person, m.
    lost : coordinates of joints that a prosthesis has, by side.
    baselines : the predictions without a model, and where what is compared comes from.
    known : what the record itself is known to, in the units of the curves.
    """

    record: GaitRecord
    curves: Curves
    recorded: RecordResult
    model: BodyModel
    person: BodyModel
    leg_length: float
    height: float
    lost: Mapping[Side, Collection[str]]
    baselines: Baselines
    known: Mapping[tuple[Kind, str], float]

    @property
    def laden(self) -> float:
        """Mass that moments are divided by, that of person and load, over the person's."""
        return self.model.mass / self.person.mass


def compared_with(
    subject: "Subject",
    record: GaitRecord,
    others: Sequence["Subject"],
    model: BodyModel,
    configuration: Configuration,
    hip_centre: Array | None = None,
) -> Comparator:
    """What the walks of `subject` in a run with `configuration` are measured against: `record`, and
    predictions without a model from `others`. `model` is the body before mu, `hip_centre` where the
    record's hips are in it (`ReferenceMotion.hip_centre`).
    """
    origins = record_origins(subject, configuration.record)
    curves = recorded_curves(record)
    # what repeats the walk's own trial measures the same thing again and is no guess, unless it is
    # all that a prediction knows
    alone = subject
    if not is_predicted(configuration.record):
        other = tuple(trial for trial in subject.trials if not repeats(trial, subject))
        alone = subject.model_copy(update={"trials": other})
    own = KINDS if configuration.record.use == "all" else KINDS[:1]
    free_hips = hip_centre is not None and bool(np.any(hip_centre))
    guesses = predicted_parts(alone, others, by_kind(curves), origins, free_hips=free_hips)
    person = body_without(model, configuration.record)
    laden = model.mass / person.mass
    recorded = recorded_part(record, subject, model.ground, laden, hip_centre, origins=origins)
    return Comparator(
        record=record,
        curves=curves,
        recorded=recorded,
        model=model,
        person=person,
        leg_length=subject.leg_length_m,
        height=subject.height_m,
        lost=lost_joints(subject),
        baselines=Baselines(guesses, own, origins),
        known=known_to(subject.uncertainty),
    )
