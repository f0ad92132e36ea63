"""Segments of a body of given lengths: joints, masses, inertias and contact spheres.

Masses and inertias are after de Leva (1996); `scaling` describes the pose.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.model.body import SEGMENTS, BodyModel, ContactSphere, Segment
from gaitval.scaling.anthropometry import (
    DE_LEVA,
    TOES_MASS,
    Sex,
    inertia_tensor,
    mass_fractions,
    shifted_inertia,
)
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.person import Individual

SPHERE_RADIUS = 0.020
"""Radius of the contact spheres, m; see `contact_spheres`."""

SPHERES = {
    "heel": ("foot", 0.0019, -0.0038),
    "midfoot_lateral": ("foot", 0.0662, 0.0264),
    "ball_medial": ("foot", 0.1484, -0.0287),
    "ball_lateral": ("foot", 0.1330, 0.0516),
    "toes_medial": ("toes", 0.1788 + 0.0600, 0.00108 - 0.0188),
    "toes_lateral": ("toes", 0.1788 + 0.0450, 0.00108 + 0.0619),
}
"""Segment, and forward and lateral position, of each sphere under the published right foot, m, from
the origin of OpenSim's calcaneus (Falisse et al. 2022; the toe joint of Rajagopal et al. 2016 is at
0.1788, 0.00108)."""

PUBLISHED_WIDTH = 0.0951
"""Distance between markers on the first and fifth metatarsal heads of the published foot, m: the
lateral ball sphere lies 7.4 mm inside the model's fifth metatarsal marker, and the medial one is
assumed to lie as far inside."""


@dataclass(frozen=True)
class Lengths:
    """Lengths of the model, m; the foot's points as in `measurements.Leg`."""

    thigh: float
    shank: float
    ankle_height: float
    heel: Array
    metatarsals: Array
    foot: float
    head: float
    upper_trunk: float
    middle_trunk: float
    lower_trunk: float
    shoulder_height: float
    shoulder_half_width: float
    upper_arm: float
    forearm: float
    hand: float


@dataclass(frozen=True)
class _Part:
    """A rigid piece: mass, centre of mass (3,) m, inertia (3, 3) about it."""

    mass: float
    centre: Array
    inertia: Array


def body_of(measured: Measurements, lengths: Lengths, subject: Individual) -> BodyModel:
    """The model of a body with these lengths, whose mass is exactly the person's."""
    masses = {
        name: fraction * subject.mass_kg for name, fraction in mass_fractions(subject.sex).items()
    }
    bodies = {
        "pelvis": (np.zeros(3), _pelvis(measured, lengths, masses, subject.sex)),
        "torso": (_lumbar_joint(measured, lengths), _torso(lengths, masses, subject.sex)),
    }
    foot, toes = _foot_and_toes(lengths, masses["foot"], subject.sex)
    right = {
        "thigh": (
            np.array([0.0, -measured.hip_half_width, 0.0]),
            _hanging("thigh", masses, lengths.thigh, subject.sex),
        ),
        "shank": (
            np.array([0.0, 0.0, -lengths.thigh]),
            _hanging("shank", masses, lengths.shank, subject.sex),
        ),
        "foot": (np.array([0.0, 0.0, -lengths.shank]), foot),
        "toes": (_toe_joint(lengths), toes),
        "upper_arm": (
            np.array(
                [
                    0.0,
                    -lengths.shoulder_half_width,
                    (
                        lengths.shoulder_height - lengths.lower_trunk
                        if measured.shoulder_up is None
                        else measured.shoulder_up
                    ),
                ]
            ),
            _hanging("upper arm", masses, lengths.upper_arm, subject.sex),
        ),
        "forearm": (
            np.array([0.0, 0.0, -lengths.upper_arm]),
            _forearm_and_hand(lengths, masses, subject.sex),
        ),
    }
    mirror = np.array([1.0, -1.0, 1.0])
    for name, (joint, part) in right.items():
        bodies[f"{name}_r"] = joint, part
        bodies[f"{name}_l"] = mirror * joint, _mirrored(part)
    return BodyModel(
        name=subject.identifier,
        segments=tuple(
            Segment(
                name,
                bodies[name][0],
                part.mass,
                part.centre,
                # Exactly symmetric: a URDF stores one triangle.
                (part.inertia + part.inertia.T) / 2,
            )
            for name in SEGMENTS
            for part in [bodies[name][1]]
        ),
        spheres=contact_spheres(lengths),
    )


