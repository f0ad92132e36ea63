"""The two halves of a session's gait cycles, as two trials of one subject.

A walk that was fitted to one half can be compared with the other, which was held out. The
difference between the halves themselves is the smallest error that a model can be asked for.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Final

import numpy as np

from gaitval.arrays import Flags
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.cycles import SpatioTemporal
from gaitval.session.average import mean_angles, mean_kinetics
from gaitval.session.request import Halves
from gaitval.session.session import Import
from gaitval.session.subject import subject_of
from gaitval.session.trial import WalkingTrial
from gaitval.subjects.subject import Subject

FEWEST_CYCLES: Final = 3
"""Valid cycles of each side in a half; the mean of fewer is mostly chance."""


def halves_of(found: Import, which: Halves) -> dict[str, Import]:
    """Two imports with half of the cycles of each trial and side of `found`, by name: odd and even,
    or first and last, as `which` says.

    Raises RecordError if a half has fewer than `FEWEST_CYCLES` valid cycles of a side.
    """
    names = which.split("-")
    halves = {name: _half(found, which, first=name == names[0]) for name in names}
    for name, half in halves.items():
        for side in SIDES:
            usable = [
                cycle
                for walk in half.trials
                for cycle in walk.cycles[side]
                if (
                    cycle.kinematics_valid if half.request.kinematics_only else cycle.kinetics_valid
                )
            ]
            if len(usable) < FEWEST_CYCLES:
                raise RecordError(
                    f"halves = {which!r}: the {name} half has {len(usable)} valid cycles of the "
                    f"{side} side, and {FEWEST_CYCLES} are needed. Give a longer trial or more "
                    "trials, or import without halves."
                )
    return halves


def subject_of_halves(found: Import, which: Halves) -> Subject:
    """The subject of one half of the cycles of `found`, with the other as a further trial; `which`
    says how they are shared out.
    """
    known, held_out = (
        subject.model_copy(update={"trial": name, "source": f"{subject.source}, {name} cycles"})
        for name, half in halves_of(found, which).items()
        for subject in [subject_of(half)]
    )
    return known.with_trial(held_out)


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


def _half_of_trial(walk: WalkingTrial, which: Halves, *, first: bool) -> WalkingTrial:
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
