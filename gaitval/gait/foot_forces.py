"""Which foot a force plate shows, and the ground reaction on each foot.

The wrench of a plate (force, and moment about the origin) is what is offset-corrected, combined
and filtered; centre of pressure and free moment follow from it at the end. All are linear in the
wrench, and a filtered centre of pressure would not belong to the filtered force.

Axes: the project's (REP-103, z up). Forces act on the person.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion

from gaitval.arrays import Array, Flags
from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.events import foot_contacts, marker_events, marker_stance
from gaitval.mocap.cleaning import Finding, FindingKind, low_pass, runs
from gaitval.mocap.foot_markers import FootMarkers, foot_markers
from gaitval.mocap.force_plates import make_plate, plate_axes
from gaitval.mocap.recording import FootForces, Plate, Recording

SETTLING_SECONDS: Final = 0.06
"""Around a strike or a toe-off found from markers, which are good to about 20 ms, nothing is
concluded about the plate for this long, s."""
LEAST_UNLOADED_SECONDS: Final = 0.1
"""A plate's offset is its mean over at least this long without a foot on it, s."""
SMALLEST_OFFSET_N: Final = 1.0
"""Offsets below this are the noise of a plate."""
RESTLESS_N: Final = 15.0
"""Standard deviation of the low-passed vertical force of an unloaded plate above which something
else than an offset acts on it, N. A running belt leaves about 1 N."""
RESTLESS_CUTOFF_HZ: Final = 20.0
"""... after this low-pass, Hz: a belt's motor and frame shake the plate at 25 Hz and above."""
LOW_POINT: Final = 0.03
"""m. A marker of the foot is on the ground within this of its usual lowest height."""
OUTSIDE_FOOT: Final = 0.06
"""m. How far outside the outline of the foot a centre of pressure may lie: the shoe is 1 to 2 cm
beyond the markers, plates and cameras agree within 2 cm, and little force makes it unsure."""
OUTSIDE_SHARE: Final = 0.2
"""Share of a contact's loaded time beyond `OUTSIDE_FOOT` that marks it as another foot's."""
WELL_LOADED: Final = 0.2
"""Share of the contact's peak force above which the centre of pressure is taken seriously."""
LEAST_SHOWN: Final = 0.8
"""Share of a stance, by markers, in which the plates must show a force."""
BRUSH_FORCE: Final = 2.0
"""Thresholds of force above which a touch too short for a stance is reported."""
SHORTEST_SHARED_SECONDS: Final = 0.03
"""Both feet on a plate for less than this is within the error of the markers' events, s."""

LARGEST_LAG_SECONDS: Final = 0.06
"""Events from forces may be this much earlier or later than those from markers, both strikes and
toe-offs in the median: 0.03 s at most in WBDS01 T01 and the walk of Rajagopal et al. 2016."""


@dataclass(frozen=True)
class _Feet:
    """Markers of the feet at the times of the forces: T samples, right foot first.

    Attributes
    ----------
    outlines : (T, n, 3) m of each foot.
    low : (T, n) whether each of these points is on the ground, in stance.
    stance : (T, 2).
    """

    outlines: tuple[Array, Array]
    low: tuple[Flags, Flags]
    stance: Flags


def zero_plates(
    recording: Recording, *, landmarks: Mapping[str, str]
) -> tuple[Recording, tuple[Finding, ...]]:
    """Take away what the plates show while no foot is on them.

    The offset of all six components is the mean in each phase without a foot on the plate (by
    the markers), interpolated linearly between the phases, so that a drift goes with it. It
    matters most for the centre of pressure: WBDS01 T01 has −34 N and 18 Nm on its right
    plate in swing, which moves the centre of pressure out of the foot by decimetres at toe-off.

    A plate without moments (`Plate.moment` is None) is left as it is, and an offset of its
    force only reported, for its centre of pressure could not be corrected with it.

    Parameters
    ----------
    recording : cleaned, in the project's axes.
    landmarks : see `foot_markers`.
    """
    if not recording.plates:
        return recording, ()
    feet = _feet(recording, landmarks)
    plates, findings = [], []
    for plate in recording.plates:
        zeroed, finding = _zeroed(recording, plate, feet)
        plates.append(zeroed)
        findings += finding
    return replace(recording, plates=tuple(plates)), tuple(findings)


