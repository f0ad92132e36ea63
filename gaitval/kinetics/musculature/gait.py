"""Muscles of a gait: of every cycle of each side, and their mean, with bands.

Where a recording shows no whole cycle, or that of one side only, what it shows counts.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gaitval._internal.text.display import Displayed
from gaitval.arrays import Array, Index
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.kinetics.musculature.bands import SPREADS, Draws, Spreads, draw
from gaitval.kinetics.musculature.forces import LegForces, MuscleForces, RecordedActivation, share
from gaitval.kinetics.musculature.leg_metabolics import leg_rates
from gaitval.kinetics.musculature.metabolics import MODELS
from gaitval.kinetics.musculature.paths import COORDINATES, table
from gaitval.kinetics.musculature.pelvis_zero import pelvis_zero, walking_tilt
from gaitval.kinetics.musculature.sharing import Criterion
from gaitval.model.body import BodyModel

if TYPE_CHECKING:
    import pandas as pd

DEFAULT: Final = "contact by volume"
"""The criterion where nobody chose one."""


@dataclass(frozen=True)
class SampledGait:
    """How a gait is sampled for its muscles."""

    rate: float = 100.0
    """Hz: motions that are sampled faster are thinned out to about this; what is shared has passed
    filters of 15 Hz or less."""
    padding: float = 0.05
    """s before and after a span, so that rates at its ends are not one-sided."""
    band_frames: int = 41
    """Frames of a cycle for which draws are shared."""


SAMPLED: Final = SampledGait()


CONTACTS: Final[Mapping[str, str]] = {
    "hip": "Hip contact force",
    "knee": "Knee contact force, axial",
    "medial": "Knee, medial",
    "lateral": "Knee, lateral",
    "patella": "Patella contact force",
    "ankle": "Ankle contact force",
}
"""Contact forces, by name: the sizes of the forces, but at the knee the part along the tibia, which
is what implants measure, and its parts."""

_FIELD: Final = {"knee": "compression"}

GROUPS: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "gluteus_maximus": ("Gluteus maximus", ("glmax1", "glmax2", "glmax3")),
    "gluteus_medius": ("Gluteus medius", ("glmed1", "glmed2", "glmed3")),
    "iliopsoas": ("Iliopsoas", ("iliacus", "psoas")),
    "hamstrings": ("Hamstrings", ("bflh", "semimem", "semiten")),
    "rectus_femoris": ("Rectus femoris", ("recfem",)),
    "vasti": ("Vasti", ("vasint", "vaslat", "vasmed")),
    "gastrocnemius": ("Gastrocnemius", ("gasmed", "gaslat")),
    "soleus": ("Soleus", ("soleus",)),
    "tibialis_anterior": ("Tibialis anterior", ("tibant",)),
}
"""Muscles as electromyography sees them: title, and the muscles of the table, whose activations
count by how strong they are."""

USUAL_ON: Final[Mapping[str, tuple[tuple[int, int], ...]]] = {
    "gluteus_maximus": ((0, 24), (96, 100)),
    "gluteus_medius": ((0, 30), (97, 100)),
    "iliopsoas": ((64, 75),),
    "hamstrings": ((0, 14), (81, 100)),
    "rectus_femoris": ((57, 65),),
    "vasti": ((0, 16), (91, 100)),
    "gastrocnemius": ((9, 50),),
    "soleus": ((7, 53),),
    "tibialis_anterior": ((0, 13), (57, 100)),
}
"""% of the cycle in which the electromyogram of healthy adults exceeds 5 % of the largest manual
test, by `GROUPS`; read from the curves of Perry and Burnfield (2010), Gait Analysis, 2nd edition,
as Moco's authors digitised them. Force follows the electromyogram by some 4 % of the cycle."""

_PHASE: Final = np.linspace(0.0, 1.0, 101)


