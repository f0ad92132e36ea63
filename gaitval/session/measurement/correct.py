"""Faults of the plates taken away, where the user asks for it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.errors import ConfigurationError
from gaitval.gait.agreement import both_known
from gaitval.kinetics.inverse.inverse_dynamics import residuals
from gaitval.mocap.recording import Plate, Recording
from gaitval.session.average import check_mass, mean_angles, mean_kinetics
from gaitval.session.measurement.balance import moment_of, plate_middle
from gaitval.session.measurement.estimate import Examined, together
from gaitval.session.measurement.fault_text import title
from gaitval.session.measurement.kinds import KINDS as FAULTS
from gaitval.session.measurement.kinds import kind_of
from gaitval.session.request import Notify
from gaitval.session.session import Import
from gaitval.session.trial import WalkingTrial, work_out_trial

KINDS: Final = tuple(name for name, kind in FAULTS.items() if kind.corrected)
"""Faults that a recording can be corrected for; others are those of the body or of the cameras, or
have taken away what cannot be brought back."""
WORSE: Final = 1.1
"""Times the residuals, beyond which a correction does harm; that of a small error that is not there
changes them by less."""


def wanted(given: Sequence[str]) -> tuple[str, ...]:
    """The kinds of faults that `--correct` names, also as "delay,gain". Raises ConfigurationError
    if one cannot be corrected.
    """
    kinds = tuple(
        part.strip().lower() for each in given for part in each.split(",") if part.strip()
    )
    unknown = [kind for kind in kinds if kind not in KINDS]
    if unknown:
        raise ConfigurationError(
            f"--correct {unknown[0]}: this fault cannot be corrected. Those that can be: "
            f"{', '.join(KINDS)}."
        )
    return kinds


def corrected(found: Import, seen: Examined, kinds: Sequence[str], notify: Notify) -> Import:
    """The import `found` again, with its plates corrected for the faults of these `kinds` that were
    `seen`.
    """
    faults = together(seen, kinds)
    for kind in kinds:
        if not any(kind_of(name) == kind for name in faults):
            notify("correct", f"{kind}: none that its estimate is sure of; nothing is changed")
    for name, value in faults.items():
        of = FAULTS[kind_of(name)]
        notify("correct", f"{title(name)}: {-of.factor * value:+.1f} {of.unit}")
    trials = []
    for walk, recording in zip(found.trials, _recordings(found), strict=True):
        trials.append(
            work_out_trial(
                found.request, found.processing, found.session, found.body, walk.name,
                without_faults(recording, faults),
            )
        )  # fmt: skip
    (force, moment), (force_now, moment_now) = _left(found.trials), _left(trials)
    force, moment = force_now / force, moment_now / moment
    if force * moment > WORSE**2:
        notify(
            "warnings",
            f"--correct {','.join(kinds)}: forces and motion contradict each other more than "
            f"before (residual force {force:.1f} times, moment {moment:.1f} times), so these "
            "faults are not there, or not so large. Leave the option out",
        )
    moments, forces = mean_kinetics(found.request, trials)
    return replace(
        found,
        trials=tuple(trials),
        moments=moments,
        forces=forces,
        angles=mean_angles(found.body.model, trials),
        weight_ratio=check_mass(found.request, trials),
    )


def _left(walks: Sequence[WalkingTrial]) -> tuple[float, float]:
    """N and Nm, root mean square over trials of what Newton's law for the whole body leaves."""
    found = [
        residuals(walk.dynamics, known)
        for walk in walks
        if walk.dynamics is not None and walk.loads is not None
        for known in [both_known(walk.loads)]
        if known.any()
    ]
    if not found:
        return 1.0, 1.0
    forces, moments = np.array([(each.force_rms, each.moment_rms) for each in found]).T
    return float(np.sqrt(np.mean(forces**2))), float(np.sqrt(np.mean(moments**2)))


def _recordings(found: Import) -> list[Recording]:
    """The walking trials as read, of those that were used."""
    by_source = {recording.source: recording for recording in found.session.walking}
    return [by_source[walk.recording.source] for walk in found.trials]


