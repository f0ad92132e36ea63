"""Segments of a body of given lengths: joints, masses, inertias and contact spheres.

Masses and inertias are after de Leva (1996); `scaling` describes the pose.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.model.body import SEGMENTS, BodyModel, ContactSphere, Segment
from gaitval.scaling.anthropometry import (
    DE_LEVA,
    SHOULDER_HALF_WIDTH,
    SHOULDER_HEIGHT,
    TOES_MASS,
    Proportions,
    body_proportions,
    inertia_tensor,
    shifted_inertia,
)
from gaitval.scaling.measurements import Limbs, Measurements

if TYPE_CHECKING:
    from gaitval.scaling.person import Individual

TRUNK: Final = ("lower trunk", "middle trunk", "upper trunk", "head")
"""De Leva's segments from the hips upwards."""

SPHERE_RADIUS = 0.020
"""Radius of the contact spheres, m; see `contact_spheres`."""

SPHERES: Final[Mapping[str, tuple[str, float | None, float]]] = {
    "heel": ("foot", 0.0019, -0.0038),
    "midfoot_lateral": ("foot", 0.0662, 0.0264),
    "ball_lateral": ("foot", None, 0.0516),
    "ball_medial": ("toes", None, -0.0287),
    "toes_medial": ("toes", 0.1788 + 0.0600, 0.00108 - 0.0188),
    "toes_lateral": ("toes", 0.1788 + 0.0450, 0.00108 + 0.0619),
}
"""Segment, and forward and lateral position, of each sphere under the published right foot, m, from
the origin of OpenSim's calcaneus (Falisse et al. 2022; the toe joint of Rajagopal et al. 2016 is at
0.1788, 0.00108). None: by the person's own metatarsal head, of `HEADS`. The published medial ball
is on the calcaneus: see `contact_spheres`."""

HEADS: Final[Mapping[str, int]] = {"ball_lateral": 1, "ball_medial": 0}
"""Sphere that lies under a metatarsal head -> row of `Limbs.metatarsals`."""

PUBLISHED_WIDTH = 0.0951
"""Distance between markers on the first and fifth metatarsal heads of the published foot, m: the
lateral ball sphere lies 7.4 mm inside the model's fifth metatarsal marker, and the medial one is
assumed to lie as far inside."""


@dataclass(frozen=True)
class ScaledSegment:
    """One line of the scaling table, from which the body is built.

    Attributes
    ----------
    segment : what was measured or scaled.
    right_m, left_m : measured length of each side, m; None where no marker shows it.
    length_m : length in the model, m.
    mass_kg : mass of one such segment, kg; None for a length that carries none.
    factor : `length_m` / the population mean for this stature (see `source`).
    source : where the length, the population mean and the mass come from.
    side : whose segment it is; None for both sides alike, and in the middle of the body.
    """

    segment: str
    right_m: float | None
    left_m: float | None
    length_m: float
    mass_kg: float | None
    factor: float
    source: str
    side: Side | None = None

    @property
    def name(self) -> str:
        """The segment and its side, for readers."""
        return self.segment if self.side is None else f"{self.side} {self.segment}"


@dataclass(frozen=True)
class _Sized:
    """Length m and mass kg of the segments of a table, by name, and the table; of one side."""

    length: Mapping[str, float]
    mass: Mapping[str, float]
    table: Mapping[str, Proportions]


@dataclass(frozen=True)
class _Part:
    """A rigid piece: mass, centre of mass (3,) m, inertia (3, 3) about it."""

    mass: float
    centre: Array
    inertia: Array


def body_of(
    measured: Measurements, table: Sequence[ScaledSegment], subject: "Individual"
) -> BodyModel:
    """The model of a body with the lengths and masses of `table`, which add up to exactly the mass
    of `subject`; joints and feet are as `measured`.
    """
    bodies: dict[str, tuple[Array, _Part]] = {}
    spheres: list[ContactSphere] = []
    for side, limbs in measured.modelled.items():
        rows = [row for row in table if row.side in (None, side)]
        sized = _Sized(
            {row.segment: row.length_m for row in rows},
            {row.segment: row.mass_kg for row in rows if row.mass_kg is not None},
            body_proportions(subject.sex, subject.age_years),
        )
        bodies["pelvis"] = np.zeros(3), _pelvis(measured, sized)
        bodies["torso"] = _lumbar_joint(measured, sized), _torso(sized)
        for name, (joint, part) in _right_side(measured, limbs, sized, subject).items():
            if side == "left":
                # Both sides are built as right ones; y is to the left.
                joint, part = np.array([1.0, -1.0, 1.0]) * joint, _mirrored(part)
            bodies[f"{name}_{side[0]}"] = joint, part
        spheres += contact_spheres(limbs, side)
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
        spheres=tuple(spheres),
    )