@dataclass(frozen=True)
class LoadedMotion:
    """A motion whose moments are known, of at least one leg and some of the time.

    Attributes
    ----------
    name : of the trial or walk.
    model : the scaled body, of the person alone.
    height : of the person, m.
    positions : (T, 31) as `dynamics` are of.
    dynamics : N and Nm.
    cycles : s, starts and ends of whole gait cycles with moments of each side.
    spans : s, when a side's moments are known, where there is no cycle.
    lost : coordinates (`paths.COORDINATES`) of joints that a prosthesis has, by side.
    assist : (T, 25) Nm of devices at the joints; None without.
    knees : m, how far the middle of a knee is to the outer side of the body's knee centre
        (`mapping.knee_aside`), by side; sides that no marker shows are left out.
    speed : m/s, of walking; None where it is not known.
    laden : the body with what the person wears, whose moments `dynamics` are; None if nothing.
    """

    name: str
    model: BodyModel
    height: float
    positions: Array
    dynamics: InverseDynamics
    cycles: Mapping[Side, Sequence[tuple[float, float]]]
    spans: Mapping[Side, Sequence[tuple[float, float]]] = field(default_factory=dict)
    lost: Mapping[Side, Collection[str]] = field(default_factory=dict)
    assist: Array | None = None
    knees: Mapping[Side, float] = field(default_factory=dict)
    speed: float | None = None
    laden: BodyModel | None = None


@dataclass(frozen=True)
class LegGait:
    """Muscles of one leg over its gait cycle: means of all cycles, (101,) each.

    Attributes
    ----------
    cycles : how many.
    activation : (40, 101), order of `paths.table().names`.
    force : (40, 101) body weights, of the tendons.
    contact : of `CONTACTS`, body weights; those of lost joints are left out.
    deviation : (101,) of `contact` between cycles; empty for one cycle.
    activation_band : (2, 40, 101) low and high of 90 %; None if not asked for.
    contact_band : (2, 101) likewise.
    metabolic : (101,) W/kg of the body, metabolic rate of the leg's muscles, by model.
    """

    cycles: int
    activation: Array
    force: Array
    contact: Mapping[str, Array]
    deviation: Mapping[str, Array]
    present: Array
    strengths: Array
    activation_band: Array | None = None
    contact_band: Mapping[str, Array] = field(default_factory=dict)
    metabolic: Mapping[str, Array] = field(default_factory=dict)

    def group(self, name: str) -> Array:
        """(101,) activation of one of `GROUPS`; NaN where the person has none of it."""
        return grouped(self.activation, self.strengths * self.present, name)

    def group_band(self, name: str) -> Array | None:
        """(2, 101) of `group`: of its muscles' bands."""
        if self.activation_band is None:
            return None
        weights = self.strengths * self.present
        return np.stack([grouped(edge, weights, name) for edge in self.activation_band])


def grouped(activation: Array, weights: Array, name: str) -> Array:
    """Activation (101,) of one of `GROUPS` of `activation` (40, 101), whose muscles count by
    `weights` (40,); NaN where none has any.
    """
    names = table().names
    which = [names.index(each) for each in GROUPS[name][1]]
    total = weights[which].sum()
    if total <= 0.0:
        return np.full(activation.shape[1], np.nan)
    return np.asarray(weights[which] @ activation[which] / total)


