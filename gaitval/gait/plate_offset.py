"""Remove what a force plate shows while no foot is on it.

The correction is made to the wrench; see `foot_forces`. Axes: the project's (REP-103, z up).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.ndimage import binary_erosion

from gaitval.arrays import Array, runs
from gaitval.gait.feet_on_plates import FEET, Feet, feet_of, reaches
from gaitval.gait.filters import low_pass
from gaitval.mocap.pressed_plates import plate_under
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.repairs import Repair, repair


@dataclass(frozen=True)
class OffsetLimits:
    """What the offset of an unloaded plate is taken from."""

    least_unloaded_seconds: float = 0.1
    """A plate's offset is its mean over at least this time without a foot on it, s."""
    smallest_offset_n: float = 1.0
    """Offsets below this are the noise of a plate."""
    restless_n: float = 15.0
    """Standard deviation of the low-passed vertical force of an unloaded plate above which
    something other than an offset acts on it, N. A running belt leaves about 1 N."""
    restless_cutoff_hz: float = 20.0
    """... after this low-pass, Hz: a belt's motor and frame shake the plate at 25 Hz and above."""


OFFSETS: Final = OffsetLimits()


def zero_plates(
    recording: Recording, *, landmarks: Mapping[str, str]
) -> tuple[Recording, tuple[Repair, ...]]:
    """Subtract what the plates show while no foot is on them.

    The offset of all six components is the mean in each phase without a foot on the plate (by the
    markers), interpolated linearly between the phases, so that drift is removed too. Phases in
    which the force varies as if a foot were there are left out, if most are quiet; what is larger
    there than with a foot on the plate is no offset, and is left as it is. It matters most
    for the centre of pressure: WBDS01 T01 has −34 N and 18 Nm on its right plate in swing, which
    moves the centre of pressure decimetres away from the foot at toe-off.

    A plate without moments (`Plate.moment` is None) is left as it is, and an offset of its force is
    only reported, because its centre of pressure could not be corrected.

    Parameters
    ----------
    recording : cleaned, in the project's axes.
    landmarks : see `foot_markers`.

    Returns
    -------
    tuple
        The recording with zeroed plates, and one finding for each plate that had an offset.

    Raises
    ------
    RecordError : as `marker_events`.
    """
    if not recording.plates:
        return recording, ()
    feet = feet_of(recording, landmarks)
    plates, findings = [], []
    for plate in recording.plates:
        zeroed, found = _zeroed(recording, plate, feet)
        plates.append(zeroed)
        findings += found
    return replace(recording, plates=tuple(plates)), tuple(findings)


def _zeroed(recording: Recording, plate: Plate, feet: Feet) -> tuple[Plate, list[Repair]]:
    rate = recording.force_rate
    settling = round(FEET.settling_seconds * rate)
    occupied = np.zeros(len(plate.force), dtype=bool)
    for column in (0, 1):
        occupied |= feet.stance[:, column] & reaches(plate, feet.outlines[column])
    # Near a strike or toe-off the markers do not decide who is on the plate. An end of the trial is
    # no event, hence `border_value` 1.
    free = binary_erosion(~occupied, iterations=settling, border_value=1) if settling else ~occupied
    phases = [
        (begin, end)
        for begin, end in zip(*runs(free), strict=True)
        if end - begin >= OFFSETS.least_unloaded_seconds * rate
    ]
    if not phases:
        return plate, []
    # Whether something acts on the plate is judged below the frequencies at which a belt shakes it.
    smooth = low_pass(plate.force[:, 2], rate=rate, cutoff_hz=OFFSETS.restless_cutoff_hz)
    spreads = [float(smooth[begin:end].std()) for begin, end in phases]
    restless = float(np.median(spreads))
    if restless <= OFFSETS.restless_n:
        # A foot whose markers are lost, or whose strike they do not show, may be on it in others.
        both = zip(phases, spreads, strict=True)
        phases = [phase for phase, spread in both if spread <= OFFSETS.restless_n]
    middles = np.array([0.5 * (begin + end - 1) for begin, end in phases])
    components = plate.force if plate.moment is None else np.hstack([plate.force, plate.moment])
    means = np.array([components[begin:end].mean(axis=0) for begin, end in phases])
    size = float(np.abs(np.median(means[:, :3], axis=0)).max())
    drift = float(np.ptp(means[:, 2])) if len(phases) > 1 else 0.0
    if size < OFFSETS.smallest_offset_n and drift < OFFSETS.smallest_offset_n:
        return plate, []

    kept = ""
    with_foot = float(np.median(plate.force[occupied, 2])) if occupied.any() else np.inf
    if float(np.median(means[:, 2])) > abs(with_foot) + OFFSETS.restless_n:
        # An offset is there with a foot on the plate, too, whose weight adds to it.
        kept = (
            f"with a foot on it {with_foot:.0f} N up, so somebody stood on it there: the corners "
            "of two plates are exchanged, or the markers and forces are of different trials"
        )
    elif restless > OFFSETS.restless_n:
        kept = (
            f"its force varies there by {restless:.0f} N (standard deviation), so something else "
            "was on it"
        )
    return without_offset(recording, plate, middles, means, kept)


def without_offset(
    recording: Recording, plate: Plate, middles: Array, means: Array, kept: str
) -> tuple[Plate, list[Repair]]:
    """A `plate` of `recording` without its offset, and what was done; see `plate_offset`.

    Parameters
    ----------
    middles, means : (n,) samples and (n, 3 or 6) N and Nm, middle and mean of each phase without a
        foot on the plate.
    kept : why it is left as it is, in words; empty if it is taken away.
    """
    drift = float(np.ptp(means[:, 2]))
    shown = (
        f"shows {np.round(np.median(means[:, :3], axis=0), 1).tolist()} N (forward, left, up; up "
        f"varies by {drift:.1f} N) without a foot on it; "
    )
    if kept:
        shown += f"{kept}: left as it is"
    elif plate.moment is None:
        shown += (
            "left as it is, because the file has no moments to correct the centre of pressure "
            "with; give the trial as C3D with the plate's own channels"
        )
    else:
        shown += "taken away"
        samples = np.arange(len(plate.force))
        # Before the first and after the last phase the offset is that phase's own.
        offset = np.stack([np.interp(samples, middles, mean) for mean in means.T], axis=1)
        force, moment = plate.force - offset[:, :3], plate.moment - offset[:, 3:]
        # Its centre of pressure is found anew.
        plate = plate_under(plate.name, plate.corners, force, moment)
    names = [f"plate {plate.name}"]
    return plate, [repair(recording, "offset", names, 0, len(plate.force), shown)]