def assign_forces(
    recording: Recording,
    processing: ProcessingSettings,
    *,
    landmarks: Mapping[str, str],
    cutoff_hz: float | None = None,
) -> tuple[FootForces, tuple[Finding, ...]]:
    """Ground reaction on each foot from the plates that it stood on.

    A contact is a time in which a plate's vertical force, low-passed at `force_cutoff_hz`, is
    above `force_threshold_n`. It belongs to the foot nearer to its centre of pressure. Wrenches
    of plates under one foot are added, then low-passed at `cutoff_hz`; the foot is on the
    ground where the filtered vertical force is above the threshold.

    `valid` is False for a foot, and a finding says why, while both feet are on one plate (one of
    them partly, perhaps: the crossing of a split belt); while its contact's centre of pressure
    lies outside the foot; while part of it stands beside the plates; and in a stance (by the
    markers) of which the plates show less than four fifths.

    Parameters
    ----------
    recording : cleaned and zeroed, in the project's axes.
    landmarks : see `foot_markers`.
    cutoff_hz : `force_cutoff_hz` if not given; `moment_force_cutoff_hz` for inverse dynamics.

    Returns
    -------
    tuple
        The forces at the plates' rate, and the findings in order of time.

    Raises
    ------
    RecordError : no plates; forces of another length than the markers, or of another time; nobody
        on the plates.
    """
    _require_plates(recording)
    cutoff_hz = processing.force_cutoff_hz if cutoff_hz is None else cutoff_hz
    feet = _feet(recording, landmarks)
    samples = len(recording.force_time)
    wrench = np.zeros((samples, 2, 6))
    valid = np.ones((samples, 2), dtype=bool)
    touched = np.zeros((samples, 2), dtype=bool)
    findings: list[Finding] = []
    heights = []
    for plate in recording.plates:
        vertical = low_pass(
            plate.force[:, 2],
            rate=recording.force_rate,
            cutoff_hz=processing.force_cutoff_hz,
            order=processing.filter_order,
        )
        begins, ends = foot_contacts(
            vertical > processing.force_threshold_n, rate=recording.force_rate
        )
        if not len(begins):
            continue
        heights.append(float(np.nanmedian(plate.centre_of_pressure[:, 2])))
        moment = _moment(plate)
        sharing = _shared(plate, feet, recording.force_rate)
        for number, (begin, end) in enumerate(zip(begins, ends, strict=True)):
            # the filter needs the rise and fall below the threshold as well
            before = (ends[number - 1] + begin) // 2 if number else 0
            after = (end + begins[number + 1]) // 2 if number + 1 < len(begins) else samples
            reach = int(SETTLING_SECONDS * recording.force_rate)
            window = slice(max(before, begin - reach), min(after, end + reach))
            distances = _distances(plate, feet, begin, end)
            owner = _owners(plate.force[begin:end, 2], distances, sharing[begin:end])
            for column in (0, 1):
                mine = np.zeros(samples, dtype=bool)
                mine[begin:end] = owner == column
                if not mine.any():
                    continue
                touched[mine, column] = True
                if mine[begin]:
                    mine[window.start : begin] = True
                if mine[end - 1]:
                    mine[end : window.stop] = True
                wrench[mine, column, :3] += plate.force[mine]
                wrench[mine, column, 3:] += moment[mine]
            touched[begin:end] |= sharing[begin:end, None]
            findings += _judge(recording, plate, feet, begin, end, owner, distances, sharing, valid)
        used = np.zeros(samples, dtype=bool)
        for begin, end in zip(begins, ends, strict=True):
            used[begin:end] = True
        findings += _brushes(recording, plate, feet, vertical, used, processing, valid)
    if not touched.any():
        largest = max(float(plate.force[:, 2].max()) for plate in recording.plates)
        raise RecordError(
            f"{recording.source}: no foot is on the {len(recording.plates)} force plate(s): their "
            f"vertical force is at most {largest:.3g} N, and never above "
            f"{processing.force_threshold_n:g} N for the length of a step. If the plates were "
            "walked on, the forces are in another unit than N or of another trial: export them "
            "again. If not, give a trial in which they were."
        )
    _check_synchrony(recording, touched, landmarks)
    findings += _unshown(recording, feet, touched, valid)
    filtered = low_pass(
        wrench, rate=recording.force_rate, cutoff_hz=cutoff_hz, order=processing.filter_order
    )
    on = filtered[:, :, 2] > processing.force_threshold_n
    height = float(np.median(heights))
    forces = _from_wrench(recording.force_rate, recording.start, filtered, on, valid, height)
    return forces, tuple(sorted(findings, key=lambda finding: (finding.start, finding.names)))


