"""What joints carry: the free body of everything beyond a joint (as OpenSim's joint reactions).

The bone before the joint must exert on the bone beyond it what the motion needs (the
intersegmental force of inverse dynamics) less what the muscles that cross the joint already exert.
Muscles that cross it without ending nearby count, too.

At the knee the compression is split by what is left of the moment in the frontal plane (muscles
included; ligaments are not) between two points of contact, as Winby et al. (2009) J Biomech
42:2294. The moment is about the middle of the person's knee, which the markers on its epicondyles
show. A plateau that would have to pull lifts off, and the other carries all.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.kinetics.musculature.mapping import BoneSizes, LegLoads, tibia_axes
from gaitval.kinetics.musculature.paths import JOINTS, KNEE, Geometry


@dataclass(frozen=True)
class KneeContact:
    """Where the knee bears load."""

    plateaus: float = 0.040
    """Distance of the points of contact of a knee, m, of a tibia of the published size; 38 to 46 mm
    in people and implants (Winby et al. 2009; Lerner et al. 2015)."""
    aside: float = -0.0068
    """How far the middle of the knee is to the outer side of the body's knee centre where no marker
    shows it, m, of a leg of the published size: the mean of twenty knees of ten standing people
    (`knee_middles` at 60ee3cba). They lie inside of the line from the regression's hip to the
    ankle."""
    below: float = 0.019
    """How far the plateau is below the knee's centre in the published model, m."""


KNEE_CONTACT: Final = KneeContact()


@dataclass(frozen=True)
class Contact:
    """Contact forces of one leg, N; T frames, axes of `paths.JOINTS` (x forward, y up, z to the
    leg's outer side).

    Attributes
    ----------
    hip, knee, patella, ankle : (T, 3) of the bone before the joint on that beyond it: the pelvis on
        the femur, the femur on the tibia, the femur on the patella, the tibia on the talus. That of
        the knee is in the tibia's axes.
    knee_moment : (T, 3) Nm about the middle of the knee, tibia's axes, that no muscle makes.
    compression : (T,) along the tibia, pressing.
    medial, lateral : (T,) of it.
    lifted : (T,) whether one plateau would have to pull.
    """

    hip: Array
    knee: Array
    patella: Array
    ankle: Array
    knee_moment: Array
    compression: Array
    medial: Array
    lateral: Array
    lifted: Flags

    def size(self, joint: str) -> Array:
        """(T,) N, length of the force at one of `paths.JOINTS`."""
        return np.asarray(np.linalg.norm(getattr(self, joint), axis=-1))


def knee_middle(loads: LegLoads, own: BoneSizes) -> float:
    """m, `loads.knee_aside`, or what is usual."""
    return KNEE_CONTACT.aside * own.tibia if loads.knee_aside is None else loads.knee_aside


def contact(
    loads: LegLoads,
    paths: Geometry,
    force: Array,
    own: BoneSizes,
    *,
    wider: float = 1.0,
) -> Contact:
    """What the joints carry with `loads`, where muscles pull with `force` (T, 40) N along `paths`,
    in a leg of the sizes `own`, whose plateaus are `wider` apart than usual.
    """
    left = loads.force - np.einsum("tm,tmjk->tjk", force, paths.pull)
    by_muscles = own.femur * np.einsum("tm,tmk->tk", force, paths.knee_moment)
    at = JOINTS.index("knee")
    aside = np.array([0.0, 0.0, knee_middle(loads, own)])
    # Muscles cross the knee where it is; the load's moment is known about the body's centre.
    moment = loads.moment[:, at] - np.cross(aside, loads.force[:, at]) - by_muscles
    axes = tibia_axes(loads.angles[:, KNEE])
    knee = np.einsum("tji,tj->ti", axes, left[:, at])
    moment = np.einsum("tji,tj->ti", axes, moment)
    compression = -knee[:, 1]
    # Lateral less medial, by the moment about the axis forward: up on the outer side is +x.
    tilt = (moment[:, 0] + KNEE_CONTACT.below * own.tibia * knee[:, 2]) / (
        wider * KNEE_CONTACT.plateaus * own.tibia
    )
    medial, lateral = compression / 2 - tilt, compression / 2 + tilt
    lifted = (medial < 0.0) != (lateral < 0.0)
    within = np.clip(medial, 0.0, np.maximum(compression, 0.0))
    pressed = compression > 0.0
    medial = np.where(pressed, within, compression / 2)
    return Contact(
        hip=left[:, 0],
        knee=knee,
        patella=left[:, 2],
        ankle=left[:, 3],
        knee_moment=moment,
        compression=compression,
        medial=medial,
        lateral=compression - medial,
        lifted=lifted,
    )


def knee_compression(loads: LegLoads, paths: Geometry) -> tuple[Array, Array]:
    """Compression of the knee per newton of each muscle (T, 40), and without muscles (T,) N."""
    up = tibia_axes(loads.angles[:, KNEE])[:, :, 1]  # of the tibia, in the femur
    joint = JOINTS.index("knee")
    per_newton = np.einsum("tmk,tk->tm", paths.pull[:, :, joint], up)
    return per_newton, -(loads.force[:, joint] * up).sum(axis=1)
