"""A trial of another file, for a person whose subject is there already."""

from typing import Any

from gaitval.errors import SubjectError


def named_trial(person: Any, other: Any) -> Any:
    """The own trial of the `Subject` `other` (of `gaitval.datasets.subject`, which uses this), as
    a `Trial` under a name that the `Subject` `person` has not yet. Raises SubjectError as
    `Subject.with_trial`.
    """
    differences = [
        f"{name} {here:g} and {there:g}"
        for name, here, there, slack in (
            ("mass_kg", person.mass_kg, other.mass_kg, 0.1 * person.mass_kg),
            ("height_m", person.height_m, other.height_m, 0.03),
            ("leg_length_m", person.leg_length_m, other.leg_length_m, 0.03),
        )
        if abs(here - there) > slack
    ]
    if person.sex != other.sex:
        differences.append(f"sex {person.sex} and {other.sex}")
    if not (person.is_person_of(other) or person.guessed or other.guessed):
        named = (f"{each.person} of {each.laboratory}" for each in (person, other))
        differences.append(" and ".join(named))
    if differences:
        raise SubjectError(
            f"{other.identifier} ({other.source}): a trial of another person than "
            f"{person.identifier} ({person.source}): {', '.join(differences)}. Give a trial of the "
            "same person."
        )
    trial = other.as_trial()
    for known in (person.as_trial(), *person.trials):
        if known.gait.has_curves_of(trial.gait):
            raise SubjectError(
                f"{other.identifier} ({other.source}): the same curves as trial {known.name} "
                f"of {person.identifier}. A trial cannot be both used and held out; give another."
            )
    names = {person.trial, *(known.name for known in person.trials)}
    name = trial.name
    for number in range(2, 2 + len(names)):
        name = name if name not in names else f"{trial.name}-{number}"
    return trial.model_copy(update={"name": name})