def resample_forces(forces: FootForces, times: Array) -> FootForces:
    """The same forces at other, uniformly spaced times, as at the frames of the markers.

    Force and moment are interpolated linearly, not the centre of pressure, after a low-pass at
    0.45 of the new rate where that is lower, against aliasing. `valid` is False next to a sample
    where it was.

    Parameters
    ----------
    times : (N,) s.

    Raises
    ------
    RecordError : times outside those of the forces.
    """
    old = forces.time
    spacing = float(times[1] - times[0]) if len(times) > 1 else 1.0 / forces.rate
    # the last frame of markers may be a few force samples after the last one of the forces
    if times[0] < old[0] - spacing or times[-1] > old[-1] + spacing:
        raise RecordError(
            f"Forces from {old[0]:.3f} to {old[-1]:.3f} s cannot be given at times from "
            f"{times[0]:.3f} to {times[-1]:.3f} s: they are of another trial or of another length."
        )
    point = np.nan_to_num(forces.centre_of_pressure)
    moment = np.cross(point, forces.force) + forces.free_moment
    wrench = np.concatenate([forces.force, moment], axis=2)
    rate = 1.0 / spacing
    if rate < forces.rate:
        wrench = low_pass(wrench, rate=forces.rate, cutoff_hz=0.45 * rate)
    samples = (times - old[0]) * forces.rate
    below = np.clip(np.floor(samples + 1e-9).astype(int), 0, len(old) - 1)
    above = np.minimum(below + 1, len(old) - 1)
    share = np.clip(samples - below, 0.0, 1.0)
    taken = (1.0 - share)[:, None, None] * wrench[below] + share[:, None, None] * wrench[above]
    exact = share < 1e-6
    nearest = np.where(share < 0.5, below, above)
    on = np.isfinite(forces.centre_of_pressure[nearest, :, 2]) & (taken[:, :, 2] > 0.0)
    heights = np.nanmedian(forces.centre_of_pressure[:, :, 2])
    valid = forces.valid[below] & (forces.valid[above] | exact[:, None])
    return _from_wrench(rate, float(times[0]), taken, on, valid, float(heights))


def _require_plates(recording: Recording) -> None:
    if not recording.plates:
        raise RecordError(
            f"{recording.source}: the trial has no force plates, and moments and ground reaction "
            "need them. Give a trial with forces (C3D with FORCE_PLATFORM, or the markers with "
            "their .mot by --forces); angles and gait cycles alone can be had without."
        )
    shown = len(recording.plates[0].force) / recording.force_rate
    walked = len(recording.markers) / recording.marker_rate
    lengths = {len(plate.force) for plate in recording.plates}
    if len(lengths) > 1 or abs(shown - walked) > 1.5 / recording.marker_rate:
        raise RecordError(
            f"{recording.source}: markers of {walked:.3f} s ({len(recording.markers)} frames at "
            f"{recording.marker_rate:g} Hz), but forces of {shown:.3f} s "
            f"({', '.join(map(str, sorted(lengths)))} samples at {recording.force_rate:g} Hz): one "
            "of them is cut off or of another trial. Export both over the same time."
        )


