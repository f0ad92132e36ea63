"""What changed between two sessions of one person, curve by curve.

A curve changed where its gait cycles differ by one test of all curves of the person
(`metrics.cycle_changes`). Whether markers that are put on again would change it as much is another
question, answered by the bands of the two sessions, without what is the person's and so alike in
both (`session.measurement.bands.LASTING`). Where both sessions have the same standing trial, the
markers stayed where they were, and the test is all that is asked.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.stats import norm

from gaitval.apps.changes.results import ChangedRegion, Level
from gaitval.apps.changes.visits import UNITS, Visit, common
from gaitval.arrays import Array, runs
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ConfigurationError
from gaitval.gait.healthy_controls import load_controls
from gaitval.gait.mean_curves import TOLERANCES
from gaitval.metrics.curve_results import GaitProfile
from gaitval.metrics.curve_statistics import ALPHA
from gaitval.metrics.cycle_changes import FamilyTest, differing_curves, new_in_strides
from gaitval.metrics.gait_profile import gait_profile
from gaitval.metrics.norms import norms_at
from gaitval.reporting.grids import title
from gaitval.session.measurement.sources import NINETY

SAME_STATURE: Final = 0.03
"""m by which two statures of one adult may differ: shoes, time of day, who measured; convention."""
SAME_MASS: Final = 0.15
"""Share by which two masses of one person may differ between two sessions; convention."""
SAME_SPEED: Final = 0.05
"""Share by which speeds may differ without a word: 0.06 m/s, about what one person's free speed
changes from trial to trial; convention."""
LEAST: Final = {"angles": 0.5, "moments": 0.02, "forces": 0.5}
"""deg, Nm/kg and % of body weight below which a change is none, whatever the test says;
convention."""


@dataclass(frozen=True)
class CurveChange:
    """A curve, "angles/knee_angle_r", before and after.

    Attributes
    ----------
    half : (101,) of the band of 90 % of the difference; None without bands.
    limit : (101,) beyond it is more than re-measuring would do to any curve; None likewise.
    t, p : of the test; None where there were too few cycles.
    regions : where it changed, the largest change first.
    """

    name: str
    before: Array
    after: Array
    half: Array | None
    limit: Array | None
    t: Array | None
    p: float | None
    regions: tuple[ChangedRegion, ...]

    @property
    def difference(self) -> Array:
        """After less before."""
        return self.after - self.before

    @property
    def unit(self) -> str:
        """Of the values."""
        return UNITS[self.name.partition("/")[0]]


@dataclass(frozen=True)
class Change:
    """Two sessions of one person.

    Attributes
    ----------
    same_markers : whether both are of the same standing trial, or both walks of one body.
    test : of all curves; None where no curve has enough cycles in both.
    at_once : standard deviations within which re-measuring stays for all curves; None without
        bands.
    speed : what is said of the walking speeds; empty if they are alike.
    notes : what else to know before the rest is read.
    profiles : Gait Profile Scores, of the angles that both have; None without.
    """

    before: Visit
    after: Visit
    same_markers: bool
    curves: Mapping[str, CurveChange]
    test: FamilyTest | None
    at_once: float | None
    speed: str
    notes: tuple[str, ...]
    profiles: tuple[GaitProfile, GaitProfile] | None

    @property
    def judged(self) -> bool:
        """Whether anything could be called changed."""
        return self.test is not None or self.at_once is not None

    def findings(self) -> list[tuple[CurveChange, ChangedRegion]]:
        """All regions: first what is more than re-measuring would be, then the rest, by size."""
        ranks = {"changed": 0, None: 1, "perhaps": 2, "re-measuring": 3}
        every = [(curve, region) for curve in self.curves.values() for region in curve.regions]
        return sorted(every, key=lambda one: (ranks[one[1].level], -_size(*one)))


def _size(curve: CurveChange, region: ChangedRegion) -> float:
    scale = region.half if region.half else LEAST[curve.name.partition("/")[0]]
    return abs(region.difference) / scale


def change_between(before: Visit, after: Visit, *, same_person: bool = False) -> Change:
    """What changed from the session `before` to `after`.

    Raises ConfigurationError where they cannot be of one person (stature, mass, sex or name; with
    `same_person` all but sex is taken on trust), are of different conventions, or have no curve in
    common.
    """
    _check_person(before, after, trusted=same_person)
    _check_conventions(before, after)
    names = common(before, after)
    if not names:
        raise ConfigurationError(
            f"{before.words()} has {_had(before)}, {after.words()} has {_had(after)}: no curve of "
            "one side is in both, so nothing can be compared. Give two sessions in which the same "
            "leg was recorded whole."
        )
    simulated = before.source == after.source == "walk"
    same_markers = simulated or bool(before.static and before.static == after.static)
    test = differing_curves(
        {n: before.cycles[n] for n in names if n in before.cycles},
        {n: after.cycles[n] for n in names if n in after.cycles},
    )
    known = test if test.curves and test.threshold is not None else None
    at_once = None if same_markers else _at_once(before, after, names)
    by_speed = _by_speed(before, after)
    curves = {
        name: _curve(
            name, before, after, known, at_once, by_speed, same_markers=same_markers,
            correlation=test.correlation,
        )
        for name in names
    }  # fmt: skip
    return Change(
        before,
        after,
        same_markers,
        curves,
        known,
        at_once,
        _of_speed(before, after),
        tuple(_notes(before, after, known, same_markers=same_markers)),
        _profiles(curves),
    )


def _check_person(before: Visit, after: Visit, *, trusted: bool) -> None:
    pair = f"{before.words()} and {after.words()}"
    if before.sex != after.sex:
        raise ConfigurationError(
            f"{pair}: sex {before.sex} and {after.sex}, so they are of different people, and what "
            "differs is not a change. Give two sessions of one person, or correct --sex of an "
            "import."
        )
    if trusted:
        return
    override = "Give two sessions of one person; if they are, say so with --same-person."
    if before.person and after.person and before.person != after.person:
        raise ConfigurationError(
            f"{pair}: person {before.person} and {after.person}, so they are of different people, "
            f"and what differs is not a change. {override}"
        )
    apart = abs(before.height_m - after.height_m)
    if apart > SAME_STATURE:
        raise ConfigurationError(
            f"{pair}: stature {before.height_m:.3f} and {after.height_m:.3f} m, {100 * apart:.1f} "
            f"cm apart; one adult's differ by {100 * SAME_STATURE:.0f} cm at most, so they are "
            f"probably of different people, and what differs is not a change. {override}"
        )
    share = abs(after.mass_kg / before.mass_kg - 1.0)
    if share > SAME_MASS:
        raise ConfigurationError(
            f"{pair}: mass {before.mass_kg:.1f} and {after.mass_kg:.1f} kg, {100 * share:.0f} % "
            f"apart, more than {100 * SAME_MASS:.0f} %, so they are probably of different people, "
            f"and what differs is not a change. {override}"
        )


def _check_conventions(before: Visit, after: Visit) -> None:
    if before.processing is None or after.processing is None:
        return
    first, second = before.processing, after.processing
    other = {
        name: (first.get(name, "by landmarks"), second.get(name, "by landmarks"))
        for name in sorted({*first, *second})
        if first.get(name) != second.get(name)
    }
    if other:
        listed = "; ".join(f"{name}: {one} and {two}" for name, (one, two) in other.items())
        raise ConfigurationError(
            f"{before.words()} and {after.words()} are of different conventions ({listed}), which "
            "changes curves although nobody walks otherwise. Import one of them again with the "
            "settings of the other (--set, --joint-centres)."
        )


def _had(visit: Visit) -> str:
    sides = {name[-1] for name in visit.curves}
    word = " and ".join(side for side in SIDES if side[0] in sides)
    return f"{len(visit.curves)} curves of the {word} side" if word else "no curve"


def _of_speed(before: Visit, after: Visit) -> str:
    share = after.speed / before.speed - 1.0
    if not np.isfinite(share) or abs(share) <= SAME_SPEED:
        return ""
    return (
        f"Walking speed differs: {before.speed:.2f} m/s before, {after.speed:.2f} m/s after "
        f"({100 * share:+.0f} %). Speed changes every curve; “by speed alone” is what this "
        "difference does to healthy adults, where they walked at both."
    )


def _notes(
    before: Visit,
    after: Visit,
    test: FamilyTest | None,
    *,
    same_markers: bool,
) -> list[str]:
    found = []
    for side in SIDES:
        have = [any(n.endswith(f"_{side[0]}") for n in v.curves) for v in (before, after)]
        if have[0] != have[1]:
            found.append(
                f"The {side} side was recorded {'before' if have[0] else 'after'} only, so nothing "
                "is said of its change."
            )
    kinetics = [any(n.startswith("moments/") for n in v.curves) for v in (before, after)]
    if kinetics[0] != kinetics[1]:
        found.append(
            f"Moments are known {'before' if kinetics[0] else 'after'} only: nothing is said of "
            "their change."
        )
    if test is None:
        counts = _counts(before), _counts(after)
        found.append(
            f"Cycles are not tested: {counts[0]} before and {counts[1]} after. The test exchanges "
            "cycles between the sessions and needs four a side in each, five where strides hang "
            "together; a study's record has means alone, its import has the cycles."
        )
    if not same_markers and not (before.again and after.again):
        found.append(
            "A session has no bands, so what re-measuring would change is not known: only the test "
            "of the cycles says that something changed, markers that were put on again included."
        )
    if before.source != after.source:
        found.append(
            f"{before.words()} beside {after.words()}: where they were not worked out by the same "
            "program, hip centres and axes differ too, and with them every curve."
        )
    if before.marker_set and after.marker_set and before.marker_set != after.marker_set:
        found.append(
            f"Marker sets differ ({before.marker_set} before, {after.marker_set} after), which "
            "moves angles by more than the same markers put on again."
        )
    return found


def _counts(visit: Visit) -> str:
    return " and ".join(f"{count} {side}" for side, count in visit.counts().items())


def _at_once(before: Visit, after: Visit, names: Sequence[str]) -> float | None:
    """Standard deviations of the difference for all curves together."""
    if not (before.again and after.again):
        return None
    known = [each for each in (before.at_once, after.at_once) if each is not None]
    # Without it, as if each curve were off on its own, and alike all over the cycle (Bonferroni).
    several = float(norm.isf(ALPHA / (2.0 * len(names))))
    return max(known, default=several)


def _by_speed(before: Visit, after: Visit) -> Mapping[str, Array]:
    """What healthy adults' curves do between the two speeds, (101,) by the name without side."""
    if not (np.isfinite(before.speed) and np.isfinite(after.speed)):
        return {}
    then, now = (
        norms_at(visit.speed, before.leg_length_m, before.age_years) for visit in (before, after)
    )
    return {
        n: now[n].mean - then[n].mean
        for n in now
        # beyond the speeds of the norms nothing is known of it
        if n.partition("/")[0] in UNITS and not (then[n].beyond or now[n].beyond)
    }


