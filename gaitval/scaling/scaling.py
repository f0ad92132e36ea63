"""Body model of one person from a standing trial, stature, mass and sex.

Joint centres of the legs come from the markers (`joint_centres`), masses and inertias from
de Leva (1996), and what no marker shows (trunk, head, arms) from his mean lengths scaled to
the person. A person without markers is scaled by tape measure and stature (`tape`). Both sides of
the model are the mean of the right and the left side (`scaling.symmetric`), or each is its own.

In the neutral pose (all coordinates zero) the legs are straight and vertical, the soles lie flat in
the plane z = 0 of the feet, the arms hang with the palms to the thighs, and the pelvis is turned so
that the plane of the ASIS and PSIS is level, as the pelvis angles of clinical gait analysis have
it. In standing that plane tilts forward by `pelvic_tilt` and de Leva's trunk is straight above the
hips, so in the neutral pose the lumbar joint lies behind the hips.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from pydantic import ValidationError

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval._internal.text.display import Displayed
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ScalingError
from gaitval.model.body import BodyModel
from gaitval.model.ground import Ground
from gaitval.scaling.anthropometry import (
    ADULT_YEARS,
    DE_LEVA,
    PAIRED,
    WINTER,
    mass_fractions,
    mean_length,
)
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.measurements import ADAPTER, HEADS, LENGTH_FIELDS, LIMB_FIELDS, Measurements
from gaitval.scaling.segments import TRUNK, ScaledSegment, body_of, trunk_factor

if TYPE_CHECKING:
    import pandas as pd

    from gaitval.scaling.person import Individual, Person

Masses = dict[tuple[str, Side], float]
"""kg, by segment and side."""

SCALED: Final = "de Leva, scaled to stature"
"""Source of lengths that were not measured."""


@dataclass(frozen=True)
class PlausibleBody:
    """Between which bounds measurements of a person are believed."""

    plausible_factor: tuple[float, float] = (0.80, 1.25)
    """Measured / expected length. Lengths relative to stature have a coefficient of variation of
    4-6 %, so this is four standard deviations."""
    child_factor: tuple[float, float] = (0.62, 1.40)
    """The same below `child_stature`: a child of two has legs of 0.42 of its stature, an adult of
    0.53."""
    alike: float = 1.25
    """Largest / smallest of the factors of a leg's segments that another stature explains."""
    child_stature: float = 1.4
    """m, of those whose age is not known; `ADULT_YEARS` of the others."""
    plausible_ankle_factor: tuple[float, float] = (0.70, 2.00)
    """The same for the ankle height: Winter's is that of the lateral malleolus of cadavers. Outside
    this range the floor is not at z = 0."""
    highest_bare_ankle: float = 1.60
    """Beyond this a person stands on thick soles, on the toes, or above the floor."""
    largest_asymmetry: float = 0.06
    """Largest plausible difference between right and left, m."""
    usual_asymmetry: float = 0.025
    """The same of people whose legs are alike, m."""
    largest_arm_asymmetry: float = 0.05
    """The same of upper arm and forearm. The markers of shoulder and elbow sit on clothes and,
    without a medial one, on one side of the joint; both arms get the mean, and no result depends on
    them much."""
    plausible_tilt: tuple[float, float] = (-15.0, 40.0)
    """Forward tilt of the plane of the ASIS and PSIS in standing, degrees; adults have about 12 +-
    6."""


PLAUSIBLE: Final = PlausibleBody()


PLAUSIBLE_HALF_WIDTH = {"hip": (0.035, 0.085), "shoulder": (0.065, 0.140)}
"""Half the distance between the hip joints, and between the shoulder joints, divided by stature.
For hips it is 0.047-0.070 in the built-in subjects; for shoulders 0.100 is expected."""


@dataclass(frozen=True, repr=False)
class ScaledBody(Displayed):
    """The model of a person (lengths in m, masses in kg) and the table of how it was scaled."""

    model: BodyModel
    table: tuple[ScaledSegment, ...]

    def write_table(self, path: Path) -> None:
        """Write the table as CSV: a row per segment, with the fields of `ScaledSegment`."""
        rows = [asdict(each) for each in self.table]
        write_text(path, csv_text([rows[0], *(each.values() for each in rows)]))

    def frame(self) -> "pd.DataFrame":
        """The table with a row per segment and the fields of `ScaledSegment` as columns."""
        import pandas as pd

        return pd.DataFrame([asdict(row) for row in self.table])

    def title(self) -> str:
        """Name and mass."""
        return f"Body model {self.model.name}, {self.model.mass:.1f} kg"

    def overview(self) -> "pd.DataFrame":
        """Length, mass and factor over the population's mean, of each segment."""
        rows = self.frame()[["length_m", "mass_kg", "factor"]]
        rows.insert(0, "segment", [row.name for row in self.table])
        return rows

    def to_frame(self) -> "pd.DataFrame":
        """Length in m and mass in kg of each segment."""
        from gaitval._internal.text.frames import value_frame

        masses = [(row.name, row.mass_kg) for row in self.table if row.mass_kg is not None]
        return value_frame(
            [
                *(("", f"{row.name} length", row.length_m, "m") for row in self.table),
                *(("", f"{name} mass", mass, "kg") for name, mass in masses),
            ]
        )


