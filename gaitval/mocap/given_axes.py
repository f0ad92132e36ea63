"""The laboratory's axes as a user writes them."""

import re

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.axes import LETTERS, LaboratoryAxes


def parse_axes(text: str) -> LaboratoryAxes:
    """Laboratory axes as a user writes them: `forward=+x up=+y`; a plus sign may be left out.
    Raises RecordError if the text has another form, or both share an axis.
    """
    found: dict[str, Array] = {}
    for part in text.replace(",", " ").lower().split():
        match = re.fullmatch(r"(forward|up)=([+-]?)([xyz])", part)
        if match is not None and match[1] not in found:
            axis = np.zeros(3)
            axis[LETTERS.index(match[3])] = -1.0 if match[2] == "-" else 1.0
            found[match[1]] = axis
            continue
        break
    else:
        # Signed unit vectors are at right angles unless they lie along the same axis.
        if len(found) == 2 and not found["forward"] @ found["up"]:
            # y = z × x
            left = np.cross(found["up"], found["forward"])
            return LaboratoryAxes(np.stack([found["forward"], left, found["up"]]), "")
    raise RecordError(
        f'axes "{text}" is not understood. Name the axis that the person faces along and the axis '
        'that points up, two of x, y and z: "forward=+x up=+y".'
    )
