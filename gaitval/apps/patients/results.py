"""What is found of a patient's strides: scores, norms by age and speed, and what cannot be said."""

from collections.abc import Mapping
from typing import Any, ClassVar, Final, Literal

import numpy as np

from gaitval.apps.patients.passive_foot import expected_ankles
from gaitval.apps.patients.records import Patient
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.metrics.curve_results import GaitProfile
from gaitval.metrics.gait_profile import gait_profile
from gaitval.metrics.norms import MIDDLE, norms
from gaitval.metrics.typed import Count, Flag, Number, Result
from gaitval.reporting.written import Written
from gaitval.subjects.plausible import ADULT
from gaitval.subjects.subject_file import builtin_subjects

BEYOND: Final = 2.0
"""Standard deviations from the norm beyond which a curve is unlike healthy people's."""
NORMS: Final = {
    "stride_time": "parameter/stride_time",
    "stance_right": "parameter/stance_fraction",
    "stance_left": "parameter/stance_fraction",
}
"""Norm of an estimate, where there is one."""

NEVER_KNOWN: Final = (
    "How strong a muscle is, whether it is spastic, and whether anything hurts: angles do not show "
    "it.",
    "What a stick, a rail or a helping hand carries: nothing measured it, and the walker has none.",
    "How much strides differ from one to the next: there is one a side.",
    "What moments and forces act: none were measured. Those of a walk are predictions.",
)
"""What no page of this kind can say."""


class AngleRow(Result):
    """An angle of the Gait Profile Score; deg but for the shares."""

    name: str
    score_right: Number
    score_left: Number
    healthy: Number
    healthy_sd: Number
    beyond_right: Number | None
    """% of the cycle that is more than `BEYOND` SD from people of this speed and age, or, of a
    child, from children at their free speed; None where there is no norm."""
    beyond_left: Number | None
    range_right: Number
    range_left: Number
    difference: Number
    """RMS of the right less the left curve."""


class ValueRow(Result):
    """A quantity of timing or body in SI units, with its interval of 90 % if it was estimated."""

    name: str
    value: Number
    low: Number | None
    high: Number | None
    norm: Number | None
    """Mean of healthy people of this speed and age; None where there are none."""
    norm_sd: Number | None
    how: str


class WalkResult(Result):
    """A walk without training."""

    falls: Count
    starts: Count
    angle: Number | None
    """deg, mean over pelvis, hips, knees and ankles of the RMS from the stride."""
    score: Number | None
    """Gait Profile Score of the walk, deg."""


class PatientResult(Written):
    """What `gaitval patients` found of one person."""

    NAME: ClassVar[str] = "patient"
    TEMPLATE: ClassVar[str] = "gaitval.apps.patients:patient.html.j2"
    TABLES: ClassVar[Mapping[str, tuple[str, type[Result]]]] = {
        "angles": ("angles", AngleRow),
        "values": ("values", ValueRow),
    }

    schema_version: Literal[1]
    name: str
    group: str
    state: str
    """Such as "off"; may be empty."""
    trials: dict[str, str]
    """That the strides are of, by side."""
    table: str
    """Of people, in which the person has a row; empty if none has."""
    sex: Literal["F", "M"] | None
    age_years: Number | None
    prosthesis: Side | None
    affected: Side | None
    profile: GaitProfile
    angles: list[AngleRow]
    values: list[ValueRow]
    child: Flag
    beyond: Flag
    """Whether the speed is outside that of the people of the angles' norms."""
    smoothing_deg: dict[str, Number]
    """RMS by which the subject's periodic curves are from the stride."""
    pelvis_mismatch_deg: Number
    walk: WalkResult | None
    expected_ankle_moment_nm_kg: dict[Side, list[Number]] | None
    """Of an amputee, dorsiflexion positive, by side over its own cycle, 101 points; no walk is
    needed."""
    cannot: list[str]
    """What cannot be said."""


