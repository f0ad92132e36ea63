"""Compute the muscle paths that gaitval ships, from a published model, with OpenSim.

    python experiments/muscle_paths.py MODEL.osim gaitval/kinetics/musculature/paths.npz

MODEL is Rajagopal et al. (2016) IEEE Trans Biomed Eng 63:2068-2079 with the changes of Lai et al.
(2017) Ann Biomed Eng 45:2762-2774 and Uhlrich et al. (2022) Sci Rep 12:9842
(`RajagopalLaiUhlrich2023.osim` of OpenSim's model library). The model file itself names no licence,
and is not shipped: what is shipped are figures that this script computes from it. It needs the
`opensim` wheel (4.6), which nothing else in gaitval does, and takes two minutes.

For each of the 40 muscles of the right leg, and over `RANGES`:

* the length L as a polynomial of the coordinates that move the muscle (Chebyshev products), fitted
  to lengths and to ∂L/∂q together. Its degree rises until 95 % of ∂L/∂q are right to `GOAL_ARM`,
  up to `HIGHEST`: paths that wrap need more;
* how L changes with the size of each bone, ∂L/∂s. A length is homogeneous in the sizes of the
  bones, L = Σ s ∂L/∂s, so that these terms are the length of a scaled person to first order;
* how L changes if a joint's distal part is displaced without any coordinate moving: by virtual
  work the force, and at the knee the moment, of the muscle on that part, per newton of tension.

OpenSim's own moment arms are not used: at wrapped joints they differ from -∂L/∂q of its own paths.
"""

import argparse
import itertools
import json
import pickle
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import opensim as osim
from scipy.linalg import solve
from scipy.stats import qmc

from gaitval.kinetics.musculature.paths import COORDINATES, KNEE
from gaitval.scaling.hip_regressions import hip_joint_centre

RANGES = np.radians([[-45, 70], [-32, 32], [-35, 35], [-15, 95], [-45, 40], [-35, 35]])
"""Range of each coordinate: of people's gait, and 20 degrees beyond (less where joints end)."""
MIDDLE, HALF = RANGES.mean(axis=1), np.diff(RANGES, axis=1)[:, 0] / 2

BONES = {
    "pelvis": ("pelvis",),
    "femur": ("femur_r", "patella_r"),
    "tibia": ("tibia_r",),
    "foot": ("talus_r", "calcn_r", "toes_r"),
}
DISPLACED = (
    ("hip_r", "hip", False),
    ("walker_knee_r", "knee", True),
    ("patellofemoral_r", "patella", False),
    ("ankle_r", "ankle", False),
)
"""Joints whose distal part is displaced; whether it is turned, too."""

KNEE_CENTRE = np.array([0.0, -0.404, 0.0])
"""Between the model's markers on the epicondyles, in its femur, m."""
ANKLE_CENTRE = np.array([0.0005, -0.3888, 0.0075])
"""Between the model's markers on the malleoli, in its tibia, m."""

SAMPLES, TESTS = 2400, 600
GOAL_ARM = 0.5e-3
JUMP, JUMP_OF_ARM = 1.5e-3, 15e-3
GAIT = np.radians([[-25, 50], [-15, 15], [-15, 15], [-3, 75], [-25, 20], [-15, 15]])
"""What of `RANGES` healthy gait uses, to say how right the paths are there."""
HIGHEST = {1: 9, 2: 9, 3: 8, 4: 7}
"""Highest total degree, by the number of coordinates."""
TURN, SHIFT, SIZE = 1e-3, 5e-4, 0.02
"""Steps of the central differences: rad, m, 1."""