def _feet(recording: Recording, landmarks: Mapping[str, str]) -> _Feet:
    """Feet at the times of the forces; a marker in a gap is nowhere (NaN)."""
    markers = foot_markers(recording, landmarks)
    stance_frames = marker_stance(recording, landmarks=landmarks)
    frames = (recording.force_time - recording.start) * recording.marker_rate
    nearest = np.clip(np.rint(frames).astype(int), 0, len(recording.markers) - 1)
    stance = stance_frames[nearest]
    outlines, lows = [], []
    for column, side in enumerate(SIDES):
        foot: FootMarkers = markers[side]
        outline = _interpolated(foot.outline, frames)
        height = outline[:, :, 2]
        with np.errstate(invalid="ignore"):
            # of all frames, the foot spends more than half low
            floor = np.nanpercentile(foot.outline[:, :, 2], 20.0, axis=0)
            low = (height < floor + LOW_POINT) & stance[:, column, None]
        outlines.append(outline)
        lows.append(low)
    return _Feet((outlines[0], outlines[1]), (lows[0], lows[1]), stance)


def _interpolated(values: Array, frames: Array) -> Array:
    """Linear interpolation of (T, ...) at fractional frames; the last value is held."""
    frames = np.clip(frames, 0.0, len(values) - 1)
    below = np.minimum(frames.astype(int), max(len(values) - 2, 0))
    above = np.minimum(below + 1, len(values) - 1)
    share = (frames - below).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1.0 - share) * values[below] + share * values[above])


# -- offset -------------------------------------------------------------------------------------


def _zeroed(recording: Recording, plate: Plate, feet: _Feet) -> tuple[Plate, list[Finding]]:
    rate = recording.force_rate
    settling = round(SETTLING_SECONDS * rate)
    occupied = np.zeros(len(plate.force), dtype=bool)
    for column in (0, 1):
        occupied |= feet.stance[:, column] & _reaches(plate, feet.outlines[column])
    free = binary_erosion(~occupied, iterations=settling, border_value=1) if settling else ~occupied
    phases = [
        (begin, end)
        for begin, end in zip(*runs(free), strict=True)
        if end - begin >= LEAST_UNLOADED_SECONDS * rate
    ]
    if not phases:
        return plate, []
    middles = np.array([0.5 * (begin + end - 1) for begin, end in phases])
    components = plate.force if plate.moment is None else np.hstack([plate.force, plate.moment])
    means = np.array([components[begin:end].mean(axis=0) for begin, end in phases])
    smooth = low_pass(plate.force[:, 2], rate=rate, cutoff_hz=RESTLESS_CUTOFF_HZ)
    restless = float(np.median([smooth[begin:end].std() for begin, end in phases]))
    size = float(np.abs(np.median(means[:, :3], axis=0)).max())
    drift = float(np.ptp(means[:, 2])) if len(phases) > 1 else 0.0
    if size < SMALLEST_OFFSET_N and drift < SMALLEST_OFFSET_N:
        return plate, []

    shown = (
        f"shows {np.round(np.median(means[:, :3], axis=0), 1).tolist()} N (forward, left, up; up "
        f"varies by {drift:.1f} N) without a foot on it; "
    )
    if restless > RESTLESS_N:
        shown += (
            f"its force varies there by {restless:.0f} N (standard deviation), so something else "
            "stood on it: left as it is"
        )
        return plate, [_offset_finding(recording, plate, shown)]
    if plate.moment is None:
        shown += (
            "left as it is, as the file has no moments with which the centre of pressure could "
            "be corrected; give the trial as C3D with the plate's own channels"
        )
        return plate, [_offset_finding(recording, plate, shown)]
    samples = np.arange(len(plate.force))
    offset = np.stack([np.interp(samples, middles, mean) for mean in means.T], axis=1)
    force, moment = plate.force - offset[:, :3], plate.moment - offset[:, 3:]
    axes, centre = plate_axes(plate.corners), plate.corners.mean(axis=0)
    about_centre = moment - np.cross(centre, force)
    zeroed = make_plate(plate.name, plate.corners, force @ axes, about_centre @ axes)
    return zeroed, [_offset_finding(recording, plate, shown + "taken away")]


def _offset_finding(recording: Recording, plate: Plate, action: str) -> Finding:
    names = (f"plate {plate.name}",)
    return _finding(recording, names, 0, len(plate.force), action, kind="offset")


def _reaches(plate: Plate, outline: Array) -> Flags:
    """(T,) whether a foot may touch a plate: some of its outline is over it, or 2 cm beside it."""
    if not np.isfinite(plate.corners).all():
        return np.ones(len(outline), dtype=bool)
    inside = _over(plate, outline, margin=0.02)
    # a marker that is not seen may be anywhere
    return np.asarray((inside | ~np.isfinite(outline).all(axis=2)).any(axis=1))


