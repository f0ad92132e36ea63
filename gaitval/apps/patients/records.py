"""Subjects from one stride a side.

What the stride shows is its record: pelvis, hips, knees, ankles, and where the feet point. The rest
is what other people have (subtalar angle), or an estimate with an interval (`Patient.estimates`):
leg length, speed, stride time, stance, the time of the left heel strike. Both sides are the
person's own; nothing is mirrored.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final

import numpy as np

from gaitval.apps.patients import estimates
from gaitval.apps.patients.estimates import EstimatedValue
from gaitval.apps.patients.one_stride import STRIKE_PRIOR, Smoothed, left_strike, smoothed
from gaitval.apps.patients.people import PersonRow, person_of
from gaitval.apps.patients.rolling_foot import STANCE_BIAS, RolledFeet, feet
from gaitval.apps.patients.sound_side import expected_of, later_of_prosthesis
from gaitval.apps.patients.strides import PersonStrides
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.errors import SubjectError
from gaitval.gait.record import FittedCurve, PeriodicCurve, periodic_through
from gaitval.gait.sampling import SAMPLES
from gaitval.scaling.anthropometry import ADULT_YEARS, mass_fractions
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.scaling import scale_subject
from gaitval.scaling.tape import measure_by_tape
from gaitval.subjects.identity import identity
from gaitval.subjects.stored_gait import Gait, StanceFraction
from gaitval.subjects.subject import Subject, make_subject
from gaitval.subjects.subject_file import builtin_subjects

PROSTHESIS_KG: Final = {"shank": 1.9, "foot": 0.9}
"""Of an above-knee prosthesis: a microprocessor knee of 1.24 kg (C-Leg 4, maker's data sheet, from
memory) with pylon, adapters and cover; a carbon foot with its shell, 0.4 to 0.6 kg by makers' data
sheets (from memory), in a shoe."""

EXPECTED: Final = ("subtalar_angle",)
"""Angles that the model has and a stride has not: the mean of the built-in people."""

_STATURE: Final[Mapping[str | None, tuple[float, float]]] = {
    "M": (1.757, 0.068),
    "F": (1.630, 0.064),
    None: (1.694, 0.092),
}
"""m, mean and SD of stature in ANSUR II (Gordon et al. 2014), where none is recorded; of both sexes
where that is not known either."""
_BMI: Final = EstimatedValue(26.0, 4.0, "a body mass index of 26")
"""kg/m², where no mass is recorded."""


@dataclass(frozen=True)
class Patient:
    """A person of whom a stride a side is known, as a subject.

    Attributes
    ----------
    subject : for every run of gaitval.
    strides : as recorded.
    person : row of the table of people.
    state : such as "off", from the name; may be empty.
    estimates : by name, what was not recorded and what it may be off by; those that were recorded
        say so.
    smoothing : by angle with its side, what became of the stride, rad.
    mismatch : rad, RMS by which the two sides' strides disagree about the one pelvis.
    affected : side that the table, or the amputation, names; None if nothing does.
    """

    subject: Subject
    strides: PersonStrides
    person: PersonRow
    state: str
    estimates: Mapping[str, EstimatedValue]
    smoothing: Mapping[str, Smoothed]
    mismatch: float
    affected: Side | None


def patient(
    strides: PersonStrides,
    people: Mapping[str, PersonRow],
    *,
    speed: float | None = None,
    healthy: bool = False,
    citation: str = "not given",
    licence: str = "not given",
    laboratory: str | None = None,
) -> Patient:
    """The subject of a person's strides.

    Parameters
    ----------
    strides : a stride a side.
    people : tables of people, by identifier.
    speed : m/s, if it is known otherwise than from the tables.
    healthy : the walk ratio is that of healthy adults, with their spread.
    citation, licence : of the strides.
    laboratory : who recorded; by default the strides' group, or WBDS.

    Raises
    ------
    SubjectError : a value is not plausible, or a child's stature or mass is not known.
    """
    person, state = person_of(strides.subject, people)
    found = _size(strides, person)
    height, mass, leg = found["height"], found["mass"], found["leg_length"]
    smoothing = {name: smoothed(np.radians(values)) for name, values in strides.angles.items()}
    curves = {name: each.curve for name, each in smoothing.items()} | expected_angles()
    angles = {name: each.periodic() for name, each in curves.items()}
    strike = left_strike(angles, STRIKE_PRIOR)
    found["left_phase"] = EstimatedValue(strike.phase, strike.sd, "both sides' views of the pelvis")
    values: dict[str, Any] = {
        "identifier": re.sub(r"[^A-Za-z0-9_-]+", "_", strides.subject),
        "trial": state or "walk",
        **_who(strides, person, laboratory),
        "source": f"{strides.subject}, one stride a side ({', '.join(strides.trials.values())})",
        "citation": citation,
        "licence": licence,
        # Without a sex, the segment tables of men, as for every body of unknown sex here.
        "sex": person.sex or "M",
        "age_years": person.age,
        "prosthesis": person.amputation or ("none" if healthy else None),
        "mass_kg": mass.value,
        "height_m": height.value,
        "leg_length_m": leg.value,
        "walking_speed_m_s": 1.0,
        "stride_time_s": 1.2,
        "left_phase": strike.phase,
        "stance_fraction": StanceFraction(right=0.62, left=0.62),
        "gait": Gait(samples=SAMPLES, angles=curves),
        **_lengths(height.value, mass.value, leg, person),
    }
    draft = make_subject(values, strides.subject)
    model = scale_subject(draft, symmetric=not two_sided(person)).model
    on_ground = feet(angles, strike.phase, model)
    found |= _way(on_ground, leg, person, speed, healthy=healthy)
    found |= _stances(on_ground.stance, values["identifier"], person.amputation)
    values |= {
        "walking_speed_m_s": found["speed"].value,
        "stride_time_s": found["stride_time"].value,
        "stance_fraction": StanceFraction(
            right=found["stance_right"].value, left=found["stance_left"].value
        ),
    }
    sides = person.affected or {}
    affected = person.amputation or sides.get(state, sides.get(""))
    return Patient(
        make_subject(values, strides.subject),
        strides,
        person,
        state,
        found,
        smoothing,
        strike.mismatch,
        affected,
    )


def _size(strides: PersonStrides, person: PersonRow) -> dict[str, EstimatedValue]:
    """Stature, mass and leg length, and by how much the legs differ if that is recorded; of a child
    SubjectError if they would have to be estimated.
    """
    lacking = [name for name in ("height", "mass") if getattr(person, name) is None]
    if lacking and person.age is not None and person.age < ADULT_YEARS:
        raise SubjectError(
            f"{strides.subject}: {person.age:g} years old, and no {' and no '.join(lacking)}: what "
            "is not recorded is estimated from adults. Give it in the table of people."
        )
    mean, sd = _STATURE[person.sex]
    height = _known(person.height, mean, sd, "the mean of adults")
    mass = _known(
        person.mass,
        _BMI.value * height.value**2,
        # Of the index, and of the square of a stature that was not recorded.
        float(np.hypot(_BMI.sd * height.value**2, 2.0 * _BMI.value * height.value * height.sd)),
        _BMI.how,
    )
    leg = estimates.leg_length(height, person.leg_length)
    found = {"height": height, "mass": mass, "leg_length": leg}
    if person.legs is not None:
        found["leg_difference"] = estimates.leg_difference(person.legs)
    return found


def _way(
    on_ground: RolledFeet,
    leg: EstimatedValue,
    person: PersonRow,
    speed: float | None,
    *,
    healthy: bool,
) -> dict[str, EstimatedValue]:
    """Speed, stride time and stride length, by the feet `on_ground` or a given `speed`, m/s."""
    length = EstimatedValue(
        on_ground.stride_length,
        float(np.hypot(on_ground.sd, on_ground.stride_length * leg.sd / leg.value)),
        "the way of the ball of the foot under the pelvis",
    )
    known = person.speed if speed is None else speed
    went = estimates.pace(length, leg, known, patient=not healthy)
    return {
        "speed": went.speed if speed is None else went.speed._replace(how="given"),
        "stride_time": went.stride_time,
        "stride_length": went.stride_length,
    }


@cache
def expected_angles() -> dict[str, FittedCurve]:
    """Mean curves of the built-in people for `EXPECTED`, of both sides together."""
    phase = np.arange(100) / 100
    found = {}
    for name in EXPECTED:
        known = [
            subject.gait.angles_of_both()[f"{name}_{side[0]}"](phase)
            for subject in builtin_subjects()
            for side in SIDES
        ]
        curve: PeriodicCurve = periodic_through(np.mean(known, axis=0), 8)
        for side in SIDES:
            found[f"{name}_{side[0]}"] = FittedCurve.fitted((curve, 0.0))
    return found


def _known(value: float | None, mean: float, sd: float, how: str) -> EstimatedValue:
    return (
        EstimatedValue(mean, sd, how) if value is None else EstimatedValue(value, 0.0, "recorded")
    )


def _stances(
    seen: Mapping[Side, float], identifier: str, amputation: Side | None
) -> dict[str, EstimatedValue]:
    """Stance of each side, of its own cycle, from what is `seen` of the ball of its foot."""
    how = "the ball of the foot furthest back"
    found = {f"stance_{side}": EstimatedValue(seen[side], STANCE_BIAS.sd, how) for side in SIDES}
    if amputation is not None:
        sound, usual = opposite(amputation), expected_of(identifier)
        found[f"stance_{sound}"] = EstimatedValue(
            seen[sound] + usual.later,
            float(np.hypot(STANCE_BIAS.sd, usual.later_sd)),
            f"{how}, and how much later sound sides of amputees leave the ground",
        )
        later, sd = later_of_prosthesis(identifier)
        found[f"stance_{amputation}"] = EstimatedValue(
            seen[amputation] + later,
            float(np.hypot(STANCE_BIAS.sd, sd)),
            f"{how}, and how much later prosthetic feet leave the ground",
        )
    return found


def _who(strides: PersonStrides, person: PersonRow, laboratory: str | None) -> dict[str, Any]:
    """Person, laboratory and what of it was assumed."""
    of_wbds = identity(None, None, sources=[strides.subject], name=strides.subject)
    if laboratory is None and of_wbds.laboratory == "WBDS":
        return {"person": of_wbds.person, "laboratory": of_wbds.laboratory}
    group = strides.group.removesuffix("_off").removesuffix("_on")
    return {"person": person.identifier, "laboratory": laboratory or group}


def _lengths(height: float, mass: float, leg: EstimatedValue, person: PersonRow) -> dict[str, Any]:
    """Lengths of the body by leg length and stature, as `tape`; as `measurements` where each leg
    has its own, or the masses of a prosthesis.
    """
    tape = {"hip_height": leg.value} if leg.sd == 0.0 else {}
    if not two_sided(person):
        return {"tape": tape}
    if person.legs is not None:  # the trunk stands on the mean of both
        tape = {"hip_height": float(np.mean(list(person.legs.values())))}
    measured = measure_by_tape(height_m=height, **tape)
    if person.legs is not None:
        right, left = (
            measure_by_tape(height_m=height, hip_height=person.legs[side]) for side in SIDES
        )
        measured = replace(measured, right=right.right, left=left.left)
    if person.amputation is not None:
        fractions = mass_fractions(person.sex or "M", person.age)
        measured = with_prosthesis(measured, person.amputation, mass, fractions)
    return {"measurements": measured.to_dict()}


def two_sided(person: PersonRow) -> bool:
    """Whether the body of a `person` has two different legs."""
    return person.amputation is not None or person.legs is not None


def with_prosthesis(
    measured: Measurements, side: Side, mass: float, fractions: Mapping[str, float]
) -> Measurements:
    """`measured` with the shank and foot of an above-knee prosthesis on a `side`. `mass` kg is that
    of the body with the prosthesis; `fractions` are of each segment of a sound body's mass,
    `anthropometry.mass_fractions`.

    The sound leg's masses are given too, since a mass that is known of one side only is that of
    both: its shares of the body that the person would be with two sound legs.
    """
    worn = PROSTHESIS_KG
    whole = (mass - worn["shank"] - worn["foot"]) / (1.0 - fractions["shank"] - fractions["foot"])
    legs = {
        each: replace(
            getattr(measured, each),
            **{
                f"{part}_mass": own if each == side else fractions[part] * whole
                for part, own in worn.items()
            },
        )
        for each in SIDES
    }
    return replace(measured, right=legs["right"], left=legs["left"], symmetric=False)