def result_of(patient: Patient, walk: Mapping[str, Any] | None) -> PatientResult:
    """What is found of a `patient`, and of a `walk`, as `apps.patients.walk.walk` gives it, if
    there was one.
    """
    person, usual = patient.person, norms(patient.subject)
    profile = gait_profile(patient.strides.angles, load_controls().curves)
    return PatientResult.made(
        name=patient.subject.identifier,
        group=patient.strides.group,
        state=patient.state,
        trials=patient.strides.trials,
        table=person.table,
        sex=person.sex,
        age_years=person.age,
        prosthesis=person.amputation,
        affected=patient.affected,
        profile=profile,
        angles=[_angle(patient, name, profile) for name in PROFILE_ANGLES],
        values=_values(patient),
        child=_is_child(patient),
        beyond=any(each.beyond for name, each in usual.items() if name.startswith("angles/")),
        smoothing_deg={n: np.degrees(each.rms) for n, each in patient.smoothing.items()},
        pelvis_mismatch_deg=np.degrees(patient.mismatch),
        walk=None
        if walk is None
        else {
            "falls": walk["falls"],
            "starts": walk["starts"],
            "angle": walk["angle"],
            "score": walk["scores"]["walk"],
        },
        expected_ankle_moment_nm_kg=_ankles(patient),
        cannot=[*NEVER_KNOWN, *_of_this_person(patient)],
    )


def _ankles(patient: Patient) -> dict[Side, Array] | None:
    if patient.person.amputation is None:
        return None
    ankles = expected_ankles(patient, builtin_subjects())
    return {side: curve(np.linspace(0.0, 1.0, 101)) for side, curve in ankles.items()}


def _angle(patient: Patient, name: str, profile: GaitProfile) -> dict[str, Any]:
    controls, norm = load_controls(), norms(patient.subject).get(f"angles/{name}")
    right, left = (patient.strides.angles[f"{name}_{side[0]}"] for side in SIDES)
    mean, sd = controls.scores[name]
    row: dict[str, Any] = {
        "name": name,
        "healthy": mean,
        "healthy_sd": sd,
        "difference": np.sqrt(np.mean((right - left) ** 2)),
    }
    for side, own in zip(SIDES, (right, left), strict=True):
        row[f"score_{side}"] = profile.scores[f"{name}_{side[0]}"]
        row[f"range_{side}"] = np.ptp(own)
        row[f"beyond_{side}"] = None
        if norm is not None:
            row[f"beyond_{side}"] = 100.0 * np.mean(np.abs(own - norm.mean) > BEYOND * norm.sd)
    return row


def _values(patient: Patient) -> list[dict[str, Any]]:
    usual, rows = norms(patient.subject), []
    for name, of in patient.estimates.items():
        low, high = of.interval() if of.sd > 0.0 else (None, None)
        norm = usual.get(NORMS.get(name, ""))
        shown = norm is not None and not norm.beyond
        rows.append(
            {
                "name": name,
                "value": of.value,
                "low": low,
                "high": high,
                "norm": norm.mean if norm is not None and shown else None,
                "norm_sd": norm.sd if norm is not None and shown else None,
                "how": of.how,
            }
        )
    return rows


def _is_child(patient: Patient) -> bool:
    """Whether `norms` are those of children."""
    age = patient.person.age
    return age is not None and age < ADULT


def _of_this_person(patient: Patient) -> list[str]:
    """What cannot be said of this one."""
    person = patient.person
    known = (
        (person.sex, "Whether the person is male or female: the body is a male's."),
        (person.age, f"What is usual at this age: norms are those of {MIDDLE['age']:.0f} years."),
        (
            not _is_child(patient),
            "What is usual at this speed: the children beside whom the person is shown walked at "
            "their free speed. A child that walks slowly differs from them for its speed alone.",
        ),
        (
            patient.estimates["speed"].sd == 0.0,
            "How fast the person walked: norms are read at the estimated speed.",
        ),
        (person.legs, "Whether the legs differ in length: they were not measured on both sides."),
        (
            person.amputation is None,
            "What the prosthesis does between socket and foot: its masses are in the body, its "
            "knee and ankle are moved like sound ones.",
        ),
        (patient.affected, "Which side is affected: no table names one."),
    )
    return [words for there, words in known if not there]
