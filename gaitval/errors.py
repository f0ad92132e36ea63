"""Errors that a user can fix, one type per kind of input.

Every message says what was seen, where, why it is wrong and how to fix it. The command line prints
the message without a traceback and exits with `exit_code`.
"""

from typing import Self


class RecordWarning(UserWarning):
    """A file is not as it should be in something that could be passed over."""


class GaitvalError(Exception):
    """Base of all errors that the command line reports without a traceback."""

    exit_code = 2
    goes_on: tuple[str, ...] = ()
    """Options with which the same command continues, without what was wrong."""

    def with_way_on(self, *options: str) -> Self:
        """The same error, with the `options` that let the command continue."""
        self.goes_on = options
        return self


class SubjectError(GaitvalError):
    """A subject file or the request for a subject cannot be used."""


class RecordError(GaitvalError):
    """A file of recorded angles, moments, forces or markers cannot be used."""

    trial: int | None = None
    """Which of a session's walking trials it is about, from 0; None if none alone."""


class NoCycleError(RecordError):
    """No trial shows a whole gait cycle of either side, though its motion was worked out."""


class TrialOnlyError(RecordError):
    """No subject could be made, but poses, and moments where forces show them, of the trials were
    worked out and written: the result is a trial with moments, or with poses.
    """

    exit_code = 0


class ConfigurationError(GaitvalError):
    """A configuration value is unknown, of the wrong type or out of range."""


class ScalingError(GaitvalError):
    """A body model scaled to the subject would be implausible."""


class ModelError(GaitvalError):
    """A body model or URDF file cannot be used."""


class PolicyError(GaitvalError):
    """A stored policy is missing, damaged or made for another model."""


class ArtefactError(GaitvalError):
    """A file in the run folder is missing, truncated or from another run."""


class ArchiveError(GaitvalError):
    """A published data set cannot be downloaded, or differs from what was published."""


class ToleranceError(GaitvalError):
    """A result is outside the tolerance that it was checked against."""

    # 1 for a result that is not good enough; the other errors, with 2, end commands that cannot
    # run.
    exit_code = 1


def count_of(number: int, one: str, many: str = "") -> str:
    """`number` with the word for `one` thing or for `many` (if not given, `one` with an s), in the
    words of a message.

    >>> count_of(1, "study", "studies"), count_of(0, "walk")
    ('1 study', '0 walks')
    """
    return f"{number} {one if number == 1 else many or one + 's'}"
