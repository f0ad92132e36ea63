"""What physics says of the forces of a walk: plates that are implausible or cannot be right.

A wrong sign, two exchanged axes or a dead channel of a force plate give wrong moments and no other
sign of it. The limits were measured on recordings whose forces agree with the motion: WBDS01 T01
(treadmill, 0.49 m/s), the walk of Rajagopal et al. 2016, two of Plug-in Gait's samples and eleven
children of biomechZoo (1.1 to 1.5 m/s). Each constant gives the values nearest to its limit there.

Axes: the project's (REP-103), the person walks along +x. Forces act on the person.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from shlex import quote
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.coordinates import SIDES, Side
from gaitval.errors import count_of
from gaitval.gait.events import EVENTS, foot_contacts
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.force_plates import (
    CERTAIN_LOAD_N,
    LONGEST_LEVER_M,
    RENUMBER,
    numbered_other_way,
    plate_axes,
)
from gaitval.mocap.recording import FootForces, Plate, Recording

LEAST_BRAKING: Final = 0.02
"""Fore-aft impulse of the last 40 % of a stance less that of its first 40 %, as a fraction of the
vertical impulse: at least 0.039 (0.49 m/s) and 0.085 (over ground). Turned round it is negative."""
SHARE_OF_FALL: Final = 0.25
"""Of what a force from the foot to the pelvis would brake by: who takes short steps, as a small
child does, brakes little and needs no more. Turned round it is negative."""
SHARE_OF_LEAN: Final = 0.08
"""Of the pelvis' lean over the foot: an outward push that is smaller is of neither sign."""
MOSTLY_SEEN: Final = 0.8
"""Share of a stance in which pelvis and centre of pressure must be known for its `fall`."""
EXCHANGED: Final = 0.03
"""The same difference of the sideways impulse: at most 0.013 in size."""
LEAST_INWARD: Final = 0.0
"""Inward impulse in the middle 70 % of a stance, as a fraction of the vertical: 0.009 to 0.064."""
CERTAINLY_OUTWARD: Final = 0.02
"""An outward push as large as this cannot be while the body is inward of the foot."""
LEAST_LEAN: Final = 0.015
"""... by this fraction of its height above the foot; 0.018 to 0.087."""
LARGEST_FREE_MOMENT_M: Final = 0.03
"""Free moment over vertical force, 95th percentile in loaded stance: at most 0.014 m, and 0.010 m
on plates that were zeroed by their maker. Beyond `LONGEST_LEVER_M` no foot can twist."""
TURNED_FREE_MOMENT_M: Final = -0.002
"""Mean free moment in the second half of stance over the vertical force, positive where it turns
the foot inwards (right foot: to the left): 0.001 to 0.011 m."""
LOADED: Final = 0.2
"""Fraction of a contact's peak above which its centre of pressure and free moment are used."""

DEAD_FORCE: Final = (0.01, 0.002)
"""Range of a horizontal force under load over the vertical force: below the first there is a
warning, below the second the plate cannot be right; at least 0.06 sideways and 0.2 along."""
DEAD_MOMENT_M: Final = (0.003, 0.0005)
"""Range of the vertical moment about the plate's middle over the vertical force, m: likewise; at
least 0.008. Of a foot in the very middle of a plate only the free moment is left."""
DEAD_POINT_M: Final = (0.005, 0.001)
"""Range of the centre of pressure along an axis of the plate, m: likewise; at least 0.011."""
CLIPPED_SECONDS: Final = 0.025
"""A force that stays at its largest value for longer is cut off there: a peak of walking of 3 Hz
is within a thousandth of its height for 5 ms, and stored in steps of 0.5 N for 13 ms."""
CLIPPED_SAMPLES: Final = 5
STUCK_SECONDS: Final = 0.025
"""A channel that stays the same for longer under load has not been read anew: in the recordings at
most one sample of 300 Hz repeats the one before."""
STUCK_STEPS: Final = 4.0
"""A channel that was stuck continues with a jump of more than this many of its smallest changes."""
STUCK_SHARE: Final = 1e-10
"""Of the weight (and of a metre): changes below this are the rounding of turned axes."""
CLIPPED_SHARE: Final = 1e-4
"""Samples this near, relatively, to the largest are equal to it."""


