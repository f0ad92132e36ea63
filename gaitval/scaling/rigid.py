"""Points of a rigid segment without a marker, carried by the markers that it has."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.mocap.recording import Recording

FEWEST: Final = 3
"""Markers of a segment that show its pose."""


def carried(
    recording: Recording, shape: Mapping[str, Array], places: Mapping[str, Array]
) -> dict[str, Array]:
    """Trajectories (T, 3) m of `places` (3,) that are rigid with the markers of `shape` (3,), both
    of one moment, in `recording`: NaN in frames that show fewer than three of these.
    """
    names = [name for name in shape if name in recording.names]
    found = {name: np.full((len(recording.markers), 3), np.nan) for name in places}
    if len(names) < FEWEST or not places:
        return found if places else {}
    rest, at = np.stack([shape[name] for name in names]), np.stack(list(places.values()))
    markers = recording.columns(names)
    seen = np.isfinite(markers).all(axis=2)
    for pattern in np.unique(seen, axis=0):
        if pattern.sum() < FEWEST:
            continue
        frames = np.flatnonzero((seen == pattern).all(axis=1))
        rotation, shift = superimposed(rest[pattern], markers[frames][:, pattern])
        for name, place in zip(found, at, strict=True):
            found[name][frames] = np.einsum("tij,j->ti", rotation, place) + shift
    return found


def superimposed(rest: Array, markers: Array) -> tuple[Array, Array]:
    """Rotations (T, 3, 3) and translations (T, 3) from (M, 3) to (T, M, 3) (Kabsch 1976)."""
    middle, middles = rest.mean(axis=0), markers.mean(axis=1)
    products = np.einsum("tmi,mj->tij", markers - middles[:, None], rest - middle)
    left, _, right = np.linalg.svd(products)
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]  # no reflection
    rotation = left @ right
    return rotation, middles - rotation @ middle
