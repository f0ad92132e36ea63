"""Read C3D files: markers, force plates of types 1 to 7 (`c3d_plates`), events."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.errors import RecordError
from gaitval.mocap.c3d_contents import Contents, check_size, labels_of, read_contents
from gaitval.mocap.c3d_plates import read_plates
from gaitval.mocap.recording import Event, EventKind, Recording
from gaitval.mocap.units import METRES, unit_factor

# What a list of points may contain besides markers: results of the laboratory's own software.
_RESULTS: Final = (
    "ANGLES",
    "FORCES",
    "MOMENTS",
    "POWERS",
    "SCALARS",
    "REACTIONS",
    "MODELED_MARKERS",
)

SAME_EVENT_S: Final = 0.2
"""Events of the same side and kind that are closer than this are one event, s; half a running step
takes longer."""

_SIDES: Final[dict[str, Side]] = {"left": "left", "right": "right", "l": "left", "r": "right"}
_STRIKES: Final = (
    *("hs", "fs", "ic", "fc", "on", "heelstrike", "heelcontact", "footstrike", "footcontact"),
    *("footon", "initialcontact"),
)
_OFFS: Final = ("to", "fo", "off", "toeoff", "footoff")


def read_c3d(path: Path, *, plates: bool = True) -> Recording:
    """Read a C3D file.

    Parameters
    ----------
    path : the file.
    plates : whether to read the force plates.

    Returns
    -------
    Recording
        In the laboratory's axes, SI units. A marker is NaN where its residual is negative or it
        lies exactly at the origin. Points that the file declares to be angles, forces, moments or
        powers are left out, and so are unlabelled ones (`*12`). A subject's prefix that all names
        share (`Anna:LASI`) is removed. Forces are those of the plate on the person: if a file has
        the opposite sign it is reversed, because a plate can only push. Plates without channels are
        left out. Baselines are subtracted as FORCE_PLATFORM:ZERO says, unless the plate is loaded
        in those frames. The polynomial with which Kistler refines the centre of pressure of type 3
        (FPCOPPOLY) is not applied: a few millimetres near the plate's edge.

    Raises
    ------
    RecordError
        The file is not C3D, truncated or damaged; a unit is missing or unknown; a plate is of
        another type, or lacks what its type needs.
    """
    path = Path(path)
    check_size(path)
    contents = read_contents(path)
    names, markers = _markers(path, contents)
    rate = contents.number("POINT", "RATE")
    if not 0 < rate < np.inf:
        raise RecordError(
            f"{path}: POINT:RATE is {rate:g}, so the times of the frames are unknown. Enter the "
            "camera rate in the program that made the file, and export again."
        )
    found, force_rate = read_plates(path, contents, markers, rate) if plates else ((), 0.0)
    start = contents.first_frame / rate
    return Recording(
        source=str(path),
        axes="laboratory",
        names=names,
        markers=markers,
        marker_rate=rate,
        start=start,
        plates=found,
        force_rate=force_rate,
        events=_events(contents, start, len(markers) / rate),
    )


def _markers(path: Path, contents: Contents) -> tuple[tuple[str, ...], Array]:
    """Names and trajectories (T, M, 3) m of the markers."""
    labels = labels_of(contents, "POINT", "LABELS")
    count = contents.points.shape[1]
    if not count or not len(contents.points):
        raise RecordError(
            f"{path}: no markers in the file ({len(contents.points)} frames, {count} points). "
            "Export the trial with its labelled markers."
        )
    if len(labels) < count:
        raise RecordError(
            f"{path}: {count} points but {len(labels)} names (POINT:LABELS). Label the markers "
            "in the program that recorded them and export again."
        )
    metres = unit_factor(path, contents.text("POINT", "UNITS"), METRES, "POINT:UNITS")
    results = {name for group in _RESULTS for name in labels_of(contents, "POINT", group)}
    kept = [
        i
        for i, label in enumerate(labels[:count])
        if label and not label.startswith("*") and label not in results
    ]
    if not kept:
        raise RecordError(
            f"{path}: none of the {count} points is a labelled marker. Label the markers in the "
            "program that recorded them and export again."
        )
    points = contents.points[:, kept]
    # The format marks an unseen point by a negative residual, but some programs write zeros
    # instead.
    hidden = (contents.residuals[:, kept] < 0) | (points == 0).all(axis=2)
    markers = np.where(hidden[:, :, None], np.nan, points) * metres
    names = [labels[i] for i in kept]
    # Two subjects may have the same marker, so only a prefix that all names share is removed.
    prefixes = {name.partition(":")[0] for name in names if ":" in name}
    if len(prefixes) == 1 and all(":" in name for name in names):
        names = [name.partition(":")[2] for name in names]
    return tuple(names), markers


def _event(label: str, context: str) -> tuple[Side, EventKind, bool] | None:
    """Side and kind of an event, and whether it is a plate's contact; None for other events."""
    # Letters only: `R-HS` and `R HS` are the same.
    plain = re.sub(r"[^a-z]", "", label.lower())
    named = context.strip().lower()[:1]
    side: Side | None = "left" if named == "l" else "right" if named == "r" else None
    # Ordered with the longest prefixes first: `left` also begins with `l`.
    for prefix, found in _SIDES.items():
        rest = plain.removeprefix(prefix)
        if rest != plain and rest in _STRIKES + _OFFS:
            plain, side = rest, found
            break
    if side is None or plain not in _STRIKES + _OFFS:
        return None
    return side, "heel_strike" if plain in _STRIKES else "toe_off", plain in ("on", "off")


def _events(contents: Contents, start: float, duration: float) -> tuple[Event, ...]:
    """Gait events within the recording, in order of time, each once.

    Times are on the clock in which the trial's first frame is frame 1, even if the file has been
    cut. Some programs count from the first frame that is kept; this is assumed if no event fits
    otherwise. If a file has an event twice, as a plate contact (ON, OFF) and as a gait event (HS,
    TO), the contact is kept: in WBDS01walkT01.c3d, 6 of 15 RHS are 53 ms before any force.
    """
    labels = labels_of(contents, "EVENT", "LABELS")
    contexts = labels_of(contents, "EVENT", "CONTEXTS")
    times = contents.get("EVENT", "TIMES")
    found = []
    for index, label in enumerate(labels[: len(times) // 2]):
        # CONTEXTS, which has the side, may be shorter than LABELS or missing.
        meaning = _event(label, contexts[index] if index < len(contexts) else "")
        if meaning is not None:
            side, kind, contact = meaning
            # EVENT:TIMES is an array of 2 by events, minutes and seconds, with the first index
            # fastest.
            seconds = 60.0 * float(times[2 * index]) + float(times[2 * index + 1])
            found.append((Event(seconds, side, kind), contact))
    inside = [pair for pair in found if start - 0.05 <= pair[0].time <= start + duration]
    if start and not inside:
        found = [(replace(event, time=event.time + start), contact) for event, contact in found]
        inside = [pair for pair in found if start - 0.05 <= pair[0].time <= start + duration]
    kept: list[Event] = []
    # Contacts first, so that of two entries for one event the contact is kept.
    for event, _ in sorted(inside, key=lambda pair: (not pair[1], pair[0].time)):
        if not any(
            (event.side, event.kind) == (other.side, other.kind)
            and abs(event.time - other.time) < SAME_EVENT_S
            for other in kept
        ):
            kept.append(event)
    return tuple(sorted(kept, key=lambda event: event.time))