NOTHING_SHARE: Final = 0.1
"""Share of the samples in which a plate must be exactly 0 for a program to have set it so."""
LARGEST_CUT_N: Final = 35.0
"""N. Programs set forces below 10 to 20 N to zero; at 500 Hz a force rises by 10 N from sample to
sample."""
FEWEST_EDGES: Final = 2
"""Beginnings and ends of contacts that show it: over ground a plate has one of each."""

EXCHANGED_AXES: Final = "fore-aft and sideways force"
BRAKING: Final = "braking before propulsion"
INWARD: Final = "push towards the middle line"
HORIZONTAL: Final = frozenset({EXCHANGED_AXES, BRAKING, INWARD})
"""Checks of the horizontal forces of a plate."""
FREE_MOMENT: Final = "size of the free moment"
FREE_MOMENT_TURNED: Final = "direction of the free moment"
NOT_ALONG: Final = frozenset({INWARD, FREE_MOMENT, FREE_MOMENT_TURNED})
"""Checks of a plate that say nothing of its fore-aft force."""
OUTSIDE: Final = "centre of pressure under the foot"
CUT_OFF: Final = "forces cut off"
SATURATED: Final = "saturated channel"
"""The check of this warning, which says better what faults of the vertical force look like."""


@dataclass(frozen=True)
class Stance:
    """A foot's whole contact that one plate shows; samples from `begin` up to `end`."""

    side: Side
    plate: str
    begin: int
    end: int


def whole_stances(recording: Recording, forces: FootForces) -> tuple[Stance, ...]:
    """Stances that the plates of a `recording` show whole, by `forces` of `assign_forces` at the
    plates' rate: the right foot's, then the left's, each with the plate that carries most of it.
    """
    found = []
    least = EVENTS.dragged * forces.force[..., 2].max(initial=0.0)
    for column, side in enumerate(SIDES):
        loaded = forces.force[:, column, 2] > 0.0
        for begin, end in zip(*foot_contacts(loaded, rate=forces.rate), strict=True):
            if begin == 0 or end == len(loaded) or not forces.valid[begin:end, column].all():
                continue
            if forces.force[begin:end, column, 2].max() < least:
                continue
            # Sums of the vertical force are impulses but for the sample time, which they share.
            shares = [plate.force[begin:end, 2].sum() for plate in recording.plates]
            name = recording.plates[int(np.argmax(shares))].name
            found.append(Stance(side, name, int(begin), int(end)))
    return tuple(found)


@dataclass(frozen=True)
class StanceFigures:
    """Figures of one stance; impulses as fractions of the vertical one.

    Attributes
    ----------
    braking, sideways : of the last 40 % less of the first 40 %, forward and left.
    inward : in the middle 70 %, towards the other foot.
    fall : what `braking` would be of a force from the foot to the pelvis; NaN where it is not seen.
    lean : how far the pelvis is inward of the centre of pressure, over its height, likewise.
    twist : m, 95th percentile of the free moment over the vertical force.
    late_twist : m, mean free moment of the second half over the vertical force, positive inwards.
    """

    braking: float
    sideways: float
    inward: float
    fall: float
    lean: float
    twist: float
    late_twist: float


