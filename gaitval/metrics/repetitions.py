"""Which further trials repeat a person's own: those at the same speed."""

from typing import Final

from gaitval.datasets.subject import Subject, Trial

SAME_SPEED: Final = 0.03
"""Relative difference of speed up to which two trials are repetitions of one another."""


def repetitions(subject: Subject) -> list[Subject]:
    """`subject` on each further trial with kinetics at the speed of its own."""
    trials = [subject.on_trial(trial.name) for trial in subject.trials]
    return [trial for trial in trials if trial.has_kinetics and repeats(trial, subject)]


def repeats(trial: Subject | Trial, subject: Subject) -> bool:
    """Whether a `trial` is at the speed of the own one of `subject`."""
    return abs(trial.walking_speed_m_s / subject.walking_speed_m_s - 1.0) <= SAME_SPEED