def _right_side(
    measured: Measurements, limbs: Limbs, sized: _Sized, subject: "Individual"
) -> dict[str, tuple[Array, _Part]]:
    """Joint (3,) m in the parent, and body, of a side's segments, as if it were the right side."""
    length = sized.length
    foot, toes = _foot_and_toes(limbs, sized)
    return {
        "thigh": (np.array([0.0, -measured.hip_half_width, 0.0]), _hanging("thigh", sized)),
        "shank": (np.array([0.0, 0.0, -length["thigh"]]), _hanging("shank", sized)),
        "foot": (np.array([0.0, 0.0, -length["shank"]]), foot),
        "toes": (_toe_joint(limbs), toes),
        "upper_arm": (_shoulder(measured, sized, subject), _hanging("upper arm", sized)),
        "forearm": (np.array([0.0, 0.0, -length["upper arm"]]), _forearm_and_hand(sized)),
    }


def _shoulder(measured: Measurements, sized: _Sized, subject: "Individual") -> Array:
    """Right shoulder in the trunk, (3,) m: as fitted or measured, else de Leva's height in
    proportion to the trunk and a mean width.
    """
    aside, up = measured.shoulder_half_width, measured.shoulder_up
    if aside is None:
        aside = SHOULDER_HALF_WIDTH * subject.height_m
    if up is None:
        above_hips = measured.shoulder_height
        if above_hips is None:
            above_hips = SHOULDER_HEIGHT[subject.sex] * trunk_factor(measured, subject)
        up = above_hips - sized.length["lower trunk"]
    return np.array([0.0, -aside, up])


def trunk_factor(measured: Measurements, subject: "Individual") -> float:
    """Factor on de Leva's trunk and head to fill the stature of `subject` above `measured` hips."""
    table = DE_LEVA[subject.sex]
    return (subject.height_m - measured.hip_height) / math.fsum(table[n].length for n in TRUNK)


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


def _hanging(name: str, sized: _Sized, top: float = 0.0, *, turned: bool = False) -> _Part:
    """A segment along -z from its upper end, at a height `top`; perhaps `turned` by a quarter."""
    proportions, mass, length = sized.table[name], sized.mass[name], sized.length[name]
    across = ("transverse", "sagittal") if turned else ("sagittal", "transverse")
    return _Part(
        mass,
        np.array([0.0, 0.0, top - proportions.centre_of_mass * length]),
        inertia_tensor(proportions, mass, length, (*across, "longitudinal")),
    )


def _forearm_and_hand(sized: _Sized) -> _Part:
    # The palm faces the thigh, a quarter turn from the anatomical position of the table.
    hand = _hanging("hand", sized, -sized.length["forearm"], turned=True)
    return _combined([_hanging("forearm", sized), hand])


def _standing_to_neutral(measured: Measurements) -> Array:
    """Rotation, (3, 3), that takes vectors fixed to the pelvis in standing to its axes."""
    c, s = np.cos(measured.pelvic_tilt), np.sin(measured.pelvic_tilt)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def _lumbar_joint(measured: Measurements, sized: _Sized) -> Array:
    """As fitted, or at the navel (OMPH), where de Leva divides lower from middle trunk."""
    joint = np.asarray(_standing_to_neutral(measured) @ [0.0, 0.0, sized.length["lower trunk"]])
    for axis, fitted in ((0, measured.lumbar_forward), (2, measured.lumbar_up)):
        if fitted is not None:
            joint[axis] = fitted
    return np.asarray(joint - _hips_moved(measured))


def _hips_moved(measured: Measurements) -> Array:
    """How far the fit moved the hips, and with them the pelvis' origin, in the pelvis, (3,) m."""
    return np.array([measured.hip_forward or 0.0, 0.0, measured.hip_up or 0.0])


def _pelvis(measured: Measurements, sized: _Sized) -> _Part:
    proportions = sized.table["lower trunk"]
    mass, length = sized.mass["lower trunk"], sized.length["lower trunk"]
    turn = _standing_to_neutral(measured)
    centre = np.array([0.0, 0.0, (1.0 - proportions.centre_of_mass) * length])
    inertia = turn @ inertia_tensor(proportions, mass, length) @ turn.T
    return _Part(mass, turn @ centre - _hips_moved(measured), inertia)


def _torso(sized: _Sized) -> _Part:
    """Middle and upper trunk and head, stacked upwards from the lumbar joint."""
    top, parts = 0.0, []
    for name in TRUNK[1:]:
        # The table counts from the upper end of a trunk segment; here they are stacked upwards.
        top += sized.length[name]
        parts.append(_hanging(name, sized, top))
    return _combined(parts)


def _toe_joint(limbs: Limbs) -> Array:
    """Between the first and fifth metatarsal heads, at half the height of the skin."""
    middle = limbs.metatarsals.mean(axis=0)
    return np.array([middle[0], middle[1], (middle[2] - limbs.ankle_height) / 2])