def stance_figures(stance: Stance, forces: FootForces, pelvis: Array) -> StanceFigures:
    """Measures of the force on a foot over one `stance` of `whole_stances`, in samples of `forces`
    (of `assign_forces`). `pelvis` (T, 3) m is a middle point of the pelvis at the times of the
    forces; NaN where not seen.
    """
    column, window = SIDES.index(stance.side), slice(stance.begin, stance.end)
    # y is to the left, so +y is towards the middle line for the right foot only.
    inward = 1.0 if stance.side == "right" else -1.0
    force = forces.force[window, column]
    samples, impulse = len(force), force[:, 2].sum()
    late, early = force[int(0.6 * samples) :, :2], force[: int(0.4 * samples), :2]
    # Ratios of impulses: the sample time cancels.
    difference = (late.sum(axis=0) - early.sum(axis=0)) / impulse
    middle = slice(int(0.15 * samples), int(0.85 * samples))
    whole = pelvis[window] - forces.centre_of_pressure[window, column]
    away = whole[middle]
    away = away[np.isfinite(away).all(axis=1)]
    # Where a force that points from the foot to the pelvis would have its impulses.
    towards = force[:, 2] * whole[:, 0] / whole[:, 2]
    ends = [
        towards[part][np.isfinite(towards[part])].sum()
        for part in (slice(int(0.6 * samples), None), slice(None, int(0.4 * samples)))
    ]
    seen = np.isfinite(towards).mean() > MOSTLY_SEEN
    twist = forces.free_moment[window, column, 2]
    heavy = force[:, 2] > LOADED * force[:, 2].max()
    half = samples // 2
    return StanceFigures(
        braking=float(difference[0]),
        sideways=float(difference[1]),
        inward=float(inward * force[middle, 1].sum() / impulse),
        fall=float((ends[0] - ends[1]) / impulse) if seen else np.nan,
        lean=float(inward * np.mean(away[:, 1] / away[:, 2])) if len(away) else np.nan,
        # A percentile, because one sample of noise would decide the largest value.
        twist=float(np.percentile(np.abs(twist[heavy]) / force[heavy, 2], 95.0)),
        late_twist=float(inward * twist[half:].sum() / force[half:, 2].sum()),
    )


def force_warnings(
    recording: Recording, forces: FootForces, pelvis: Array
) -> tuple[QualityFlag, ...]:
    """Warnings about the forces of a walk, plate by plate: those about single channels first, then
    those about whole stances. `recording` is cleaned and zeroed, in the project's axes, walking
    along +x; `forces` are of `assign_forces`; `pelvis` (T, 3) m is a middle point of the pelvis at
    their times.
    """
    # A sign or an axis is wrong for a plate, not for a foot: stances of both feet count together.
    by_plate: dict[str, list[tuple[Stance, StanceFigures]]] = {}
    for stance in whole_stances(recording, forces):
        figures = stance_figures(stance, forces, pelvis)
        by_plate.setdefault(stance.plate, []).append((stance, figures))
    found = [
        warning
        for plate in recording.plates
        for warning in channel_warnings(plate, recording.force_rate)
    ]
    for name, members in by_plate.items():
        sides = [side for side in SIDES if any(stance.side == side for stance, _ in members)]
        where = f"plate {name} ({' and '.join(sides)} foot, {count_of(len(members), 'stance')})"
        horizontal = [*_horizontal(name, where, [figures for _, figures in members])]
        # the free moment is what horizontal forces leave of the vertical moment
        found += horizontal or _free_moment(name, where, [figures for _, figures in members])
    return tuple(found)