@dataclass(frozen=True, repr=False)
class MuscleGait(Displayed):
    """Muscle activations and forces, and joint contact forces, of a gait.

    Attributes
    ----------
    name : whose.
    mass_kg : of the body.
    criterion : what the sharing kept small.
    legs : means over cycles, by side; a side without a whole cycle is left out.
    pieces : what was shared, by trial and side, over time.
    remarks : what a reader must know, each once.
    """

    name: str
    mass_kg: float
    criterion: Criterion
    legs: Mapping[Side, LegGait]
    pieces: tuple[tuple[str, Side, MuscleForces], ...]
    remarks: tuple[str, ...]

    @property
    def body_weight(self) -> float:
        """N."""
        return self.mass_kg * GRAVITY

    def title(self) -> str:
        """Whose, and how many cycles of each side."""
        shown = ", ".join(f"{leg.cycles} {side}" for side, leg in self.legs.items())
        return (
            f"Muscles of {self.name}: {shown or 'no whole'} cycles, criterion {self.criterion.name}"
        )

    def curves(self) -> Iterator[tuple[str, str, Array, Array | None]]:
        """Name with `_r` or `_l`, unit, mean (101,) and band (2, 101) or None: activations of
        groups and of muscles, forces of muscles, contact forces.
        """
        names = table().names
        for side, leg in self.legs.items():
            end = f"_{side[0]}"
            for group in GROUPS:
                yield f"activation {group}{end}", "1", leg.group(group), leg.group_band(group)
            for i, name in enumerate(names):
                if leg.present[i]:
                    band = None if leg.activation_band is None else leg.activation_band[:, i]
                    yield f"activation {name}{end}", "1", leg.activation[i], band
                    yield f"force {name}{end}", "BW", leg.force[i], None
            for contact, curve in leg.contact.items():
                yield f"contact {contact}{end}", "BW", curve, leg.contact_band.get(contact)
            for model, curve in leg.metabolic.items():
                yield f"metabolic {model}{end}", "W/kg", curve, None

    def to_frame(self) -> "pd.DataFrame":
        """Mean activations (1), muscle forces and contact forces (body weights) at 0, 1, … 100 % of
        each side's gait cycle.
        """
        from gaitval._internal.text.frames import curve_frame

        return curve_frame((name, unit, mean) for name, unit, mean, _ in self.curves())

    def overview(self) -> "pd.DataFrame":
        """Peaks of contact forces, body weights, with their bands."""
        import pandas as pd

        rows = []
        for side, leg in self.legs.items():
            for contact, curve in leg.contact.items():
                at = int(np.argmax(curve))
                row = {"contact": contact, "side": side, "peak_bw": curve[at], "at_percent": at}
                if contact in leg.contact_band:
                    low, high = leg.contact_band[contact][:, at]
                    row |= {"band_low": low, "band_high": high}
                rows.append(row)
        return pd.DataFrame(rows)


