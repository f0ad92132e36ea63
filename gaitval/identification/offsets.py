"""What models and laboratories get wrong on everybody, as a moved mean of the prior.

The shifts that records of several people ask for are draws from the prior only if scaling errs by
chance. In the ten built-in people it does not: their soles want to end further back than the
model's, their hips further back and their knees further forward. These four are moved by what the
records of other people say of them; lengths are not, because nothing says that markers get them
wrong on everybody, and an error of a length is what is looked for.

With the prior as unit, a posterior mean of covariance C is a draw of N((1 - C) d, 1 - C) if d is
the common error. So over people d has the information Σ (1 - C) and the score Σ s; its own prior
has an SD of 1: what a method gets wrong on everybody may be as large as what it gets wrong on one.
Nobody corrects themselves: the offset of a built-in person is that of the nine others. It was
estimated of people who were scaled by markers in one laboratory (Fukuchi et al. 2018, PeerJ
6:e4640, CC BY 4.0), and is used in others, where what of it is that laboratory's is wrong. The
virtual people that are made of the model itself have none.
"""

from collections.abc import Sequence
from importlib import resources
from json import loads
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.identification.shared_errors import SOLE_ENDS
from gaitval.model.parameters import PARAMETERS
from gaitval.subjects.subject import Subject

OFFSETS: Final = (*PARAMETERS, *SOLE_ENDS)
"""Order of an offset."""
MOVED: Final = ("hip_x", "knee_x", *SOLE_ENDS)
"""Those that are moved."""


def estimated(shifts: Sequence[Array], joints: Sequence[Array]) -> Array:
    """The common error (16,) of `OFFSETS`, in prior SDs; 0 but of `MOVED`. `shifts` (16,) and
    `joints` (16, 16) are those of each person, see `shared_errors.Shared`.
    """
    moved = [OFFSETS.index(name) for name in MOVED]
    information = np.sum([np.eye(len(OFFSETS)) - each for each in joints], axis=0)
    found = np.zeros(len(OFFSETS))
    found[moved] = np.linalg.solve(
        information[np.ix_(moved, moved)] + np.eye(len(moved)), np.sum(shifts, axis=0)[moved]
    )
    return found


def offset_of(subject: Subject) -> Array:
    """The offset (16,) of `OFFSETS` for a subject, in prior SDs, of other people's records."""
    found = np.zeros(len(OFFSETS))
    if subject.laboratory == "virtual":
        return found
    stored = loads(
        resources.files("gaitval.identification").joinpath("offsets.json").read_text("utf-8")
    )
    without = stored["without"].get(f"{subject.laboratory} {subject.person}", stored["of all"])
    for name, value in without.items():
        found[OFFSETS.index(name)] = value
    return found
