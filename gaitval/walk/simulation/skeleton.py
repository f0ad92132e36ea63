"""The body model as a DART skeleton with compound joints.

`DartLoader` makes a chain of one-dof joints with massless links of every compound joint; the
skeleton here has one Euler or universal joint instead, which steps faster and has the same mass
matrix, Coriolis forces and forward dynamics as the loader's (tested).
"""

import dartpy
import numpy as np
from numpy.typing import NDArray

from gaitval.coordinates import AXES, COORDINATES, ROOT
from gaitval.model.body import JOINT_COORDINATES, PARENTS, BodyModel, Segment


def _isometry(rotation: NDArray[np.float64], translation: NDArray[np.float64]) -> object:
    transform = dartpy.math.Isometry3()
    transform.set_rotation(rotation)
    transform.set_translation(translation)
    return transform


def _joint_axes(segment: str) -> NDArray[np.float64]:
    """(3, 3) joint frame in the parent's axes, one column per axis; three axes are right-handed."""
    axes = [np.array(AXES[name], dtype=float) for name in JOINT_COORDINATES[segment]]
    return np.column_stack(axes) if len(axes) == 3 else np.eye(3)


def _add_segment(skeleton: object, segment: Segment) -> None:
    parent = skeleton.getBodyNode(PARENTS[segment.name])  # type: ignore[attr-defined]
    names = JOINT_COORDINATES[segment.name]
    kind = {3: "Euler", 2: "Universal", 1: "Revolute"}[len(names)]
    create = getattr(skeleton, f"create{kind}JointAndBodyNodePair")
    joint, body = create(parent)
    body.setName(segment.name)
    joint.setName(segment.name)
    if kind == "Universal":
        joint.setAxis1(AXES[names[0]])
        joint.setAxis2(AXES[names[1]])
    elif kind == "Revolute":
        joint.setAxis(AXES[names[0]])
    # By default an Euler joint rotates about x, y, z of its own frame (dartpy binds no setter).
    joint.setTransformFromChildBodyNode(_isometry(_joint_axes(segment.name), np.zeros(3)))
    for i, name in enumerate(names):
        joint.setDofName(i, name)


class HumanSkeleton:
    """A DART skeleton in a world without ground; the ground acts through `setForces`.

    Positions, velocities and forces have the order of `coordinates.COORDINATES`.

    Attributes
    ----------
    skeleton : dartpy.dynamics.Skeleton.
    step : advances one physics step; bound once, because it is called most often.
    """

    def __init__(self, model: BodyModel, *, physics_step: float) -> None:
        world = dartpy.simulation.World()
        world.setTimeStep(physics_step)
        skeleton = dartpy.dynamics.Skeleton()
        joint, pelvis = skeleton.createFreeJointAndBodyNodePair()
        joint.setName("root")
        pelvis.setName(model.segments[0].name)
        for i, name in enumerate(ROOT):
            joint.setDofName(i, name)
        for segment in model.segments[1:]:
            _add_segment(skeleton, segment)
        world.addSkeleton(skeleton)
        order = tuple(skeleton.getDof(i).getName() for i in range(skeleton.getNumDofs()))
        assert order == COORDINATES, order
        self.skeleton = skeleton
        self.world = world
        self.step = world.step
        self.configure(model)

    def configure(self, model: BodyModel) -> None:
        """Give all joints and segments the positions and masses of another model, and its gravity
        to the world.
        """
        self.world.setGravity(model.ground.gravity)
        for segment in model.segments:
            body = self.skeleton.getBodyNode(segment.name)
            inertia = segment.mass, segment.centre_of_mass, segment.inertia
            body.setInertia(dartpy.dynamics.Inertia(*inertia))
            if segment.name in PARENTS:
                body.getParentJoint().setTransformFromParentBodyNode(
                    _isometry(_joint_axes(segment.name), np.asarray(segment.joint_position))
                )

    def set_servo(self, stiffness: NDArray[np.float64], damping: NDArray[np.float64]) -> None:
        """Springs (25,) Nm/rad about zero and dampers (25,) Nms/rad of the joints, which DART
        integrates implicitly; the servo's targets enter as forces.
        """
        for dof, k, d in zip(self.skeleton.getDofs()[len(ROOT) :], stiffness, damping, strict=True):
            dof.setSpringStiffness(k)
            dof.setRestPosition(0.0)
            dof.setDampingCoefficient(d)

    def set(self, q: NDArray[np.float64], qd: NDArray[np.float64]) -> None:
        """Place the body at positions and velocities (31,)."""
        self.skeleton.setPositions(q)
        self.skeleton.setVelocities(qd)

    def advance(
        self, forces: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Advance one step under generalised forces (31,); positions and velocities (31,)."""
        self.skeleton.setForces(forces)
        self.step()
        return self.skeleton.getPositions(), self.skeleton.getVelocities()
