"""The metric of marker displacements against differences of forward kinematics."""

import numpy as np
from marked_walk import moving_walk, spread_markers
from scipy.spatial.transform import Rotation
from simulation_fixtures import random_state

from gaitval.kinetics.inverse.motion_rates import cardan_coordinates
from gaitval.kinetics.inverse.residual_derivatives import marker_metric, moved_by
from gaitval.model.body import SEGMENTS
from gaitval.model.rotations import pelvis_rotation
from gaitval.model.tree import segment_frames, tree_arrays


def test_markers_move_with_the_coordinates_as_the_metric_says():
    """Against differences of forward kinematics, at a pose far from gait."""
    model, _ = moving_walk()
    markers = spread_markers(model, ("forearm_l", "foot_r", "pelvis"))
    segment = np.array([SEGMENTS.index(marker.segment) for marker in markers])
    place = np.array([marker.position for marker in markers])
    weight = np.linspace(0.5, 2.0, len(markers))
    coordinates = cardan_coordinates(random_state(3)[0][None])
    metric = np.zeros((1, 31, 31))
    marker_metric(
        tree_arrays(model).joint_position, segment, place, weight, moved_by(), coordinates, metric
    )

    def places(values):
        q = values.copy()
        q[:, :3] = Rotation.from_matrix(pelvis_rotation(*values[:, :3].T)).as_rotvec()
        frames = segment_frames(model, q)[0, segment]
        return (np.einsum("mij,mj->mi", frames[:, :3, :3], place) + frames[:, :3, 3]).ravel()

    steps = 1e-6 * np.eye(31)
    jacobian = np.column_stack(
        [(places(coordinates + d) - places(coordinates - d)) / 2e-6 for d in steps]
    )
    expected = jacobian.T @ (np.repeat(weight, 3)[:, None] * jacobian)
    np.testing.assert_allclose(metric[0], expected, atol=1e-6)
