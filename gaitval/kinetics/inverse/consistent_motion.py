"""What `gaitval import --consistent` finds (`kinetics.inverse.residual_reduction`)."""

from collections.abc import Mapping
from dataclasses import dataclass

from gaitval.arrays import Array
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics, Residuals
from gaitval.model.body import BodyModel


@dataclass(frozen=True)
class ConsistentMotion:
    """A motion and a body that fit the ground reactions better, and the changes made.

    Attributes
    ----------
    model : the body with its new masses and the trunk's new centre of mass.
    time : (T,) s.
    positions : (T, 31), changed.
    dynamics : inverse dynamics of the changed motion and body.
    before, after : measures of the residuals in the frames whose ground reaction is known.
    coordinate_change : RMS change of each coordinate, rad or m; for the pelvis' orientation, of the
        rotation between the two, about the world's axes.
    marker_change_rms, marker_change_max : m, of the markers' displacements on the body; zero
        without markers.
    mass_factors : by group of segments that share one: both sides, and the toes with the foot.
    trunk_offset : (3,) m, of the trunk's centre of mass, in the trunk's axes.
    steps : number of Gauss-Newton steps.
    """

    model: BodyModel
    time: Array
    positions: Array
    dynamics: InverseDynamics
    before: Residuals
    after: Residuals
    coordinate_change: Mapping[str, float]
    marker_change_rms: float
    marker_change_max: float
    mass_factors: Mapping[str, float]
    trunk_offset: Array
    steps: int