def muscles_of(
    motions: Sequence[LoadedMotion],
    *,
    criterion: str | Criterion = DEFAULT,
    sides: Sequence[Side] = SIDES,
    strength: Mapping[str, float] | float = 1.0,
    dynamics_of_activation: bool = True,
    draws: int = 0,
    spreads: Spreads = SPREADS,
    recorded: "Mapping[str, Mapping[Side, RecordedActivation]] | None" = None,
) -> MuscleGait:
    """Muscles of all `motions` of a person, pooled.

    Parameters
    ----------
    criterion, strength, dynamics_of_activation : as for `forces.share`. Without limits of how fast
        activations change, muscles let go at toe-off at once; with them the activations of four
        of five people are nearer to their own EMG (`emg_criteria` at 60ee3cba).
    sides : legs to look at.
    draws : for bands of 90 %, such as 200; 0 for none.
    spreads : what they draw.
    recorded : activations to stay near by the name of the motion, at the times of its `dynamics`.

    Raises RecordError if nothing has moments, or as `forces.share`.
    """
    pieces: list[tuple[str, Side, MuscleForces]] = []
    cut: dict[Side, list[tuple[MuscleForces, float, float]]] = {}
    remarks: list[str] = []
    tilt = walking_tilt(motions)
    zero = 0.0 if tilt is None else pelvis_zero(tilt)
    for motion in motions:
        for side in sides:
            whole = list(motion.cycles.get(side, ()))
            for start, end in _joined(whole or motion.spans.get(side, ())):
                seen = None if recorded is None else recorded.get(motion.name, {}).get(side)
                found = _share_span(
                    _counted(motion) if whole else motion,
                    side,
                    start,
                    end,
                    criterion,
                    strength,
                    dynamics_of_activation,
                    seen,
                    zero,
                )
                message = f"{motion.name}: " if len(motions) > 1 else ""
                if not whole:
                    found = _within(found, start, end)
                    remarks.append(
                        f"{message}{side}: no whole cycle is known; shared from {start:.2f} to "
                        f"{end:.2f} s, where the force on this foot is known"
                    )
                pieces.append((motion.name, side, found))
                remarks += [f"{message}{each}" for each in found.remarks()]
                cut.setdefault(side, []).extend(
                    (found, a, b) for a, b in whole if start <= a and b <= end
                )
    if not pieces:
        raise RecordError(
            f"{', '.join(motion.name for motion in motions)}: the moments of no leg are known over "
            "a gait cycle, so nothing can be shared to muscles. Give a trial in which a foot is "
            "alone on a plate for its stance, and its swing is shown."
        )
    legs = {side: _leg(side, parts, draws, spreads) for side, parts in cut.items() if parts}
    model = motions[0].model
    return MuscleGait(
        name=motions[0].name if len(motions) == 1 else model.name,
        mass_kg=model.mass,
        criterion=pieces[0][2].criterion,
        legs=legs,
        pieces=tuple(pieces),
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _counted(motion: LoadedMotion) -> LoadedMotion:
    """`motion` with its moments known throughout: what its cycles need was looked at when they were
    counted.
    """
    return replace(motion, dynamics=replace(motion.dynamics, known=None, foot_known=None))


def _joined(spans: Sequence[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Spans that touch are one."""
    start = end = np.nan
    for a, b in sorted(spans):
        if a <= end + SAMPLED.padding:
            end = max(end, b)
            continue
        if np.isfinite(start):
            yield start, end
        start, end = a, b
    if np.isfinite(start):
        yield start, end


def _share_span(
    motion: LoadedMotion,
    side: Side,
    start: float,
    end: float,
    criterion: str | Criterion,
    strength: Mapping[str, float] | float,
    dynamics_of_activation: bool,
    recorded: RecordedActivation | None,
    zero: float,
) -> MuscleForces:
    time = motion.dynamics.time
    every = max(1, round(1.0 / (SAMPLED.rate * float(np.median(np.diff(time))))))
    rows = np.flatnonzero((time >= start - SAMPLED.padding) & (time <= end + SAMPLED.padding))[
        ::every
    ]
    if recorded is not None:
        recorded = RecordedActivation(recorded.activation[rows], recorded.weight[rows])
    return share(
        motion.model,
        motion.positions[rows],
        part_of(motion.dynamics, rows),
        height=motion.height,
        criterion=criterion,
        sides=(side,),
        strength=strength,
        lost=motion.lost,
        dynamics_of_activation=dynamics_of_activation,
        recorded=None if recorded is None else {side: recorded},
        assist=None if motion.assist is None else motion.assist[rows],
        knees=motion.knees,
        pelvis_zero=zero,
    )


def _within(found: MuscleForces, start: float, end: float) -> MuscleForces:
    """`found` from `start` to `end` s: what pads a span that is no whole cycle is not known."""
    rows = np.flatnonzero((found.time >= start - 1e-9) & (found.time <= end + 1e-9))
    legs = {side: leg.part(rows) for side, leg in found.legs.items()}
    return replace(found, time=found.time[rows], legs=legs)


def part_of(dynamics: InverseDynamics, rows: Index) -> InverseDynamics:
    """The frames `rows` of `dynamics`."""
    count = len(dynamics.time)
    own = {each.name: getattr(dynamics, each.name) for each in fields(dynamics)}
    cut: dict[str, Any] = {
        name: value[rows]
        for name, value in own.items()
        if isinstance(value, np.ndarray) and len(value) == count
    }
    return replace(dynamics, **cut)


def _leg(
    side: Side, parts: Sequence[tuple[MuscleForces, float, float]], draws: int, spreads: Spreads
) -> LegGait:
    """Mean over the cycles, and bands of the one whose knee force is nearest to its mean."""
    legs = [(found.legs[side], found) for found, _, _ in parts]
    times = [start + (end - start) * _PHASE for _, start, end in parts]
    weight = legs[0][1].body_weight

    def over(values: Array, found: MuscleForces, at: Array) -> Array:
        flat = values.reshape(len(found.time), -1).T
        return np.stack([np.interp(at, found.time, row) for row in flat])

    activation = [over(leg.activation, f, t) for (leg, f), t in zip(legs, times, strict=True)]
    force = [over(leg.force, f, t) / weight for (leg, f), t in zip(legs, times, strict=True)]
    first = legs[0][0]
    kept = [name for name in CONTACTS if _has(first, name)]
    contact = {
        name: np.stack(
            [over(contact_curve(leg, name), f, t)[0] / weight
             for (leg, f), t in zip(legs, times, strict=True)]
        )
        for name in kept
    }  # fmt: skip
    mean = {name: each.mean(axis=0) for name, each in contact.items()}
    mass = legs[0][1].mass_kg
    known = {
        id(f): leg_rates(f.time, leg, dynamics_of_activation=f.dynamics_of_activation)
        for leg, f in {id(f): (leg, f) for leg, f in legs}.values()
    }
    metabolic = {
        model: np.stack(
            [np.interp(t, f.time, known[id(f)][model]) / mass
             for (_, f), t in zip(legs, times, strict=True)]
        )
        for model in MODELS
    }  # fmt: skip
    means = LegGait(
        cycles=len(parts),
        activation=np.mean(activation, axis=0),
        force=np.mean(force, axis=0),
        contact=mean,
        deviation={
            name: each.std(axis=0, ddof=1) for name, each in contact.items() if len(parts) > 1
        },
        present=first.muscles.present,
        strengths=first.muscles.max_force,
        metabolic={model: each.mean(axis=0) for model, each in metabolic.items()},
    )
    if not draws:
        return means
    off = np.abs(contact.get("knee", contact["hip"]) - mean.get("knee", mean["hip"])).mean(axis=1)
    typical = int(off.argmin())
    drawn, time = _drawn(parts[typical], side, draws, spreads)
    at = times[typical]

    def band(name: str, centre: Array, own: Array, scale: float) -> Array:
        edges = drawn.band(name) / scale
        flat = edges.reshape(2, len(time), -1)
        moved = np.stack([np.stack([np.interp(at, time, row) for row in edge.T]) for edge in flat])
        return np.maximum(moved + (centre - own), 0.0)

    bands = {
        name: band(_FIELD.get(name, name), mean[name][None], contact[name][typical][None], weight)[
            :, 0
        ]
        for name in kept
    }
    return replace(
        means,
        activation_band=np.minimum(
            band("activation", means.activation, activation[typical], 1.0), 1.0
        ),
        contact_band=bands,
    )


def _has(leg: LegForces, contact: str) -> bool:
    """Whether the person has the joint of a contact force: its muscles would say."""
    joint = {"hip": "hip_flexion", "ankle": "ankle_angle"}.get(contact, "knee_angle")
    at = COORDINATES.index(joint)
    return bool(np.abs(leg.arms[:, leg.muscles.present, at]).max(initial=0.0) > 1e-6)


def contact_curve(leg: LegForces, name: str) -> Array:
    """(T,) N, of a leg, one of `CONTACTS`."""
    if name in ("knee", "medial", "lateral"):
        return np.asarray(getattr(leg.contact, _FIELD.get(name, name)))
    return leg.contact.size(name)


def _drawn(
    part: tuple[MuscleForces, float, float], side: Side, draws: int, spreads: Spreads
) -> tuple[Draws, Array]:
    few = _cycle_of(part, side)
    return draw(few, side, draws=draws, spreads=spreads), few.time


def _cycle_of(part: tuple[MuscleForces, float, float], side: Side) -> MuscleForces:
    """One cycle, thinned out, as `draw` takes it."""
    found, start, end = part
    inside = np.flatnonzero((found.time >= start - 0.01) & (found.time <= end + 0.01))
    step = max(1, round(len(inside) / SAMPLED.band_frames))
    rows = inside[::step]
    if rows[-1] != inside[-1]:
        rows = np.append(rows, inside[-1])
    return replace(found, time=found.time[rows], legs={side: found.legs[side].part(rows)})
