"""The reference motion that a walker imitates, from Python."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd

from gaitval.configuration import load_configuration
from gaitval.coordinates import ACTUATED
from gaitval.interface.result import Result, angle_curves, curve_frame, of_kind, same_fields
from gaitval.interface.subjects import FORCE, MOMENT, Subject
from gaitval.reference import motion
from gaitval.reference.dynamic_fit import consistent_reference
from gaitval.scaling.scaling import scale_subject


@dataclass(frozen=True, repr=False)
class ReferenceMotion(Result, motion.ReferenceMotion):
    """`gaitval.reference.motion.ReferenceMotion` that prints itself: one right gait cycle."""

    def title(self) -> str:
        """Length and speed of the cycle."""
        return f"Reference motion: stride time {self.stride_time:.2f} s, {self.speed:.2f} m/s"

    def to_frame(self) -> pd.DataFrame:
        """Joint angles (deg), joint moments (Nm) and ground reaction (% of body weight), of both
        sides at % of the right gait cycle. A moment that no record has is left out.
        """
        moments = zip(ACTUATED, self.moments.T, strict=True)
        forces = (
            (f"{axis}_{side}", 100.0 * self.ground_reaction[:, i, j])
            for i, side in enumerate("rl")
            for j, axis in enumerate(("forward", "left", "up"))
        )
        return curve_frame(
            [
                *angle_curves(self.positions),
                *((of_kind(name, MOMENT), "Nm", each) for name, each in moments if np.any(each)),
                *((of_kind(name, FORCE), "% BW", each) for name, each in forces),
            ],
            at=100.0 * self.phase,
        )

    def save(self, path: str | Path) -> None:
        """Write one npz file, whole or not at all, as `gaitval reference` does."""
        motion.ReferenceMotion.save(self, Path(path))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` or `gaitval reference` wrote (`reference.npz`). Raises ArtefactError."""
        shown: Self = same_fields(cls, motion.ReferenceMotion.load(Path(path)))
        return shown


def reference_motion(subject: Subject, *, settings: Sequence[str] = ()) -> ReferenceMotion:
    """The periodic motion that the walker of a subject imitates, as `gaitval reference` builds it.

    It is the recorded gait on the scaled body, changed within the accuracy of the record so that
    it obeys the laws of motion. It takes some seconds.

    Parameters
    ----------
    subject : whose record it is.
    settings : "section.key=value", as for `--set`; here those of `contact`.

    Returns
    -------
    ReferenceMotion
        N samples of the right gait cycle: `positions` and `velocities` (N, 31) in rad, m and s,
        `moments` (N, 25) Nm, `ground_reaction` (N, 2, 3) body weights; x forward, y left, z up.

    Raises
    ------
    ScalingError
        The subject's lengths give no plausible body.
    ConfigurationError
        There is no such setting.

    References
    ----------
    Winter (2009), Biomechanics and Motor Control of Human Movement, chapter 5: the equations of
    motion; `gaitval.reference` says what is derived and what is a convention.

    Examples
    --------
    >>> import gaitval as gv
    >>> subject = gv.load_subject(5)
    >>> reference = gv.reference_motion(subject)
    >>> reference.positions.shape, reference.stride_time == subject.stride_time_s
    ((1024, 31), True)
    """
    contact = load_configuration(settings=settings).contact
    found = consistent_reference(subject.record(), scale_subject(subject).model, contact)
    shown: ReferenceMotion = same_fields(ReferenceMotion, found)
    return shown
