"""Settings given to a run that no stage of it reads."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from gaitval.configuration import Configuration, Start
from gaitval.study.stage import Run, Stage

PARTS: Final[Mapping[str, str]] = {"walks": "validation"}
"""Sections of the configuration that stages depend on in part, by the name of that part."""

BY_THE_RUN: Final[Mapping[str, tuple[str, ...]]] = {"identification": ("rounds", "kappa")}
"""Keys that the loop of Algorithm 1 reads, and no stage depends on."""

BY_THE_REPORT: Final = "report"
"""The section that the report reads from `configuration.toml`, and no stage names."""

FROM_NOTHING: Final = ("initial_log_std", "exploration_hold", "difficulty_ramp")
"""Settings of `training` that only a training from nothing reads: another begins with little
exploration and the full randomisation."""
FROM_A_POLICY: Final = ("warm_learning_rate_factor",)
"""And one that only the others read."""


def given(configuration: Configuration) -> list[tuple[str, str]]:
    """Section and key of every setting in `configuration` that was given and is not the default."""
    default = Configuration()
    return [
        (section, key)
        for section in sorted(configuration.model_fields_set - {"seed"})
        for key in sorted(getattr(configuration, section).model_fields_set)
        if getattr(getattr(configuration, section), key) != getattr(getattr(default, section), key)
    ]


def _of_other_laws(law: str) -> set[str]:
    """Settings of `contact` that only other laws read."""
    from gaitval.walk.contact.law import LAWS

    others = {key for each in LAWS.values() for key in each().settings}
    return others - set(LAWS[law]().settings)


def unread(configuration: Configuration, stages: Sequence[Stage], start: Start) -> Iterator[str]:
    """A message, with the reason, for each setting given in `configuration` that none of `stages`
    reads. `start` is what the training starts from.
    """
    read: dict[str, set[str]] = {BY_THE_REPORT: set(type(configuration.report).model_fields)}
    for stage in stages:
        for name, values in stage.values.items():
            # other values are versions, speeds and hashes, not settings
            if isinstance(values, Mapping):
                section = PARTS.get(name, name)
                read.setdefault(section, set()).update(values, BY_THE_RUN.get(section, ()))
    for section, key in given(configuration):
        value: Any = getattr(getattr(configuration, section), key)
        if section == "training" and key in FROM_NOTHING and start != "scratch":
            why = "only a training from nothing does (--scratch)"
        elif section == "training" and key in FROM_A_POLICY and start == "scratch":
            why = "only a training that starts from a policy does"
        elif section == "contact" and key in _of_other_laws(configuration.contact.law):
            why = "it is of another contact law"
        elif key not in read.get(section, ()):
            why = "it is for other commands"
        else:
            continue
        yield f"{section}.{key} = {value} has no effect: nothing in this run reads it, {why}."


def say_unread(run: Run, stages: Sequence[Stage], start: Start) -> None:
    """Report settings of `run` that `stages` do not read; `start`: see `unread`."""
    for line in unread(run.configuration, stages, start):
        run.observer.say(line)
