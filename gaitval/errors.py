"""Errors that a user can mend, one type per kind of input.

Every message says what was seen, where, why it is wrong and how to mend it. The
command line prints the message without a traceback and exits with `exit_code`.
"""


class GaitvalError(Exception):
    """Base of all errors that the command line reports without a traceback."""

    exit_code = 2


class SubjectError(GaitvalError):
    """A subject file or the request for a subject cannot be used."""


class RecordError(GaitvalError):
    """A file of recorded angles, moments, forces or markers cannot be used."""


class ConfigurationError(GaitvalError):
    """A configuration value is unknown, of the wrong type or out of range."""


class ScalingError(GaitvalError):
    """A body model scaled to the subject would not be plausible."""


class ModelError(GaitvalError):
    """A body model or URDF file cannot be used."""


class PolicyError(GaitvalError):
    """A stored policy is missing, damaged or made for another model."""


class ArtefactError(GaitvalError):
    """A file in the run folder is missing, truncated or of another run."""


class ArchiveError(GaitvalError):
    """A published data set cannot be downloaded, or what came is not what was published."""


class ToleranceError(GaitvalError):
    """A result is outside the tolerance that it was checked against."""

    exit_code = 1