def _horizontal(name: str, where: str, figures: Sequence[StanceFigures]) -> Iterator[QualityFlag]:
    """Braking before propulsion, and a push towards the middle line."""
    braking = float(np.mean([one.braking for one in figures]))
    sideways = float(np.mean([one.sideways for one in figures]))
    if abs(sideways) > max(EXCHANGED, 2.0 * abs(braking)):
        yield QualityFlag(
            EXCHANGED_AXES, where, abs(sideways), EXCHANGED, "1",
            "braking and propulsion are in the sideways force (its impulse changes by "
            f"{100 * abs(sideways):.1f} % of the vertical one from early to late stance, the "
            f"fore-aft one by {100 * braking:.1f} %): the plate's axes are exchanged. Check the "
            "order of its corners, or of the force's columns",
            certain=True, plate=name,
        )  # fmt: skip
        return
    fall = float(np.mean([one.fall for one in figures]))
    small = fall > 0.0 and braking >= SHARE_OF_FALL * fall  # False where the fall is not known
    if braking < LEAST_BRAKING and not small:
        turned = (
            f"the fore-aft force has the wrong sign or axis. {_fix(name, 'along')}"
            if braking < 0.0
            else "the fore-aft force is nearly missing, which is no wrong sign. Is the channel "
            "dead or its sensitivity too small, or does the person shuffle?"
        )
        yield QualityFlag(
            BRAKING, where, braking, LEAST_BRAKING, "1",
            "a walking foot is pushed back first and forward later, but here the fore-aft impulse "
            f"changes by {100 * braking:.1f} % of the vertical one from early to late stance (at "
            f"least {100 * LEAST_BRAKING:.0f} %): {turned}",
            certain=braking < -LEAST_BRAKING, plate=name,
        )  # fmt: skip
    inward = float(np.mean([one.inward for one in figures]))
    lean = float(np.mean([one.lean for one in figures]))  # NaN where no marker shows the pelvis
    if inward < LEAST_INWARD - SHARE_OF_LEAN * (lean if lean > 0.0 else 0.0):
        yield QualityFlag(
            INWARD, where, inward, LEAST_INWARD, "1",
            f"the foot is pushed outwards by {-100 * inward:.1f} % of the vertical impulse, but "
            "the body, which the force carries, is inwards of it: the sideways force has the "
            f"wrong sign or axis. {_fix(name, 'across')}",
            certain=inward < -CERTAINLY_OUTWARD and lean > LEAST_LEAN, plate=name,
        )  # fmt: skip


def _fix(name: str, where: str) -> str:
    """What to do about a force of the plate `name` with the wrong sign `where` it acts."""
    return (
        f"Check the plate's corners and calibration, or give --plate {quote(name)}= with the "
        f"axis of the file (x, y or z) {where} the walk, which reverses this force"
    )


def _free_moment(name: str, where: str, figures: Sequence[StanceFigures]) -> Iterator[QualityFlag]:
    twist = float(np.mean([one.twist for one in figures]))
    if twist > LARGEST_FREE_MOMENT_M:
        yield QualityFlag(
            FREE_MOMENT, where, twist, LARGEST_FREE_MOMENT_M, "m",
            f"the free moment is {100 * twist:.1f} cm times the vertical force (at most "
            f"{100 * LARGEST_FREE_MOMENT_M:.0f} cm in walking; friction under a foot allows "
            f"{100 * LONGEST_LEVER_M:.0f}): its unit or calibration, or the place of the plate's "
            "origin, is wrong",
            certain=twist > LONGEST_LEVER_M, plate=name,
        )  # fmt: skip
    late = float(np.mean([one.late_twist for one in figures]))
    has = "has" if len(figures) > 1 else "may have"  # one stance may be of an odd step
    if late < TURNED_FREE_MOMENT_M:
        yield QualityFlag(
            FREE_MOMENT_TURNED, where, late, TURNED_FREE_MOMENT_M, "m",
            f"in late stance the ground turns the foot outwards ({-1000 * late:.1f} mm times the "
            f"vertical force), which in walking is inwards: the free moment {has} the wrong sign",
            plate=name,
        )  # fmt: skip


def channel_warnings(plate: Plate, rate: float) -> Iterator[QualityFlag]:
    """Warnings about channels of a `plate`, in the project's axes with samples at `rate` Hz, that
    do not move with the load, or are cut off: dead, saturated and stuck ones; `certain` where no
    walking can look like that.
    """
    where = f"plate {plate.name}"
    yield from _cut_below(plate, where)
    loaded = plate.force[:, 2] > CERTAIN_LOAD_N / 2
    if np.count_nonzero(loaded) < CLIPPED_SAMPLES * 4:
        yield from _dead_vertical(plate, where)
        return
    # Stands for the body weight, which a single plate does not know; the peaks of stance are near
    # it.
    weight = float(np.percentile(plate.force[loaded, 2], 95.0))
    for what, size, (uncertain, impossible), unit in _ranges(plate, loaded, weight):
        if size < uncertain:
            yield QualityFlag(
                "dead channel", where, size, uncertain, unit,
                f"{what} hardly changes under load (range {size:.2g} {unit}, in walking above "
                f"{uncertain:g} {unit}): its channel is dead, or has no calibration",
                certain=size < impossible, plate=plate.name,
            )  # fmt: skip
    saturated = False
    for axis, name in enumerate(("fore-aft", "sideways", "vertical")):
        longest = _longest_at_extreme(plate.force[:, axis], loaded, 0.02 * weight) / rate
        if longest > max(CLIPPED_SECONDS, CLIPPED_SAMPLES / rate):
            saturated = True
            yield QualityFlag(
                SATURATED, where, longest, CLIPPED_SECONDS, "s",
                f"the {name} force stays at its largest value for {1000 * longest:.0f} ms: the "
                "amplifier or the converter is saturated there. Record with a larger range",
                plate=plate.name,
            )  # fmt: skip
    # A saturated channel repeats itself too; one warning is enough.
    if not saturated:
        yield from _stuck(plate, loaded, weight, rate)