def _over(plate: Plate, points: Array, *, margin: float = 0.0) -> Flags:
    """(T, n) whether points (T, n, 3) are over the plate, widened by a margin in m."""
    centre, axes = plate.corners.mean(axis=0), plate_axes(plate.corners)
    half = np.abs((plate.corners - centre) @ axes).max(axis=0)[:2] + margin
    with np.errstate(invalid="ignore"):
        inside = np.abs((points - centre) @ axes)[..., :2] <= half
    return np.asarray(inside.all(axis=-1))


# -- contacts -----------------------------------------------------------------------------------


def _moment(plate: Plate) -> Array:
    """(T, 3) Nm about the origin, of a plate; where it has no centre of pressure, the force acts
    at the nearest one in time, which keeps the little force there is under the foot.
    """
    if plate.moment is not None:
        return plate.moment
    point = plate.centre_of_pressure
    known = np.isfinite(point).all(axis=1)
    if not known.any():
        return np.zeros_like(plate.force)
    samples = np.arange(len(point))
    filled = np.stack([np.interp(samples, samples[known], x[known]) for x in point.T], axis=1)
    return np.asarray(np.cross(filled, plate.force) + plate.free_moment)


def _shared(plate: Plate, feet: _Feet, rate: float) -> Flags:
    """(T,) whether both feet stand on the plate, at least partly."""
    if not np.isfinite(plate.corners).all():
        return np.zeros(len(plate.force), dtype=bool)
    standing = [
        (_over(plate, feet.outlines[column]) & feet.low[column]).any(axis=1) for column in (0, 1)
    ]
    shared = np.asarray(standing[0] & standing[1])
    # the markers' strikes and toe-offs are good to about 20 ms
    for begin, end in zip(*runs(shared), strict=True):
        if end - begin < SHORTEST_SHARED_SECONDS * rate:
            shared[begin:end] = False
    return shared


def _distances(plate: Plate, feet: _Feet, begin: int, end: int) -> Array:
    """(n, 2) m: horizontal distance of the centre of pressure to the outline of each foot."""
    point = plate.centre_of_pressure[begin:end, :2]
    return np.stack(
        [_outside(point, outline[begin:end, :, :2]) for outline in feet.outlines], axis=1
    )


def _outside(point: Array, outline: Array) -> Array:
    """(T,) m: distance of points (T, 2) to the convex hull of a foot's outline (T, n, 2).

    In the plane the hull is the union of the triangles of any three points, and a point outside
    it is nearest to a segment between two.
    """
    best = np.full(len(point), np.inf)
    for first, second in combinations(range(outline.shape[1]), 2):
        a, b = outline[:, first], outline[:, second]
        along = b - a
        length = np.maximum((along**2).sum(axis=1), 1e-12)
        share = np.clip(((point - a) * along).sum(axis=1) / length, 0.0, 1.0)
        best = np.fmin(best, np.linalg.norm(point - a - share[:, None] * along, axis=1))
    for corners in combinations(range(outline.shape[1]), 3):
        a, b, c = (outline[:, corner] for corner in corners)
        turns = np.sign([_turn(p, q, point) for p, q in ((a, b), (b, c), (c, a))])
        best[(turns[0] == turns[1]) & (turns[1] == turns[2])] = 0.0
    return np.where(np.isfinite(best), best, np.nan)


def _turn(start: Array, end: Array, point: Array) -> Array:
    """Twice the signed area of the triangles of points (T, 2)."""
    u, v = end - start, point - start
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _owners(vertical: Array, distances: Array, shared: Flags) -> NDArray[np.int64]:
    """(n,) column of the foot that a plate's contact belongs to, sample by sample.

    One foot for each stretch in which no other stands on the plate; a shared stretch stays with
    the foot before it (and is not valid for either).
    """
    load = np.maximum(vertical, 0.0)
    owner = np.zeros(len(vertical), dtype=np.int64)
    starts, stops = runs(~shared)
    previous = 0
    for start, stop in zip(starts, stops, strict=True):
        owner[previous:start] = owner[previous - 1] if previous else 0
        weight = np.where(np.isfinite(distances[start:stop]), load[start:stop, None], 0.0)
        mean = (weight * np.nan_to_num(distances[start:stop])).sum(axis=0)
        total = weight.sum(axis=0)
        mean = np.where(total > 0.0, mean / np.maximum(total, 1e-12), np.inf)
        owner[start:stop] = int(np.argmin(mean))
        if previous == 0 and start > 0:
            owner[:start] = owner[start]
        previous = stop
    owner[previous:] = owner[previous - 1] if previous else _nearest(distances)
    return owner


