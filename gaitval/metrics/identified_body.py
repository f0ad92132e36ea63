"""The body that an identification found, before the parameters mu."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from gaitval.errors import ArtefactError
from gaitval.model.body import BodyModel, Segment

MOST: Final = 0.05
"""Share by which a leg may be longer than the mean of both; 8 cm between the legs of an adult."""


def identified_model(model: BodyModel, found: Mapping[str, Any]) -> BodyModel:
    """The scaled `model` with legs that differ by what an identification `found` beside mu, as
    `identification.json` has it.
    """
    left = 0.0 if found["identified"] == found["nominal"] else found.get("left_leg", 0.0)
    return with_legs(model, left) if left else model


def with_legs(model: BodyModel, left: float) -> BodyModel:
    """The `model` as scaled, with left thigh and shank longer by the share `left`, right ones
    shorter. Raises ArtefactError if it is no number, or beyond `MOST`.
    """
    if not isinstance(left, int | float) or not abs(left) <= MOST:
        raise ArtefactError(
            f"identification.json: left_leg is {left!r}, but the share by which the left leg is "
            f"longer is a number between {-MOST:g} and {MOST:g}. Run `gaitval subject` again."
        )
    return replace(model, segments=tuple(_with_leg(each, left) for each in model.segments))


def _with_leg(segment: Segment, left: float) -> Segment:
    if segment.kind not in ("shank", "foot"):  # at the lower ends of thigh and shank
        return segment
    joint = segment.joint_position.copy()
    joint[2] *= 1.0 + (left if segment.side == "left" else -left)
    return replace(segment, joint_position=joint)
