"""Mean curves over the cycles of all trials, and the mass that the force plates measure."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.constants import POUND, STANDARD_GRAVITY
from gaitval.coordinates import COORDINATES, SIDES, Side
from gaitval.datasets.plausible import LEAST_WITH_AID
from gaitval.errors import RecordError
from gaitval.gait.cycles import AverageCurve, WalkedPart, average
from gaitval.gait.quality_flags import QualityFlag
from gaitval.gait.record import ANGLE_NAMES, RECORDED_ANGLES, REQUIRED_ANGLES
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.rotations import foot_angles, pelvis_angles
from gaitval.model.tree import segment_frames
from gaitval.session.request import Request
from gaitval.session.trial import WalkingTrial, valid_cycles

MASS_TOLERANCE = 0.12
"""Fraction of the body mass by which the force plates may differ from it. Plates with a wrong
offset, or a foot beside them, miss a few per cent; a mass in pounds is 120 % off."""

NEARLY_WHOLE: Final = 0.98
"""Least share of a cycle in which the plates show both feet. A foot that ends it beside the plates
is on the ground a few samples before, by the markers, depending on their rate."""

_MASS_HINTS = (
    (POUND, "The mass looks like pounds: give --mass {mass:.1f}."),
    (1.0 / STANDARD_GRAVITY, "The forces look like kilograms (kgf): export them in N."),
    (1.0 / (POUND * STANDARD_GRAVITY), "The forces look like pounds (lbf): export them in N."),
)
"""By the ratio of the weight on the plates to the mass given."""


def side_angles(model: BodyModel, positions: Array, side: Side) -> dict[str, Array]:
    """Angles of one side over a motion `positions` (T, 31) of `model`, (T,) rad each, by the names
    and signs of `gait.record.GaitRecord`: of the joints, the pelvis and the foot.
    """
    suffix, sign = side[0], 1.0 if side == "right" else -1.0
    found = {
        f"{name}_{suffix}": positions[:, COORDINATES.index(f"{name}_{suffix}")]
        for name in RECORDED_ANGLES
    }
    # The pelvis is one body, but a record has its angles over each side's cycle. List and rotation
    # are positive with that side up and forward, hence the sign.
    tilt, list_right, rotation_right = pelvis_angles(
        Rotation.from_rotvec(positions[:, :3]).as_matrix()
    ).T
    found[f"pelvis_tilt_{suffix}"] = tilt
    found[f"pelvis_list_{suffix}"] = sign * list_right
    found[f"pelvis_rotation_{suffix}"] = sign * rotation_right
    foot = segment_frames(model, positions)[:, SEGMENTS.index(f"foot_{suffix}"), :3, :3]
    for name, angle in zip(
        ("pitch", "list", "progression"), foot_angles(foot, side).T, strict=True
    ):
        found[f"foot_{name}_{suffix}"] = angle
    return found


def mean_angles(model: BodyModel, walks: Sequence[WalkingTrial]) -> dict[str, AverageCurve]:
    """Mean joint angles of `model` by name, rad, over the cycles of all trials (`walks`)."""
    found = {}
    for side in SIDES:
        sampled = [side_angles(model, walk.motion, side) for walk in walks]
        for name in sampled[0]:
            curve = average(
                (walk.recording.time, angles[name], valid_cycles(walk, side, kinetics=False))
                for walk, angles in zip(walks, sampled, strict=True)
            )
            if curve is not None:
                found[name] = curve
    return found


SAGITTAL: Final = ("pelvis_tilt", "hip_flexion", "knee_angle", "ankle_angle")
_STEADY: Final = float(np.radians(10.0))


def largest_drift(name: str, kind: str) -> float:
    """By how much (rad, Nm/kg) a mean curve of this `name` and `kind` may end elsewhere than it
    began.

    Closing it moves no point by more than half of that: 5 degrees, beyond which joint angles
    mislead (McGinley et al. 2009, Gait & Posture 29:360), for angles that show whether a walk is
    steady; those across and about a limb, which a foot that is put down a little elsewhere changes,
    may do twice that.
    """
    if kind == "moment":
        return 0.8
    return _STEADY if name.startswith(SAGITTAL) else 2.0 * _STEADY


USUAL_DRIFT: Final = {"angle": float(np.radians(5.7)), "moment": 0.57}
"""rad and Nm/kg. Of 208 single strides of 82 people over ground, with and without a gait disorder,
in 99 % all of nine angles end nearer than this to where they began (WBDS, Fukuchi 2018; Shida 2023,
Front Neurosci 17:992585; Hood 2020, Sci Data 7:150): one angle by itself does in 99 % within 4.2
degrees, and then every twelfth stride has one that is beyond. So do the moments of all of 52 single
cycles of 13 people, most of them children."""
TIMING: Final = 2.0
"""% of a cycle by which the one strike of a foot may be timed unlike the other (99 % of 20 ms in a
stride of 1 s, `events.FOOT_SPREAD`): what an angle that changes fast there drifts by of itself."""
ABOUT: Final = ("hip_rotation", "subtalar", "foot_list", "foot_progression", "pelvis_rotation")
"""Angles that a foot changes which is put down a little elsewhere. As in `largest_drift` they may
drift by twice as much: at most 10.6 degrees in 64 single strides of three boys of 10 to 15 years,
two of them with cerebral palsy, worked out here."""
LEAST_DRIFT: Final = float(np.radians(4.0))
"""rad. Closing it moves no point by more than 2 degrees, which nobody minds (McGinley 2009)."""


def usual_drift(name: str, kind: str, curve: AverageCurve) -> float:
    """By how much (rad, Nm/kg) the mean `curve` of this `name` and `kind` differs between its ends
    in nearly everybody: single strides of people are not alike, nor is the time of a strike exact,
    and their mean drifts the less the more there are.
    """
    usual = USUAL_DRIFT[kind]
    if kind == "moment":
        return usual
    if name.startswith(ABOUT):
        usual *= 2.0
    fast = float(np.mean(np.abs(np.diff(curve.mean)[[0, -1]])))  # a % of the cycle
    return max(LEAST_DRIFT, float(np.hypot(usual, TIMING * fast) / np.sqrt(len(curve.curves))))


def left_open(name: str, curve: Array) -> bool:
    """Whether the mean angle `curve` (101,) of this `name`, which a subject need not have, is left
    out because it does not close.
    """
    return name not in REQUIRED_ANGLES and bool(abs(curve[-1] - curve[0]) > _STEADY)


def drift_warnings(
    angles: Mapping[str, AverageCurve], moments: Mapping[str, AverageCurve]
) -> Iterator[QualityFlag]:
    """Warning about mean `angles` (rad) and `moments` (Nm/kg) whose ends differ by more than nearly
    everybody's: one at most, of all of them, because one stride that is not as the others, or one
    marker, moves several curves.
    """
    of_subjects = {name: curve for name, curve in angles.items() if name in ANGLE_NAMES}
    wide: list[tuple[float, str, float, float, str]] = []
    words: list[str] = []
    for kind, curves, size, unit, shown in (
        ("angle", of_subjects, 180.0 / np.pi, "deg", "{:+.1f}°"),
        ("moment", moments, 1.0, "Nm/kg", "{:+.2f} Nm/kg"),
    ):
        for name, curve in curves.items():
            gap = float(curve.mean[-1] - curve.mean[0])
            usual = usual_drift(name, kind, curve)
            if abs(gap) <= usual:
                continue
            out = kind == "angle" and left_open(name, curve.mean)
            said = f"{name} {shown.format(size * gap)}"
            words.append(
                f"{said} (left out of the subject, for it does not close)" if out else said
            )
            wide.append((abs(gap) / usual, name, size * abs(gap), size * usual, unit))
    if not wide:
        return
    _, _, value, limit, unit = max(wide)
    yield QualityFlag(
        *("drift", ", ".join(name for _, name, *_ in wide), value, limit, unit),
        "from one heel strike to the next the mean curves drift by more than those of 99 % of "
        f"people over as many strides: {', '.join(words)}; taken away evenly over the cycle. An "
        "uneven walk does so, and so do markers that moved, gaps, and forces that are late: begin "
        "there if other warnings name them; else more cycles make it smaller",
    )


def mean_kinetics(
    request: Request, walks: Sequence[WalkingTrial]
) -> tuple[dict[str, AverageCurve], dict[Side, AverageCurve]]:
    """Moments in Nm/kg and ground reactions in body weights, with the mass of `request`, over the
    cycles of all `walks`; empty without forces.
    """
    moments: dict[str, AverageCurve] = {}
    forces: dict[Side, AverageCurve] = {}
    for i, side in enumerate(SIDES):
        parts: dict[str, list[WalkedPart]] = {}
        reactions: list[WalkedPart] = []
        for walk in walks:
            if walk.moments is None or walk.forces is None:
                return {}, {}
            cycles = valid_cycles(walk, side, kinetics=True)
            for name, values in walk.moments.recorded_moments().items():
                if name.endswith(f"_{side[0]}"):
                    parts.setdefault(name, []).append(
                        (walk.recording.time, values / request.mass_kg, cycles)
                    )
            weights = walk.forces.force[:, i] / (request.mass_kg * STANDARD_GRAVITY)
            reactions.append((walk.forces.time, weights, cycles))
        for name, of_name in parts.items():
            curve = average(of_name)
            if curve is not None:
                moments[name] = curve
        force = average(reactions)
        if force is not None:
            forces[side] = force
    return moments, forces


def check_mass(request: Request, walks: Sequence[WalkingTrial]) -> float | None:
    """Mean vertical force of `walks` over whole gait cycles, in body weights of `request`; None if
    no cycle is shown whole.

    Raises RecordError if the plates measure another mass, perhaps because one is in pounds; less
    than the mass is right with an aid, which carries the rest.
    """
    shares = []
    for walk in walks:
        if walk.forces is None:
            continue
        time = walk.forces.time
        for side in SIDES:
            for cycle in valid_cycles(walk, side, kinetics=True):
                inside = (time >= cycle.start) & (time < cycle.end)
                known = walk.forces.valid.all(axis=1) & inside
                if known.sum() >= NEARLY_WHOLE * inside.sum():
                    # Momentum at both ends of a cycle of steady walking is equal, so the mean force
                    # is the weight.
                    shares.append(walk.forces.force[known, :, 2].sum(axis=1).mean())
    if not shares:
        return None
    weight = float(np.mean(shares)) / STANDARD_GRAVITY
    ratio = weight / request.mass_kg
    if request.aid is not None and LEAST_WITH_AID <= ratio <= 1.0 + MASS_TOLERANCE:
        return ratio
    if abs(ratio - 1.0) > MASS_TOLERANCE:
        hint = next(
            (words for factor, words in _MASS_HINTS if abs(ratio / factor - 1.0) < MASS_TOLERANCE),
            "Check the mass, the unit of the forces, and that the trial is of this person. If "
            "something else carries a part of the body, say so with aid in a session file"
            + ("." if ratio < 1.0 else "; what the person carried counts in the mass."),
        ).format(mass=request.mass_kg * POUND)
        raise RecordError(
            f"The force plates carry {weight:.1f} kg over {len(shares)} whole gait cycles, but "
            f"the mass given is {request.mass_kg:.1f} kg. Over whole cycles the two must agree "
            f"within {100 * MASS_TOLERANCE:.0f} %. {hint} Without the forces the body keeps the "
            "mass given: only where that one is right."
        ).with_way_on("--kinematics-only")
    return ratio
