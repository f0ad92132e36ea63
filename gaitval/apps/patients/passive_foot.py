"""The ankle moment that a passive prosthetic foot gives at the angles of its own walk.

A prosthetic foot has no muscles: what bends it is its load. It is taken as two springs of one
stiffness on a rigid shank, one below the heel and one below the ball of the foot (hindfoot and
forefoot stiffness: Adamczyk et al. 2017, Hum Mov Sci 54:154). Both carry the vertical force F, and
with b and a the distances of ball and heel from the ankle and θ the angle from the unloaded one

    M = -(k θ + F (b - a) / 2).

So a foot under load bends about an angle that is more plantarflexed than the one of swing, because
the heel carries most where the moment is zero. The unloaded angle is the mean of swing; b and a are
those of the body's own foot; F is what healthy people have over this stance. The stiffness k is the
one with which the moment where the ankle is turned furthest is that of healthy people: there the
force is on the ball of either foot. No number of it is chosen.

Both this and the healthy moment in the time of this ankle (`told.bent_ankle`) are guesses
from different knowledge, so their mean is expected, with what of other amputees' moments is left
then, by the ankle's angle (`sound_side.prosthetic_rest_of`).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.apps.patients.known_record import HARMONICS, SAMPLES, known_record, most_dorsiflexed
from gaitval.apps.patients.records import Patient, two_sided
from gaitval.apps.patients.sound_side import prosthetic_rest_of
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.gait.record import GaitRecord, PeriodicCurve, periodic_through
from gaitval.model.body import BodyModel
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject import Subject

UNLOADED: Final = (0.05, 0.04)
"""Of the cycle, left out after toe-off and before heel strike, where a foot may still bend."""

BALL: Final = 0.586
"""Share of the way from the heel's sphere to the toes' at which the forefoot's spring is: the mean
of the two spheres of PredSim's foot. A prosthetic foot has no metatarsal heads; with the spring
there moments of twelve amputees were 0.013 Nm/kg further off."""

LEAST_BENT: Final = float(np.radians(5.0))
"""rad, of dorsiflexion, by which the load is divided at least: 18 amputees bend it by 7 to 17
degrees, and what is hardly bent says little of its stiffness.
"""


def expected_ankles(patient: Patient, others: Sequence[Subject]) -> dict[Side, PeriodicCurve]:
    """Ankle moments to expect of a `patient` of whom angles alone are known, Nm/kg, dorsiflexion
    positive, each side over its own cycle. No walk is needed.
    """
    model = scale_subject(patient.subject, symmetric=not two_sided(patient.person)).model
    record = patient_record(patient, others, model)
    return {side: record.moments[f"ankle_angle_{side[0]}"] for side in SIDES}


def patient_record(patient: Patient, others: Sequence[Subject], model: BodyModel) -> GaitRecord:
    """Angles and timing of a `patient`, and the kinetics to expect: healthy people's over this
    stance and in the time of these feet (`told.told_record`), and of a prosthetic foot as this
    module says.
    """
    side = patient.person.amputation
    record = known_record(patient.subject, others, model, side)
    if side is None:
        return record
    name, cycle = f"ankle_angle_{side[0]}", np.arange(101) / 100.0
    found = with_passive_foot(record, model, side)
    rest = prosthetic_rest_of(patient.subject.identifier, record.angles[name](cycle))
    phase = np.arange(SAMPLES) / SAMPLES
    moment = found.moments[name](phase) + np.interp(phase, cycle, rest)
    moments = dict(found.moments) | {name: periodic_through(moment, HARMONICS)}
    return replace(found, moments=moments)


def with_passive_foot(record: GaitRecord, model: BodyModel, side: Side) -> GaitRecord:
    """`record` with the ankle moment expected of a prosthetic foot on a `side`. The record has
    angles, stance and forces of the patient, and the registered healthy moments; `model` is the
    body, for the places of heel and ball below the ankle.
    """
    name = f"ankle_angle_{side[0]}"
    passive = passive_ankle(record, model, side)
    phase = np.arange(SAMPLES) / SAMPLES
    both = 0.5 * (passive(phase) + record.moments[name](phase))
    return replace(record, moments=dict(record.moments) | {name: periodic_through(both, HARMONICS)})


def passive_ankle(record: GaitRecord, model: BodyModel, side: Side) -> PeriodicCurve:
    """Moment of the two springs, Nm/kg, dorsiflexion positive; parameters as `with_passive_foot`
    takes them. A foot that is not dorsiflexed beyond its unloaded angle has a stiffness of zero.
    """
    name, stance = f"ankle_angle_{side[0]}", record.stance_fraction[side]
    phase = np.arange(SAMPLES) / SAMPLES
    angle = record.angles[name](phase)
    swings = (phase > stance + UNLOADED[0]) & (phase < 1.0 - UNLOADED[1])
    bent = angle - float(np.mean(angle[swings]))
    heel_ahead, ball_ahead = _places(model, side)
    load = np.where(
        phase <= stance, record.ground_reaction(side, np.minimum(phase, stance))[:, 2], 0
    )
    # Nm/kg: forces in body weights times metres.
    offset = 0.5 * GRAVITY * load * (ball_ahead + heel_ahead)
    furthest = round(most_dorsiflexed(record.angles[name], stance) * SAMPLES)
    highest = -float(record.moments[name](phase).min())
    stiffness = 0.0
    if bent[furthest] > 0.0:
        stiffness = max(highest - offset[furthest], 0.0) / max(bent[furthest], LEAST_BENT)
    moment = np.where(phase <= stance, -(stiffness * bent + offset), 0.0)
    return periodic_through(moment, HARMONICS)


def _places(model: BodyModel, side: Side) -> tuple[float, float]:
    """How far the springs of heel (negative) and ball are ahead of the ankle, m."""
    found = {each.name: each.position[0] for each in model.spheres}
    heel, joint = found[f"contact_heel_{side[0]}"], model[f"toes_{side[0]}"].joint_position[0]
    toes = found[f"contact_toes_medial_{side[0]}"] + joint
    return float(heel), float(heel + BALL * (toes - heel))