def _curve(
    name: str,
    before: Visit,
    after: Visit,
    test: FamilyTest | None,
    at_once: float | None,
    by_speed: Mapping[str, Array],
    *,
    same_markers: bool,
    correlation: float,
) -> CurveChange:
    first, second = before.curves[name], after.curves[name]
    half = limit = None
    if same_markers:
        half = _of_cycles(before, after, name, correlation)
    elif name in before.again and name in after.again:
        half = np.hypot(before.again[name], after.again[name])
        limit = None if at_once is None else half * at_once / NINETY
    tested = None if test is None else test.curves.get(name)
    differs = np.zeros(len(first), dtype=bool)
    for each in () if tested is None else tested.regions:
        differs[each.first : each.last + 1] = True
    kind = name.partition("/")[0]
    difference = second - first
    enough = np.abs(difference) >= LEAST[kind]
    if kind == "forces":
        up = [v.curves.get(f"forces/vertical_{name[-1]}") for v in (before, after)]
        standing = [u > 100.0 * TOLERANCES.stance_threshold for u in up if u is not None]
        enough &= np.any(standing, axis=0) if standing else True
    chosen = differs if tested is not None else np.zeros_like(differs)
    if limit is not None and tested is None:
        assert half is not None
        chosen = np.abs(difference) > half
    regions = [
        _region(name, int(start), int(end) - 1, difference, half, limit, by_speed.get(name[:-2]),
                after, tested=tested is not None, same_markers=same_markers)
        for start, end in zip(*runs(chosen & enough), strict=True)
    ]  # fmt: skip
    return CurveChange(
        name,
        first,
        second,
        half,
        limit,
        None if tested is None else tested.t[:-1],
        None if tested is None else tested.p,
        tuple(sorted(regions, key=lambda one: -abs(one.difference))),
    )


