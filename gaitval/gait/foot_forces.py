"""Which foot is on which force plate, and the ground reaction on each foot.

The wrench of a plate (force, and moment about the origin) is what is offset-corrected, combined
and filtered; centre of pressure and free moment follow from it at the end. All are linear in the
wrench, and a filtered centre of pressure would not belong to the filtered force.

Axes: the project's (REP-103, z up). Forces act on the person.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.ndimage import binary_dilation

from gaitval.arrays import Array, Flags
from gaitval.configuration import ProcessingSettings
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.events import foot_contacts
from gaitval.gait.feet_on_plates import FEET, Feet, distances_to_feet, feet_of, shared_by_both
from gaitval.gait.filters import low_pass
from gaitval.gait.plate_contacts import (
    check_synchrony,
    judge_brushes,
    judge_contact,
    judge_unshown,
    owners_of,
)
from gaitval.gait.sampling import bridged
from gaitval.mocap.recording import FootForces, Plate, Recording
from gaitval.mocap.repairs import Repair

LIGHTEST: Final = 0.05
"""Of the weight, below which a foot is in the air: 20 N are 14 % of a child of 15 kg, whose stance
they cut by 4 to 5 % of the cycle (WBDS01 made as small)."""


@dataclass(frozen=True)
class _Shares:
    """What the plates give to each foot, right first; T samples, filled plate by plate.

    Attributes
    ----------
    wrench : (T, 2, 6) N and Nm about the origin.
    valid : (T, 2) whether the plates measure all of this foot's force and nothing else.
    touched : (T, 2) whether the foot is on a plate.
    heights : m, of the surface of each plate that was stepped on.
    """

    wrench: Array
    valid: Flags
    touched: Flags
    heights: list[float]


def of_weight(processing: ProcessingSettings, mass: float) -> ProcessingSettings:
    """`processing` with a force of contact of at most `LIGHTEST` of a person's weight; `mass` in
    kg.
    """
    least = min(processing.force_threshold_n, LIGHTEST * mass * STANDARD_GRAVITY)
    return processing.model_copy(update={"force_threshold_n": least})


def assign_forces(
    recording: Recording,
    processing: ProcessingSettings,
    *,
    landmarks: Mapping[str, str],
    cutoff_hz: float | None = None,
) -> tuple[FootForces, tuple[Repair, ...]]:
    """Ground reaction on each foot from the plates that it was on.

    A contact is a time in which a plate's vertical force, low-passed at `force_cutoff_hz`, is
    above `force_threshold_n`. It belongs to the foot nearer to its centre of pressure. Wrenches
    of plates under one foot are added, then low-passed at `cutoff_hz`; the foot is on the
    ground where the filtered vertical force is above the threshold.

    `valid` is False for a foot, and a finding says why, while both feet are on one plate (one of
    them partly, perhaps: the crossing of a split belt); while its contact's centre of pressure is
    outside the foot; while part of it is beside the plates; and in a stance (by the markers) that
    the plates do not show from its beginning to its end.

    Parameters
    ----------
    recording : cleaned and zeroed, in the project's axes.
    processing : cut-offs and order of the low-pass, and the force threshold.
    landmarks : see `foot_markers`.
    cutoff_hz : Hz; `force_cutoff_hz` if not given, `moment_force_cutoff_hz` for inverse dynamics.

    Returns
    -------
    tuple
        The forces at the plates' rate, and the findings in order of time.

    Raises
    ------
    RecordError : there are no plates; forces and markers differ in length or in time; nobody is on
        the plates.
    """
    _require_plates(recording)
    cutoff_hz = processing.force_cutoff_hz if cutoff_hz is None else cutoff_hz
    feet = feet_of(recording, landmarks)
    samples = len(recording.force_time)
    shares = _Shares(
        wrench=np.zeros((samples, 2, 6)),
        valid=np.ones((samples, 2), dtype=bool),
        touched=np.zeros((samples, 2), dtype=bool),
        heights=[],
    )
    findings: list[Repair] = []
    for plate in recording.plates:
        findings += _share_out(recording, plate, feet, processing, shares)
    if not shares.touched.any():
        largest = max(float(plate.force[:, 2].max()) for plate in recording.plates)
        raise RecordError(
            f"{recording.source}: no foot is on the {len(recording.plates)} force plate(s): their "
            f"vertical force is at most {largest:.3g} N, and never above "
            f"{processing.force_threshold_n:g} N for the length of a step. If somebody walked on "
            "the plates, the forces are not in N or are from another trial: export them again. "
            "If not, give a trial in which somebody did."
        ).with_way_on("--kinematics-only")
    check_synchrony(recording, shares.touched, landmarks)
    faint = bool(shares.wrench[:, :, 2].max() < 10.0 * processing.force_threshold_n)
    findings += judge_unshown(recording, feet, shares.touched, shares.valid, faint=faint)
    filtered = low_pass(
        shares.wrench, rate=recording.force_rate, cutoff_hz=cutoff_hz, order=processing.filter_order
    )
    on = filtered[:, :, 2] > processing.force_threshold_n
    # The sum of several plates' wrenches has no surface of its own; the centre of pressure is put
    # on their median level.
    height = float(np.median(shares.heights))
    forces = _from_wrench(recording.force_rate, recording.start, filtered, on, shares.valid, height)
    return forces, tuple(sorted(findings, key=lambda finding: (finding.start, finding.names)))


def resample_forces(forces: FootForces, times: Array) -> FootForces:
    """The same `forces`, of `assign_forces`, at other, uniformly spaced `times` (N,) s on the
    recording's clock, such as the marker frames.

    Force and moment are interpolated linearly, not the centre of pressure, after an anti-aliasing
    low-pass at 0.45 of the new rate if that is lower. `valid` is False next to a sample where it
    was False. Raises RecordError for times outside those of the forces.
    """
    old = forces.time
    spacing = float(times[1] - times[0]) if len(times) > 1 else 1.0 / forces.rate
    # the last frame of markers may be a few force samples after the last one of the forces
    if times[0] < old[0] - spacing or times[-1] > old[-1] + spacing:
        raise RecordError(
            f"Forces from {old[0]:.3f} to {old[-1]:.3f} s cannot be resampled at times from "
            f"{times[0]:.3f} to {times[-1]:.3f} s: they are of another trial or of another length."
        )
    # Back to the wrench about the origin, M = p × F + T. In the air F is zero, so any p will do.
    point = np.nan_to_num(forces.centre_of_pressure)
    moment = np.cross(point, forces.force) + forces.free_moment
    wrench = np.concatenate([forces.force, moment], axis=2)
    rate = 1.0 / spacing
    if rate < forces.rate:
        wrench = low_pass(wrench, rate=forces.rate, cutoff_hz=0.45 * rate)
    samples = (times - old[0]) * forces.rate
    # 1e-9 keeps a time that equals a sample's but for rounding at that sample.
    below = np.clip(np.floor(samples + 1e-9).astype(int), 0, len(old) - 1)
    above = np.minimum(below + 1, len(old) - 1)
    share = np.clip(samples - below, 0.0, 1.0)
    taken = (1.0 - share)[:, None, None] * wrench[below] + share[:, None, None] * wrench[above]
    # At a sample's own time the next sample does not matter.
    exact = share < 1e-6
    nearest = np.where(share < 0.5, below, above)
    # The low-pass lets force leak into swing, so contact is that of the nearest original sample.
    on = np.isfinite(forces.centre_of_pressure[nearest, :, 2]) & (taken[:, :, 2] > 0.0)
    heights = np.nanmedian(forces.centre_of_pressure[:, :, 2])
    valid = forces.valid[below] & (forces.valid[above] | exact[:, None])
    return _from_wrench(rate, float(times[0]), taken, on, valid, float(heights))


def settled(forces: FootForces) -> Flags:
    """(T, 2) whether a foot's low-passed force is known: where it is `valid`, but for what a loaded
    foot has within `FEET.settling_seconds` of frames that are not. There the low-pass has a part of
    them in it, such as the other foot's force on the same plate.
    """
    width = 2 * round(FEET.settling_seconds * forces.rate) + 1
    loaded = np.isfinite(forces.centre_of_pressure[..., 2])
    beside = binary_dilation(~forces.valid, structure=np.ones((width, 1), dtype=bool))
    return np.asarray(forces.valid & ~(loaded & beside))


def _share_out(
    recording: Recording,
    plate: Plate,
    feet: Feet,
    processing: ProcessingSettings,
    shares: _Shares,
) -> list[Repair]:
    """Assign each contact with a plate to a foot, in place; returns the objections as findings."""
    vertical = low_pass(
        plate.force[:, 2],
        rate=recording.force_rate,
        cutoff_hz=processing.force_cutoff_hz,
        order=processing.filter_order,
    )
    begins, ends = foot_contacts(vertical > processing.force_threshold_n, rate=recording.force_rate)
    if not len(begins):
        return []
    findings = []
    samples = len(vertical)
    shares.heights.append(float(np.nanmedian(plate.centre_of_pressure[:, 2])))
    whole = np.concatenate([plate.force, _moment(plate)], axis=1)
    sharing = shared_by_both(plate, feet, recording.force_rate)
    if plate.foot is not None:
        sharing = np.zeros(samples, dtype=bool)
    used = np.zeros(samples, dtype=bool)
    for number, (begin, end) in enumerate(zip(begins, ends, strict=True)):
        # the filter also needs the rise and fall below the threshold
        # They reach at most half-way to the next contact, so that no sample counts twice.
        before = (ends[number - 1] + begin) // 2 if number else 0
        after = (end + begins[number + 1]) // 2 if number + 1 < len(begins) else samples
        reach = int(FEET.settling_seconds * recording.force_rate)
        window = slice(max(before, begin - reach), min(after, end + reach))
        distances = distances_to_feet(plate, feet, begin, end)
        owner = owners_of(plate.force[begin:end, 2], distances, sharing[begin:end])
        if plate.foot is not None:
            owner[:] = SIDES.index(plate.foot)
        for column in (0, 1):
            mine = np.zeros(samples, dtype=bool)
            mine[begin:end] = owner == column
            if not mine.any():
                continue
            shares.touched[mine, column] = True
            # The tails belong to the foot that begins the contact and to the one that ends it.
            if mine[begin]:
                mine[window.start : begin] = True
            if mine[end - 1]:
                mine[end : window.stop] = True
            # All wrenches are about the same origin, so those of a foot on two plates simply add
            # up.
            shares.wrench[mine, column] += whole[mine]
        # One foot owns a shared contact, but both touch the plate.
        shares.touched[begin:end] |= sharing[begin:end, None]
        if plate.foot is None:
            findings += judge_contact(
                recording, plate, feet, begin, end, owner, distances, sharing, shares.valid
            )
        used[begin:end] = True
    findings += judge_brushes(recording, plate, feet, vertical, used, processing, shares.valid)
    return findings


def _require_plates(recording: Recording) -> None:
    if not recording.plates:
        raise RecordError(
            f"{recording.source}: the trial has no force plates, but moments and ground reaction "
            "need them. Give a trial with forces (C3D with FORCE_PLATFORM, or the markers with "
            "their .mot by --forces); angles and gait cycles need no forces."
        )
    shown = len(recording.plates[0].force) / recording.force_rate
    walked = len(recording.markers) / recording.marker_rate
    lengths = {len(plate.force) for plate in recording.plates}
    if len(lengths) > 1 or abs(shown - walked) > 1.5 / recording.marker_rate:
        raise RecordError(
            f"{recording.source}: markers of {walked:.3f} s ({len(recording.markers)} frames at "
            f"{recording.marker_rate:g} Hz), but forces of {shown:.3f} s "
            f"({', '.join(map(str, sorted(lengths)))} samples at {recording.force_rate:g} Hz): "
            "one of them is cut off or from another trial. Export both over the same time."
        )


def _moment(plate: Plate) -> Array:
    """(T, 3) Nm about the origin, of a plate; without a centre of pressure the force acts at the
    nearest one in time, which keeps the small force there under the foot.
    """
    if plate.moment is not None:
        return plate.moment
    point = plate.centre_of_pressure
    known = np.asarray(np.isfinite(point).all(axis=1))
    if not known.any():
        return np.zeros_like(plate.force)
    return np.asarray(np.cross(bridged(point, known), plate.force) + plate.free_moment)


def _from_wrench(
    rate: float, start: float, wrench: Array, on: Flags, valid: Flags, height: float
) -> FootForces:
    """Force, centre of pressure at a height, and the free moment about it, while a foot is on the
    ground.

    The moment about the centre of pressure is vertical: M − p × F = (0, 0, Tz) with pz = h gives
    px = (h Fx − My) / Fz and py = (h Fy + Mx) / Fz (Winter 2009, chapter 5).
    """
    force = np.where(on[:, :, None], wrench[:, :, :3], 0.0)
    # Where a foot is in the air the division is by NaN, so its centre of pressure is NaN.
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
