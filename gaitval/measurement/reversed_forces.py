"""Horizontal forces of the wrong sign, undone so that the other faults of a session are seen.

A force of the wrong sign contradicts the motion by more than most other faults do, and looks like
many of them, so the estimate of what else is wrong is made without it. The import itself is left as
it was recorded: its warning says which option reverses the force.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from gaitval.checks.force_checks import BRAKING, INWARD
from gaitval.gait.foot_forces import assign_forces, resample_forces
from gaitval.gait.quality_flags import QualityFlag
from gaitval.measurement.balance import PlateTrial, data_of, ground_of
from gaitval.measurement.likelihood import balance
from gaitval.session.session import Import
from gaitval.session.stated_plates import reversed_along
from gaitval.session.trial import WalkingTrial

AXES: Final = {BRAKING: 0, INWARD: 1}
"""Checks that a wrong sign of a plate's force does not pass, and the axis of that force."""

ReversedAxes = Mapping[str, frozenset[int]]
"""Axes (0 fore-aft, 1 sideways) along which the forces of plates, by their names, are reversed."""


def of_a_sign(flag: QualityFlag) -> bool:
    """Whether a warning says that a force may be reversed; one that is nearly missing is not."""
    return flag.check in AXES and flag.value < 0.0


def suspected(walks: Sequence[WalkingTrial]) -> ReversedAxes:
    """What the warnings of the `walks` say may be reversed."""
    found: dict[str, frozenset[int]] = {}
    for walk in walks:
        for flag in walk.warnings:
            if of_a_sign(flag):
                found[flag.plate] = found.get(flag.plate, frozenset()) | {AXES[flag.check]}
    return found


def likeliest_signs(
    found: Import, trials: Sequence[PlateTrial]
) -> tuple[list[PlateTrial], ReversedAxes]:
    """The `trials` of the import `found` with the signs that forces and motion contradict least, of
    those recorded, of those that are `suspected`, and of all plates if one is: a wrong sign is
    often the laboratory's. Beside each, any other fault may be there.
    """
    some = suspected([trial.walk for trial in trials])
    if not some:
        return [*trials], {}
    mass, height = found.request.mass_kg, found.request.height_m
    best: tuple[float, list[PlateTrial], ReversedAxes] | None = None
    for signs in _candidates(some, trials):
        tried = [_reversed(found, trial, signs) for trial in trials]
        if (data := data_of(tried, mass)) is not None:
            left = balance(data, height).left
            if best is None or left < best[0]:
                best = left, tried, signs
    return ([*trials], {}) if best is None else best[1:]


def _candidates(some: ReversedAxes, trials: Sequence[PlateTrial]) -> Iterator[ReversedAxes]:
    yield {}
    yield some
    axes = frozenset[int]().union(*some.values())
    everywhere = {plate.name: axes for trial in trials for plate in trial.walk.recording.plates}
    if everywhere != some:
        yield everywhere


def _reversed(found: Import, trial: PlateTrial, signs: ReversedAxes) -> PlateTrial:
    """A `trial` whose plates' forces have other `signs`; what the motion needs stays."""
    if not signs or trial.walk.loads is None:
        return trial
    plates = []
    for plate in trial.walk.recording.plates:
        for axis in sorted(signs.get(plate.name, ())):
            plate = reversed_along(plate, axis)
        plates.append(plate)
    recording = replace(trial.walk.recording, plates=tuple(plates))
    forces, _ = assign_forces(
        recording,
        found.processing,
        landmarks=found.session.marker_set.landmarks,
        divide=found.request.divided_plates,
        cutoff_hz=found.processing.moment_force_cutoff_hz,
    )
    loads = replace(resample_forces(forces, recording.time), valid=trial.walk.loads.valid)
    walk = replace(trial.walk, recording=recording, loads=loads)
    return replace(trial, walk=walk, ground=ground_of(loads, recording))
