"""Body model of one person from a standing trial, stature, mass and sex.

Joint centres of the legs come from the markers (`joint_centres`), masses and inertias from
de Leva (1996), and what no marker shows (trunk, head, arms) from his mean lengths scaled to
the person. A person without markers is scaled by tape measure and stature (`tape`). The model
is mirror-symmetric: it takes the mean of the right and the left side.

In the neutral pose (all coordinates zero) the legs are straight and vertical, the soles lie
flat in the plane z = 0 of the feet, the arms hang with the palms to the thighs, and the
pelvis is turned so that the plane of the ASIS and PSIS is level, as the pelvis angles of
clinical gait analysis have it. In standing that plane tilts forward by `pelvic_tilt`, and
de Leva's trunk is straight above the hips; so the lumbar joint lies behind the hips here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Protocol

import numpy as np
import pandas as pd

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.errors import ScalingError
from gaitval.model.body import SEGMENTS, BodyModel, ContactSphere, Segment
from gaitval.scaling.anthropometry import (
    DE_LEVA,
    SHOULDER_HALF_WIDTH,
    SHOULDER_HEIGHT,
    TOES_MASS,
    WINTER,
    Sex,
    inertia_tensor,
    mass_fractions,
    mean_length,
    shifted_inertia,
)
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.tape import measure_by_tape

PLAUSIBLE_FACTOR = (0.80, 1.25)
"""Measured over expected length. Lengths relative to stature have a coefficient of variation
of 4-6 %, so this is four standard deviations."""

PLAUSIBLE_ANKLE_FACTOR = (0.70, 1.60)
"""The same for the ankle height: Winter's is that of the lateral malleolus of a cadaver;
outside, the floor is not at z = 0."""

LARGEST_ASYMMETRY = 0.025
"""Largest plausible difference between right and left, m."""

PLAUSIBLE_TILT = (-15.0, 40.0)
"""Forward tilt of the plane of the ASIS and PSIS in standing, degrees; adults have
about 12 +- 6."""

PLAUSIBLE_HALF_WIDTH = {"hip": (0.035, 0.085), "shoulder": (0.065, 0.140)}
"""Half the distance between the hip joints, and between the shoulder joints, over stature. The
built-in subjects' hips have 0.047-0.070; 0.100 is expected of shoulders."""

SPHERE_RADIUS = 0.020
"""Radius of the contact spheres, m; see `_spheres`."""

SPHERES = {
    "heel": ("foot", 0.0019, -0.0038),
    "midfoot_lateral": ("foot", 0.0662, 0.0264),
    "ball_medial": ("foot", 0.1484, -0.0287),
    "ball_lateral": ("foot", 0.1330, 0.0516),
    "toes_medial": ("toes", 0.1788 + 0.0600, 0.00108 - 0.0188),
    "toes_lateral": ("toes", 0.1788 + 0.0450, 0.00108 + 0.0619),
}
"""Segment, and forward and lateral position of each sphere under the published right foot, m,
from the origin of OpenSim's calcaneus (Falisse et al. 2022; the toes' joint of Rajagopal et
al. 2016 is at 0.1788, 0.00108)."""

PUBLISHED_WIDTH = 0.0951
"""Distance between markers on the first and fifth metatarsal heads of the published foot, m:
the lateral ball sphere lies 7.4 mm inside the model's fifth metatarsal marker, and the medial
one is taken to lie as far inside."""


class Individual(Protocol):
    """What scaling needs of a subject whose lengths are given."""

    @property
    def identifier(self) -> str:
        """Becomes the model's name."""

    @property
    def sex(self) -> Sex:
        """Chooses de Leva's table."""

    @property
    def mass_kg(self) -> float:
        """Body mass, kg."""

    @property
    def height_m(self) -> float:
        """Stature, m."""


class Person(Individual, Protocol):
    """What scaling needs of a subject; `gaitval.datasets.subject.Subject` has it."""

    @property
    def markers(self) -> Mapping[str, Sequence[float]]:
        """Standing trial, (3,) m each; see `joint_centres`. May be empty."""


