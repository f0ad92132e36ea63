"""Muscle activations and forces, and what the joints carry, of a motion whose moments are known."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from gaitval._internal.text.any_case import as_known
from gaitval.arrays import Array, Flags, Index, runs, spread_out
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, Side
from gaitval.errors import ModelError, RecordError
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.kinetics.musculature.contact import Contact, contact, knee_compression
from gaitval.kinetics.musculature.curves import (
    FASTEST,
    active_length,
    passive_length,
    tendon_strain,
    velocity,
)
from gaitval.kinetics.musculature.mapping import LegLoads, leg_loads, sizes
from gaitval.kinetics.musculature.paths import (
    COORDINATES,
    JOINTS,
    MUSCLES,
    Geometry,
    geometry,
    table,
)
from gaitval.kinetics.musculature.person import LegMuscles, leg_muscles
from gaitval.kinetics.musculature.sharing import CRITERIA, SHARING, Criterion, solve
from gaitval.model.body import BodyModel


@dataclass(frozen=True)
class ForceSettings:
    """When muscle forces are believed, and how they are worked out."""

    reserve: float = 0.3
    """A reserve of so many Nm is as dear as a whole muscle at full activation."""
    much_reserve: float = 0.05
    """Reserve over the largest moment from which it is remarked."""
    at_limit: float = 0.99
    farthest: float = np.radians(20.0)
    """How far an angle may be beyond the table of paths, in a frame."""
    rise: float = 0.010
    fall: float = 0.040
    """s, time constants of a muscle's activation as it rises and as it falls (Zajac 1989)."""
    elastic_steps: int = 30
    elastic_enough: float = 2e-3
    shortest: float = 0.3
    """Of the optimal fibre's length: shorter fibres are held here, where they have no force."""


FORCES: Final = ForceSettings()


class RecordedActivation(NamedTuple):
    """What a leg's muscles were seen to do.

    Attributes
    ----------
    activation : (T, 40) 0 to 1; anything where there is no weight.
    weight : (T, 40) of its distance's square against that of an activation; 0 where nothing was
        seen.
    """

    activation: Array
    weight: Array