def _of_cycles(before: Visit, after: Visit, name: str, correlation: float) -> Array | None:
    """Half of the band of 90 % of a difference of means, by the cycles alone, which have that
    `correlation` with the next one.
    """
    new = [
        new_in_strides(visit.cycles[name], correlation)
        for visit in (before, after)
        if name in visit.cycles
    ]
    errors = [each.var(axis=0, ddof=1) / len(each) for each in new if len(each) > 1]
    return None if len(errors) < 2 else np.asarray(NINETY * np.sqrt(sum(errors)))


def _region(
    name: str,
    first: int,
    last: int,
    difference: Array,
    half: Array | None,
    limit: Array | None,
    by_speed: Array | None,
    after: Visit,
    *,
    tested: bool,
    same_markers: bool,
) -> ChangedRegion:
    part = slice(first, last + 1)
    size = np.abs(difference[part])
    at = first + int(np.argmax(size if half is None else size / np.maximum(half[part], 1e-9)))
    level: Level | None = None
    if same_markers:
        level = "changed"
    elif limit is not None and half is not None:
        level = "re-measuring"
        if (size > half[part]).any():
            level = "perhaps"
        if (size > limit[part]).any():
            level = "changed"
    region = ChangedRegion(
        first=first,
        last=last,
        at=at,
        difference=float(difference[at]),
        half=None if half is None else float(half[at]),
        level=level,
        tested=tested,
        by_speed=None if by_speed is None else float(by_speed[at]),
        words="",
    )
    words = _sentence(name, region, after, same_markers=same_markers)
    return region.model_copy(update={"words": words})