class Leg:
    """The right leg of a model, to be posed and measured."""

    def __init__(self, path: str) -> None:
        self.model = osim.Model(path)
        self.muscles = [
            m for m in map(self.model.getMuscles().get, range(self.model.getMuscles().getSize()))
            if m.getName().endswith("_r")
        ]  # fmt: skip
        self.restart()

    def restart(self) -> None:
        """Build the model's state again after it was changed."""
        for coordinate in self.model.getCoordinateSet():
            coordinate.set_locked(False)
        self.state = self.model.initSystem()
        self.moved = [self.model.getCoordinateSet().get(f"{n}_r") for n in COORDINATES]
        self.patella = self.model.getCoordinateSet().get("knee_angle_r_beta")
        self.paths = [m.getGeometryPath() for m in self.muscles]

    def pose(self, q: np.ndarray) -> None:
        """Put the leg at the angles `q` (6,) rad."""
        for coordinate, value in zip(self.moved, q, strict=True):
            coordinate.setValue(self.state, float(value), False)
        # The coupler is beta = knee_angle; assembling would find the same, slowly.
        self.patella.setValue(self.state, float(q[3]), False)
        self.model.realizePosition(self.state)

    def lengths(self, poses: np.ndarray, only: np.ndarray | None = None) -> np.ndarray:
        """(poses, 40) m; of some muscles alone, the others 0."""
        found = np.zeros((len(poses), len(self.paths)))
        chosen = np.arange(len(self.paths)) if only is None else np.flatnonzero(only)
        for i, q in enumerate(poses):
            self.pose(q)
            found[i, chosen] = [self.paths[m].getLength(self.state) for m in chosen]
        return found

    def scaled(self, sizes: dict[str, float]) -> None:
        """Scale the bones of the model by `sizes`, from as it is now."""
        scales = osim.ScaleSet()
        for bone, factor in sizes.items():
            for body in BONES[bone]:
                scale = osim.Scale()
                scale.setSegmentName(body)
                scale.setScaleFactors(osim.Vec3(factor))
                scale.setApply(True)
                scales.cloneAndAppend(scale)
        self.model.scale(self.state, scales, True, -1.0)
        self.restart()


def derivatives(leg: Leg, poses: np.ndarray) -> np.ndarray:
    """∂L/∂q (poses, 40, 6) m/rad."""
    found = []
    for i in range(len(COORDINATES)):

        def slope(some: np.ndarray, only: np.ndarray | None = None, i: int = i) -> np.ndarray:
            step = np.zeros(len(COORDINATES))
            step[i] = TURN
            higher, lower = leg.lengths(some + step, only), leg.lengths(some - step, only)
            return (higher - lower) / (2 * TURN)

        found.append(where_it_matters(slope, poses))
    return np.stack(found, axis=2)


def where_it_matters(measure: Callable[..., np.ndarray], poses: np.ndarray) -> np.ndarray:
    """`measure` of all poses, but only of the muscles for which it is not 0 in a few of them."""
    return measure(poses, np.abs(measure(poses[:12])).max(axis=0) > 1e-6)


def displaced(
    leg: Leg,
    poses: np.ndarray,
    only: np.ndarray | None = None,
    *,
    joint: str,
    axis: int,
    turned: bool,
) -> np.ndarray:
    """∂L (poses, 40) by a shift (m/m), or a turn (m/rad), of the distal part of a joint along
    `axis` of the proximal bone.
    """
    frame = osim.PhysicalOffsetFrame.safeDownCast(
        leg.model.getJointSet().get(joint).getParentFrame()
    )
    origin, angles = frame.get_translation().to_numpy(), frame.get_orientation().to_numpy()
    step, both = (TURN if turned else SHIFT), []
    for sign in (1.0, -1.0):
        if turned:
            small = np.zeros(3)
            small[axis] = sign * step
            turn = osim.Rotation(float(small[axis]), osim.CoordinateAxis(axis))
            old = osim.Rotation()
            old.setRotationToBodyFixedXYZ(osim.Vec3(*map(float, angles)))
            frame.set_orientation(turn.multiply(old).convertRotationToBodyFixedXYZ())
        else:
            moved = origin.copy()
            moved[axis] += sign * step
            frame.set_translation(osim.Vec3(*map(float, moved)))
        leg.restart()
        both.append(leg.lengths(poses, only))
    frame.set_translation(osim.Vec3(*map(float, origin)))
    frame.set_orientation(osim.Vec3(*map(float, angles)))
    leg.restart()
    return (both[0] - both[1]) / (2 * step)


