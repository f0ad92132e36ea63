"""Markers on the body that walked: the person's own, where known, and the joint centres."""

from typing import Final

import numpy as np

import gaitval
from gaitval.apps.export.walked import ExportedWalk
from gaitval.model.markers import ModelMarker

JOINT_CENTRES: Final = {
    f"{side.upper()}{name}": f"{segment}_{side}"
    for side in "rl"
    for name, segment in (
        ("HJC", "thigh"),
        ("KJC", "shank"),
        ("AJC", "foot"),
        ("MTP", "toes"),
        ("SJC", "upper_arm"),
        ("EJC", "forearm"),
    )
} | {"LUMBAR": "torso", "MIDHIP": "pelvis"}
"""Virtual markers, and the segment whose frame begins there."""


def virtual_markers(walked: ExportedWalk) -> list[ModelMarker]:
    """The markers that the person wore, on the segments as placed by standing, then the joint
    centres. A person without standing markers has the joint centres alone.
    """
    symmetric = walked.stored.configuration.scaling.symmetric
    attached = gaitval.scale(walked.stored.subject, symmetric=symmetric).markers
    own = [marker for marker in attached if marker.name not in JOINT_CENTRES]
    centres = [ModelMarker(name, segment, np.zeros(3)) for name, segment in JOINT_CENTRES.items()]
    return [*own, *centres]