def _profiles(curves: Mapping[str, CurveChange]) -> tuple[GaitProfile, GaitProfile] | None:
    angles = {n.partition("/")[2]: c for n, c in curves.items() if n.startswith("angles/")}
    try:
        first, second = (
            gait_profile({n: getattr(c, which) for n, c in angles.items()}, load_controls().curves)
            for which in ("before", "after")
        )
    except ValueError:  # no angle of both sides
        return None
    return first, second


_LEVELS: Final[Mapping[Level | None, str]] = {
    "changed": "more than re-measuring would",
    "perhaps": "perhaps: outside the band of 90 % of this curve, but in so many curves "
    "re-measuring may do that to one",
    "re-measuring": "no more than re-measuring would",
    None: "what re-measuring would do is not known",
}
_DIGITS: Final = {"deg": 1, "Nm/kg": 2, "% BW": 1}
_SIGNS: Final = {"deg": "°", "Nm/kg": " Nm/kg", "% BW": " % of body weight"}


def curve_words(name: str) -> str:
    """A curve in words: "left knee flexion"."""
    side: Side = "right" if name[-1] == "r" else "left"
    kind = name.partition("/")[0]
    word = title(name[:-2])
    word = word[0].lower() + word[1:]
    return f"{side} {word}{' moment' if kind == 'moments' else ''}"


CHANGED: Final = ("changed", None)
"""Levels of what is counted as a change; without bands the test of the cycles alone says so."""


def _sentence(name: str, region: ChangedRegion, after: Visit, *, same_markers: bool) -> str:
    """What changed there, in words."""
    unit = UNITS[name.partition("/")[0]]
    digits, sign = _DIGITS[unit], _SIGNS[unit]
    size = f"{region.difference:+.{digits}f}".replace("-", "−")
    spread = "" if region.half is None else f"{region.half:.{digits}f}"
    if spread and float(spread) > 0.0:
        size += f" ± {spread}"
    where = f"{region.first}–{region.last} % of the cycle"
    if region.last - region.first >= 100:
        where = "all over the cycle"
    said = _LEVELS[region.level]
    if same_markers and spread and float(spread) == 0.0:
        said = "the difference itself, since the strides of each hardly differ there"
    elif same_markers:
        said = "more than strides differ by chance, the markers being the same"
    words = curve_words(name)
    return (
        f"{words[0].upper()}{words[1:]}{_phase(name, region, after)} {size}{sign} ({where}), {said}"
    )


def headline(change: Change) -> str:
    """The answer in a sentence: how much changed, or that it was not judged."""
    if not change.judged:
        return f"Not judged: too few cycles{'' if change.same_markers else ', and no bands'}."
    count = sum(region.level in CHANGED for _, region in change.findings())
    if not count:
        chance = "strides differ by chance" if change.same_markers else "measuring again would"
        return f"No curve changed by more than {chance}."
    what = "of curves" if change.same_markers else "by more than measuring again would"
    return f"{count} change{'' if count == 1 else 's'} {what}."


def _phase(name: str, region: ChangedRegion, after: Visit) -> str:
    """In swing or in stance, where all of a region is in one; else nothing."""
    toe_off = after.parameters.get(f"stance_fraction_{name[-1]}")
    if toe_off is None or not np.isfinite(toe_off.mean):
        return ""
    percent = 100.0 * toe_off.mean
    if region.first >= percent:
        return " in swing"
    return " in stance" if region.last <= percent else ""