def without_faults(recording: Recording, faults: dict[str, float]) -> Recording:
    """A `recording` whose plates have these `faults`, in the units of `kinds.KINDS`, without
    them. One of all plates adds to those of each; if they are turned, they are as one block about
    their middle (`likelihood.balance`). Corners move with a plate, but do not turn: which foot is
    on which plate was found with them.
    """
    middles = [
        plate_middle(plate, np.hstack([plate.force, moment_of(plate)]))
        for plate in recording.plates
    ]
    block = np.mean(middles, axis=0) if middles else np.zeros(3)
    plates = []
    for plate, middle in zip(recording.plates, middles, strict=True):
        size = {
            kind: faults.get(f"{kind} {plate.name}", 0.0) + faults.get(f"{kind} all", 0.0)
            for kind in ("place x", "place y", "gain", "cross-talk x", "cross-talk y")
        }
        turns = (
            (faults.get(f"rotation {plate.name}", 0.0), middle),
            (faults.get("rotation all", 0.0), block),
        )
        samples = faults.get("delay", 0.0) * recording.force_rate
        plates.append(_repaired(plate, middle, size, turns, samples))
    return replace(recording, plates=tuple(plates))


def _repaired(
    plate: Plate,
    middle: Array,
    size: dict[str, float],
    turns: Sequence[tuple[float, Array]],
    samples: float,
) -> Plate:
    """`turns` are angles, rad, and the points (3,) m that they are about."""
    force, moment = plate.force, moment_of(plate)
    # In the reverse order of how they come about: what is recorded late was shown by channels
    # with cross-talk, of a plate that is not where it seems to be.
    force, moment = _sooner(force, samples), _sooner(moment, samples)
    more = force[:, 2:] * np.array([size["cross-talk x"], size["cross-talk y"], 0.0])
    force, moment = force - more, moment - np.cross(middle, more)
    force, moment = force / (1.0 + size["gain"]), moment / (1.0 + size["gain"])
    for angle, about in turns:
        if not angle:
            continue
        back = Rotation.from_rotvec([0.0, 0.0, -angle]).as_matrix()
        turned = force @ back.T
        moment = (moment - np.cross(about, force)) @ back.T + np.cross(about, turned)
        force = turned
    by = np.array([size["place x"], size["place y"], 0.0])
    moment = moment - np.cross(by, force)
    point, free = _pressure(plate, force, moment)
    return replace(
        plate,
        corners=plate.corners - by,
        force=force,
        centre_of_pressure=point,
        free_moment=free,
        moment=None if plate.moment is None else moment,
    )


def _sooner(values: Array, samples: float) -> Array:
    """Values (T, 3) this many samples earlier; at the end the last one stays."""
    at, rows = np.arange(len(values)) + samples, np.arange(len(values))
    return np.column_stack([np.interp(at, rows, values[:, i]) for i in range(values.shape[1])])


def _pressure(plate: Plate, force: Array, moment: Array) -> tuple[Array, Array]:
    """Centre of pressure at the height of the plate, and the free moment about it, where the plate
    is loaded.
    """
    known = np.isfinite(plate.centre_of_pressure[:, 2])
    height = float(np.median(plate.centre_of_pressure[known, 2])) if known.any() else 0.0
    least = float(np.abs(plate.force[known, 2]).min()) if known.any() else np.inf
    vertical = np.where(np.abs(force[:, 2]) >= max(least, 1.0), force[:, 2], np.nan)
    point = np.stack(
        [
            (height * force[:, 0] - moment[:, 1]) / vertical,
            (height * force[:, 1] + moment[:, 0]) / vertical,
            np.where(np.isfinite(vertical), height, np.nan),
        ],
        axis=1,
    )
    free = np.zeros_like(force)
    loaded = np.isfinite(vertical)
    free[loaded, 2] = (moment - np.cross(point, force))[loaded, 2]
    return point, free
