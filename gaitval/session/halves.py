"""The two halves of a session's gait cycles, as two trials of one subject.

A walk that was fitted to one half can be compared with the other, which it was not told. How far
the halves themselves are apart is the floor below which no model can be asked to go.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Final, Literal, get_args

import numpy as np

from gaitval.arrays import Flags
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.cycles import SpatioTemporal
from gaitval.session.average import mean_angles, mean_kinetics
from gaitval.session.session import Import
from gaitval.session.trial import Trial

Halves = Literal["odd-even", "first-last"]
HALVES: Final[tuple[Halves, ...]] = get_args(Halves)

FEWEST_CYCLES: Final = 3
"""Valid cycles of each side in a half; the mean of fewer is mostly chance."""


def halves_of(found: Import, which: Halves) -> dict[str, Import]:
    """Two imports with half of the cycles of each trial and side, by name: odd and even, or first
    and last.

    Raises
    ------
    RecordError : a half has fewer than `FEWEST_CYCLES` valid cycles of a side.
    """
    names = which.split("-")
    halves = {name: _half(found, which, first=name == names[0]) for name in names}
    for name, half in halves.items():
        for side in SIDES:
            usable = [
                cycle
                for walk in half.trials
                for cycle in walk.cycles[side]
                if (cycle.kinematics_valid if half.request.without_forces else cycle.kinetics_valid)
            ]
            if len(usable) < FEWEST_CYCLES:
                raise RecordError(
                    f"--halves {which}: the {name} half has {len(usable)} valid cycles of the "
                    f"{side} side, and {FEWEST_CYCLES} are needed. Give a longer trial or more "
                    "trials, or import without --halves."
                )
    return halves


def _half(found: Import, which: Halves, *, first: bool) -> Import:
    walks = tuple(_half_of_trial(walk, which, first=first) for walk in found.trials)
    moments, forces = mean_kinetics(found.request, walks)
    return replace(
        found,
        trials=walks,
        angles=mean_angles(found.body.model, walks),
        moments=moments,
        forces=forces,
    )


def _half_of_trial(walk: Trial, which: Halves, *, first: bool) -> Trial:
    cycles, gait = {}, {}
    for side in SIDES:
        every = walk.cycles[side]
        # Of the valid ones, so that the halves have as many.
        number = np.cumsum([cycle.kinematics_valid for cycle in every]) - 1
        count = int(number[-1]) + 1 if len(every) else 0
        inside = number % 2 == 0 if which == "odd-even" else number < (count + 1) // 2
        inside = inside if first else ~inside
        cycles[side] = tuple(cycle for cycle, taken in zip(every, inside, strict=True) if taken)
        # spatiotemporal parameters are of the valid cycles only
        valid = np.array([cycle.kinematics_valid for cycle in every], dtype=bool)
        gait[side] = _those(walk.gait[side], inside[valid])
    return replace(walk, cycles=cycles, gait=gait)


def _those(gait: SpatioTemporal, inside: Flags) -> SpatioTemporal:
    values: Mapping[str, object] = {
        each.name: getattr(gait, each.name)[inside] for each in fields(gait) if each.name != "side"
    }
    return replace(gait, **values)  # type: ignore[arg-type]
