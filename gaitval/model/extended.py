"""Parameters beside the 14 of mu that a walk depends on and that a record can determine: the
contact with the ground, where the sole ends, and a leg that is longer than the other.

Left out after a screening by Morris's method, because a record leaves 0.9 of their prior SD: the
height of the sole and the trunk's share of the mass. Passive joint stiffness is left out because
recorded moments are net moments.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.model.body import BodyModel, ContactSphere, Segment


@dataclass(frozen=True)
class ExtendedParameter:
    """A parameter whose nominal value is 0.

    Attributes
    ----------
    unit : "1" of a logarithm or fraction, or m.
    prior_sd : what is known of it without a record.
    """

    name: str
    unit: str
    prior_sd: float
    meaning: str


EXTENDED: Final = (
    ExtendedParameter(
        "contact_stiffness", "1", 0.5,
        "logarithm of the factor on the stiffness of the sole; published moduli are 1 to 3 MPa",
    ),
    ExtendedParameter(
        "contact_dissipation", "1", 0.5, "logarithm of the factor on the dissipation of the sole"
    ),
    ExtendedParameter("heel_x", "m", 0.010, "heel's contact forward; where a shoe's heel is"),
    ExtendedParameter("forefoot_x", "m", 0.010, "forefoot's contact forward; a shoe's rocker"),
    ExtendedParameter(
        "left_leg", "1", 0.008,
        "left thigh and shank longer, right ones shorter, by this fraction; legs differ by 5 mm "
        "(Knutson 2005)",
    ),
)  # fmt: skip


def extended_body(
    model: BodyModel, contact: ContactSettings, values: Array
) -> tuple[BodyModel, ContactSettings]:
    """`model` and `contact` with the extended parameters `values` (5,), in `EXTENDED`'s order."""
    stiffness, dissipation, heel, forefoot, left = np.asarray(values, float).tolist()
    changed = contact.scaled(np.exp(stiffness), np.exp(dissipation))
    segments = tuple(_segment(each, left) for each in model.segments)
    spheres = tuple(_sphere(each, heel, forefoot) for each in model.spheres)
    return replace(model, segments=segments, spheres=spheres), changed


def _segment(segment: Segment, left: float) -> Segment:
    if segment.kind not in ("shank", "foot"):  # at the lower ends of thigh and shank
        return segment
    joint = segment.joint_position.copy()
    joint[2] *= 1.0 + (left if segment.side == "left" else -left)
    return replace(segment, joint_position=joint)


def _sphere(sphere: ContactSphere, heel: float, forefoot: float) -> ContactSphere:
    is_heel = sphere.segment.startswith("foot") and sphere.position[0] < 0.0
    forward = heel if is_heel else forefoot
    return replace(sphere, position=sphere.position + np.array([forward, 0.0, 0.0]))