def _cut_below(plate: Plate, where: str) -> Iterator[QualityFlag]:
    """A plate whose small forces a program set to zero."""
    size = np.abs(plate.force).max(axis=1)
    nothing = size == 0.0
    if nothing.mean() < NOTHING_SHARE or not (~nothing).any():
        return
    begins, ends = runs(~nothing)
    long = ends - begins > 1
    begins, ends = begins[long & (begins > 0)], ends[long & (ends < len(size))] - 1
    up = np.abs(plate.force[:, 2])
    edges = np.concatenate([up[begins], up[ends]])
    if len(edges) < FEWEST_EDGES:
        return
    # What was set to zero is below the smallest of them, and above what a straight line through the
    # first two says of the sample before: at a low rate a force rises much from one to the next.
    before = 2 * edges - np.concatenate([up[begins + 1], up[ends - 1]])
    least = float(edges.min())
    if least > LARGEST_CUT_N and np.median(before) > LARGEST_CUT_N / 2:
        yield QualityFlag(
            CUT_OFF, where, least, LARGEST_CUT_N, "N",
            f"its forces begin and end at {least:.0f} N or more, and are exactly 0 beside: a "
            "program set smaller ones to zero. Strikes come late and toe-offs early, and the rise "
            "of the force is missing: export the forces as they were recorded, or with a "
            f"threshold of at most {LARGEST_CUT_N:.0f} N",
            plate=plate.name,
        )  # fmt: skip


def _stuck(plate: Plate, loaded: Flags, weight: float, rate: float) -> Iterator[QualityFlag]:
    """The channel that repeats itself for longest, if that is too long."""
    axes, centre = _own_axes(plate)
    # A repeated sample is exactly equal only in the plate's own axes and about its own middle:
    # turned into other axes each component mixes several channels.
    channels = {
        f"{name} force": (plate.force @ axes)[:, axis]
        for axis, name in enumerate(("first horizontal", "second horizontal", "vertical"))
    }
    channels["free moment"] = plate.free_moment[:, 2]
    if plate.moment is not None:
        about = (plate.moment - np.cross(centre, plate.force)) @ axes
        channels |= {
            f"moment about the {name} axis": about[:, axis]
            for axis, name in enumerate(("first", "second", "vertical"))
        }
    else:  # the file has the point itself
        point = (plate.centre_of_pressure - centre) @ axes
        channels |= {"centre of pressure, sideways": point[:, 1], "centre of pressure": point[:, 0]}
    longest, stuck = 0.0, ""
    for name, values in channels.items():
        # A channel that hardly moves repeats itself without being stuck; `_ranges` judges it.
        if np.ptp(values[loaded]) > DEAD_FORCE[1] * DEAD_MOMENT_M[1] * weight:
            seconds = _longest_stuck(values, loaded, STUCK_SHARE * weight) / rate
            longest, stuck = max((longest, stuck), (seconds, name))
    if longest > max(STUCK_SECONDS, CLIPPED_SAMPLES / rate):
        yield QualityFlag(
            "stuck channel", f"plate {plate.name}", longest, STUCK_SECONDS, "s",
            f"its {stuck} stays exactly the same for {1000 * longest:.0f} ms while a foot is on "
            "it: samples were lost there and the last one repeated. Look at the raw channels",
            plate=plate.name,
        )  # fmt: skip


