"""A force plate whose offset is taken away, or left and reported."""

import numpy as np

from gaitval.arrays import Array
from gaitval.mocap.findings import Finding, finding
from gaitval.mocap.pressed_plates import plate_under
from gaitval.mocap.recording import Plate, Recording


def without_offset(
    recording: Recording, plate: Plate, middles: Array, means: Array, kept: str
) -> tuple[Plate, list[Finding]]:
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
    return plate, [finding(recording, "offset", names, 0, len(plate.force), shown)]
