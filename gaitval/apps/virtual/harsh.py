"""A virtual person of a harsh world, which disagrees with what the identification assumes.

In the plain world (`person`) a record errs as the identification's noise model says, so its
intervals are right there by construction. Here soft tissue moves in phase with the joints, belt and
clock are off, axes are tilted, and the body differs in what nobody identifies: masses, sole, arms,
and legs that are not equal. Nothing here is taken from the fit, whose
priors are in `gaitval.identification`.

| fault | size | source |
|---|---|---|
| thigh's skin, share of the hip's excursion | -5 ± 4 % | [1], [2], [3] |
| thigh's, shank's skin, share of the knee's excursion | 0 ± 2, 0 ± 2.5 % | [2], [3], [4] |
| foot's skin, share of the ankle's excursion | 0 ± 5 % | [5] |
| or by joint: hip, knee, ankle | -5 ± 4, -3 ± 3, -3 ± 5 % | chosen |
| thigh's skin by the load on the foot | 0 ± 0.5° a body weight | chosen |
| skin later than bone | 0 to 2 % of the cycle | chosen |
| belt, clock | 1.25, 0.2 % | [6]; chosen |
| segments' axes in the sagittal plane | 1.4° each | joint offsets of 2°, as `noise` |
| knee's and ankle's axis | 5, 6° | chosen |
| stiffness, dissipation of the sole | factor e^0.4 | chosen, within published moduli |
| heel's and forefoot's contact | 8 mm | chosen |
| thigh's, shank's mass; trunk's centre | 10 %; 10, 20 mm | chosen |
| arms' swing | factor e^0.3 | chosen |
| left leg less right | 6.5 mm, or as asked | [7]: mean difference 5 mm |
| left hip's place alone | 3 mm | chosen |
| gain of a plate | 1 % | chosen |

1. Fiorentino et al. 2020, J Biomech 108:109890: markers underestimate the hip's range of flexion
   (dual fluoroscopy, eleven people walking).
2. Ancillao et al. 2021 (CAMS-Knee data, fluoroscopy): clusters turn by up to 10° on the thigh and
   by 7° on the shank, mainly in swing.
3. Bonci et al. 2014, J Biomech 47:2354: artefacts of the thigh are linear in hip and knee angle.
4. Benoit et al. 2006, Gait Posture 24:152: errors of the knee to 4.4° in walking (bone pins).
5. PMC8085108 (dual fluoroscopy, five people): ankle angles up to 7° too small.
6. Willwacher et al. 2021, Sci Rep 11: belts run at 98 to 103 % of the speed that was set.
7. Knutson 2005, Chiropr Osteopat 13:11.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from gaitval.apps.virtual.person import as_subject, drawn_parameters, seen, walked, with_errors
from gaitval.arrays import Array
from gaitval.configuration import Configuration, ContactSettings
from gaitval.coordinates import ARM, COORDINATES, SIDES
from gaitval.datasets.subject import Subject
from gaitval.gait.cycle_curves import FORCES, Curves
from gaitval.identification.prior import prior_sd
from gaitval.model.body import BodyModel, Segment
from gaitval.model.extended import extended_body
from gaitval.policy.storage import Policy
from gaitval.reference.motion import ReferenceMotion, moved

_SHARED: Final = 0.8
"""Correlation of the faults of right and left skin."""
_OWN_OFFSET: Final = 0.009
"""rad, SD of a joint's own offset, 0.5°, beside those of the segments' axes."""
_WORLD: Final = 2
"""Third number of the seed, so that a harsh person's draws are not a plain one's."""


@dataclass(frozen=True, kw_only=True)
class Faults:
    """What is wrong in one harsh record; right, left where there are two.

    Attributes
    ----------
    skin : how soft tissue shows in the angles: by segment, or by joint.
    thigh_by_hip, thigh_by_knee, shank_by_knee, foot_by_ankle : shares of a joint's excursion by
        which skin turns further than its bone.
    hip, knee, ankle : shares of a joint's own excursion that are seen too much, if by joint.
    thigh_by_load, shank_by_load : rad a body weight.
    wobble : rad, of the thigh's skin at heel strike; it decays.
    late : by which skin follows its bone, share of the cycle.
    belt, clock : shares by which speed and stride time are reported too large.
    pelvis : rad, too far forward, of the pelvis' axes.
    axes : (2, 3) rad, of thigh's, shank's and foot's axes in the sagittal plane.
    knee_axis, ankle_axis : rad, by which the axis is turned in the horizontal plane.
    sole : (4,) logarithms of stiffness and dissipation, m of heel and forefoot.
    thigh_mass, shank_mass : factors. trunk : (2,) m, forward, up.
    arms : factor on their swing.
    left_leg : m, by which the left leg is longer than the right one.
    longer : the segment that it is longer in; None if thigh and shank are in proportion.
    left_hip : (2,) m, forward and up, of the left hip alone.
    plate_gain : factors on the forces.
    """

    skin: Literal["segments", "joints"] = "segments"
    thigh_by_hip: tuple[float, float]
    thigh_by_knee: tuple[float, float] = (0.0, 0.0)
    shank_by_knee: tuple[float, float]
    foot_by_ankle: tuple[float, float]
    hip: tuple[float, float] = (0.0, 0.0)
    knee: tuple[float, float] = (0.0, 0.0)
    ankle: tuple[float, float] = (0.0, 0.0)
    thigh_by_load: tuple[float, float] = (0.0, 0.0)
    shank_by_load: tuple[float, float] = (0.0, 0.0)
    wobble: tuple[float, float] = (0.0, 0.0)
    late: float = 0.0
    belt: float
    clock: float = 0.0
    pelvis: float
    axes: tuple[tuple[float, ...], tuple[float, ...]]
    knee_axis: tuple[float, float] = (0.0, 0.0)
    ankle_axis: tuple[float, float] = (0.0, 0.0)
    sole: tuple[float, ...]
    thigh_mass: float
    shank_mass: float = 1.0
    trunk: tuple[float, float]
    arms: float
    left_leg: float
    longer: Literal["thigh", "shank"] | None = None
    left_hip: tuple[float, float] = (0.0, 0.0)
    plate_gain: tuple[float, float] = (1.0, 1.0)

    def body(self, model: BodyModel, contact: ContactSettings) -> tuple[BodyModel, ContactSettings]:
        """The body that walks, and the ground under it; see `person.Another`."""
        # Left thigh and shank grow by what right ones shrink.
        left = 0.0 if self.longer else 0.5 * self.left_leg / model.leg_length
        model, contact = extended_body(model, contact, np.array([*self.sole, left]))
        return _heavier(model, self), contact

    def motion(self, reference: ReferenceMotion, model: BodyModel) -> ReferenceMotion:
        """The motion with arms that swing otherwise."""
        return with_arms_swung(reference, model, self.arms)


def with_arms_swung(reference: ReferenceMotion, model: BodyModel, factor: float) -> ReferenceMotion:
    """The motion of the body `model`, with arms that swing `factor` times as far."""
    positions, velocities = reference.positions.copy(), reference.velocities.copy()
    for name in (f"{joint}_{side}" for joint in ARM for side in "rl"):
        column = COORDINATES.index(name)
        mean = positions[:, column].mean()
        positions[:, column] = mean + factor * (positions[:, column] - mean)
        velocities[:, column] *= factor
    return moved(reference, model, positions, velocities)


@dataclass(frozen=True)
class HarshPerson:
    """A virtual person of the harsh world.

    Attributes
    ----------
    subject : what a laboratory would know of them.
    truth : (14,) mu of the body that walked, relative to the subject's scaling.
    faults : what else is wrong.
    """

    subject: Subject
    truth: Array
    faults: Faults

    def about(self) -> dict[str, Any]:
        """The faults by name, for a file."""
        return asdict(self.faults)


def drawn_faults(random: np.random.Generator, left_leg: float | None = None) -> Faults:
    """Faults of one record, drawn with the generator `random`. The left leg is longer by `left_leg`
    m; drawn if left out.
    """

    def one(sd: float, mean: float = 0.0) -> float:
        return float(mean + sd * np.clip(random.standard_normal(), -2.5, 2.5))

    def pair(sd: float, mean: float = 0.0) -> tuple[float, float]:
        both, own = np.sqrt(_SHARED) * one(sd), np.sqrt(1.0 - _SHARED)
        return mean + both + own * one(sd), mean + both + own * one(sd)

    skin: Literal["segments", "joints"] = "segments" if random.random() < 0.5 else "joints"
    degree = np.pi / 180.0
    found = Faults(
        skin=skin,
        thigh_by_hip=pair(0.04, -0.05),
        thigh_by_knee=pair(0.02),
        shank_by_knee=pair(0.025),
        foot_by_ankle=pair(0.05),
        hip=pair(0.04, -0.05),
        knee=pair(0.03, -0.03),
        ankle=pair(0.05, -0.03),
        thigh_by_load=pair(0.5 * degree),
        late=0.02 * float(random.random()),
        belt=one(0.0125),
        clock=one(0.002),
        pelvis=one(1.4 * degree),
        axes=(
            tuple(one(1.4 * degree) for _ in range(3)),
            tuple(one(1.4 * degree) for _ in range(3)),
        ),
        knee_axis=pair(5.0 * degree),
        ankle_axis=pair(6.0 * degree),
        sole=(one(0.4), one(0.4), one(0.008), one(0.008)),
        thigh_mass=one(0.1, 1.0),
        shank_mass=one(0.1, 1.0),
        trunk=(one(0.01), one(0.02)),
        arms=float(np.exp(one(0.3))),
        left_leg=one(0.0065),
        left_hip=(one(0.003), one(0.003)),
        plate_gain=(one(0.01, 1.0), one(0.01, 1.0)),
    )
    return found if left_leg is None else replace(found, left_leg=left_leg)


def _heavier(model: BodyModel, faults: Faults) -> BodyModel:
    """The body with another distribution of the same mass, its left hip elsewhere, and a segment
    of the left leg longer.
    """
    factors = {"thigh": faults.thigh_mass, "shank": faults.shank_mass}
    added = sum(
        (factors[each.kind] - 1.0) * each.mass for each in model.segments if each.kind in factors
    )

    def changed(segment: Segment) -> Segment:
        factor = factors.get(segment.kind, 1.0)
        centre, joint = segment.centre_of_mass, segment.joint_position
        if segment.name == "torso":
            # What the legs gain the trunk loses: the scales know the whole.
            factor = 1.0 - added / segment.mass
            centre = centre + np.array([faults.trunk[0], 0.0, faults.trunk[1]])
        if segment.name == "thigh_l":
            joint = joint + np.array([faults.left_hip[0], 0.0, faults.left_hip[1]])
        # A segment is as long as its lower joint is below its upper one.
        if faults.longer and segment.kind == {"thigh": "shank", "shank": "foot"}[faults.longer]:
            more = 0.5 * faults.left_leg * (-1.0 if segment.side == "left" else 1.0)
            joint = joint + np.array([0.0, 0.0, more])
        return replace(
            segment, joint_position=joint, mass=factor * segment.mass,
            centre_of_mass=centre, inertia=factor * segment.inertia,
        )  # fmt: skip

    return replace(model, segments=tuple(map(changed, model.segments)))


def _late(curve: Array, share: float) -> Array:
    """A curve (101,) of a whole cycle, later by a share of it."""
    phase = np.linspace(0.0, 1.0, len(curve))
    return np.interp(np.mod(phase - share, 1.0), phase, curve)


def _excursion(curve: Array, late: float) -> Array:
    followed = _late(curve, late)
    return np.asarray(followed - followed[:-1].mean())


def seen_through_skin(curves: Curves, faults: Faults) -> Curves:
    """True `curves` (101,) each, rad, Nm/kg and body weights, as markers on skin with tilted axes
    show them, and plates of another gain, by `faults`.
    """
    found = Curves(dict(curves.angles), dict(curves.moments), dict(curves.forces))
    phase = np.linspace(0.0, 1.0, 101)
    for i, side in enumerate(SIDES):
        s = side[0]
        true = {name: curves.angles[f"{name}_{s}"] for name in
                ("hip_flexion", "hip_rotation", "knee_angle", "ankle_angle",
                 "subtalar_angle")}  # fmt: skip
        hip, knee, ankle = (
            _excursion(true[name], faults.late)
            for name in ("hip_flexion", "knee_angle", "ankle_angle")
        )
        load = _excursion(curves.forces[f"vertical_{s}"], faults.late)
        # By how much each cluster is turned further forward than its bone, below its upper joint.
        thigh, shank, foot = (np.full_like(hip, each) for each in faults.axes[i])
        wrong = {"hip_flexion": 0.0 * hip, "knee_angle": 0.0 * hip, "ankle_angle": 0.0 * hip}
        wobble = np.exp(-phase / 0.06) * np.sin(2.0 * np.pi * phase / 0.09)
        thigh = thigh + faults.thigh_by_load[i] * load + faults.wobble[i] * wobble
        shank = shank + faults.shank_by_load[i] * load
        if faults.skin == "segments":
            thigh = thigh + faults.thigh_by_hip[i] * hip + faults.thigh_by_knee[i] * knee
            shank = shank - faults.shank_by_knee[i] * knee
            foot = foot + faults.foot_by_ankle[i] * ankle
        else:
            wrong = {
                "hip_flexion": faults.hip[i] * hip,
                "knee_angle": faults.knee[i] * knee,
                "ankle_angle": faults.ankle[i] * ankle,
            }
        # Flexion of the knee is the thigh's turn less the shank's, dorsiflexion the foot's less it.
        wrong["hip_flexion"] = wrong["hip_flexion"] + thigh + faults.pelvis
        wrong["knee_angle"] = wrong["knee_angle"] + thigh - shank
        wrong["ankle_angle"] = wrong["ankle_angle"] + foot - shank
        # Rotation is the last of the hip's angles, so a thigh whose axes are turned about its
        # length changes it alone; the knee then bends about an axis that is not its own.
        turn, tilt = faults.knee_axis[i], faults.ankle_axis[i]
        found.angles.update({
            f"hip_flexion_{s}": true["hip_flexion"] + wrong["hip_flexion"],
            f"hip_rotation_{s}": true["hip_rotation"] + turn,
            f"knee_angle_{s}": true["knee_angle"] * np.cos(turn) + wrong["knee_angle"],
            f"ankle_angle_{s}": true["ankle_angle"] * np.cos(tilt)
            + true["subtalar_angle"] * np.sin(tilt) + wrong["ankle_angle"],
            f"subtalar_angle_{s}": true["subtalar_angle"] * np.cos(tilt)
            - true["ankle_angle"] * np.sin(tilt),
            f"pelvis_tilt_{s}": curves.angles[f"pelvis_tilt_{s}"] + faults.pelvis,
        })  # fmt: skip
        for name in FORCES:
            found.forces[f"{name}_{s}"] = faults.plate_gain[i] * curves.forces[f"{name}_{s}"]
    return found


def harsh_person(
    number: int,
    seed: int,
    person: Subject,
    policy: Policy,
    configuration: Configuration,
    *,
    left_leg: float | None = None,
) -> HarshPerson:
    """The harsh virtual person of this `number` and `seed`, which are together the seed of all
    random numbers, drawn around the scaled body and record of `person`. `policy`,
    `reports/general`, walks it; `configuration` has settings of contact, simulation, cycles and
    noise. The left leg is longer than the right one by `left_leg` m; drawn if left out. Raises
    VirtualError if they fall.
    """
    random = np.random.default_rng([seed, number, _WORLD])
    truth = drawn_parameters(prior_sd(person), random)
    faults = drawn_faults(random, left_leg)
    return seen_with(
        faults, number, seed, truth, person, person, policy, configuration, random, world="H"
    )


def seen_with(
    faults: Faults,
    number: int,
    seed: int,
    truth: Array,
    person: Subject,
    walker: Subject,
    policy: Policy,
    configuration: Configuration,
    random: np.random.Generator,
    *,
    world: str,
) -> HarshPerson:
    """Who walks as `walker` with the body `truth` (14,) about `person`, and is recorded with
    `faults`; the subject's name begins with the letter of the `world`. Other parameters as for
    `harsh_person`, whose draws `random` goes on with; raises as it.
    """
    task, walk = walked(number, seed, walker, truth, policy, configuration, random, another=faults)
    curves, values = seen(walk, task, truth[0])
    # The segments' axes give most of the offsets here, and the rest errs as in the plain world.
    noise = configuration.noise.model_copy(update={"angle_offset": _OWN_OFFSET})
    noisy = with_errors(seen_through_skin(curves, faults), values["left_phase"], noise, random)
    values["walking_speed_m_s"] *= 1.0 + faults.belt
    values["stride_time_s"] *= 1.0 + faults.clock
    subject = as_subject(f"{world}{seed}_{number:03d}", person, noisy, values)
    return HarshPerson(subject, truth, faults)
