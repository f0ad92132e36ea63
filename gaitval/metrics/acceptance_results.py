"""What `metrics.json` says of how far each curve may be believed, as typed models.

`gaitval.metrics.acceptance` works it out.
"""

from typing import Literal

from gaitval.metrics.record_results import Kinds
from gaitval.metrics.typed import Number, Result, Size

Light = Literal["believe", "with care", "do not"]
"""Whether a curve of the walk may be believed."""

Reason = Literal[
    "nearer",
    "narrow",
    "engine",
    "guess nearer",
    "group",
    "not shown",
    "guess",
    "limit",
    "record",
    "not recorded",
    "held out",
    "no guess",
    "too short",
]
"""Why. Believe: it is "nearer" to the record than the best guess. With care: it is, but not in
every repeated walk ("narrow") or not in the second "engine"; its group is and itself is not ("guess
nearer"), or the other way round ("group"); that its group is nearer is "not shown"; nothing was
recorded to judge it by ("not recorded"), or there is "no guess" to compare with. Do not: the
"guess" is nearer, it misses its "limit", it is not within what the "record" is known to, its group
is further from the prediction than predictions of "held out" trials are from their records, or the
walk is "too short"."""


class CurveLight(Result):
    """Whether a curve of the final walk may be believed, and why."""

    light: Light
    reason: Reason
    error: Number | None
    """RMSE of the walk, in the unit of the curve; null where it is too short."""
    guess: str | None
    """The best guess without a model, by its name in `predictions`; null without one."""
    guess_error: Size | None
    """Its RMSE of this curve."""
    known: Size | None
    """What the record itself is known to: half the width of its 90 % band, median over the cycle;
    null where the record does not say."""


class CurveLights(Kinds[CurveLight]):
    """Of every curve."""


class KnownTo(Result):
    """What the mean RMSE of a group of curves is known to: a difference below all of these is none.

    All are in `unit`, means over the curves of the group on both sides.
    """

    group: str
    """Of `gaitval.metrics.groups.GROUPS`."""
    unit: str
    record: Size | None
    """Half the width of the 90 % band of the recorded mean curves, as the import found it; null
    where only mean curves are known, as of the built-in people."""
    time_step: Size | None
    """RMS difference of the mean curves from those of the whole study made anew at a quarter of
    the physics step: the largest of the built-in people's in `time_step.csv`."""
    second_engine: Size | None
    """RMS difference of the mean curves from those of the same walk in the second engine."""
