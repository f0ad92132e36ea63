"""What the force on a foot is over whole stances: signs, axes and free moments of a plate.

The limits were measured on the recordings named in `findings.plates`.

Axes: the project's (REP-103), the person walks along +x. Forces act on the person.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import count_of
from gaitval.findings.finding import Finding, Seen
from gaitval.gait.events import EVENTS, foot_contacts
from gaitval.mocap.force_plates import LONGEST_LEVER_M
from gaitval.mocap.recording import FootForces, Recording

MOSTLY_SEEN: Final = 0.8
"""Share of a stance in which pelvis and centre of pressure must be known for its `fall`."""
LOADED: Final = 0.2
"""Fraction of a contact's peak above which its centre of pressure and free moment are used."""


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
    """

    braking: float
    sideways: float
    inward: float
    fall: float
    lean: float
    twist: float


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
    return StanceFigures(
        braking=float(difference[0]),
        sideways=float(difference[1]),
        inward=float(inward * force[middle, 1].sum() / impulse),
        fall=float((ends[0] - ends[1]) / impulse) if seen else np.nan,
        lean=float(inward * np.mean(away[:, 1] / away[:, 2])) if len(away) else np.nan,
        # A percentile, because one sample of noise would decide the largest value.
        twist=float(np.percentile(np.abs(twist[heavy]) / force[heavy, 2], 95.0)),
    )


@dataclass(frozen=True)
class Stances:
    """Whole stances by their plate. A sign or an axis is wrong for a plate, not for a foot: stances
    of both feet count together.
    """

    by_plate: Mapping[str, Sequence[tuple[Stance, StanceFigures]]]

    @property
    def every(self) -> list[Stance]:
        """All stances."""
        return [stance for members in self.by_plate.values() for stance, _ in members]

    def means(self, *names: str) -> Iterator[tuple[str, str, int, list[float]]]:
        """For each plate: its name, what it shows in words, the number of its stances, and the mean
        of each of the figures of these `names`.
        """
        for plate, members in self.by_plate.items():
            sides = [side for side in SIDES if any(one.side == side for one, _ in members)]
            count = count_of(len(members), "stance")
            where = f"plate {plate} ({' and '.join(sides)} foot, {count})"
            figures = [[getattr(each, name) for _, each in members] for name in names]
            yield plate, where, len(members), [float(np.mean(each)) for each in figures]


def stances_of(recording: Recording, forces: FootForces, pelvis: Array) -> Stances:
    """Of a `recording` that is cleaned and zeroed, in the project's axes, walking along +x, with
    `forces` of `assign_forces`; `pelvis` (T, 3) m is a middle point of the pelvis at their times.
    """
    by_plate: dict[str, list[tuple[Stance, StanceFigures]]] = {}
    for stance in whole_stances(recording, forces):
        figures = stance_figures(stance, forces, pelvis)
        by_plate.setdefault(stance.plate, []).append((stance, figures))
    return Stances(by_plate)


CHECK_PLATE: Final = "Check the plate's corners and calibration, and export again"


def _exchanged(of: Stances, *, times: float) -> Iterator[Seen]:
    """Change of the sideways impulse from early to late stance, over the vertical one."""
    least = EXCHANGED_AXES.high
    for plate, where, _, (along, across) in of.means("braking", "sideways"):
        limits = (-np.inf, max(least, times * abs(along)))
        yield Seen(abs(across), where, {"along": along}, plate, limits, certain=True)


def _braking(of: Stances, *, share_of_fall: float) -> Iterator[Seen]:
    """Fore-aft impulse of the last 40 % of a stance less that of its first 40 %. Who takes short
    steps, as a small child does, brakes little and needs no more.
    """
    least = BRAKING.low
    for plate, where, _, (braking, fall) in of.means("braking", "fall"):
        low = min(least, share_of_fall * fall) if fall > 0.0 else least  # NaN: not known
        turned = (
            f"the fore-aft force has the wrong sign or axis. {CHECK_PLATE}"
            if braking < 0.0
            else "the fore-aft force is nearly missing, which is no wrong sign. Is the channel "
            "dead or its sensitivity too small, or does the person shuffle?"
        )
        yield Seen(braking, where, {"turned": turned}, plate, (low, np.inf))


def _inward(of: Stances, *, share_of_lean: float, outward: float, lean: float) -> Iterator[Seen]:
    """Inward impulse in the middle 70 % of a stance; an outward push that is small beside the
    pelvis' lean over the foot is of neither sign.
    """
    for plate, where, _, (inward, leans) in of.means("inward", "lean"):
        low = -share_of_lean * leans if leans > 0.0 else 0.0  # NaN where no marker shows the pelvis
        words = {"outward": -inward}
        certain = inward < -outward and leans > lean
        yield Seen(inward, where, words, plate, (low, np.inf), certain)


def _free_moment(of: Stances) -> Iterator[Seen]:
    """m, free moment over vertical force, 95th percentile in loaded stance."""
    for plate, where, _, (twist,) in of.means("twist"):
        yield Seen(twist, where, {"friction": LONGEST_LEVER_M}, plate)


EXCHANGED_AXES: Final[Finding] = Finding(
    name="fore-aft and sideways force",
    needs=Stances,
    values=_exchanged,
    numbers={"times": 2.0},
    limits=0.03,
    unit="1",
    sentence=(
        "braking and propulsion are in the sideways force (its impulse changes by {value:.1f %} of "
        "the vertical one from early to late stance, the fore-aft one by {along:.1f %}): the "
        "plate's axes are exchanged"
    ),
    remedy="Check the order of its corners, or of the force's columns",
    source="at most 0.013",
)
BRAKING: Final[Finding] = Finding(
    name="braking before propulsion",
    needs=Stances,
    values=_braking,
    numbers={"share_of_fall": 0.25},
    limits=(0.02, np.inf),
    impossible=(-0.02, np.inf),
    unit="1",
    sentence=(
        "a walking foot is pushed back first and forward later, but here the fore-aft impulse "
        "changes by {value:.1f %} of the vertical one from early to late stance (at least "
        "{low:.0f %}): {turned}"
    ),
    source="at least 0.039 (0.49 m/s) and 0.085 (over ground); turned round it is negative",
    hidden_by=("fore-aft and sideways force",),
)
INWARD: Final[Finding] = Finding(
    name="push towards the middle line",
    needs=Stances,
    values=_inward,
    numbers={"share_of_lean": 0.08, "outward": 0.02, "lean": 0.015},
    limits=(0.0, np.inf),
    unit="1",
    sentence=(
        "the foot is pushed outwards by {outward:.1f %} of the vertical impulse, but the body, "
        "which the force carries, is inwards of it: the sideways force has the wrong sign or axis"
    ),
    remedy=CHECK_PLATE,
    source="0.009 to 0.064; the body is inward by 0.018 to 0.087 of its height above the foot",
    hidden_by=("fore-aft and sideways force",),
)
HORIZONTAL: Final = frozenset({EXCHANGED_AXES.name, BRAKING.name, INWARD.name})
"""Findings of the horizontal forces of a plate; the free moment is what these leave of the vertical
moment."""
FREE_MOMENT: Final[Finding] = Finding(
    name="size of the free moment",
    needs=Stances,
    values=_free_moment,
    limits=0.03,
    impossible=(-np.inf, LONGEST_LEVER_M),
    unit="m",
    sentence=(
        "the free moment is {value:.1f cm} times the vertical force (at most {high:.0f cm} in "
        "walking; friction under a foot allows {friction:.0f cm}): its unit or calibration, or the "
        "place of the plate's origin, is wrong"
    ),
    source="at most 0.014 m, and 0.010 m on plates that were zeroed by their maker",
    hidden_by=(*HORIZONTAL, "weight"),
)
