"""A plate under both feet: its force divided between them, by its centre of pressure.

A plate measures the sum. In double support its centre of pressure p moves from the foot behind to
the foot in front, and between the centres of pressure of the feet it stands as the vertical forces
do: with w the share in front, p = w p' + (1 - w) p''. These two are not measured, but each is known
where its foot stands alone, and in between it rolls: behind from there to the toes, in front from
the heel to there. The level forces are those whose lines, with the sum's, meet at one height h,

    f' / f'_z = f / f_z + (p - p') / h,

because the forces on both feet point to about the same place above the centre of mass (Maus et al.
2010, doi:10.1038/ncomms1073). All forces and moments add up to those of the plate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES
from gaitval.gait.filters import low_pass
from gaitval.gait.sampling import interpolated
from gaitval.mocap.foot_markers import facing, foot_markers, pelvis_markers
from gaitval.mocap.recording import Recording


@dataclass(frozen=True)
class DividedLimits:
    """When the force under two feet can be divided."""

    beside: float = 0.03
    """s before and after the markers' double support that may belong to it."""
    toes: float = 0.6
    """How far ahead of the forefoot's marker the foot behind rolls, and `heel`, how far ahead of
    the heel's that in front begins, over the distance of these markers."""
    heel: float = 0.25
    late: float = 2.0
    """Power of the time in double support with which the foot behind rolls; 1 / it in front. These
    three and the height were chosen on four virtual people."""
    height: float = 1.3
    """Of the place in which the forces meet, over that of the pelvis's markers, above the plate."""
    least: float = 0.5
    """Of the median force: less is not all of a walking person."""


DIVIDED: Final = DividedLimits()


def divided(
    recording: Recording,
    landmarks: Mapping[str, str],
    stance: Flags,
    sharing: Flags,
    wrench: Array,
    level: float,
    processing: ProcessingSettings,
) -> list[tuple[slice, Array]]:
    """What each foot has of a plate's force while both are on it: the times, and there (n, 2, 6) N
    and Nm, right first, low-passed. Double supports that are cut off, or before or after which not
    one foot stands alone, are left out.

    `recording` is in the project's axes, and `landmarks` names its markers. At the rate of the
    forces, `stance` (T, 2) says where each foot stands, right first, `sharing` (T,) where both are
    on the plate, and `wrench` (T, 6) N and Nm about the origin is the plate's, whose surface is at
    `level` m. Of `processing` the low-pass of forces is used.
    """
    wrench = low_pass(
        wrench,
        rate=recording.force_rate,
        cutoff_hz=processing.force_cutoff_hz,
        order=processing.filter_order,
    )
    forward = facing(recording, landmarks)[:2]
    frames = (recording.force_time - recording.start) * recording.marker_rate
    markers = [foot_markers(recording, landmarks)[side] for side in SIDES]
    heels = [interpolated(each.heel, frames)[:, :2] for each in markers]
    fronts = [interpolated(each.front, frames)[:, :2] for each in markers]
    length = float(np.nanmedian([(f - h) @ forward for f, h in zip(fronts, heels, strict=True)]))
    height = DIVIDED.height * (
        float(np.nanmedian(pelvis_markers(recording, landmarks)[:, 2])) - level
    )
    up = wrench[:, 2]
    least = DIVIDED.least * float(np.median(up[up > processing.force_threshold_n]))
    turned = np.stack([-wrench[:, 4], wrench[:, 3]], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        pressure = (turned + level * wrench[:, :2]) / up[:, None]
    alone = stance[:, 0] ^ stance[:, 1]
    beside = round(DIVIDED.beside * recording.force_rate)
    found = []
    for begin, end in zip(*runs(sharing), strict=True):
        first, last = begin - beside, end + beside - 1
        if first < 0 or last >= len(up) or not (alone[begin - 1] and alone[end]):
            continue
        behind, ahead = int(stance[begin - 1, 1]), int(stance[end, 1])
        during = slice(first, last + 1)
        at, back, front = pressure[during], fronts[behind][during], heels[ahead][during]
        seen = np.isfinite(at).all() and np.isfinite(back).all() and np.isfinite(front).all()
        if behind == ahead or not seen or (up[during] < least).any():
            continue
        time = np.linspace(0.0, 1.0, len(at))[:, None]
        known = at[0] - back[0], at[-1] - front[-1]
        # Across, each stays where it is known.
        toes, heel = (
            along * length * forward + each - (each @ forward) * forward
            for along, each in zip((DIVIDED.toes, DIVIDED.heel), known, strict=True)
        )
        rolled, landed = time**DIVIDED.late, time ** (1.0 / DIVIDED.late)
        two = (
            back + (1.0 - rolled) * known[0] + rolled * toes,
            front + (1.0 - landed) * heel + landed * known[1],
        )
        share = _share((at - two[0]) @ forward, (two[1] - two[0]) @ forward, 0.1 * length)
        arms = [np.column_stack([each, np.full(len(each), level)]) for each in two]
        found.append((during, _parts(wrench[during], at, arms, share, height, behind)))
    return found


def _share(passed: Array, between: Array, least: float) -> Array:
    """(n,) share of the foot in front, which rises from 0 to 1. `passed` and `between` (n,) m,
    along the walk, reach from the pressure behind to that of both and to that in front; where they
    are nearer than `least` m, that is divided by.
    """
    share = np.clip(passed / np.maximum(between, least), 0.0, 1.0)
    # The load goes over once: the mean of the nearest rising curves above and below.
    share = 0.5 * (np.maximum.accumulate(share) + np.minimum.accumulate(share[::-1])[::-1])
    share[0], share[-1] = 0.0, 1.0
    return share


def _parts(
    wrench: Array, at: Array, arms: Sequence[Array], share: Array, height: float, behind: int
) -> Array:
    """The parts (n, 2, 6) of a `wrench` (n, 6), right first. `at` (n, 2) m is its centre of
    pressure, `arms` (n, 3) m are those of the foot behind and of that in front, `share` (n,) is
    that of the vertical force in front. The forces meet at `height` m above the plate; `behind` is
    the column of the foot behind.
    """
    ahead = share[:, None] * wrench[:, :3]
    ahead[:, :2] += ahead[:, 2:] * (at - arms[1][:, :2]) / height
    parts = np.zeros((len(wrench), 2, 6))
    for column, force, arm in (
        (behind, wrench[:, :3] - ahead, arms[0]),
        (1 - behind, ahead, arms[1]),
    ):
        parts[:, column, :3], parts[:, column, 3:] = force, np.cross(arm, force)
    # What is left of the moment goes with the load.
    rest = wrench[:, 3:] - parts[:, :, 3:].sum(axis=1)
    parts[:, behind, 3:] += (1.0 - share)[:, None] * rest
    parts[:, 1 - behind, 3:] += share[:, None] * rest
    return parts