def scale_subject(subject: "Person", *, symmetric: bool = True) -> ScaledBody:
    """Scale the body model to a person.

    The lengths are the person's `measurements` if there are any, else those between the `markers`
    of the standing trial, else those by `tape` measure, with the lengths expected for the stature
    in place of those not measured.

    Parameters
    ----------
    subject : sex "F" or "M", mass in kg, stature in m, markers of a standing trial in m
        (x forward, y left, z up, floor at z = 0).
    symmetric : both sides are the mean of right and left; otherwise each side is its own, as it
        always is of a `subject` with a prosthesis, with masses that differ between the sides, or of
        whom one leg is longer in every length (`Measurements.legs_differ`).

    Returns
    -------
    ScaledBody : the model, whose mass is exactly the subject's, and the scaling table.

    Raises
    ------
    ScalingError : the markers cannot be used (see `joint_centres.measure`), or give an implausible
        body; all implausible lengths are listed.
    """
    measured = measurements_of(subject)
    # A marker's error makes lengths differ; a mass of one side is somebody's word.
    own = getattr(subject, "prosthesis", None) in SIDES
    own = own or measured.masses_differ or measured.legs_differ
    body = build_body(subject, replace(measured, symmetric=symmetric and not own))
    slope = getattr(subject, "slope_percent", None)
    if slope is None:
        return body
    return replace(body, model=replace(body.model, ground=Ground(slope)))


def measurements_of(subject: "Person") -> Measurements:
    """The lengths that `scale_subject` builds the body of `subject` from: those stored, else by
    markers, else by tape. Raises ScalingError if the markers or lengths cannot be used.
    """
    stored = getattr(subject, "measurements", None)
    if stored:
        return measurements_from(stored)
    if subject.markers:
        return measure(subject.markers)
    from gaitval.scaling.tape import measure_by_tape

    by_tape: Mapping[str, float] = getattr(subject, "tape", {})
    return measure_by_tape(height_m=subject.height_m, **by_tape)


def build_body(subject: "Individual", measured: Measurements) -> ScaledBody:
    """The body model of a person with name, sex, mass and stature of `subject` and the lengths
    `measured` in a standing trial, a fit or with a tape measure. Raises ScalingError, which lists
    all implausible lengths, if they give an implausible body.
    """
    table = _table(measured, subject)
    _check(measured, table, subject)
    return ScaledBody(body_of(measured, table, subject), table)


def _table(measured: Measurements, subject: "Individual") -> tuple[ScaledSegment, ...]:
    stature, sex = subject.height_m, subject.sex
    masses = _masses(measured, subject)
    modelled, trunk = measured.modelled, trunk_factor(measured, subject)

    def paired(name: str, markers: str, mean: float, mean_source: str) -> Iterator[ScaledSegment]:
        """A row for both sides if they are averaged, else one for each."""
        right, left = (limbs.length(name) for limbs in (measured.right, measured.left))
        source = SCALED if right is None else measured.sources.get(name, markers)
        known = measured.one_sided.get(LENGTH_FIELDS[name])
        if known is not None:
            source += f"; {known} side only, the other is taken as equal"
        for side in (None,) if measured.symmetric else SIDES:
            own = modelled[side or "right"].length(name)
            length = mean if own is None else own  # arms only
            yield ScaledSegment(
                segment=name,
                right_m=None if "left" in (side, known) else right,
                left_m=None if "right" in (side, known) else left,
                length_m=length,
                mass_kg=masses.get((name, side or "right")),
                factor=length / mean,
                source=f"{source}; mean: {mean_source}",
                side=side,
            )

    def leg(name: str, markers: str) -> Iterator[ScaledSegment]:
        share = WINTER[name]
        return paired(name, markers, share * stature, f"Winter {share:g} of stature")

    def arm(name: str, markers: str = "markers, shoulder after Rab") -> Iterator[ScaledSegment]:
        return paired(name, markers, mean_length(sex, name, stature), SCALED)

    def middle(name: str) -> ScaledSegment:
        length = DE_LEVA[sex][name].length * trunk
        return ScaledSegment(
            segment=name,
            right_m=None,
            left_m=None,
            length_m=length,
            mass_kg=masses[name, "right"],
            factor=length / mean_length(sex, name, stature),
            source=f"de Leva, scaled to fill the stature above the hips; mean: {SCALED}",
        )

    return (
        *leg("thigh", "markers, hip after Harrington"),
        *leg("shank", "markers"),
        *leg("foot", "markers, ball ratio"),
        *leg("ankle height", "markers"),
        *(middle(name) for name in TRUNK),
        *(row for name in ("upper arm", "forearm", "hand") for row in arm(name)),
    )