class MeasuredPerson(Person, Protocol):
    """A person with lengths of other sources than markers."""

    @property
    def measurements(self) -> Mapping[str, object]:
        """As `Measurements.to_dict` stores them; empty where not known."""

    @property
    def tape(self) -> Mapping[str, float]:
        """Lengths by tape measure, m, as `tape.measure_by_tape` takes them; may be empty."""


@dataclass(frozen=True)
class SegmentRow:
    """One line of the scaling table.

    Attributes
    ----------
    segment : what was measured or scaled.
    right_m, left_m : measured length of each side, m; None where no marker shows it.
    length_m : length in the model, m.
    mass_kg : mass of one such segment, kg; None for a length that carries none.
    factor : `length_m` over the population's mean for this stature (see `source`).
    source : where the length, the population's mean and the mass come from.
    """

    segment: str
    right_m: float | None
    left_m: float | None
    length_m: float
    mass_kg: float | None
    factor: float
    source: str


@dataclass(frozen=True)
class ScaledBody:
    """The model of a person and the table of how it was scaled."""

    model: BodyModel
    table: tuple[SegmentRow, ...]

    def frame(self) -> pd.DataFrame:
        """The table with a row per segment and the fields of `SegmentRow` as columns."""
        return pd.DataFrame([asdict(row) for row in self.table])


@dataclass(frozen=True)
class _Lengths:
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


def scale_subject(subject: Person | MeasuredPerson) -> ScaledBody:
    """Scale the body model to a person.

    The lengths are the person's `measurements` where there are any, else those between the
    `markers` of the standing trial, else those by `tape` measure, with what the stature leads to
    expect for the ones not measured.

    Parameters
    ----------
    subject : sex "F" or "M", mass in kg, stature in m, markers of a standing trial in m
        (x forward, y left, z up, floor at z = 0).

    Returns
    -------
    ScaledBody : the model, whose mass is exactly the subject's, and the scaling table.

    Raises
    ------
    ScalingError : the markers cannot be used (see `joint_centres.measure`), or the body
        they give is not plausible; all implausible lengths are listed.
    """
    stored = getattr(subject, "measurements", None)
    if stored:
        return build_body(subject, Measurements.from_dict(stored))
    if subject.markers:
        return build_body(subject, measure(subject.markers))
    by_tape: Mapping[str, float] = getattr(subject, "tape", {})
    return build_body(subject, measure_by_tape(height_m=subject.height_m, **by_tape))


def build_body(subject: Individual, measured: Measurements) -> ScaledBody:
    """The body model of a person with these lengths.

    Parameters
    ----------
    subject : name, sex, mass and stature.
    measured : lengths from a standing trial, a fit or a tape measure.

    Raises
    ------
    ScalingError : the lengths give no plausible body; all implausible ones are listed.
    """
    lengths = _lengths(measured, subject)
    table = _table(measured, lengths, subject)
    _check(measured, table, subject)
    return ScaledBody(_build(measured, lengths, subject), table)


def _lengths(measured: Measurements, subject: Individual) -> _Lengths:
    right, left, sex = measured.right, measured.left, subject.sex
    trunk = _trunk_factor(measured, subject)
    proportions = DE_LEVA[sex]
    return _Lengths(
        thigh=(right.thigh + left.thigh) / 2,
        shank=(right.shank + left.shank) / 2,
        ankle_height=(right.ankle_height + left.ankle_height) / 2,
        heel=(right.heel + left.heel) / 2,
        metatarsals=(right.metatarsals + left.metatarsals) / 2,
        foot=(right.foot_length + left.foot_length) / 2,
        head=proportions["head"].length * trunk,
        upper_trunk=proportions["upper trunk"].length * trunk,
        middle_trunk=proportions["middle trunk"].length * trunk,
        lower_trunk=proportions["lower trunk"].length * trunk,
        shoulder_height=(
            SHOULDER_HEIGHT[sex] * trunk
            if measured.shoulder_height is None
            else measured.shoulder_height
        ),
        shoulder_half_width=(
            SHOULDER_HALF_WIDTH * subject.height_m
            if measured.shoulder_half_width is None
            else measured.shoulder_half_width
        ),
        upper_arm=_mean_of_sides(measured.upper_arm, "upper arm", subject),
        forearm=_mean_of_sides(measured.forearm, "forearm", subject),
        hand=mean_length(sex, "hand", subject.height_m),
    )


