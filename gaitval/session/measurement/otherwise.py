"""Loads with a fault of the plates, and a body with other masses: what bands move a curve by."""

from dataclasses import replace

import numpy as np

from gaitval.coordinates import split_side
from gaitval.mocap.recording import FootForces
from gaitval.model.body import BodyModel


def with_fault(loads: FootForces, fault: str, size: float) -> FootForces:
    """The `loads` on the feet with a `fault` of both plates ("delay", "place x" and others) of this
    `size` in its unit: s, m, rad or a share.
    """
    force, point = loads.force, loads.centre_of_pressure
    if fault == "delay":
        at = np.clip(np.arange(len(force)) - size * loads.rate, 0, len(force) - 1)
        low = np.floor(at).astype(int)
        share = (at - low)[:, None, None]
        high = np.minimum(low + 1, len(force) - 1)
        # Where a foot lands or leaves, one of the two samples has no point; it acts at the other's.
        both = np.isfinite(point[low]) & np.isfinite(point[high])
        one = np.where(np.isfinite(point[low]), point[low], point[high])
        late = np.where(both, (1 - share) * point[low] + share * point[high], one)
        return replace(
            loads, force=(1 - share) * force[low] + share * force[high], centre_of_pressure=late
        )
    if fault.startswith("place"):
        return replace(loads, centre_of_pressure=point + size * np.eye(3)["xy".index(fault[-1])])
    if fault == "gain":
        return replace(loads, force=force * (1 + size), free_moment=loads.free_moment * (1 + size))
    if fault == "rotation":
        return replace(loads, force=force + size * np.cross([0.0, 0.0, 1.0], force))
    return replace(loads, force=force + size * force[..., 2:] * np.eye(3)["xy".index(fault[-1])])


def heavier(model: BodyModel, segment: str, mass: float, inertia: float) -> BodyModel:
    """A body whose segments of this name, such as "thigh", have a `mass` and an `inertia` larger by
    these shares.
    """
    return replace(
        model,
        segments=tuple(
            replace(one, mass=(1 + mass) * one.mass, inertia=(1 + inertia) * one.inertia)
            if split_side(one.name)[1] == segment
            else one
            for one in model.segments
        ),
    )
