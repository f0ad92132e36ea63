"""Spines of the pelvis and heels that no marker is on: from crests, or carried from standing.

Where a laboratory marks crests and sacrum, or takes the markers off the spines after the standing
trial and leaves a cluster, the pelvis is as rigid as with markers on the spines: where they are
follows from the markers that stay.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_set import MarkerDefinition, MarkerSet
from gaitval.scaling.markers.spines import CRESTS, REARS, SPINES, Spines, spines_of
from gaitval.scaling.rigid import carried

FROM_CRESTS: Final = "spines from crests"
"""The check that says so."""
_REAR: Final = tuple(name for rear in REARS for name in rear)


@dataclass(frozen=True)
class WithSpines:
    """Trials whose pelvis has its spines.

    Attributes
    ----------
    marker_set : with the spines, and the crests as markers that only track.
    standing, walking : with the spines' trajectories.
    placement_sd : m, of the spines that were estimated, by name.
    flags : the warning about these.
    """

    marker_set: MarkerSet
    standing: Recording
    walking: tuple[Recording, ...]
    placement_sd: Mapping[str, float]
    flags: tuple[QualityFlag, ...]


def completed(
    marker_set: MarkerSet, standing: Recording, walking: Sequence[Recording]
) -> WithSpines:
    """The trials, named after `marker_set`, with the spines that no trial has a marker for, from
    its crests; and with those of the pelvis that are taken off after standing, carried by the
    markers that stay. Raises RecordError if crests without a rear are all that there is.
    """
    marker_set = _without_absent_spines(marker_set, (standing, *walking))
    landmarks, placement_sd, flags = marker_set.landmarks, dict[str, float](), list[QualityFlag]()
    if not set(SPINES) & set(landmarks) and set(CRESTS) <= set(landmarks):
        known = (*CRESTS, *_REAR)
        points = _shape(standing, {at: landmarks[at] for at in known if at in landmarks})
        found = spines_of(points)
        if found is None:
            raise RecordError(
                f"{standing.source}: no marker on the anterior spines of the pelvis (ASIS), and "
                "its crests alone do not show them: mark the sacrum or both PSIS too (landmark "
                f"Sacrum, or R.PSIS and L.PSIS). The set {marker_set.name} has on the pelvis "
                f"{', '.join(_on(marker_set, 'pelvis'))}."
            )
        marker_set = _with_spines(marker_set)
        # in the frame that the spines were found in
        shape = {landmarks[at]: point for at, point in points.items()}
        standing, *walking = [
            _carried(trial, shape, found.places) for trial in (standing, *walking)
        ]
        placement_sd = dict.fromkeys(SPINES, float(np.linalg.norm(found.sd) / np.sqrt(3.0)))
        flags.append(_doubt(found))
    elif set(CRESTS) & set(landmarks):
        marker_set = _tracking_crests(marker_set)
    walks, taken_off = _with_taken_off(marker_set, standing, walking)
    return WithSpines(marker_set, standing, walks, placement_sd, (*flags, *taken_off))


def _with_taken_off(
    marker_set: MarkerSet, standing: Recording, walking: Sequence[Recording]
) -> tuple[tuple[Recording, ...], list[QualityFlag]]:
    """The walks with the paths of markers of the pelvis and heels that were taken off after
    standing, as Plug-in Gait allows, and a warning about each heel. The
    other markers of the segment carry them; those of the foot, and those on the malleoli, which lie
    near the axis that it turns about, carry the heel.
    """
    landmarks, walks, flags = marker_set.landmarks, list(walking), list[QualityFlag]()
    for segment, parts, beside in (
        ("pelvis", (*SPINES, *_REAR), ()),
        ("foot_r", ("R.Heel",), ("R.Ankle", "R.Ankle.Medial")),
        ("foot_l", ("L.Heel",), ("L.Ankle", "L.Ankle.Medial")),
    ):
        names = [landmarks[at] for at in parts if at in landmarks]
        off = [
            name
            for name in names
            if _seen(standing, name) and not all(_seen(walk, name) for walk in walks)
        ]
        carriers = {*_on(marker_set, segment), *(landmarks[at] for at in beside if at in landmarks)}
        shape = _shape(standing, {name: name for name in marker_set.markers if name in carriers})
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
    return tuple(walks), flags


def _on(marker_set: MarkerSet, segment: str) -> list[str]:
    """The markers on a segment."""
    return [name for name, each in marker_set.markers.items() if each.segment == segment]


def _seen(recording: Recording, name: str) -> bool:
    """Whether a trial ever shows the marker `name`."""
    return name in recording.names and bool(np.isfinite(recording.marker(name)).any())


def _without_absent_spines(marker_set: MarkerSet, trials: Sequence[Recording]) -> MarkerSet:
    """The set without the markers of the spines, if no trial has one of them and the crests are
    there, as where a belt or a belly covers the spines.
    """
    landmarks = marker_set.landmarks
    spines = {landmarks[at] for at in SPINES if at in landmarks}
    crests = [landmarks[at] for at in CRESTS if at in landmarks]
    if any(_seen(trial, name) for trial in trials for name in spines) or not (
        len(crests) == len(CRESTS) and all(_seen(trials[0], name) for name in crests)
    ):
        return marker_set
    kept = {name: each for name, each in marker_set.markers.items() if name not in spines}
    return replace(marker_set, markers=kept)


def _doubt(found: Spines) -> QualityFlag:
    sd, tilt = 1000 * float(np.max(found.sd)), float(np.degrees(found.tilt_sd))
    return QualityFlag(
        FROM_CRESTS, ", ".join(SPINES), tilt, 0.0, "deg",
        "the anterior spines have no marker; they are estimated from the crests and "
        f"{' and '.join(found.rear)}, to {sd:.0f} mm (1 SD of drawn people). The tilt of the "
        f"pelvis, and hip flexion with it, is known to {tilt:.0f}° over the whole cycle only; "
        "changes within the cycle are measured. Mark the spines in standing, if only there",
    )  # fmt: skip


def _with_spines(marker_set: MarkerSet) -> MarkerSet:
    given = _tracking_crests(marker_set)
    spines = {name: MarkerDefinition(segment="pelvis", landmark=name) for name in SPINES}
    return replace(given, markers={**given.markers, **spines})


def _tracking_crests(marker_set: MarkerSet) -> MarkerSet:
    return replace(
        marker_set,
        markers={
            name: each.model_copy(update={"landmark": None}) if each.landmark in CRESTS else each
            for name, each in marker_set.markers.items()
        },
    )


def _shape(recording: Recording, names: Mapping[str, str]) -> dict[str, Array]:
    """Where the markers `names` are, (3,) m each, in one frame that shows all of them: that in
    which their distances are nearest to their medians. Those that are never seen are left out.
    """
    names = {
        at: name
        for at, name in names.items()
        if name in recording.names and np.isfinite(recording.marker(name)).any()
    }
    if not names:
        return {}
    markers = recording.columns(list(names.values()))
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