def _mean_of_sides(
    measured: tuple[float, float] | None, segment: str, subject: Individual
) -> float:
    if measured is None:
        return mean_length(subject.sex, segment, subject.height_m)
    return (measured[0] + measured[1]) / 2


def _trunk_factor(measured: Measurements, subject: Individual) -> float:
    """Factor on de Leva's trunk and head that fills the stature above the hip joints."""
    table = DE_LEVA[subject.sex]
    names = ("head", "upper trunk", "middle trunk", "lower trunk")
    return (subject.height_m - measured.hip_height) / sum(table[name].length for name in names)


def _table(
    measured: Measurements, lengths: _Lengths, subject: Individual
) -> tuple[SegmentRow, ...]:
    stature, sex = subject.height_m, subject.sex
    right, left = measured.right, measured.left
    fractions = mass_fractions(sex)

    def leg(name: str, right: float, left: float, length: float, markers: str) -> SegmentRow:
        source = measured.sources.get(name, markers)
        return SegmentRow(
            segment=name,
            right_m=right,
            left_m=left,
            length_m=length,
            mass_kg=fractions[name] * subject.mass_kg if name in fractions else None,
            factor=length / (WINTER[name] * stature),
            source=f"{source}; mean: Winter {WINTER[name]:g} of stature",
        )

    def upper(
        name: str, length: float, source: str, sides: tuple[float, float] | None = None
    ) -> SegmentRow:
        if sides is not None:
            source = measured.sources.get(name, "markers, shoulder after Rab")
        return SegmentRow(
            segment=name,
            right_m=None if sides is None else sides[0],
            left_m=None if sides is None else sides[1],
            length_m=length,
            mass_kg=fractions[name] * subject.mass_kg,
            factor=length / mean_length(sex, name, stature),
            source=f"{source}; mean: de Leva, scaled to stature",
        )

    filled = "de Leva, scaled to fill the stature above the hips"
    scaled = "de Leva, scaled to stature"
    return (
        leg("thigh", right.thigh, left.thigh, lengths.thigh, "markers, hip after Harrington"),
        leg("shank", right.shank, left.shank, lengths.shank, "markers"),
        leg("foot", right.foot_length, left.foot_length, lengths.foot, "markers, ball ratio"),
        leg("ankle height", right.ankle_height, left.ankle_height, lengths.ankle_height, "markers"),
        upper("lower trunk", lengths.lower_trunk, filled),
        upper("middle trunk", lengths.middle_trunk, filled),
        upper("upper trunk", lengths.upper_trunk, filled),
        upper("head", lengths.head, filled),
        upper("upper arm", lengths.upper_arm, scaled, measured.upper_arm),
        upper("forearm", lengths.forearm, scaled, measured.forearm),
        upper("hand", lengths.hand, scaled),
    )


def _check(measured: Measurements, table: Sequence[SegmentRow], subject: Individual) -> None:
    problems = []
    for row in table:
        low, high = PLAUSIBLE_ANKLE_FACTOR if row.segment == "ankle height" else PLAUSIBLE_FACTOR
        if not low <= row.factor <= high:
            problems.append(
                f"{row.segment}: {row.length_m:.3f} m is {row.factor:.2f} of what a stature of "
                f"{subject.height_m:.3f} m leads to expect (plausible: {low:g} to {high:g})"
            )
        if row.right_m is not None and row.left_m is not None:
            difference = abs(row.right_m - row.left_m)
            if difference > LARGEST_ASYMMETRY:
                problems.append(
                    f"{row.segment}: right {row.right_m:.3f} m and left {row.left_m:.3f} m "
                    f"differ by more than {LARGEST_ASYMMETRY:g} m"
                )
    for name, (low, high) in PLAUSIBLE_HALF_WIDTH.items():
        half = getattr(measured, f"{name}_half_width")
        if half is not None and not low <= half / subject.height_m <= high:
            problems.append(
                f"{name}s: {half:.3f} m from the midline (plausible for this stature: "
                f"{low * subject.height_m:.3f} to {high * subject.height_m:.3f})"
            )
    tilt = np.degrees(measured.pelvic_tilt)
    if not PLAUSIBLE_TILT[0] <= tilt <= PLAUSIBLE_TILT[1]:
        problems.append(
            f"pelvis: tilted forward by {tilt:.0f} degrees in standing (plausible: "
            f"{PLAUSIBLE_TILT[0]:g} to {PLAUSIBLE_TILT[1]:g})"
        )
    if problems:
        raise ScalingError(
            f"the {_origin(measured)} of {subject.identifier} gives no plausible body:\n  "
            + "\n  ".join(problems)
            + "\nCheck "
            + (
                "the names and units of the markers, that the floor is at z = 0, and the stature."
                if _origin(measured) == "standing trial"
                else "the measured lengths, their unit (metres), and the stature."
            )
        )