def _foot_and_toes(limbs: Limbs, sized: _Sized) -> tuple[_Part, _Part]:
    """Foot and toes, which together are de Leva's foot: his runs from the heel to the toe tip at
    half the ankle's height, and the toes are a solid ellipsoid from the toe joint to the tip.
    """
    proportions, toe_joint = sized.table["foot"], _toe_joint(limbs)
    mass, length = sized.mass["foot"], sized.length["foot"]
    share = proportions.centre_of_mass * length
    along = share / (toe_joint[0] - limbs.heel[0])
    centre = np.array(
        [
            limbs.heel[0] + share,
            limbs.heel[1] + along * (toe_joint[1] - limbs.heel[1]),
            -limbs.ankle_height / 2,
        ]
    )
    whole = inertia_tensor(proportions, mass, length, ("longitudinal", "transverse", "sagittal"))

    tip = limbs.heel[0] + length
    toes_length = tip - toe_joint[0]
    width = limbs.metatarsals[0, 1] - limbs.metatarsals[1, 1]
    height = 2 * (limbs.ankle_height + toe_joint[2])
    # Solid ellipsoid of half axes a, b, c: Ixx = m (b² + c²) / 5.
    squares = (np.array([toes_length, width, height]) / 2) ** 2
    toes_mass = TOES_MASS * mass
    toes = _Part(
        toes_mass,
        np.array([toes_length / 2, 0.0, 0.0]),
        np.diag(toes_mass / 5 * (squares.sum() - squares)),
    )

    # What remains of de Leva's foot, so that both together have its mass, centre and inertia.
    toes_centre = toe_joint + toes.centre
    foot_mass = mass - toes_mass
    foot_centre = (mass * centre - toes_mass * toes_centre) / foot_mass
    inertia = (
        whole
        - toes.inertia
        - shifted_inertia(toes_mass, toes_centre - centre)
        - shifted_inertia(foot_mass, foot_centre - centre)
    )
    return _Part(foot_mass, foot_centre, _possible(inertia)), toes


def _possible(inertia: Array) -> Array:
    """The nearest inertia (3, 3) that a rigid body can have, which no principal moment larger than
    the other two together is: what remains of a short, flat foot without its toes may have one.
    """
    moments, axes = np.linalg.eigh(inertia)
    if moments[0] > 0.0 and moments[0] + moments[1] >= moments[2]:
        return inertia
    moments = np.maximum(moments, 0.01 * moments[2])
    moments[2] = min(moments[2], 0.999 * (moments[0] + moments[1]))
    return np.asarray(axes * moments @ axes.T)


def contact_spheres(limbs: Limbs, side: Side) -> list[ContactSphere]:
    """The published spheres, fitted to the foot of a `side` with the lengths `limbs`: they reach
    from its heel to its toes, and are spread in proportion to the width across the metatarsal
    heads. Those of the ball lie as far forward as the person's first and fifth metatarsal heads,
    which carry it, but not ahead of the axis about which the toes turn. Ours is straight across,
    10 mm behind the first head; a sphere ahead of it would go down as the heel comes up, by 7 mm at
    40 degrees, and take the body's weight from the toes, though no head has a lever about their
    axis. The published spheres lie behind the oblique axis of Rajagopal's toes, by 10 mm on the
    outside and 52 on the inside, and behind ours, between the heads, by 28 in the mean of ten
    people: the toes of a walker carried then what the ball of a foot does, and braked.

    The first head's sphere goes with the toes: what it stands on are its sesamoids, which are fixed
    to the proximal phalanx and stay with it while the head moves over them (Sarrafian, as quoted in
    a handbook's chapter on the forefoot; Wheeless' Textbook, hallux valgus). On the foot it rolled
    about the toes' joint and slipped by 5 to 9 cm/s as the heel rose, while the toes stood. The
    fifth head's stays on the foot: it lies behind our axis, and would have a lever about it.

    The radius is smaller than the published 32 mm, with which the rounded heel of a foot that
    points 20° up would touch down 5 mm, about 2 % of the cycle, later than in the recorded force.
    """
    published = {name: at for name, (_, at, _) in SPHERES.items() if at is not None}
    first, last = min(published.values()), max(published.values())
    stretch = (limbs.foot_length - 2 * SPHERE_RADIUS) / (last - first)
    heel = limbs.heel[0] + SPHERE_RADIUS
    x = {name: heel + stretch * (at - first) for name, at in published.items()}
    joint = _toe_joint(limbs)
    x |= {name: min(limbs.metatarsals[row, 0], joint[0]) for name, row in HEADS.items()}
    lateral = np.array([place[2] for place in SPHERES.values()])
    width = limbs.metatarsals[0, 1] - limbs.metatarsals[1, 1]
    published_middle = (SPHERES["ball_medial"][2] + SPHERES["ball_lateral"][2]) / 2
    # SPHERES has positions to the side, y is to the left: minus for the right foot.
    y = limbs.metatarsals[:, 1].mean() - width / PUBLISHED_WIDTH * (lateral - published_middle)
    # From the ankle, the foot's origin: every sphere touches the sole's plane.
    z = SPHERE_RADIUS - limbs.ankle_height
    mirror = np.array([1.0, 1.0 if side == "right" else -1.0, 1.0])
    spheres = []
    for (name, (segment, _, _)), left_position in zip(SPHERES.items(), y, strict=True):
        place = np.array([x[name], left_position, z])
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
    return spheres
