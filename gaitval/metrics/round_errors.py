"""Epsilon of walks, and of the rounds of Algorithm 1, as files have it.

It is apart from the other results because training reads it, and a change of training code makes
trainings out of date.
"""

import math
from pathlib import Path
from typing import Final

from gaitval._internal.io.artefacts import read_json
from gaitval.metrics.typed import Number, Result

EPSILON: Final = "epsilon.json"
"""Of a round: `RoundErrors`."""


class Epsilon(Result):
    """Epsilon and its parts, see gaitval/metrics/epsilon.py."""

    angles: Number | None
    """The normalised parts; they add up to `total`."""
    moments: Number | None
    forces: Number | None
    total: Number | None
    """Compared with kappa."""
    angles_rad: Number | None = None
    """The parts before normalisation."""
    moments_nm_per_kg: Number | None = None
    forces_body_weights: Number | None = None


class RoundErrors(Result):
    """Epsilon of the policy of one round of Algorithm 1: `epsilon.json`, with all digits."""

    nominal: Epsilon | None
    """With the nominal body, mean over the start phases; null if a walk was too short."""
    identified: Epsilon | None
    """The same with the body that was found."""
    scatter: Number | None
    """SD of epsilon over the start phases."""
    floor: Number
    """Epsilon of the reference itself."""

    @property
    def total(self) -> float:
        """Epsilon with the body that was found; infinite if the walker fell early."""
        return _total(self.identified)

    @property
    def supported(self) -> bool:
        """Whether the walk with the body that the search found is nearer to the record, by epsilon,
        than with the nominal body, for which the reference was made. Else the body stays nominal.
        """
        if self.identified is None:
            return self.nominal is None
        return self.total < _total(self.nominal)


def _total(error: Epsilon | None) -> float:
    return math.inf if error is None or error.total is None else error.total


def read_round(folder: Path) -> RoundErrors:
    """The errors of a finished round, of its folder. Raises ArtefactError."""
    path = folder / EPSILON
    return RoundErrors.read(
        read_json(path), str(path), file=EPSILON, fix="run `gaitval subject` again"
    )