def _nearest(distances: Array) -> int:
    """Column of the foot that is nearer on average (n, 2); the right one if neither is seen."""
    known = np.where(np.isfinite(distances), distances, np.inf)
    return int(np.argmin(np.median(known, axis=0)))


def _judge(
    recording: Recording,
    plate: Plate,
    feet: _Feet,
    begin: int,
    end: int,
    owner: NDArray[np.int64],
    distances: Array,
    sharing: Flags,
    valid: Flags,
) -> list[Finding]:
    """Mark where a contact is not one foot's alone, or not wholly on the plates; say why."""
    findings = []
    plates = [other for other in recording.plates if np.isfinite(other.corners).all()]
    for start, stop in zip(*runs(sharing[begin:end]), strict=True):
        first, last = begin + int(start), begin + int(stop)
        points = [
            (_over(plate, feet.outlines[c][first:last]) & feet.low[c][first:last]).mean(axis=0)
            for c in (0, 1)
        ]
        guest = int(np.argmin([share.mean() for share in points]))
        partly = any(
            other is not plate
            and (_over(other, feet.outlines[guest][first:last]) & feet.low[guest][first:last]).any()
            for other in plates
        )
        action = (
            f"the {SIDES[guest]} foot crosses onto this plate, on which the "
            f"{SIDES[1 - guest]} one stands; forces not used"
            if partly
            else "both feet on this plate; forces not used"
        )
        valid[first:last] = False
        names = (f"plate {plate.name}", *(f"{side} foot" for side in SIDES))
        findings.append(_finding(recording, names, first, last, action))
    load = plate.force[begin:end, 2]
    heavy = load > WELL_LOADED * load.max()
    for column, side in enumerate(SIDES):
        mine = (owner == column) & ~sharing[begin:end]
        if not mine.any():
            continue
        first, last = begin + int(np.argmax(mine)), begin + len(mine) - int(np.argmax(mine[::-1]))
        names = (f"plate {plate.name}", f"{side} foot")
        known = mine & heavy & np.isfinite(distances[:, column])
        away = distances[known, column] > OUTSIDE_FOOT
        if len(away) and away.mean() > OUTSIDE_SHARE:
            valid[first:last, column] = False
            action = (
                f"the centre of pressure is up to {100 * distances[known, column].max():.0f} cm "
                f"outside the foot, in {100 * away.mean():.0f} % of the loaded time (another foot "
                "or person on the plate, or wrong corners or axes); forces not used"
            )
            findings.append(_finding(recording, names, first, last, action))
        if len(plates) < len(recording.plates):
            continue  # a plate whose place is not known may carry what seems to be beside
        on_any = np.any([_over(other, feet.outlines[column]) for other in plates], axis=0)
        beside = (feet.low[column] & ~on_any).any(axis=1)[begin:end] & mine & heavy
        if beside.mean() * len(beside) > SHORTEST_SHARED_SECONDS * recording.force_rate:
            valid[first:last, column] = False
            action = "part of the foot stands beside the plates; forces not used"
            findings.append(_finding(recording, names, first, last, action))
    return findings


def _brushes(
    recording: Recording,
    plate: Plate,
    feet: _Feet,
    vertical: Array,
    used: Flags,
    processing: ProcessingSettings,
    valid: Flags,
) -> list[Finding]:
    """Mark touches that are too short to be a stance, but not too weak to matter."""
    findings = []
    threshold = processing.force_threshold_n
    for begin, end in zip(*runs((vertical > threshold) & ~used), strict=True):
        peak = float(vertical[begin:end].max())
        if peak < BRUSH_FORCE * threshold:
            continue
        column = _nearest(_distances(plate, feet, begin, end))
        valid[begin:end, column] = False
        action = f"touched with {peak:.0f} N, too short for a stance; not used"
        names = (f"plate {plate.name}", f"{SIDES[column]} foot")
        findings.append(_finding(recording, names, begin, end, action))
    return findings


