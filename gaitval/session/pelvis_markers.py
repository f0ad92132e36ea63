"""Markers of the pelvis and heels that are taken off after standing: those that stay carry them.

Where a laboratory takes the markers off the spines after the standing trial and leaves a cluster,
the pelvis is as rigid as with markers on the spines.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_set import MarkerSet
from gaitval.scaling.rigid import carried


def completed(
    marker_set: MarkerSet, standing: Recording, walking: Sequence[Recording]
) -> tuple[list[Recording], list[QualityFlag]]:
    """The walks, named after `marker_set`, with the paths of markers of the pelvis and heels that
    were taken off after standing, as Plug-in Gait allows, and a warning about each heel. The other
    markers of the segment carry them; those of the foot, and those on the malleoli, which lie near
    the axis that it turns about, carry the heel.
    """
    landmarks, walks, flags = marker_set.landmarks, list(walking), list[QualityFlag]()
    for segment, parts, beside in (
        ("pelvis", ("R.ASIS", "L.ASIS", "R.PSIS", "L.PSIS", "Sacrum"), ()),
        ("foot_r", ("R.Heel",), ("R.Ankle", "R.Ankle.Medial")),
        ("foot_l", ("L.Heel",), ("L.Ankle", "L.Ankle.Medial")),
    ):
        names = [landmarks[at] for at in parts if at in landmarks]
        off = [
            name
            for name in names
            if _seen(standing, name) and not all(_seen(walk, name) for walk in walks)
        ]
        carriers = {name for name, each in marker_set.markers.items() if each.segment == segment}
        carriers |= {landmarks[at] for at in beside if at in landmarks}
        shape = _shape(standing, [name for name in marker_set.markers if name in carriers])
        places = {name: shape.pop(name) for name in off if name in shape}
        walks = [_carried(walk, shape, places) for walk in walks]
        flags += [
            QualityFlag(
                "heel taken off", name, float(len(shape)), 3.0, "markers",
                f"the walk has no marker there; {', '.join(shape)} carry it from where it was in "
                "standing. A foot that bends at its middle moves it otherwise: leave it on",
            )
            for name in off
            if beside and all(_seen(walk, name) for walk in walks)
        ]  # fmt: skip
    return walks, flags


def _seen(recording: Recording, name: str) -> bool:
    """Whether a trial ever shows the marker `name`."""
    return name in recording.names and bool(np.isfinite(recording.marker(name)).any())


def _shape(recording: Recording, names: Sequence[str]) -> dict[str, Array]:
    """Where the markers `names` are, (3,) m each, in one frame that shows all of them: that in
    which their distances are nearest to their medians. Those that are never seen are left out.
    """
    names = [name for name in names if _seen(recording, name)]
    if not names:
        return {}
    markers = recording.columns(names)
    whole = np.flatnonzero(np.isfinite(markers).all(axis=(1, 2)))
    if not len(whole):
        return {}
    apart = np.linalg.norm(markers[whole, :, None] - markers[whole, None], axis=3)
    off = np.abs(apart - np.median(apart, axis=0)).sum(axis=(1, 2))
    return dict(zip(names, markers[whole[np.argmin(off)]], strict=True))


def _carried(
    recording: Recording, shape: Mapping[str, Array], places: Mapping[str, Array]
) -> Recording:
    """A trial with the trajectories of `places` that it has no markers for."""
    lacking = {name: at for name, at in places.items() if not _seen(recording, name)}
    if not lacking:
        return recording
    kept = [name for name in recording.names if name not in lacking]
    recording = recording.with_markers(kept, recording.columns(kept))
    extra = carried(recording, shape, lacking)
    if not extra:
        return recording
    return recording.with_markers(
        (*recording.names, *extra),
        np.concatenate([recording.markers, np.stack(list(extra.values()), axis=1)], axis=1),
    )
