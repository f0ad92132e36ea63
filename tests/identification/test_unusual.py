"""A mistake in a subject's file is remarked on, and ten real people are not."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from gaitval.configuration import Configuration
from gaitval.gait.record import REQUIRED_ANGLES, REQUIRED_MOMENTS, FittedCurve
from gaitval.identification.unusual import remarks_before_scaling, remarks_on_body, remarks_on_gait
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.tape import measure_by_tape
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects, load_subject

PEOPLE = builtin_subjects()


def remarks(subject: Subject, others: Sequence[Subject]) -> list[str]:
    return [*remarks_on_body(subject), *remarks_on_gait(subject, others)]


def turned(curve: FittedCurve, factor: float = -1.0) -> FittedCurve:
    return curve.model_copy(
        update={
            "mean": factor * curve.mean,
            "cosine": tuple(factor * each for each in curve.cosine),
            "sine": tuple(factor * each for each in curve.sine),
        }
    )


def with_curves(subject: Subject, group: str, names: tuple[str, ...], factor: float) -> Subject:
    curves = getattr(subject.gait, group)
    changed = curves | {name: turned(curves[name], factor) for name in names}
    return subject.model_copy(update={"gait": subject.gait.model_copy(update={group: changed})})


@pytest.mark.parametrize("person", PEOPLE, ids=lambda person: person.identifier)
def test_nobody_real_is_remarked_on(person: Subject) -> None:
    for trial in (person.trial, *(trial.name for trial in person.trials)):
        assert remarks(person.on_trial(trial), PEOPLE) == []


@pytest.mark.parametrize("name", REQUIRED_ANGLES)
def test_an_angle_whose_sign_is_turned_is_remarked_on(name: str) -> None:
    (message,) = remarks(with_curves(PEOPLE[4], "angles", (name,), -1.0), PEOPLE)
    assert message.startswith(f"S05: gait.angles.{name}: ")
    assert "with its sign turned. Check its sign" in message


@pytest.mark.parametrize("name", REQUIRED_MOMENTS)
def test_a_moment_whose_sign_is_turned_is_remarked_on(name: str) -> None:
    message = remarks(with_curves(PEOPLE[0], "moments", (name,), -1.0), PEOPLE)
    assert any(each.startswith(f"S01: gait.moments.{name}: ") for each in message)
    assert len(message) <= 2  # the other side of a knee may look wrong beside it


@pytest.mark.parametrize("axis", ["forward", "left"])
@pytest.mark.parametrize("side", ["right", "left"])
def test_a_force_whose_sign_is_turned_is_remarked_on(side: str, axis: str) -> None:
    """The vertical one is refused already."""
    person = PEOPLE[4]
    assert person.gait.forces is not None
    force = getattr(person.gait.forces, side)
    other = force.model_copy(update={axis: turned(getattr(force, axis))})
    forces = person.gait.forces.model_copy(update={side: other})
    changed = person.model_copy(update={"gait": person.gait.model_copy(update={"forces": forces})})
    (message,) = remarks(changed, PEOPLE)
    assert message.startswith(f"S05: gait.forces.{side}.{axis}: ")


def test_both_sides_turned_alike_are_remarked_on() -> None:
    names = ("knee_angle_r", "knee_angle_l")
    (message,) = remarks(with_curves(PEOPLE[4], "angles", names, -1.0), PEOPLE)
    assert "gait.angles.knee_angle_r and gait.angles.knee_angle_l" in message


@pytest.mark.parametrize("factor", [0.1, 9.81])
@pytest.mark.parametrize("person", PEOPLE, ids=lambda person: person.identifier)
def test_moments_of_another_size_are_remarked_on(person: Subject, factor: float) -> None:
    message = remarks(with_curves(person, "moments", tuple(person.gait.moments), factor), PEOPLE)
    assert any("times the size of other people's" in each for each in message)


def test_without_forces_or_markers_there_is_less_to_compare() -> None:
    person = load_subject(5)
    bare = person.gait.model_copy(update={"moments": {}, "forces": None})
    assert remarks(person.model_copy(update={"gait": bare, "markers": {}}), PEOPLE) == []
    assert remarks(person, ()) == []


def test_two_measured_legs_are_not_averaged_without_a_word() -> None:
    person = PEOPLE[4]
    measured = measure_by_tape(height_m=person.height_m)
    longer = replace(measured.right, thigh=measured.right.thigh + 0.015)

    def message(body: Measurements, symmetric: bool = True, **more: object) -> list[str]:
        subject = person.model_copy(update={"measurements": body.to_dict(), **more})
        configuration = Configuration.model_validate({"scaling": {"symmetric": symmetric}})
        found = remarks_before_scaling(subject, configuration, person.record())
        return [each for each in found if "mean of both" in each]

    (one,) = message(replace(measured, right=longer))
    assert "the right leg is 1.5 cm longer" in one
    assert message(measured) == []
    assert message(replace(measured, right=longer), symmetric=False) == []
    assert message(replace(measured, right=longer), prosthesis="left") == []