def _check_synchrony(recording: Recording, touched: Flags, landmarks: Mapping[str, str]) -> None:
    """Refuse forces that rise and fall at other times than the feet strike and leave the ground."""
    events = marker_events(recording, landmarks=landmarks)
    lags = {}
    for kind, edge in (("heel_strike", 0), ("toe_off", 1)):
        found: list[float] = []
        for column, side in enumerate(SIDES):
            shown = np.array([e.time for e in events if (e.side, e.kind) == (side, kind)])
            samples = foot_contacts(touched[:, column], rate=recording.force_rate)[edge]
            samples = samples[(samples > 0) & (samples < len(touched))]
            if len(shown):
                away = recording.start + samples[:, None] / recording.force_rate - shown
                nearest = np.argmin(np.abs(away), axis=1)
                found += away[np.arange(len(samples)), nearest].tolist()
        lags[kind] = float(np.median(found)) if found else 0.0
    early, late = sorted(lags.values())
    lag = late if early > LARGEST_LAG_SECONDS else early if late < -LARGEST_LAG_SECONDS else 0.0
    if lag:
        when = "after" if lag > 0 else "before"
        raise RecordError(
            f"{recording.source}: by the forces the feet strike the ground "
            f"{abs(lags['heel_strike']):.2f} s and leave it {abs(lags['toe_off']):.2f} s {when} "
            "the markers show it (medians): the forces are of another trial, or not "
            "synchronised with the cameras. Give the forces of this trial, exported by the clock "
            "of the markers."
        )


def _unshown(recording: Recording, feet: _Feet, touched: Flags, valid: Flags) -> list[Finding]:
    """Mark stances that the plates do not show."""
    findings = []
    settling = round(SETTLING_SECONDS * recording.force_rate)
    for column, side in enumerate(SIDES):
        shown = binary_dilation(touched[:, column], iterations=settling)
        for begin, end in zip(*runs(feet.stance[:, column]), strict=True):
            share = float(shown[begin:end].mean())
            if share >= LEAST_SHOWN:
                continue
            valid[begin:end, column] = False
            action = (
                "stands on no plate; no forces there"
                if share < 1.0 - LEAST_SHOWN
                else f"the plates show only {100 * share:.0f} % of this stance; forces not used"
            )
            findings.append(_finding(recording, (f"{side} foot",), begin, end, action))
    return findings


def _finding(
    recording: Recording,
    names: tuple[str, ...],
    begin: int,
    end: int,
    action: str,
    kind: FindingKind = "contact",
) -> Finding:
    start, rate = recording.start, recording.force_rate
    last = int(end) - 1
    return Finding(kind, names, int(begin), last, start + begin / rate, start + last / rate, action)


# -- from wrench to force, centre of pressure and free moment -------------------------------------


def _from_wrench(
    rate: float, start: float, wrench: Array, on: Flags, valid: Flags, height: float
) -> FootForces:
    """Force, centre of pressure at a height, and the free moment about it, where a foot is on.

    The moment about the centre of pressure is vertical: M − p × F = (0, 0, Tz) with pz = h gives
    px = (h Fx − My) / Fz and py = (h Fy + Mx) / Fz (Winter 2009, chapter 5).
    """
    force = np.where(on[:, :, None], wrench[:, :, :3], 0.0)
    moment = wrench[:, :, 3:]
    vertical = np.where(on, force[:, :, 2], np.nan)
    point = np.stack(
        [
            (height * force[:, :, 0] - moment[:, :, 1]) / vertical,
            (height * force[:, :, 1] + moment[:, :, 0]) / vertical,
            np.where(on, height, np.nan),
        ],
        axis=2,
    )
    free = np.zeros_like(force)
    free[:, :, 2] = np.where(on, moment[:, :, 2] - np.cross(point, force)[:, :, 2], 0.0)
    return FootForces(rate, start, force, point, free, valid)