def change_limits(time: Array) -> tuple[float, float]:
    """Shares by which activations may fall and rise from frame to frame of `time` (T,) s."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else np.inf
    return float(-np.expm1(-step / FORCES.fall)), float(-np.expm1(-step / FORCES.rise))


@dataclass(frozen=True)
class LegForces:
    """One leg; T frames, 40 muscles in the order of the names in `muscles`.

    What follows from forces is NaN in frames in which the ground reaction on the foot is not known
    (`InverseDynamics.leg_known`).

    Attributes
    ----------
    muscles : of this leg.
    loads : what they had to do.
    activation : (T, 40) 0 to 1.
    force : (T, 40) N, of the tendon, active and passive.
    passive : (T, 40) N, of which passive.
    length : (T, 40) m, of muscle and tendon.
    fibre : (T, 40) optimal lengths.
    arms : (T, 40, 6) m, -∂L/∂q of `paths.COORDINATES`.
    moments : (T, 6) Nm that were asked for.
    reserves : (T, 6) Nm, what the muscles do not make of them.
    contact : what the joints carry.
    outside : (T, 6) whether an angle is beyond the table's range (the nearest one was used).
    solved : (T,) whether the sharing converged; False where nothing was shared.
    """

    muscles: LegMuscles
    loads: LegLoads
    activation: Array
    force: Array
    passive: Array
    length: Array
    fibre: Array
    arms: Array
    moments: Array
    reserves: Array
    contact: Contact
    outside: Flags
    solved: Flags

    def part(self, rows: Index) -> "LegForces":
        """The frames `rows` of it."""
        count = len(self.activation)

        def cut(of: Any) -> dict[str, Any]:
            values = {each.name: getattr(of, each.name) for each in fields(of)}
            return {
                name: value[rows]
                for name, value in values.items()
                if isinstance(value, np.ndarray) and value.ndim and len(value) == count
            }

        return replace(
            self,
            **cut(self),
            loads=self.loads.part(rows),
            contact=replace(self.contact, **cut(self.contact)),
        )

    @property
    def known(self) -> Flags:
        """(T,) frames in which anything was shared."""
        return np.isfinite(self.activation[:, 0])

    def reserve_share(self) -> Array:
        """(6,) largest reserve over the largest moment, of each of `paths.COORDINATES`."""
        left, asked = np.abs(self.reserves[self.known]), np.abs(self.moments[self.known])
        return np.asarray(left.max(axis=0) / np.maximum(asked.max(axis=0), 1e-9))


@dataclass(frozen=True)
class MuscleForces:
    """Muscles of a motion.

    Attributes
    ----------
    time : (T,) s.
    mass_kg : of the body.
    criterion : what was kept small.
    legs : by side; a leg that is missing is left out.
    dynamics_of_activation : whether activations changed no faster than muscles can.
    """

    time: Array
    mass_kg: float
    criterion: Criterion
    legs: Mapping[Side, LegForces]
    dynamics_of_activation: bool = False

    @property
    def body_weight(self) -> float:
        """N."""
        return self.mass_kg * GRAVITY

    def remarks(self) -> tuple[str, ...]:
        """What a reader must know of this result: moments that the muscles do not make, angles that
        the paths do not reach, muscles at their limit, frames without a solution.
        """
        return tuple(message for side, leg in self.legs.items() for message in self._of(side, leg))

    def _of(self, side: Side, leg: LegForces) -> Iterator[str]:
        largest = np.abs(leg.moments[leg.known]).max(axis=0, initial=0.0)
        for i, share_left in enumerate(leg.reserve_share()):
            if share_left > FORCES.much_reserve:
                at = int(np.nanargmax(np.abs(leg.reserves[:, i])))
                yield (
                    f"{side} {COORDINATES[i].replace('_', ' ')}: "
                    f"{abs(leg.reserves[at, i]):.1f} Nm at {self.time[at]:.2f} s are made by no "
                    f"muscle, {100 * share_left:.0f} % of its largest moment ({largest[i]:.0f} Nm)"
                )
        begins, ends = runs(~leg.known)
        if len(begins):
            spans = zip(self.time[begins], self.time[ends - 1], strict=True)
            yield (
                f"{side}: the plates do not show the force on this foot alone at "
                f"{', '.join(f'{a:.2f} to {b:.2f} s' for a, b in spans)}: its muscles and joint "
                "contact forces are not known there"
            )
        for i, name in enumerate(COORDINATES):
            if not leg.outside[:, i].any():
                continue
            yield (
                f"{side} {name.replace('_', ' ')}: in {leg.outside[:, i].sum()} of "
                f"{len(self.time)} frames beyond the table of muscle paths; the nearest angle was "
                "used"
            )
        full = [
            MUSCLES[muscle]
            for muscle, activation in zip(leg.muscles.names, leg.activation.T, strict=True)
            if (activation > FORCES.at_limit).any()
        ]
        if full:
            yield (
                f"{side}: as active as they can be in some frames: {', '.join(full)}. Either they "
                "are stronger than the model's, or the moment is too large"
            )
        unsolved = int((leg.known & ~leg.solved).sum())
        if unsolved:
            few = f"{unsolved} of {len(self.time)}"
            yield f"{side}: {few} frames were not solved exactly"


def criterion_of(name: str | Criterion) -> Criterion:
    """The criterion called `name`. Raises ModelError for another name."""
    if isinstance(name, Criterion):
        return name
    name = as_known(name, CRITERIA)
    if name not in CRITERIA:
        raise ModelError(
            f"No criterion is called {name!r}. Choose one of {', '.join(map(repr, CRITERIA))}."
        )
    return CRITERIA[name]


def share(
    model: BodyModel,
    positions: Array,
    dynamics: InverseDynamics,
    *,
    height: float,
    criterion: str | Criterion = "squares",
    sides: Sequence[Side] = ("right", "left"),
    strength: Mapping[str, float] | float = 1.0,
    lost: Mapping[Side, Collection[str]] | None = None,
    dynamics_of_activation: bool = False,
    recorded: Mapping[Side, RecordedActivation] | None = None,
    assist: Array | None = None,
    knees: Mapping[Side, float] | None = None,
    pelvis_zero: float = 0.0,
) -> MuscleForces:
    """Share the moments of a motion out to the muscles.

    Where `dynamics` says that the ground reaction on a foot is not known (`leg_known`), nothing is
    shared in that leg: its activations, forces and contact forces are NaN there.

    Parameters
    ----------
    model : the scaled body.
    positions : (T, 31) that `dynamics` are of, low-passed as they are.
    dynamics : intersegmental forces and moments, N and Nm.
    height : of the person, m.
    criterion : one of `sharing.CRITERIA`, or one of your own.
    sides : legs to look at.
    strength : factor on all muscles, or on some by name.
    lost : coordinates (`paths.COORDINATES`) of joints that a prosthesis has, by side: what muscles
        that span them had to do is left out.
    dynamics_of_activation : whether activations rise and fall no faster than muscles can
        (`FORCES.rise`, `FORCES.fall`).
    recorded : activations to stay near, such as of EMG, by side.
    assist : (T, 25) Nm that devices make at the joints (`coordinates.ACTUATED`), which muscles need
        not.
    knees : `mapping.LegLoads.knee_aside` by side, m.
    pelvis_zero : as for `mapping.leg_loads`, rad.

    Raises
    ------
    RecordError : moments that are not finite, look like moments per kilogram, or are known in no
        frame; angles more than 20 degrees beyond the table of paths.
    ModelError : an unknown criterion or muscle, or a body that no person has.
    """
    chosen = criterion_of(criterion)
    legs: dict[Side, LegForces] = {}
    for side in sides:
        known = dynamics.leg_known(side)
        _check_moments(dynamics, known, side)
        aside = None if knees is None else knees.get(side)
        loads = leg_loads(
            model, positions, dynamics, side[0], knee_aside=aside, pelvis_zero=pelvis_zero
        )
        _check_angles(dynamics.time, loads, side)
        if assist is not None:
            loads = loads.assisted(
                assist[:, [ACTUATED.index(f"{name}_{side[0]}") for name in COORDINATES]]
            )
        gone = () if lost is None else lost.get(side, ())
        muscles = leg_muscles(
            sizes(model, side[0]), mass=model.mass, height=height, strength=strength, lost=gone
        )
        legs[side] = _share_known(
            dynamics.time,
            known,
            loads.without(gone),
            muscles,
            chosen,
            model.mass,
            dynamics_of_activation=dynamics_of_activation,
            recorded=None if recorded is None else recorded.get(side),
        )
    return MuscleForces(dynamics.time, model.mass, chosen, legs, dynamics_of_activation)


def _check_moments(dynamics: InverseDynamics, known: Flags, side: Side) -> None:
    if not known.any():
        span = f"{dynamics.time[0]:.4g} to {dynamics.time[-1]:.4g} s"
        raise RecordError(
            f"The ground reaction on the {side} foot is known in no frame from {span}, so nothing "
            "can be shared to the muscles of its leg. Look at the other leg (sides), or give a "
            "trial in which this foot is alone on a plate."
        )
    missing = known & ~np.isfinite(dynamics.moments).all(axis=1)
    if missing.any():
        raise RecordError(
            f"The joint moments are not known at {dynamics.time[missing][0]:.4g} s. Muscles need "
            "all of them: leave these frames out, or say that they are not known (foot_known)."
        )
    largest = float(np.abs(dynamics.joint_force).max(initial=0.0))
    weight = dynamics.mass_kg * GRAVITY
    if 0.0 < largest < 0.1 * weight:
        raise RecordError(
            f"The largest intersegmental force is {largest:.3g} where the person weighs "
            f"{weight:.0f} N. Forces must be in N and moments in Nm, not per kilogram: multiply by "
            "the mass."
        )


def _check_angles(time: Array, loads: LegLoads, side: Side) -> None:
    low, high = table().ranges.T
    beyond = np.maximum(low - loads.angles, loads.angles - high)
    t, i = np.unravel_index(int(beyond.argmax()), beyond.shape)
    if beyond[t, i] > FORCES.farthest:
        raise RecordError(
            f"{COORDINATES[i]} of the {side} leg is {np.degrees(loads.angles[t, i]):.0f} deg at "
            f"{time[t]:.4g} s; muscle paths are known from {np.degrees(low[i]):.0f} to "
            f"{np.degrees(high[i]):.0f} deg, which is gait and 20 deg beyond. Leave out the frames "
            "in which nobody walks, or check the angle's unit and sign."
        )


def _share_known(
    time: Array,
    known: Flags,
    loads: LegLoads,
    muscles: LegMuscles,
    criterion: Criterion,
    mass: float,
    *,
    dynamics_of_activation: bool,
    recorded: RecordedActivation | None,
) -> LegForces:
    """`share_leg` of the frames that are `known` (T,), each stretch of them by itself."""
    paths = geometry(loads.angles)
    options: dict[str, Any] = {"dynamics_of_activation": dynamics_of_activation}
    if known.all():
        return share_leg(time, loads, paths, muscles, criterion, mass, recorded=recorded, **options)
    stretches = [np.arange(begin, end) for begin, end in zip(*runs(known), strict=True)]
    found = [
        share_leg(
            time[rows],
            loads.part(rows),
            paths.part(rows),
            muscles,
            criterion,
            mass,
            recorded=None if recorded is None else RecordedActivation(*(e[rows] for e in recorded)),
            **options,
        )
        for rows in stretches
    ]
    rows = np.concatenate(stretches)

    def spread(parts: Sequence[Any]) -> dict[str, Any]:
        """The arrays of time of `parts`, of all frames; NaN, and False of flags, between them."""
        every = {
            each.name: [getattr(part, each.name) for part in parts] for each in fields(parts[0])
        }
        return {
            name: spread_out(np.concatenate(values), rows, len(time))
            for name, values in every.items()
            if isinstance(values[0], np.ndarray)
        }

    unknown: dict[str, Any] = {
        name: spread_out(getattr(loads, name)[rows], rows, len(time))
        for name in ("moments", "force", "moment")
    }
    return replace(
        found[0],
        **spread(found)
        | {
            "length": paths.length @ muscles.sizes.factors,
            "arms": -(paths.slope @ muscles.sizes.factors),
            "outside": paths.outside,
        },
        loads=replace(loads, **unknown),
        contact=Contact(**spread([part.contact for part in found])),
    )


def share_leg(
    time: Array,
    loads: LegLoads,
    paths: Geometry,
    muscles: LegMuscles,
    criterion: Criterion,
    mass: float,
    *,
    dynamics_of_activation: bool = False,
    recorded: RecordedActivation | None = None,
) -> LegForces:
    """Share the `loads` of one leg at `time` (T,) s, whose paths are `paths`, of a person of `mass`
    kg.
    """
    length = paths.length @ muscles.sizes.factors
    arms = -(paths.slope @ muscles.sizes.factors)
    shared = capacity_shares(
        length,
        rate(time, length),
        arms,
        loads,
        paths,
        muscles,
        criterion,
        mass * GRAVITY,
        limits=change_limits(time) if dynamics_of_activation else (1.0, 1.0),
        recorded=recorded,
    )
    return LegForces(
        muscles=muscles,
        loads=loads,
        activation=shared.activation,
        force=shared.force,
        passive=shared.able.passive,
        length=length,
        fibre=shared.able.fibre,
        arms=arms,
        moments=loads.moments,
        reserves=loads.moments - np.einsum("tmj,tm->tj", arms, shared.force),
        contact=contact(loads, paths, shared.force, muscles.sizes),
        outside=paths.outside,
        solved=shared.solved,
    )


def rate(time: Array, values: Array) -> Array:
    """Rate of `values` (T, …) by cubic splines over `time` (T,) s; zeros for less than 4 frames."""
    if len(time) < 4:
        return np.zeros_like(values)
    return np.asarray(make_interp_spline(time, values, k=3).derivative()(time))


@dataclass(frozen=True)
class Capacity:
    """Force of muscles along their tendons: `active` (…, 40) N at full activation, `passive` N,
    and `fibre` in optimal lengths.
    """

    active: Array
    passive: Array
    fibre: Array


def capacity(
    length: Array, speed: Array, muscles: LegMuscles, tendon_force: Array | None = None
) -> Capacity:
    """What muscles of whole `length` (…, 40) m can do while it changes by `speed` m/s.

    Tendons are rigid, but the elastic ones stretch by `tendon_force` (…, 40) N where that is given;
    `speed` is then that of the muscle less its tendon.
    """
    slack = muscles.tendon_slack
    if tendon_force is not None:
        stretched = slack * (1.0 + tendon_strain(tendon_force / muscles.max_force))
        slack = np.where(muscles.elastic, stretched, slack)
    width = muscles.optimal_fibre * np.sin(muscles.pennation)
    along = np.maximum(length - slack, FORCES.shortest * muscles.optimal_fibre)
    fibre = np.hypot(along, width)
    slope = along / fibre
    normal = fibre / muscles.optimal_fibre
    fast = np.clip(speed * slope / (FASTEST * muscles.optimal_fibre), -1.0, 1.0)
    fixed = length - slack <= FORCES.shortest * muscles.optimal_fibre
    active = np.where(fixed, 0.0, active_length(normal) * velocity(fast))
    passive = passive_length(normal, muscles.passive_from, muscles.passive_to)
    most = np.where(muscles.present, muscles.max_force, 0.0)
    return Capacity(most * active * slope, most * passive * slope, normal)


class _Spared(NamedTuple):
    """Contact forces that a criterion keeps small, k of them, in body weights: `per_newton`
    (T, k, 40), what they are without muscles, `own` (T, k), and `weights` (k,) of their squares.
    """

    per_newton: Array
    own: Array
    weights: Array


def _spared(loads: LegLoads, paths: Geometry, criterion: Criterion, weight: float) -> _Spared:
    per_newton = [np.zeros((len(loads.angles), 0, paths.length.shape[1]))]
    own, weights = [np.zeros((len(loads.angles), 0))], list[float]()
    if criterion.knee:
        each, rest = knee_compression(loads, paths)
        per_newton, own = [*per_newton, each[:, None]], [*own, rest[:, None]]
        weights.append(criterion.knee)
    if criterion.hip:
        hip = JOINTS.index("hip")
        per_newton.append(-paths.pull[:, :, hip].transpose(0, 2, 1))
        own.append(loads.force[:, hip])
        weights += [criterion.hip] * 3
    return _Spared(
        np.concatenate(per_newton, axis=1) / weight,
        np.concatenate(own, axis=1) / weight,
        np.array(weights),
    )


@dataclass(frozen=True)
class SharedFrames:
    """Activations (T, 40) and forces (T, 40) N, what the muscles were able to do, and whether a
    frame was solved, (T,).
    """

    activation: Array
    force: Array
    able: Capacity
    solved: Flags


def capacity_shares(
    length: Array,
    speed: Array,
    arms: Array,
    loads: LegLoads,
    paths: Geometry,
    muscles: LegMuscles,
    criterion: Criterion,
    weight: float,
    lowest: float = SHARING.lowest,
    limits: tuple[float, float] = (1.0, 1.0),
    recorded: RecordedActivation | None = None,
) -> SharedFrames:
    """Share `loads` to muscles of whole `length` (T, 40) m, that change by `speed` m/s, with `arms`
    (T, 40, 6) m, in a body of `weight` N; none is less active than `lowest`. `limits` are
    `change_limits`; `recorded` activations are stayed near.

    Raises ModelError for recorded activations and a criterion that is not of squares.
    """
    weights = np.array([criterion.weights.get(name, 1.0) for name in muscles.names])
    if criterion.by_volume:
        weights = weights * muscles.volume / muscles.volume.mean()
    favour = None
    if recorded is not None:
        if criterion.exponent != 2.0:
            raise ModelError(
                f"Recorded activations cannot be kept near with the criterion {criterion.name!r}, "
                "whose cost is no square. Choose another, such as 'contact by volume'."
            )
        weights = weights + recorded.weight
        favour = 2.0 * recorded.weight * recorded.activation
    # A fibre behind a long tendon is nearly isometric in stance, while its speed by differences of
    # the tendon's stretch is mostly noise: as Uhlrich et al. (2022), it is taken to be 0.
    speed = np.where(muscles.elastic, 0.0, speed)
    spared = _spared(loads, paths, criterion, weight)
    able, start = capacity(length, speed, muscles), None
    stretching, guess = muscles.elastic.any(), np.zeros_like(length)
    stiffness = np.concatenate(
        [np.full(arms.shape[2], 2.0 / FORCES.reserve**2), 2.0 * spared.weights]
    )
    for step in range(FORCES.elastic_steps):
        rows = np.einsum("tmj,tm->tjm", arms, able.active)
        wanted = loads.moments - np.einsum("tmj,tm->tj", arms, able.passive)
        if len(spared.weights):
            rows = np.concatenate([rows, spared.per_newton * able.active[:, None]], axis=1)
            own = spared.own + np.einsum("tkm,tm->tk", spared.per_newton, able.passive)
            wanted = np.concatenate([wanted, -own], axis=1)
        shares = solve(
            rows,
            wanted,
            stiffness,
            weights,
            exponent=criterion.exponent,
            lowest=lowest,
            favour=favour,
            limits=limits,
            start=start,
        )
        force, start = shares.activations * able.active + able.passive, shares.multipliers
        off = (np.abs(force - guess) / muscles.max_force)[:, muscles.elastic]
        if not stretching or off.max(initial=0.0) < FORCES.elastic_enough:
            break
        # Halfway, so that a tendon that stretches too far in one step does not slacken in the next.
        guess = force if step == 0 else (guess + force) / 2
        able = capacity(length, speed, muscles, guess)
    return SharedFrames(shares.activations, force, able, shares.solved)


__all__ = ["LegForces", "MuscleForces", "RecordedActivation", "share", "share_leg"]