def _masses(measured: Measurements, subject: "Individual") -> dict[tuple[str, Side], float]:
    """Mass of each segment of de Leva's table on each side, kg; those of the trunk are "right".

    Where some are known, the others share the rest of the body's mass in his proportions.
    """
    fractions = mass_fractions(subject.sex, subject.age_years)
    known: dict[tuple[str, Side], float] = {}
    for side, limbs in measured.modelled.items():
        for name in PAIRED:
            mass = getattr(limbs, f"{name.replace(' ', '_')}_mass")
            if mass is not None:
                known[name, side] = mass
    if not known:
        return {
            (name, side): share * subject.mass_kg
            for name, share in fractions.items()
            for side in SIDES
        }
    return with_known(known, fractions, subject)


def _check(measured: Measurements, table: Sequence[ScaledSegment], subject: "Individual") -> None:
    problems = []
    age = subject.age_years
    child = subject.height_m < PLAUSIBLE.child_stature if age is None else age < ADULT_YEARS
    of_lengths = PLAUSIBLE.child_factor if child else PLAUSIBLE.plausible_factor
    for row in table:
        low, high = (
            PLAUSIBLE.plausible_ankle_factor if row.segment == "ankle height" else of_lengths
        )
        factor = row.factor
        if measured.legs_differ:
            # The stature may be that of either leg, and the other one may stand on a lift.
            both = (each.factor for each in table if each.segment == row.segment)
            factor = min(both, key=lambda each: abs(each - 1.0))
        if not low <= factor <= high:
            problems.append(
                f"{row.name}: {row.length_m:.3f} m is {row.factor:.2f} of the length expected "
                f"for a stature of {subject.height_m:.3f} m (plausible: {low:g} to {high:g})"
            )
        if row.right_m is not None and row.left_m is not None:
            difference = abs(row.right_m - row.left_m)
            arm = row.segment in ("upper arm", "forearm")
            most = PLAUSIBLE.largest_arm_asymmetry if arm else PLAUSIBLE.largest_asymmetry
            if difference > most:
                problems.append(
                    f"{row.segment}: right {row.right_m:.3f} m and left {row.left_m:.3f} m "
                    f"differ by more than {most:g} m"
                )
    if measured.legs_differ:
        right, left = measured.right, measured.left
        lift = right.ankle_height - left.ankle_height
        reach = lift + right.thigh - left.thigh + right.shank - left.shank
        if min(abs(lift), abs(reach)) > PLAUSIBLE.largest_asymmetry:
            problems.append(
                f"ankle height: right {right.ankle_height:.3f} m and left "
                f"{left.ankle_height:.3f} m do not make up for legs that differ"
            )
    for name, (low, high) in PLAUSIBLE_HALF_WIDTH.items():
        half = getattr(measured, f"{name}_half_width")
        if half is not None and not low <= half / subject.height_m <= high:
            problems.append(
                f"{name}s: {half:.3f} m from the midline (plausible for this stature: "
                f"{low * subject.height_m:.3f} to {high * subject.height_m:.3f})"
            )
    legs = {row.name: row.factor for row in table if row.segment in ("thigh", "shank", "foot")}
    least, most = min(legs.values()), max(legs.values())
    # All too short or too long alike: one number is wrong, and the trunk only fills the rest.
    if (
        problems
        and (most < of_lengths[0] or least > of_lengths[1])
        and most < PLAUSIBLE.alike * least
    ):
        problems = [
            f"thigh, shank and foot are {least:.2f} to {most:.2f} of the lengths expected for a "
            f"stature of {subject.height_m:.3f} m, as of a person of about "
            f"{subject.height_m * np.median(list(legs.values())):.2f} m: either the stature is "
            "wrong, or the unit of the markers"
        ]
    tilt = np.degrees(measured.pelvic_tilt)
    if not PLAUSIBLE.plausible_tilt[0] <= tilt <= PLAUSIBLE.plausible_tilt[1]:
        problems.append(
            f"pelvis: tilted forward by {tilt:.0f} degrees in standing (plausible: "
            f"{PLAUSIBLE.plausible_tilt[0]:g} to {PLAUSIBLE.plausible_tilt[1]:g})"
            + (
                ": its front markers are as high above the rear ones as the iliac crests are. If "
                "they are on the crests, say so in a marker set (landmarks R.Crest and L.Crest), "
                "and the spines are estimated; else look whether front and rear are exchanged"
                if tilt < PLAUSIBLE.plausible_tilt[0] and "markers" in _origin(measured)
                else ""
            )
        )
    if problems:
        raise ScalingError(
            f"the {_origin(measured)} of {subject.identifier} give an implausible body:\n  "
            + "\n  ".join(problems)
            + "\nCheck "
            + (
                "the names and units of the markers, the stature, and that the floor is at z = 0 "
                "(its height is floor in a session file) and level: where the cameras' vertical is "
                "tilted, feet are too high or too low beside its origin."
                if "markers" in _origin(measured)
                else "the measured lengths, their unit (metres), and the stature."
            )
        )


