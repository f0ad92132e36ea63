"""The laboratory's axes as a user writes them."""

import re

import numpy as np

from gaitval.errors import RecordError
from gaitval.mocap.axes import LETTERS, LaboratoryAxes


def parse_axes(text: str) -> LaboratoryAxes:
    """Laboratory axes as a user writes them: `forward=+x up=+y`; a plus sign may be left out.
    Raises RecordError if the text has another form, or both share an axis.
    """
    match = re.fullmatch(r"forward=([+-]?[xyz])\s+up=([+-]?[xyz])", text.strip().lower())
    if match is not None and match[1][-1] != match[2][-1]:
        forward, up = (
            (-1.0 if name[0] == "-" else 1.0) * np.eye(3)[LETTERS.index(name[-1])]
            for name in match.groups()
        )
        # y = z × x
        return LaboratoryAxes(np.stack([forward, np.cross(up, forward), up]), "")
    raise RecordError(
        f'axes "{text}" is not understood. Name the axis that the person faces along and the axis '
        'that points up, two of x, y and z: "forward=+x up=+y".'
    )