def powers_of(spans: np.ndarray, degree: int) -> np.ndarray:
    """Products of Chebyshev polynomials of the coordinates `spans` up to a total degree. That of
    the knee counts half in muscles that do not cross the hip: gastrocnemius wraps there.
    """
    halved = KNEE in spans and spans[0] == KNEE
    tops = [2 * degree if halved and c == KNEE else degree for c in spans]
    every = itertools.product(*(range(top + 1) for top in tops))
    costs = [0.5 if halved and c == KNEE else 1.0 for c in spans]
    return np.array([p for p in every if np.dot(p, costs) <= degree], dtype=np.int8)


def basis(unit: np.ndarray, powers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (poses, terms) at `unit` (poses, variables) in [-1, 1], and their derivatives
    (poses, terms, variables).
    """
    top = int(powers.max(initial=0))
    value, slope = [np.ones_like(unit), unit], [np.zeros_like(unit), np.ones_like(unit)]
    for _ in range(2, top + 1):
        slope.append(2 * value[-1] + 2 * unit * slope[-1] - slope[-2])
        value.append(2 * unit * value[-1] - value[-2])
    value, slope = np.stack(value), np.stack(slope)
    columns = np.arange(unit.shape[1])
    each = np.stack([value[powers[:, c], :, c] for c in columns])  # (variables, terms, poses)
    down = np.stack([slope[powers[:, c], :, c] for c in columns])
    slopes = [
        np.prod(np.stack([down[c] if c == d else each[c] for c in columns]), axis=0)
        for d in columns
    ]
    return each.prod(axis=0).T, np.stack(slopes, axis=-1).transpose(1, 0, 2)


def knee_motion(leg: Leg) -> dict[str, np.ndarray]:
    """Velocity of the tibia per rate of the knee angle, femur's axes: turning (3,), and of the
    point at `KNEE_CENTRE` (3,), as Chebyshev series of the knee angle (6, 9).
    """
    low, high = RANGES[3]
    angles = (low + high) / 2 + (high - low) / 2 * np.cos(np.pi * (np.arange(41) + 0.5) / 41)

    def place(angle: float) -> tuple[np.ndarray, np.ndarray]:
        q = np.zeros(6)
        q[3] = angle
        leg.pose(q)
        bodies = leg.model.getBodySet()
        found = bodies.get("tibia_r").findTransformBetween(leg.state, bodies.get("femur_r"))
        turned = np.array([[found.R().get(i, j) for j in range(3)] for i in range(3)])
        return turned, found.p().to_numpy()

    rows = []
    for angle in angles:
        (r0, p0), (r1, p1), (r, p) = place(angle - TURN), place(angle + TURN), place(angle)
        spin = (r1 - r0) / (2 * TURN) @ r.T
        omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        rows.append(np.r_[omega, (p1 - p0) / (2 * TURN) + np.cross(omega, KNEE_CENTRE - p)])
    unit = (2 * angles - low - high) / (high - low)
    series = np.polynomial.chebyshev.chebfit(unit, np.array(rows), 8)
    error = np.polynomial.chebyshev.chebval(unit, series).T - np.array(rows)
    print(f"knee motion: worst {np.abs(error).max() * 1e3:.3f} mm/rad")
    return {"knee_motion": series.T}


def bones(leg: Leg) -> dict[str, np.ndarray]:
    """Joints, axes and zero: see `gaitval.kinetics.musculature.paths.MuscleSkeleton`."""
    leg.pose(np.zeros(6))
    bodies = leg.model.getBodySet()

    def in_body(child: str, parent: str) -> tuple[np.ndarray, np.ndarray]:
        found = bodies.get(child).findTransformBetween(leg.state, bodies.get(parent))
        turned = np.array([[found.R().get(i, j) for j in range(3)] for i in range(3)])
        return turned, found.p().to_numpy()

    def marker(name: str) -> np.ndarray:
        return leg.model.getMarkerSet().get(name).get_location().to_numpy()

    def axis(joint: str) -> np.ndarray:
        frame = osim.PhysicalOffsetFrame.safeDownCast(
            leg.model.getJointSet().get(joint).getParentFrame()
        )
        turn = osim.Rotation()
        turn.setRotationToBodyFixedXYZ(frame.get_orientation())
        return np.array([turn.get(i, 2) for i in range(3)])

    hip = osim.PhysicalOffsetFrame.safeDownCast(
        leg.model.getJointSet().get("hip_r").getParentFrame()
    )
    turn, knee = in_body("tibia_r", "femur_r")
    (_, talus), (_, calcaneus) = in_body("talus_r", "tibia_r"), in_body("calcn_r", "talus_r")
    (_, toes) = in_body("toes_r", "calcn_r")
    ankle = knee + turn @ ANKLE_CENTRE
    shank = ankle - KNEE_CENTRE
    asis, psis = marker("RASI"), marker("RPSI")
    return {
        # As gaitval's regression (Harrington et al. 2007) finds it from this pelvis' ASIS: its own
        # hips are nearer to each other, and the person's pelvis would seem larger than it is.
        "hip_half_width": 0.33 * 2 * asis[2] + 0.0073,
        "hip_from_regression": hip.get_translation().to_numpy() - regressed(asis, psis),
        "thigh": np.linalg.norm(KNEE_CENTRE),
        "shank": np.linalg.norm(shank),
        # From the ankle to the toes' joint, along the foot.
        "foot": (talus + calcaneus + toes - ANKLE_CENTRE)[0],
        "ankle_in_shank": talus - ANKLE_CENTRE,
        "ankle_axis": axis("ankle_r"),
        "subtalar_in_talus": calcaneus,
        "subtalar_axis": axis("subtalar_r"),
        # Angles of this model while the ASIS and PSIS are level, and hip, knee and ankle centres in
        # a line, which is gaitval's zero.
        "hip_zero": -np.arctan2(psis[1] - asis[1], asis[0] - psis[0]),
        "knee_zero": np.arctan2(shank[0], -shank[1]),
        "shank_axis": turn.T @ shank / np.linalg.norm(shank),
    }


def regressed(asis: np.ndarray, psis: np.ndarray) -> np.ndarray:
    """The right hip's centre by gaitval's regression from the right ASIS and PSIS, (3,) m each, in
    the pelvis of the model (x forward, y up, z right).
    """
    forward = (asis - psis) * [1, 1, 0]
    depth = float(np.linalg.norm(forward))
    x = forward / depth
    up = np.array([-x[1], x[0], 0.0])
    ahead, left, above = hip_joint_centre(2 * asis[2], depth)
    return asis * [1, 1, 0] + ahead * x + above * up + np.array([0.0, 0.0, -left])


def least_squares(rows: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """By the normal equations, which Chebyshev products of poses all over the range allow."""
    gram = rows.T @ rows
    gram[np.diag_indices(len(gram))] *= 1 + 1e-12
    return solve(gram, rows.T @ wanted, assume_a="pos")


def smooth_part(
    value: np.ndarray, down: np.ndarray, length: np.ndarray, slope: np.ndarray
) -> np.ndarray:
    """(poses,) whether the path does not jump: lengths within `JUMP` of a smooth function, which
    is fitted to most of them (reweighted least squares, Cauchy's weights), and slopes within
    `JUMP_OF_ARM` of its own. `value` and `down` are of `basis`.

    OpenSim's wrapping jumps by millimetres where a path slides off a surface: of psoas beyond 40
    degrees of hip extension, for example. Nothing of the body does, so these poses are left out.
    """
    weight = np.ones(len(value))
    for _ in range(20):
        found = least_squares(value * weight[:, None], length * weight)
        off = np.abs(value @ found - length)
        weight = 1 / np.sqrt(1 + (off / 0.5e-3) ** 2)
    steep = np.abs(down.transpose(0, 2, 1) @ found - slope).max(axis=1)
    return (off < JUMP) & (steep < JUMP_OF_ARM)


def samples(path: str, leg: Leg, poses: np.ndarray) -> tuple[Any, ...]:
    """What is measured on the model: lengths, slopes, pulls, parts of each bone, and joints."""
    length, slope = leg.lengths(poses), derivatives(leg, poses)
    print("lengths and slopes sampled", flush=True)
    virtual = {}
    for joint, label, turned in DISPLACED:
        for kind in ("force", "moment") if turned else ("force",):
            rows = [
                where_it_matters(
                    partial(displaced, leg, joint=joint, axis=axis, turned=kind == "moment"), poses
                )
                for axis in range(3)
            ]
            virtual[label, kind] = -np.stack(rows, axis=2)
        print(f"{label} displaced", flush=True)
    # Moments are about the knee's frame; shipped is about the middle of the epicondyles.
    frame = osim.PhysicalOffsetFrame.safeDownCast(
        leg.model.getJointSet().get("walker_knee_r").getParentFrame()
    )
    virtual["knee", "moment"] += np.cross(
        frame.get_translation().to_numpy() - KNEE_CENTRE, virtual["knee", "force"]
    )
    motion = knee_motion(leg) | bones(leg)
    by_bone = {}
    for bone in BONES:
        legs = [Leg(path) for _ in range(2)]
        for other, factor in zip(legs, (1 + SIZE, 1 - SIZE), strict=True):
            other.scaled({bone: factor})

        def grown(some: np.ndarray, only: Any = None, legs: list[Leg] = legs) -> np.ndarray:
            return (legs[0].lengths(some, only) - legs[1].lengths(some, only)) / (2 * SIZE)

        by_bone[bone] = where_it_matters(grown, poses)
    print(
        "bones scaled; whole lengths differ from the sum of their parts by at most "
        f"{np.abs(sum(by_bone.values()) - length).max() * 1e3:.2f} mm",
        flush=True,
    )
    return length, slope, virtual, by_bone, motion


def drawn_poses() -> np.ndarray:
    """Where the model is measured, as shares of `RANGES` (poses, 6) in [-1, 1]: `SAMPLES` to fit
    to, `TESTS` of the whole range to judge by, and `TESTS` of gait alone.
    """
    unit = 2 * qmc.Sobol(6, seed=1).random(4096)[: SAMPLES + 2 * TESTS] - 1
    # Also the ends of the range, where polynomials are worst.
    unit[:SAMPLES] = np.clip(1.04 * unit[:SAMPLES], -1, 1)
    low, high = ((GAIT[:, k] - MIDDLE) / HALF for k in (0, 1))
    unit[-TESTS:] = (low + high) / 2 + (high - low) / 2 * unit[-TESTS:]
    return np.asarray(unit)


def kept_samples(path: str, leg: Leg, poses: np.ndarray, file: Path | None) -> tuple[Any, ...]:
    """`samples`, from `file` if they are there already, else written to it."""
    if file is not None and file.exists():
        return tuple(pickle.loads(file.read_bytes()))
    sampled = samples(path, leg, poses)
    if file is not None:
        file.write_bytes(pickle.dumps(sampled))
    return sampled


class LengthFit(NamedTuple):
    """The length of one muscle as a polynomial.

    Attributes
    ----------
    spans : places in `COORDINATES` of those that move it.
    degree, powers : total degree, and the products (terms, coordinates).
    value : (poses, terms) of the products.
    whole : (terms,) coefficients, m.
    smooth, kept, judged, gait : (poses,) where the path does not jump; of these the poses fitted
        to, those of the whole range that are not, and those of gait.
    length_error, arm_error : (poses,) m and (poses, coordinates) m/rad.
    """

    spans: np.ndarray
    degree: int
    powers: np.ndarray
    value: np.ndarray
    whole: np.ndarray
    smooth: np.ndarray
    kept: np.ndarray
    judged: np.ndarray
    gait: np.ndarray
    length_error: np.ndarray
    arm_error: np.ndarray


def fitted_length(unit: np.ndarray, length: np.ndarray, slope: np.ndarray) -> LengthFit:
    """The lowest degree that reaches `GOAL_ARM`: `length` (poses,) m and `slope` (poses, 6) m/rad
    at the poses `unit`.
    """
    spans = np.flatnonzero(np.abs(slope).max(axis=0) > 1e-5)
    x, slope, highest = unit[:, spans], slope[:, spans], HIGHEST[len(spans)]
    coarse = basis(x, powers_of(spans, min(6, highest - 1)))
    smooth = smooth_part(coarse[0], coarse[1] / HALF[spans], length, slope)
    number = np.arange(len(unit))
    train, inside = number < SAMPLES, number >= SAMPLES + TESTS
    kept, judged, gait = train & smooth, ~train & ~inside & smooth, inside & smooth
    for degree in range(3, highest + 1):
        powers = powers_of(spans, degree)
        value, down = basis(x, powers)
        down /= HALF[spans]
        every = [(value / 0.2e-3, length / 0.2e-3)]
        every += [(down[..., i] / 1e-3, slope[:, i] / 1e-3) for i in range(len(spans))]
        whole = least_squares(
            np.concatenate([a[kept] for a, _ in every]),
            np.concatenate([b[kept] for _, b in every]),
        )
        arm_error = np.abs(down.transpose(0, 2, 1) @ whole - slope)
        if np.quantile(arm_error[judged], 0.95) < GOAL_ARM:
            break
    length_error = np.abs(value @ whole - length)
    return LengthFit(
        spans, degree, powers, value, whole, smooth, kept, judged, gait, length_error, arm_error
    )


def fitted_bones(
    fit: LengthFit, length: np.ndarray, by_bone: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """How much each bone adds to the length (terms,), of the bones that do; the largest part takes
    what the fits of the others leave. `by_bone` (poses,) m.
    """
    parts = {b: v for b, v in by_bone.items() if np.abs(v).max() > 1e-6}
    whole_of_parts = np.abs(sum(parts.values()) - length)
    usable = fit.kept & (whole_of_parts < JUMP)
    found = {b: least_squares(fit.value[usable], v[usable]) for b, v in parts.items()}
    largest = max(parts, key=lambda b: np.abs(parts[b]).mean())
    found[largest] = fit.whole - sum(c for b, c in found.items() if b != largest)
    return found


def fitted_joints(
    fit: LengthFit, virtual: dict[tuple[str, str], np.ndarray]
) -> dict[str, tuple[np.ndarray, float]]:
    """Pull on each joint's distal part (3, terms), of the joints that feel one, and the error that
    95 % of it keep. `virtual` (poses, 3) per newton of tension.
    """
    joints = {}
    low = fit.powers.sum(axis=1) <= max(5, fit.degree - 2)
    for (label, kind), v in virtual.items():
        if np.abs(v).max() < 1e-6:
            continue
        usable = fit.kept & (np.abs(v).max(axis=1) < 3.0)
        found = least_squares(fit.value[usable][:, low], v[usable])
        off = np.abs(fit.value[fit.judged][:, low] @ found - v[fit.judged])
        filled = np.zeros((3, len(fit.powers)), dtype=np.float32)
        filled[:, low] = found.T
        joints[f"{label}_{kind}"] = filled, float(np.quantile(off, 0.95))
    return joints


def described(
    name: str, muscle: Any, fit: LengthFit, bones_of: list[str], errors: dict[str, float]
) -> dict[str, Any]:
    """A muscle's row of the table that is shipped: what it is, and how right its path is."""
    muscle = osim.Millard2012EquilibriumMuscle.safeDownCast(muscle)
    passive = muscle.getFiberForceLengthCurve()
    of_gait = np.arange(len(fit.smooth)) >= SAMPLES + TESTS

    def mm(values: np.ndarray, share: float = 0.95) -> float:
        return round(float(np.quantile(values, share)) * 1e3, 3)

    return {
        "name": name,
        "coordinates": [COORDINATES[c] for c in fit.spans],
        "bones": bones_of,
        "joints": list(errors),
        "max_force_n": muscle.getMaxIsometricForce(),
        "optimal_fibre_m": muscle.getOptimalFiberLength(),
        "tendon_slack_m": muscle.getTendonSlackLength(),
        "pennation_rad": muscle.getPennationAngleAtOptimalFiberLength(),
        "passive_from": passive.get_strain_at_zero_force(),
        "passive_to": passive.get_strain_at_one_norm_force(),
        "degree": int(fit.degree),
        "jumps": round(1 - float(fit.smooth[~of_gait].mean()), 4),
        "jumps_gait": round(1 - float(fit.smooth[of_gait].mean()), 4),
        "length_error_95_mm": mm(fit.length_error[fit.judged]),
        "arm_error_95_mm": mm(fit.arm_error[fit.judged]),
        "arm_error_gait_95_mm": mm(fit.arm_error[fit.gait]),
        "arm_error_gait_worst_mm": mm(fit.arm_error[fit.gait], 1.0),
        "force_error_95": {k: round(v, 4) for k, v in errors.items()},
    }


def print_muscle(row: dict[str, Any], terms: int) -> None:
    """One line for a row of `described`."""
    print(
        f"{row['name']:10s} {len(row['coordinates'])} degree {row['degree']} ({terms} terms), "
        f"jumps in {row['jumps']:.2%}; mm: length {row['length_error_95_mm']}, arm "
        f"{row['arm_error_95_mm']}, in gait {row['arm_error_gait_95_mm']}, at most "
        f"{row['arm_error_gait_worst_mm']}; {row['force_error_95']}",
        flush=True,
    )


def print_all(fits: list[LengthFit]) -> None:
    """Errors over all muscles."""
    for label, errors in {
        "length": [fit.length_error[fit.judged] for fit in fits],
        "arms": [fit.arm_error[fit.judged].ravel() for fit in fits],
        "arms in gait": [fit.arm_error[fit.gait].ravel() for fit in fits],
    }.items():
        off = np.concatenate(errors) * 1e3
        message = ", ".join(f"{q:.0%} {np.quantile(off, q):.3f} mm" for q in (0.95, 0.99))
        print(f"all {label}: {message}")


def main() -> None:
    """Sample, fit and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model")
    parser.add_argument("out", type=Path)
    parser.add_argument("--samples", type=Path, help="file that keeps what was sampled")
    arguments = parser.parse_args()
    osim.Logger.setLevelString("off")

    unit, leg = drawn_poses(), Leg(arguments.model)
    length, slope, virtual, by_bone, motion = kept_samples(
        arguments.model, leg, MIDDLE + HALF * unit, arguments.samples
    )
    arrays, table, fits = dict(motion), [], []
    for m, muscle in enumerate(leg.muscles):
        name = muscle.getName()[:-2]
        fit = fitted_length(unit, length[:, m], slope[:, m])
        of_bones = fitted_bones(fit, length[:, m], {b: v[:, m] for b, v in by_bone.items()})
        joints = fitted_joints(fit, {k: v[:, m] for k, v in virtual.items()})
        for label, (pull, _) in joints.items():
            arrays[f"{name}/{label}"] = pull
        arrays[f"{name}/powers"] = fit.powers
        arrays[f"{name}/length"] = np.stack(list(of_bones.values())).astype(np.float32)
        errors = {label: error for label, (_, error) in joints.items()}
        table.append(described(name, muscle, fit, list(of_bones), errors))
        fits.append(fit)
        print_muscle(table[-1], len(fit.powers))
    print_all(fits)
    arrays["ranges"] = RANGES
    arrays["about"] = np.frombuffer(
        json.dumps({"coordinates": COORDINATES, "muscles": table}).encode(), dtype=np.uint8
    )
    np.savez_compressed(arguments.out, **arrays)
    print(f"{arguments.out}: {arguments.out.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
