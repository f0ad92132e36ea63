"""Body model of one person from a standing trial, stature, mass and sex.

Joint centres of the legs come from the markers (`joint_centres`), masses and inertias from
de Leva (1996), and what no marker shows (trunk, head, arms) from his mean lengths scaled to
the person. A person without markers is scaled by tape measure and stature (`tape`). The model
is mirror-symmetric: it takes the mean of the right and the left side.

In the neutral pose (all coordinates zero) the legs are straight and vertical, the soles lie flat in
the plane z = 0 of the feet, the arms hang with the palms to the thighs, and the pelvis is turned so
that the plane of the ASIS and PSIS is level, as the pelvis angles of clinical gait analysis have
it. In standing that plane tilts forward by `pelvic_tilt` and de Leva's trunk is straight above the
hips, so in the neutral pose the lumbar joint lies behind the hips.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd

from gaitval.errors import ScalingError
from gaitval.model.body import BodyModel
from gaitval.scaling.anthropometry import (
    DE_LEVA,
    SHOULDER_HALF_WIDTH,
    SHOULDER_HEIGHT,
    WINTER,
    mass_fractions,
    mean_length,
)
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.person import Individual, MeasuredPerson, Person
from gaitval.scaling.segments import Lengths, body_of
from gaitval.scaling.tape import measure_by_tape

PLAUSIBLE_FACTOR = (0.80, 1.25)
"""Measured / expected length. Lengths relative to stature have a coefficient of variation of 4-6 %,
so this is four standard deviations."""

PLAUSIBLE_ANKLE_FACTOR = (0.70, 1.60)
"""The same for the ankle height: Winter's is that of the lateral malleolus of cadavers. Outside
this range the floor is not at z = 0."""

LARGEST_ASYMMETRY = 0.025
"""Largest plausible difference between right and left, m."""
LARGEST_ARM_ASYMMETRY = 0.05
"""The same of upper arm and forearm. The markers of shoulder and elbow sit on clothes and, without
a medial one, on one side of the joint; both arms get the mean, and no result depends on them much.
"""

PLAUSIBLE_TILT = (-15.0, 40.0)
"""Forward tilt of the plane of the ASIS and PSIS in standing, degrees; adults have
about 12 +- 6."""

PLAUSIBLE_HALF_WIDTH = {"hip": (0.035, 0.085), "shoulder": (0.065, 0.140)}
"""Half the distance between the hip joints, and between the shoulder joints, divided by stature.
For hips it is 0.047-0.070 in the built-in subjects; for shoulders 0.100 is expected."""


@dataclass(frozen=True)
class SegmentRow:
    """One line of the scaling table.

    Attributes
    ----------
    segment : what was measured or scaled.
    right_m, left_m : measured length of each side, m; None where no marker shows it.
    length_m : length in the model, m.
    mass_kg : mass of one such segment, kg; None for a length that carries none.
    factor : `length_m` / the population mean for this stature (see `source`).
    source : where the length, the population mean and the mass come from.
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


def scale_subject(subject: Person | MeasuredPerson) -> ScaledBody:
    """Scale the body model to a person.

    The lengths are the person's `measurements` if there are any, else those between the `markers`
    of the standing trial, else those by `tape` measure, with the lengths expected for the stature
    in place of those not measured.

    Parameters
    ----------
    subject : sex "F" or "M", mass in kg, stature in m, markers of a standing trial in m
        (x forward, y left, z up, floor at z = 0).

    Returns
    -------
    ScaledBody : the model, whose mass is exactly the subject's, and the scaling table.

    Raises
    ------
    ScalingError : the markers cannot be used (see `joint_centres.measure`), or give an implausible
        body; all implausible lengths are listed.
    """
    return build_body(subject, measurements_of(subject))


def measurements_of(subject: Person | MeasuredPerson) -> Measurements:
    """The lengths that `scale_subject` builds a person's body from.

    Raises
    ------
    ScalingError : the markers or lengths cannot be used.
    """
    stored = getattr(subject, "measurements", None)
    if stored:
        return Measurements.from_dict(stored)
    if subject.markers:
        return measure(subject.markers)
    by_tape: Mapping[str, float] = getattr(subject, "tape", {})
    return measure_by_tape(height_m=subject.height_m, **by_tape)


def build_body(subject: Individual, measured: Measurements) -> ScaledBody:
    """The body model of a person with these lengths.

    Parameters
    ----------
    subject : name, sex, mass and stature.
    measured : lengths from a standing trial, a fit or a tape measure.

    Raises
    ------
    ScalingError : the lengths give an implausible body; all implausible ones are listed.
    """
    lengths = _lengths(measured, subject)
    table = _table(measured, lengths, subject)
    _check(measured, table, subject)
    return ScaledBody(body_of(measured, lengths, subject), table)


def _lengths(measured: Measurements, subject: Individual) -> Lengths:
    right, left, sex = measured.right, measured.left, subject.sex
    trunk = _trunk_factor(measured, subject)
    proportions = DE_LEVA[sex]
    return Lengths(
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
    return (subject.height_m - measured.hip_height) / math.fsum(
        table[name].length for name in names
    )


def _table(measured: Measurements, lengths: Lengths, subject: Individual) -> tuple[SegmentRow, ...]:
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
                f"{row.segment}: {row.length_m:.3f} m is {row.factor:.2f} of the length expected "
                f"for a stature of {subject.height_m:.3f} m (plausible: {low:g} to {high:g})"
            )
        if row.right_m is not None and row.left_m is not None:
            difference = abs(row.right_m - row.left_m)
            arm = row.segment in ("upper arm", "forearm")
            most = LARGEST_ARM_ASYMMETRY if arm else LARGEST_ASYMMETRY
            if difference > most:
                problems.append(
                    f"{row.segment}: right {row.right_m:.3f} m and left {row.left_m:.3f} m "
                    f"differ by more than {most:g} m"
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
            f"the {_origin(measured)} of {subject.identifier} gives an implausible body:\n"
            "  "
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
