"""Read a trial from a laboratory's files, and refuse what cannot be right.

The only entry point is `read_recording`. The checks here are for every format; each reader checks
what is specific to its format.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.centre_points import centre_points
from gaitval.mocap.lost_markers import without_fill_values
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import passed_over
from gaitval.units import looks_like

LIMITS: Final[Mapping[str, float]] = {
    # m. The markers of a person, and of objects nearby, spread over at least and at most
    # this.
    "smallest_spread_m": 0.05,
    "largest_spread_m": 20.0,
    # Hz. Cameras of motion laboratories record at 50 to 1,000 Hz, the fastest at 10,000.
    "fastest_hz": 20000.0,
    # m. Two markers of one name that are never farther apart are one marker, stored twice.
    "same_place_m": 0.001,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""


SAME_NAMES: Final = 10
"""Markers that two people have in common; objects beside a person have other names."""

SPREAD_FRAMES: Final = 50
"""Number of frames, evenly spaced, that this is taken from."""


def read_recording(
    path: Path,
    *,
    forces: Path | None = None,
    plates: bool = True,
    faulty: bool = False,
    part: tuple[float, float] | None = None,
) -> Recording:
    """Read a trial: C3D, TRC, a marker file of WBDS, or what `formats` reads.

    Parameters
    ----------
    path : .c3d, .trc, `…mkr.txt` of WBDS, or with another ending of `formats`.
    forces : ground reaction for a marker file that has none: .mot or .sto in OpenSim's convention,
        `…grf.txt` of WBDS, or of `formats`, in the same axes and on the same clock (WBDS: from
        the first frame).
    plates : read a C3D file's force plates, too.
    faulty : keep plates that cannot be used, which then have a `fault`.
    part : s, of the trial that counts: what is outside need not be in both files.

    Returns
    -------
    Recording
        In the laboratory's axes, SI units; `gaitval.mocap.axes` turns it.

    Raises
    ------
    RecordError
        The file is of unknown kind, empty, truncated or damaged; a unit is wrong or missing; no
        camera is as fast as it says; all markers are missing; the rates do not divide; the forces
        do not belong to it.
    """
    path = Path(path)
    if path.suffix.lower() == ".c3d":
        recording = without_fill_values(_each_once(read_c3d(path, plates=plates)))
    else:
        from gaitval.mocap.formats import read_other

        recording = without_fill_values(_each_once(read_other(path)))
        centres = centre_points(recording.names, recording.markers)
        recording = replace(recording, centres=centres)
    _check_markers(recording)
    if forces is not None:
        from gaitval.mocap.formats import with_forces

        recording = with_forces(recording, Path(forces), part)
    elif part is not None:
        recording = recording.between(part, "--trial-time")
    for plate in () if faulty else recording.plates:
        if plate.fault:
            raise RecordError(plate.fault)
    return recording


def _each_once(recording: Recording) -> Recording:
    """The trial with each name once: of copies of a marker the first; others with one name are
    numbered, as NAME#1, because it is unknown which is right.
    """
    names, kept, twice = list(recording.names), list[int](), dict[str, None]()
    for first, name in enumerate(recording.names):
        same = [number for number, each in enumerate(recording.names) if each == name]
        if first == same[0] and len(same) > 1:
            twice[name] = None
            own = recording.markers[:, same]
            if np.nanmax(np.abs(own - own[:, :1]), initial=0.0) < LIMITS["same_place_m"]:
                same = same[:1]
            for number, column in enumerate(same if len(same) > 1 else (), start=1):
                names[column] = f"{name}#{number}"
        kept += same if first == same[0] else []
    if not twice:
        return recording
    kept.sort()
    passed_over(
        f"{recording.source}: more than one marker has the name {', '.join(twice)}. Copies are "
        "taken once, others numbered, as NAME#1. Give each its own name in the recording program"
    )
    return recording.with_markers([names[number] for number in kept], recording.markers[:, kept])


def _check_markers(recording: Recording) -> None:
    names = recording.names
    seen = np.isfinite(recording.markers).all(axis=2)
    if not seen.any():
        raise RecordError(
            f"{recording.source}: none of the {len(names)} markers is seen in any of the "
            f"{len(recording.markers)} frames (all NaN or at the origin). Reconstruct and "
            "label the trial, then export it again."
        )
    shown = int(np.count_nonzero(seen.any(axis=0)))
    if shown < 3:
        raise RecordError(
            f"{recording.source}: only {shown} of {len(names)} markers are ever seen. "
            "Label the trial and export it again."
        )
    _check_one_person(recording)
    if recording.marker_rate > LIMITS["fastest_hz"]:
        raise RecordError(
            f"{recording.source}: the markers are at {recording.marker_rate:g} Hz, but cameras "
            "record at 50 to 1000 Hz: the rate that the file states is wrong. Correct it (TRC: "
            "line 3 and the times; C3D: POINT:RATE), or export the trial again."
        )
    spread = _spread(recording.markers)
    if not LIMITS["smallest_spread_m"] <= spread <= LIMITS["largest_spread_m"]:
        raise RecordError(
            f"{recording.source}: the markers of a frame spread over {spread:.3g} m, but a "
            "person's spread over 1 to 2 m: the unit that the file states is "
            f"wrong{looks_like(spread)}. Correct the unit in the file (TRC: line 3; C3D: "
            "POINT:UNITS), or export it again."
        )


def _check_one_person(recording: Recording) -> None:
    """Refuse markers of several people, who have the same names after their own prefixes."""
    people: dict[str, set[str]] = {}
    for name in recording.names:
        before, _, own = name.partition(":")
        people.setdefault(before if own else "", set()).add(own or name)
    several = [
        person
        for person, own in people.items()
        if person
        and any(len(own & each) >= SAME_NAMES for who, each in people.items() if who != person)
    ]
    if len(several) > 1:
        raise RecordError(
            f"{recording.source}: the markers are of {len(several)} people, by the names before "
            f"the colon ({', '.join(several[:6])}), and no option chooses one. Export the trials "
            "of each alone, with one subject active in the recording program."
        )


def _spread(markers: Array) -> float:
    """Median over the frames of the largest extent of the markers along an axis, m.

    Only the middle 80 % count, for a reflection taken for a marker may be anywhere.
    """
    seen = np.flatnonzero(np.isfinite(markers).all(axis=2).sum(axis=1) >= 3)
    if not len(seen):
        seen = np.flatnonzero(np.isfinite(markers).any(axis=(1, 2)))
    frames = seen[np.unique(np.linspace(0, len(seen) - 1, SPREAD_FRAMES).astype(int))]
    # Each frame's own extent, then the median: where the person walks does not matter.
    low, high = np.nanpercentile(markers[frames], [10.0, 90.0], axis=1)
    return float(np.median((high - low).max(axis=1)))
