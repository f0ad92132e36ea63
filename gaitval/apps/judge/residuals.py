"""Residual force and moment at the root of a model, from the results of inverse dynamics.

OpenSim pairs a generalised force with each coordinate of the joint to the ground. Those of angles
are moments about axes that turn with the angles before, so three of them are no vector. Here they
become the force and the moment, about the origin of the root body, that have the same power.
"""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.apps.judge.limits import LIMITS
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.mot_writing import StorageTable
from gaitval.mocap.repairs import passed_over
from gaitval.scaling.opensim.model import OsimModel
from gaitval.scaling.opensim.placing import place


def residual_wrench(
    model: OsimModel, values: Mapping[str, Array], forces: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Residual force and moment (T, 3), N and Nm, in the axes of the ground. A `model` in a plane,
    with fewer than six coordinates of the root, has only the components that these span; the others
    are zero. `values` are (T,) rad or m of every coordinate, `forces` (T,) N or Nm of every
    coordinate of the joint to the ground.
    """
    root = model.root()
    assert root is not None
    body = root.child.body
    columns = []
    # Columns of the Jacobian: velocity and angular velocity of the root for a unit rate.
    for name in root.coordinates:
        low, high = (
            place(model, {**values, name: values[name] + step})[body]
            for step in (-LIMITS.root_step, LIMITS.root_step)
        )
        velocity = (high[1] - low[1]) / (2 * LIMITS.root_step)
        turn = high[0] @ np.swapaxes(low[0], 1, 2)
        columns.append(
            np.hstack([velocity, Rotation.from_matrix(turn).as_rotvec() / (2 * LIMITS.root_step)])
        )
    jacobian = np.stack(columns, axis=2)  # (T, 6, coordinates)
    paired = np.stack([forces[name] for name in root.coordinates], axis=1)
    # Equal power for all rates: Jᵀ w = forces. The pseudo-inverse, because a root in a plane has
    # fewer than six.
    inverse = np.linalg.pinv(np.swapaxes(jacobian, 1, 2))
    wrench = np.einsum("tij,tj->ti", inverse, paired)
    return wrench[:, :3], wrench[:, 3:]


def generalised_forces(model: OsimModel, table: StorageTable, source: str) -> dict[str, Array]:
    """Forces of a `table` of inverse dynamics by coordinate of the `model`, where they are known at
    any time. Raises RecordError, which names the `source`, if it has none.
    """
    found = {}
    for name in model.coordinates:
        column = next((c for c in (f"{name}_moment", f"{name}_force") if c in table.columns), None)
        if column is not None:
            values = table.column(column)
            if np.isinf(values).any():
                raise RecordError(f"{source}: {column}: a value is infinite. Export again.")
            if np.isnan(values).all():
                continue
            if gaps := int(np.isnan(values).sum()):
                passed_over(f"{source}: {column} is not known in {gaps} of {len(values)} rows")
            found[name] = values
    if not found:
        raise RecordError(
            f"{source}: has no moment of the model's coordinates (knee_angle_r_moment, …), but "
            f"{', '.join(table.columns[:5])} …. Give inverse dynamics' results for this model."
        )
    return found