def _origin(measured: Measurements) -> str:
    """What to call the measurements in messages."""
    by_markers = all(each.startswith("markers") for each in measured.sources.values())
    return "markers of the standing pose" if by_markers else "measured lengths"


def with_known(known: Masses, fractions: Mapping[str, float], subject: "Individual") -> Masses:
    """The masses of all segments of `subject`: those `known`, and of the others their shares of the
    rest by their `fractions` of a body. Raises ScalingError if nothing is left for them.
    """
    others = {
        (name, side): share
        for name, share in fractions.items()
        for side in (SIDES if name in PAIRED else SIDES[:1])
        if (name, side) not in known
    }
    rest = (subject.mass_kg - math.fsum(known.values())) / math.fsum(others.values())
    if rest <= 0:
        raise ScalingError(
            f"the known masses of segments of {subject.identifier} add up to "
            f"{math.fsum(known.values()):.1f} kg, more than the body's {subject.mass_kg:.1f} kg. "
            "Give kilograms, and check the body mass."
        )
    return known | {key: share * rest for key, share in others.items()}


def measurements_from(stored: Mapping[str, object]) -> Measurements:
    """What `Measurements.to_dict` stored. A length of one side only is that of both. Raises
    ScalingError, which lists every key that is missing, unknown or not of the right shape.
    """
    nested, one_sided = _by_side(stored)
    try:
        return ADAPTER.validate_python(nested | {"one_sided": one_sided})
    except ValidationError as error:
        problems = dict.fromkeys(
            _problem(each["loc"], each["type"], stored) for each in error.errors()
        )
        raise ScalingError(
            "the measurements of the body cannot be used:\n  " + "\n  ".join(problems)
        ) from None


def _by_side(stored: Mapping[str, object]) -> tuple[dict[str, object], dict[str, Side]]:
    """The stored values with those of `Limbs` by side, and what is known of one side only."""
    known: dict[str, dict[str, object]] = {side: {} for side in SIDES}
    values: dict[str, object] = {}
    for key, value in stored.items():
        name, _, side = key.rpartition("_")
        if side in known and (name in LIMB_FIELDS or name in HEADS) and name != "metatarsals":
            known[side][name] = value
        else:
            values[key] = value
    one_sided: dict[str, Side] = {}
    for side, other in (SIDES, SIDES[::-1]):
        for name in known[side]:
            if name not in known[other]:
                one_sided["metatarsals" if name in HEADS else name] = side
    for side, other in (SIDES, SIDES[::-1]):
        limbs = known[other] | known[side]
        if any(name in limbs for name in HEADS):
            limbs["metatarsals"] = [limbs.pop(name, None) for name in HEADS]
        values[side] = limbs
    return values, one_sided


def _problem(place: tuple[int | str, ...], kind: str, stored: Mapping[str, object]) -> str:
    """A problem in the words of the file."""
    name = str(place[1] if len(place) > 1 and place[0] in SIDES else place[0])
    if kind in ("missing", "unexpected_keyword_argument"):
        return f"{name}: {'missing' if kind == 'missing' else 'unknown'}"
    if name == "sources":
        return "sources: must be a table of texts"
    sides = (place[0], *SIDES)  # the value may be the other side's
    keys = [name, *(f"{each}_{side}" for side in sides for each in (name, *HEADS))]
    key = next(each for each in keys if each in stored)
    what = "three numbers" if name in ("heel", "metatarsals") else "a number"
    return f"{key} = {stored[key]!r}: must be {what} in m (masses in kg, tilt in rad)"