def _mirrored(part: _Part) -> _Part:
    mirror = np.diag([1.0, -1.0, 1.0])
    return _Part(part.mass, mirror @ part.centre, mirror @ part.inertia @ mirror)


def _combined(parts: Sequence[_Part]) -> _Part:
    """Several pieces, all in the same axes, as one rigid body."""
    # Python's own sum rounds otherwise from version 3.12 on.
    mass = math.fsum(part.mass for part in parts)
    centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    inertia = sum(
        (part.inertia + shifted_inertia(part.mass, part.centre - centre) for part in parts),
        np.zeros((3, 3)),
    )
    return _Part(mass, centre, inertia)


def _hanging(name: str, masses: Mapping[str, float], length: float, sex: Sex) -> _Part:
    """A segment that hangs along -z from its joint."""
    proportions = DE_LEVA[sex][name]
    return _Part(
        masses[name],
        np.array([0.0, 0.0, -proportions.centre_of_mass * length]),
        inertia_tensor(proportions, masses[name], length),
    )


def _forearm_and_hand(lengths: Lengths, masses: Mapping[str, float], sex: Sex) -> _Part:
    hand = DE_LEVA[sex]["hand"]
    # The palm faces the thigh, a quarter turn from the anatomical position of the table.
    hanging = _Part(
        masses["hand"],
        np.array([0.0, 0.0, -lengths.forearm - hand.centre_of_mass * lengths.hand]),
        inertia_tensor(
            hand, masses["hand"], lengths.hand, ("transverse", "sagittal", "longitudinal")
        ),
    )
    return _combined([_hanging("forearm", masses, lengths.forearm, sex), hanging])


def _standing_to_neutral(measured: Measurements) -> Array:
    """Rotation, (3, 3), that takes vectors fixed to the pelvis in standing to its axes."""
    c, s = np.cos(measured.pelvic_tilt), np.sin(measured.pelvic_tilt)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def _lumbar_joint(measured: Measurements, lengths: Lengths) -> Array:
    """As fitted, or at the navel (OMPH), where de Leva divides lower from middle trunk."""
    joint = np.asarray(_standing_to_neutral(measured) @ [0.0, 0.0, lengths.lower_trunk])
    for axis, fitted in ((0, measured.lumbar_forward), (2, measured.lumbar_up)):
        if fitted is not None:
            joint[axis] = fitted
    return np.asarray(joint - _hips_moved(measured))


def _hips_moved(measured: Measurements) -> Array:
    """How far the fit moved the hips, and with them the pelvis' origin, in the pelvis, (3,) m."""
    return np.array([measured.hip_forward or 0.0, 0.0, measured.hip_up or 0.0])


def _pelvis(
    measured: Measurements, lengths: Lengths, masses: Mapping[str, float], sex: Sex
) -> _Part:
    proportions, length = DE_LEVA[sex]["lower trunk"], lengths.lower_trunk
    mass = masses["lower trunk"]
    turn = _standing_to_neutral(measured)
    centre = np.array([0.0, 0.0, (1.0 - proportions.centre_of_mass) * length])
    inertia = turn @ inertia_tensor(proportions, mass, length) @ turn.T
    return _Part(mass, turn @ centre - _hips_moved(measured), inertia)


def _torso(lengths: Lengths, masses: Mapping[str, float], sex: Sex) -> _Part:
    """Middle and upper trunk and head, stacked upwards from the lumbar joint."""
    parts = []
    top = 0.0
    for name, length in (
        ("middle trunk", lengths.middle_trunk),
        ("upper trunk", lengths.upper_trunk),
        ("head", lengths.head),
    ):
        proportions = DE_LEVA[sex][name]
        top += length
        parts.append(
            _Part(
                masses[name],
                np.array([0.0, 0.0, top - proportions.centre_of_mass * length]),
                inertia_tensor(proportions, masses[name], length),
            )
        )
    return _combined(parts)


