"""Share motions to muscles as asked for: settings of the command and of Python, checked once."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gaitval.coordinates import SIDES, Side
from gaitval.errors import ConfigurationError
from gaitval.gait.electromyograms import Electromyograms, read_electromyograms
from gaitval.kinetics.musculature.electromyography import (
    SeenActivation,
    recorded_activations,
    seen_activations,
)
from gaitval.kinetics.musculature.forces import criterion_of
from gaitval.kinetics.musculature.gait import DEFAULT, LoadedMotion, MuscleGait, muscles_of

DRAWS: Final = 200
"""Of bands."""

STRENGTHS: Final = (0.05, 5.0)
WEIGHTS: Final = (0.0, 1000.0)


@dataclass(frozen=True)
class MuscleSettings:
    """How moments are shared to muscles.

    Attributes
    ----------
    criterion : one of `sharing.CRITERIA`.
    side : one leg only; None for both.
    strength : factor on the strength of all muscles, or of some by name.
    bands : of 90 %, by `DRAWS`.
    activation_dynamics : whether activations rise and fall no faster than muscles can.
    emg : files with electromyograms: one of each trial, called as it is but for the ending, or one
        where there is one trial.
    emg_side : of channels whose names do not say it.
    emg_weight : of a square of activation less electromyogram, against that of an activation; 0 to
        compare only.

    Raises ConfigurationError for what is none of these.
    """

    criterion: str = DEFAULT
    side: Side | None = None
    strength: float | Mapping[str, float] = 1.0
    bands: bool = False
    activation_dynamics: bool = True
    emg: tuple[Path, ...] = ()
    emg_side: Side | None = None
    emg_weight: float = 0.0

    def __post_init__(self) -> None:
        criterion_of(self.criterion)
        for name, side in (("side", self.side), ("EMG side", self.emg_side)):
            if side is not None and side not in SIDES:
                raise ConfigurationError(
                    f"The {name} is {side!r}: give right or left, or leave it out."
                )
        strengths = self.strength if isinstance(self.strength, Mapping) else {"": self.strength}
        for muscle, value in strengths.items():
            _within(f"strength {muscle}".strip(), value, STRENGTHS, "1 is that of healthy adults")
        _within("EMG weight", self.emg_weight, WEIGHTS, "0 only compares")
        if self.emg_weight and not self.emg:
            raise ConfigurationError(
                f"The EMG weight is {self.emg_weight:g}, but there are no electromyograms to stay "
                "near. Give their file, too (--emg)."
            )
        if self.emg_weight and self.bands:
            raise ConfigurationError(
                "Bands draw again what electromyograms do not say, and would leave them out. Ask "
                "for bands or for an EMG weight, not for both."
            )


def _within(name: str, value: object, limits: tuple[float, float], why: str) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    low, high = limits
    if not number or not math.isfinite(value) or not low <= value <= high:  # type: ignore[arg-type,operator]
        raise ConfigurationError(
            f"The {name} is {value!r}: give a number from {low:g} to {high:g}; {why}."
        )


@dataclass(frozen=True)
class SharedMotions:
    """Muscles of a gait, and how they compare with electromyograms; none are `seen` without."""

    muscles: MuscleGait
    seen: tuple[SeenActivation, ...] = ()


def shared_motions(motions: Sequence[LoadedMotion], settings: MuscleSettings) -> SharedMotions:
    """Muscles of `motions` as `settings` say.

    Raises RecordError if nothing has moments, or electromyograms are of another trial; ModelError
    for an unknown muscle.
    """

    def of(draws: int, **more: object) -> MuscleGait:
        return muscles_of(
            motions,
            criterion=settings.criterion,
            sides=SIDES if settings.side is None else (settings.side,),
            strength=settings.strength,
            dynamics_of_activation=settings.activation_dynamics,
            draws=draws,
            **more,  # type: ignore[arg-type]
        )

    draws = DRAWS if settings.bands else 0
    if not settings.emg:
        return SharedMotions(of(draws))
    seen = _of_trials(motions, settings)
    if not settings.emg_weight:
        found = of(draws)
    else:
        alone = of(0)
        near = recorded_activations(alone, motions, seen, settings.emg_weight)
        found = of(draws, recorded=near)
    return SharedMotions(found, seen_activations(found, seen))


def _of_trials(
    motions: Sequence[LoadedMotion], settings: MuscleSettings
) -> dict[str, Electromyograms]:
    names = [motion.name for motion in motions]
    found: dict[str, Electromyograms] = {}
    for path in settings.emg:
        same = [name for name in names if Path(name).stem == path.stem]
        if not same and len(names) == len(settings.emg) == 1:
            same = names
        if len(same) != 1:
            raise ConfigurationError(
                f"{path}: of which trial these electromyograms are is not clear. The trials are "
                f"{', '.join(names)}: give each a file that is called as it is."
            )
        read = read_electromyograms(path, settings.emg_side)
        time = next(motion for motion in motions if motion.name == same[0]).dynamics.time
        if read.time[-1] <= time[0] or read.time[0] >= time[-1]:
            raise ConfigurationError(
                f"{path}: its electromyograms are from {read.time[0]:.2f} to {read.time[-1]:.2f} "
                f"s, the trial {same[0]} from {time[0]:.2f} to {time[-1]:.2f} s. Both must be on "
                "one clock: export them from one file."
            )
        found[same[0]] = read
    return found
