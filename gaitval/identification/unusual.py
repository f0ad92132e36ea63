"""What in a subject differs so much from other people, or between its own sides, that a mistake is
the likelier explanation.

Each finding is a remark, not a refusal: a person may walk like that. The limits are from the
built-in subjects, each compared with the nine others on all of its trials: none of them gets a
remark. Of their 260 required curves of angles and moments, with the sign of one turned at a time,
240 are found; missed are some of the pelvis's rotation and list, hip rotation and adduction, and
knee moments, which are small or differ in sign between people.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.gait.record import REQUIRED_ANGLES, REQUIRED_MOMENTS, GaitRecord
from gaitval.identification.plausible import implausible
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.plausible import unusual_build
from gaitval.subjects.subject import Subject


@dataclass(frozen=True)
class UnusualLimits:
    """What is unusual about a body or its moments."""

    turned: float = 1.4
    """How many times further a curve is from other people's mean and the other side than the same
    curve with its sign turned; the largest of the built-in subjects' is 1.32 (a knee moment)."""
    both_turned: float = 1.6
    """The same of both sides together, and other people's mean alone; theirs reach 1.5."""
    moments: tuple[float, float] = (0.5, 2.0)
    """Size of the moments over other people's, geometric mean of all; theirs are 0.78 to 1.21."""
    legs_apart: float = 0.01
    """m, of thigh and shank; people's legs differ by 5 mm, SD 4 mm (Knutson 2005, Chiropr Osteopat
    13:11)."""
    stance: int = 60
    """Percent of the cycle in which every foot is loaded; beyond, a force's curve is no
    measurement."""


UNUSUAL: Final = UnusualLimits()


_PHASES = np.arange(100) / 100.0


def remarks_before_scaling(
    subject: Subject, configuration: Configuration, record: GaitRecord
) -> list[str]:
    """`remarks_on_body` of a `subject`, and what of it is `implausible` with a `configuration` and
    the `record` that is known.
    """
    averaged = _averaged(subject, configuration.scaling.symmetric)
    return [*remarks_on_body(subject), *averaged, *implausible(subject, configuration, record)]


def _averaged(subject: Subject, symmetric: bool) -> Iterator[str]:
    """Legs of which both were measured, and that the body has the mean of."""
    if not subject.measurements:  # a marker's error makes lengths differ
        return
    table = scale_subject(subject, symmetric=symmetric).table
    parts = [(each.right_m, each.left_m) for each in table
             if each.segment in ("thigh", "shank") and each.side is None]  # fmt: skip
    longer = sum(right - left for right, left in parts if right is not None and left is not None)
    if abs(longer) >= UNUSUAL.legs_apart:
        yield (
            f"{subject.identifier}: measurements: the {'right' if longer > 0.0 else 'left'} leg is "
            f"{100.0 * abs(longer):.1f} cm longer, thigh and shank together. The body has the mean "
            "of both: --set scaling.symmetric=false gives each leg its own."
        )


def remarks_on_body(subject: Subject) -> list[str]:
    """A sentence for everything about the body of a `subject` that is probably wrong: what was
    seen, why, and what to check.
    """
    build = unusual_build(subject.mass_kg, subject.height_m, subject.age_years)
    return [f"{subject.identifier}: {each.message}." for each in build]


def remarks_on_gait(subject: Subject, others: Sequence[Subject]) -> list[str]:
    """A sentence for everything about the curves of a `subject` that is probably wrong; none
    without `others` to compare with, among whom the same person does not count.
    """
    people = [_curves(other) for other in others if not subject.is_person_of(other)]
    if not people:
        return []
    own = _curves(subject)
    found = [*_moments(own, people), *_signs(own, people)]
    return [f"{subject.identifier}: {each}" for each in found]


_SideCurves = dict[tuple[str, str], Array]
"""By group and name with its side; each side's forces are forward, towards the midline and up."""


def _curves(subject: Subject) -> _SideCurves:
    kinetic = subject.has_kinetics
    angles = subject.gait.angles_of_both()
    found = {("angles", n): angles[n](_PHASES) for n in REQUIRED_ANGLES}
    if not kinetic:
        return found
    record: GaitRecord = subject.record()
    found |= {("moments", n): record.moments[n](_PHASES) for n in REQUIRED_MOMENTS}
    for side in SIDES:
        medial = 1.0 if side == "right" else -1.0
        for axis, sign, curve in zip(
            ("forward", "left", "up"), (1.0, medial, 1.0), record.forces[side], strict=True
        ):
            found["forces", f"{axis}_{side[0]}"] = sign * curve(_PHASES)[: UNUSUAL.stance]
    return found


def _mean(people: Sequence[_SideCurves], group: str, name: str) -> Array | None:
    """Other people's mean of a curve without its side."""
    known = [
        each[group, f"{name}_{x}"]
        for each in people
        for x in "rl"
        if (group, f"{name}_{x}") in each
    ]
    return np.asarray(np.mean(known, axis=0)) if known else None


def _signs(own: _SideCurves, people: Sequence[_SideCurves]) -> Iterator[str]:
    for group, name in dict.fromkeys((group, name[:-2]) for group, name in own):
        mean = _mean(people, group, name)
        if mean is None:
            continue
        right, left = own[group, f"{name}_r"], own[group, f"{name}_l"]
        # Both sides first: a sign that is wrong on both would agree with the other side.
        both = _times(np.array([right, left]), [np.array([mean, mean])])
        if both > UNUSUAL.both_turned:
            yield (
                f"{_place(group, name, 'r')} and {_place(group, name, 'l')}: {both:.1f} times "
                f"nearer to other people's with the sign turned. {_check(group)}"
            )
            continue
        for x, here, there in (("r", right, left), ("l", left, right)):
            times = _times(here, [mean, there])
            if times > UNUSUAL.turned:
                yield (
                    f"{_place(group, name, x)}: {times:.1f} times nearer to other people's and to "
                    f"the other side's with its sign turned. {_check(group)}"
                )


def _place(group: str, name: str, x: str) -> str:
    if group != "forces":
        return f"gait.{group}.{name}_{x}"
    return f"gait.forces.{'right' if x == 'r' else 'left'}.{name}"


def _check(group: str) -> str:
    where = "axes x forward, y left, z up" if group == "forces" else "docs/how-to/own-subject.md"
    return f"Check its sign ({where}); if it is right, this person walks unlike the others."


def _times(curve: Array, known: Sequence[Array]) -> float:
    """How many times further from what is known a curve is than the same curve turned."""
    far, turned = (
        sum(float(np.sum((sign * curve - each) ** 2)) for each in known) for sign in (1, -1)
    )
    # Ratio of RMS distances; the floor is for a curve that, turned, equals the others exactly.
    return float(np.sqrt(far / max(turned, 1e-12)))


def _moments(own: _SideCurves, people: Sequence[_SideCurves]) -> Iterator[str]:
    """Moments in another unit, or over another mass, are too small or large all together."""
    ratios = []
    for group, name in own:
        known = [np.std(each[group, name]) for each in people if (group, name) in each]
        if group == "moments" and known and np.std(own[group, name]) > 0.0:
            # Logarithms, so that half and double weigh the same; SD over the cycle, because a mean
            # may be near zero.
            ratios.append(np.log(np.std(own[group, name]) / np.mean(known)))
    if not ratios:
        return
    size = float(np.exp(np.mean(ratios)))
    if not UNUSUAL.moments[0] <= size <= UNUSUAL.moments[1]:
        yield (
            f"gait.moments: {size:.2g} times the size of other people's, all of them together. "
            "They are Nm over body mass in kg; check the unit and the mass."
        )