def _toe_joint(lengths: Lengths) -> Array:
    """Between the first and fifth metatarsal heads, at half the height of the skin."""
    middle = lengths.metatarsals.mean(axis=0)
    return np.array([middle[0], middle[1], (middle[2] - lengths.ankle_height) / 2])


def _foot_and_toes(lengths: Lengths, mass: float, sex: Sex) -> tuple[_Part, _Part]:
    """Foot and toes, which together are de Leva's foot: his runs from the heel to the toe tip at
    half the ankle's height, and the toes are a solid ellipsoid from the toe joint to the tip.
    """
    proportions, toe_joint = DE_LEVA[sex]["foot"], _toe_joint(lengths)
    share = proportions.centre_of_mass * lengths.foot
    along = share / (toe_joint[0] - lengths.heel[0])
    centre = np.array(
        [
            lengths.heel[0] + share,
            lengths.heel[1] + along * (toe_joint[1] - lengths.heel[1]),
            -lengths.ankle_height / 2,
        ]
    )
    whole = inertia_tensor(
        proportions, mass, lengths.foot, ("longitudinal", "transverse", "sagittal")
    )

    tip = lengths.heel[0] + lengths.foot
    toes_length = tip - toe_joint[0]
    width = lengths.metatarsals[0, 1] - lengths.metatarsals[1, 1]
    height = 2 * (lengths.ankle_height + toe_joint[2])
    squares = (np.array([toes_length, width, height]) / 2) ** 2
    toes_mass = TOES_MASS * mass
    toes = _Part(
        toes_mass,
        np.array([toes_length / 2, 0.0, 0.0]),
        np.diag(toes_mass / 5 * (squares.sum() - squares)),
    )

    toes_centre = toe_joint + toes.centre
    foot_mass = mass - toes_mass
    foot_centre = (mass * centre - toes_mass * toes_centre) / foot_mass
    inertia = (
        whole
        - toes.inertia
        - shifted_inertia(toes_mass, toes_centre - centre)
        - shifted_inertia(foot_mass, foot_centre - centre)
    )
    return _Part(foot_mass, foot_centre, inertia), toes


def contact_spheres(lengths: Lengths) -> tuple[ContactSphere, ...]:
    """The published spheres, fitted to this foot: they reach from its heel to its toes, and are
    spread in proportion to the width across the metatarsal heads.

    The radius is smaller than the published 32 mm, with which the rounded heel of a foot that
    points 20° up would touch down 5 mm, about 2 % of the cycle, later than in the recorded force.
    """
    forward = np.array([place[1] for place in SPHERES.values()])
    lateral = np.array([place[2] for place in SPHERES.values()])
    stretch = (lengths.foot - 2 * SPHERE_RADIUS) / (forward.max() - forward.min())
    x = lengths.heel[0] + SPHERE_RADIUS + stretch * (forward - forward.min())
    width = lengths.metatarsals[0, 1] - lengths.metatarsals[1, 1]
    published_middle = (SPHERES["ball_medial"][2] + SPHERES["ball_lateral"][2]) / 2
    y = lengths.metatarsals[:, 1].mean() - width / PUBLISHED_WIDTH * (lateral - published_middle)
    z = SPHERE_RADIUS - lengths.ankle_height
    joint = _toe_joint(lengths)
    spheres = []
    for side in SIDES:
        mirror = np.array([1.0, 1.0 if side == "right" else -1.0, 1.0])
        for (name, (segment, _, _)), forward_position, left_position in zip(
            SPHERES.items(), x, y, strict=True
        ):
            place = np.array([forward_position, left_position, z])
            if segment == "toes":
                place = place - joint
            spheres.append(
                ContactSphere(
                    name=f"contact_{name}_{side[0]}",
                    segment=f"{segment}_{side[0]}",
                    position=mirror * place,
                    radius=SPHERE_RADIUS,
                )
            )
    return tuple(spheres)
