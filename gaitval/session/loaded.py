"""A walking trial as a motion whose moments are known, for its muscles."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.gait.feet_on_plates import FEET
from gaitval.kinetics.musculature.gait import LoadedMotion
from gaitval.kinetics.musculature.mapping import knee_aside
from gaitval.kinetics.musculature.paths import COORDINATES
from gaitval.model.body import BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.session.trial import WalkingTrial, valid_cycles

LEAST_SPAN_S: Final = 0.25
"""s. What is known for a shorter time is not shared."""

LEAST_LOAD: Final = 0.2
"""Of the body's weight: a span in which a foot never carries so much shows no stance."""


def loaded_motion(
    walk: WalkingTrial,
    model: BodyModel,
    *,
    height: float,
    prosthesis: str | None = None,
    knees: Mapping[Side, float] | None = None,
) -> LoadedMotion | None:
    """The trial `walk` of the scaled body `model`, of a person of `height` m; None without moments.
    The leg of a `prosthesis` ("right", "left") has no muscles here: how much of it is left is not
    known. `knees` are `measured_knees`.
    """
    if walk.moments is None or walk.loads is None:
        return None
    own = model if walk.consistent is None else walk.consistent.model
    cycles = {
        side: [(cycle.start, cycle.end) for cycle in valid_cycles(walk, side, kinetics=True)]
        for side in SIDES
        if side != prosthesis
    }
    return LoadedMotion(
        name=walk.name,
        model=own,
        height=height,
        positions=walk.motion,
        dynamics=walk.moments,
        cycles=cycles,
        spans=known_spans(
            walk.moments.time,
            np.stack([walk.moments.leg_known(side) for side in SIDES], axis=1),
            walk.loads.force[..., 2],
            own.mass,
            cycles,
        ),
        lost=lost_leg(prosthesis),
        knees=knees or {},
    )


def measured_knees(
    model: BodyModel, markers: Sequence[ModelMarker], landmarks: Mapping[str, str]
) -> dict[Side, float]:
    """`LoadedMotion.knees` of a body with `markers`, by side; a knee whose two epicondyles have no
    markers (`landmarks` names them) is left out.
    """
    placed = {each.name: each for each in markers}
    found: dict[Side, float] = {}
    for side in SIDES:
        names = [landmarks.get(f"{side[0].upper()}.{place}") for place in ("Knee", "Knee.Medial")]
        both = [placed[name] for name in names if name in placed]
        if len(both) == len(names):
            found[side] = knee_aside(model, side[0], both)
    return found


def lost_leg(prosthesis: str | None) -> dict[Side, Collection[str]]:
    """All coordinates of the leg of a `prosthesis`."""
    return {side: COORDINATES for side in SIDES if side == prosthesis}


def known_spans(
    time: Array,
    known: Flags,
    vertical: Array,
    mass: float,
    sides: Mapping[Side, object],
) -> dict[Side, list[tuple[float, float]]]:
    """s, when the moments of each of `sides` are known and its foot carries the body in between:
    `time` (T,) s, `known` (T, 2) as `InverseDynamics.foot_known`, `vertical` (T, 2) N, right first;
    `mass` kg. A foot in the air is left out for `FEET.settling_seconds` beside frames that are not
    known: they end or begin with an event that only markers show.
    """

    def of(column: int) -> Iterator[tuple[float, float]]:
        air = vertical[:, column] <= 0.0
        for begin, end in zip(*runs(known[:, column]), strict=True):
            first, last = float(time[begin]), float(time[end - 1])
            first += FEET.settling_seconds if begin and air[begin] else 0.0
            last -= FEET.settling_seconds if end < len(time) and air[end - 1] else 0.0
            if last - first < LEAST_SPAN_S:
                continue
            inside = (time >= first) & (time <= last)
            if np.nanmax(vertical[inside, column]) > LEAST_LOAD * GRAVITY * mass:
                yield first, last

    return {side: list(of(column)) for column, side in enumerate(SIDES) if side in sides}