def _origin(measured: Measurements) -> str:
    """What to call the measurements in messages."""
    sources = measured.sources.values()
    return "standing trial" if all(s.startswith("markers") for s in sources) else "measured body"


def _build(measured: Measurements, lengths: _Lengths, subject: Individual) -> BodyModel:
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
        spheres=_spheres(lengths),
    )


def _mirrored(part: _Part) -> _Part:
    mirror = np.diag([1.0, -1.0, 1.0])
    return _Part(part.mass, mirror @ part.centre, mirror @ part.inertia @ mirror)


def _combined(parts: Sequence[_Part]) -> _Part:
    """Several pieces, all in the same axes, as one rigid body."""
    mass = sum(part.mass for part in parts)
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


def _forearm_and_hand(lengths: _Lengths, masses: Mapping[str, float], sex: Sex) -> _Part:
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


def _lumbar_joint(measured: Measurements, lengths: _Lengths) -> Array:
    """As fitted, or at the navel (OMPH), where de Leva parts lower and middle trunk."""
    joint = np.asarray(_standing_to_neutral(measured) @ [0.0, 0.0, lengths.lower_trunk])
    for axis, fitted in ((0, measured.lumbar_forward), (2, measured.lumbar_up)):
        if fitted is not None:
            joint[axis] = fitted
    return np.asarray(joint - _hips_moved(measured))


def _hips_moved(measured: Measurements) -> Array:
    """How far the hips, and with them the pelvis' origin, were moved in the pelvis, (3,) m."""
    return np.array([measured.hip_forward or 0.0, 0.0, measured.hip_up or 0.0])


def _pelvis(
    measured: Measurements, lengths: _Lengths, masses: Mapping[str, float], sex: Sex
) -> _Part:
    proportions, length = DE_LEVA[sex]["lower trunk"], lengths.lower_trunk
    mass = masses["lower trunk"]
    turn = _standing_to_neutral(measured)
    centre = np.array([0.0, 0.0, (1.0 - proportions.centre_of_mass) * length])
    inertia = turn @ inertia_tensor(proportions, mass, length) @ turn.T
    return _Part(mass, turn @ centre - _hips_moved(measured), inertia)


def _torso(lengths: _Lengths, masses: Mapping[str, float], sex: Sex) -> _Part:
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


def _toe_joint(lengths: _Lengths) -> Array:
    """Between the first and fifth metatarsal heads, at half the height of the skin there."""
    middle = lengths.metatarsals.mean(axis=0)
    return np.array([middle[0], middle[1], (middle[2] - lengths.ankle_height) / 2])


def _foot_and_toes(lengths: _Lengths, mass: float, sex: Sex) -> tuple[_Part, _Part]:
    """de Leva's foot, from the heel to the toe tip at half the ankle's height, less the toes,
    a solid ellipsoid from the toe joint to the tip; together they are de Leva's foot.
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


def _spheres(lengths: _Lengths) -> tuple[ContactSphere, ...]:
    """The published spheres under this foot: their outline from heel to toes is the foot's,
    and they are spread in proportion to the width across the metatarsal heads.

    The radius is smaller than the published 32 mm, with which the rounded heel of a foot that
    points 20° up comes down 5 mm, about 2 % of the cycle, later than the recorded force does.
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
