"""Computed activations beside electromyograms, and kept near them.

An electromyogram says when a muscle is active, and its shape; not how much of its strength that is
unless it was measured at the largest effort, too. So a shape is compared, and one is kept near
after it was made as large as what was computed without it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.coordinates import Side
from gaitval.gait.electromyograms import Channel, Electromyograms
from gaitval.kinetics.musculature.forces import RecordedActivation
from gaitval.kinetics.musculature.gait import LoadedMotion, MuscleGait
from gaitval.kinetics.musculature.paths import table

DELAY: Final = 0.04
"""s, from an electromyogram to the force: about 4 % of the cycle, as for `gait.USUAL_ON`."""

ON: Final = 0.25
"""Of its range, above which a muscle is on, computed or seen: amplifiers are never quite silent."""


@dataclass(frozen=True)
class SeenActivation:
    """A channel beside what was computed of its muscles, over all that was shared.

    Attributes
    ----------
    trial, channel, side : where it is seen.
    muscles : that it is of.
    correlation : of envelope and activation; NaN where either is constant.
    agrees, by_chance : share of the time in which both are on or both are off, and that of two
        that know nothing of each other.
    size : activation over the envelope, least squares.
    """

    trial: str
    channel: str
    side: Side
    muscles: tuple[str, ...]
    correlation: float
    agrees: float
    by_chance: float
    size: float


def seen_activations(
    found: MuscleGait, seen: Mapping[str, Electromyograms]
) -> tuple[SeenActivation, ...]:
    """Every channel of `seen`, by the trial's name, whose leg was shared in `found`."""
    rows = []
    for trial, recorded in seen.items():
        for channel in recorded.channels:
            pairs = list(_pairs(found, trial, recorded, channel))
            if not pairs:
                continue
            activation = np.concatenate([pair[0] for pair in pairs])
            envelope = np.concatenate([pair[1] for pair in pairs])
            if len(activation) < 3:
                continue
            rows.append(_compared(trial, channel, activation, envelope))
    return tuple(rows)


def recorded_activations(
    found: MuscleGait,
    motions: Sequence[LoadedMotion],
    seen: Mapping[str, Electromyograms],
    weight: float,
) -> dict[str, dict[Side, RecordedActivation]]:
    """What `muscles_of` is to stay near, with `weight`, of `seen` by the trial's name:
    envelopes as large as the activations of `found`, which knew nothing of them.
    """
    names = table().names
    sizes = {(row.trial, row.channel): row.size for row in seen_activations(found, seen)}
    wanted: dict[str, dict[Side, RecordedActivation]] = {}
    for motion in motions:
        recorded = seen.get(motion.name)
        if recorded is None:
            continue
        time = motion.dynamics.time
        own = wanted.setdefault(motion.name, {})
        for channel in recorded.channels:
            size = sizes.get((motion.name, channel.name))
            if size is None:
                continue
            shape = (len(time), len(names))
            near = own.setdefault(
                channel.side, RecordedActivation(np.zeros(shape), np.zeros(shape))
            )
            inside = (time >= recorded.time[0] + DELAY) & (time <= recorded.time[-1] + DELAY)
            envelope = np.clip(size * _at(time, recorded, channel), 0.0, 1.0)
            for muscle in channel.muscles:
                near.activation[:, names.index(muscle)] = envelope
                near.weight[:, names.index(muscle)] = np.where(inside, weight, 0.0)
    return wanted


def _at(time: Array, recorded: Electromyograms, channel: Channel) -> Array:
    return np.interp(time - DELAY, recorded.time, channel.envelope)


def _pairs(
    found: MuscleGait, trial: str, recorded: Electromyograms, channel: Channel
) -> "list[tuple[Array, Array]]":
    """Activation, of the muscles by their strength, and envelope of every stretch of the trial."""
    which = [table().names.index(name) for name in channel.muscles]
    pairs = []
    for name, side, piece in found.pieces:
        if name != trial or side != channel.side:
            continue
        leg = piece.legs[side]
        strength = (leg.muscles.max_force * leg.muscles.present)[which]
        if strength.sum() <= 0.0:
            continue
        inside = piece.time >= recorded.time[0] + DELAY
        inside &= piece.time <= recorded.time[-1] + DELAY
        activation = leg.activation[inside][:, which] @ strength / strength.sum()
        pairs.append((activation, _at(piece.time[inside], recorded, channel)))
    return pairs


def _compared(trial: str, channel: Channel, activation: Array, envelope: Array) -> SeenActivation:
    varies = activation.std() > 1e-6 and envelope.std() > 1e-6
    on, also = _on(activation), _on(envelope)
    square = float(envelope @ envelope)
    return SeenActivation(
        trial=trial,
        channel=channel.name,
        side=channel.side,
        muscles=channel.muscles,
        correlation=float(np.corrcoef(activation, envelope)[0, 1]) if varies else float("nan"),
        agrees=float((on == also).mean()),
        by_chance=float(on.mean() * also.mean() + (1 - on.mean()) * (1 - also.mean())),
        size=float(activation @ envelope) / square if square > 0.0 else 0.0,
    )


def _on(values: Array) -> Flags:
    low, high = float(values.min()), float(values.max())
    return np.asarray(values > low + ON * (high - low))