def _longest_stuck(values: Array, loaded: Flags, rounding: float) -> int:
    """Samples under load for which a channel repeats itself and then jumps.

    A channel that is stored in steps also repeats itself at a peak, but then changes by one step.
    """
    changes = np.abs(np.diff(values))
    # The smallest change above rounding is the step in which the file stores the channel.
    jump = STUCK_STEPS * float(changes[changes > rounding].min(initial=np.inf))
    longest = 0
    for begin, end in zip(*runs(loaded[1:] & (changes <= rounding)), strict=True):
        if end == len(changes) or changes[end] > jump:
            longest = max(longest, int(end - begin))
    return longest


def _dead_vertical(plate: Plate, where: str) -> Iterator[QualityFlag]:
    """A plate that somebody pushes along, but not down."""
    along = float(np.ptp(plate.force[:, :2], axis=0).max())
    down = float(np.abs(plate.force[:, 2]).max())
    if along > CERTAIN_LOAD_N / 4 and down < along / 2:
        yield QualityFlag(
            "dead channel", where, down, along / 2, "N",
            f"its vertical force is at most {down:.3g} N, but its horizontal force changes by "
            f"{along:.0f} N: the vertical channel is dead, or has no calibration",
            certain=True, plate=plate.name,
        )  # fmt: skip


def place_warnings(plate: Plate, outside: int, used: int) -> Iterator[QualityFlag]:
    """Warning about a centre of pressure that is not under the foot in most contacts with a
    `plate`: `outside` contacts were left out for that reason, `used` stances were not.
    """
    if outside > used:
        why = (
            f"the plate's corners are {RENUMBER}"
            if numbered_other_way(plate)
            else "the plate's corners, origin or moments are wrong, or somebody else was on it"
        )
        yield QualityFlag(
            OUTSIDE, f"plate {plate.name}", outside, used, "contacts",
            f"the centre of pressure is outside the foot in {outside} of {outside + used} "
            f"contacts, whose forces are not used: {why}", plate=plate.name,
        )  # fmt: skip


def _ranges(
    plate: Plate, loaded: Flags, weight: float
) -> Iterator[tuple[str, float, tuple[float, float], str]]:
    """What moves under every step: its name, its range, its limits and unit."""
    for axis, name in ((0, "fore-aft"), (1, "sideways")):
        size = float(np.ptp(plate.force[loaded, axis])) / weight
        yield f"the {name} force", size, DEAD_FORCE, "of the weight"
    axes, centre = _own_axes(plate)
    point = (plate.centre_of_pressure[loaded] - centre) @ axes
    for axis, name in ((0, "first"), (1, "second")):
        size = float(np.ptp(point[:, axis]))
        yield f"the centre of pressure along the {name} axis", size, DEAD_POINT_M, "m"
    if plate.moment is not None:
        about = plate.moment - np.cross(centre, plate.force)
        size = float(np.ptp((about @ axes)[loaded, 2])) / weight
        yield "the vertical moment", size, DEAD_MOMENT_M, "m of the weight"


def _own_axes(plate: Plate) -> tuple[Array, Array]:
    """Axes, as columns, and middle of a plate; those of the recording where they are unknown."""
    if np.isfinite(plate.corners).all():
        return plate_axes(plate.corners), plate.corners.mean(axis=0)
    return np.eye(3), np.zeros(3)


def _longest_at_extreme(values: Array, loaded: Flags, least: float) -> int:
    """Samples for which a component stays at its largest or smallest value under load."""
    longest = 0
    for sign in (1.0, -1.0):
        top = float((sign * values[loaded]).max())
        # A component that stays near zero is not cut off at its small largest value.
        if top > least:
            at_top = loaded & (sign * values >= (1.0 - CLIPPED_SHARE) * top)
            begins, ends = runs(at_top)
            longest = max(longest, int((ends - begins).max(initial=0)))
    return longest
