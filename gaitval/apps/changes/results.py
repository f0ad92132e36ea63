"""Content of `change.json`, as typed models; `scripts/schemas.py` writes the schema beside them."""

from typing import Annotated, Final, Literal

from pydantic import Field

from gaitval.metrics.statistics_results import GaitProfile
from gaitval.metrics.typed import Count, Flag, Number, Result, Sha256, Share, Size

CHANGE_VERSION: Final = 2
"""Of `change.json`."""

_Figure = Number | None
_Points = Annotated[list[Number], Field(min_length=101, max_length=101)]


class SessionResult(Result):
    """A session that was compared."""

    source: Literal["import", "record", "walk"]
    identifier: str
    sex: Literal["F", "M"]
    mass_kg: Number
    height_m: Number
    walking_speed_m_s: _Figure
    cycles: dict[Literal["right", "left"], Count]
    """Gait cycles that are kept one by one; 0 where only means are."""
    files: dict[str, Sha256]


class ChangedRegion(Result):
    """Where a curve changed."""

    first: Count
    last: Count
    at: Count
    """% of the cycle where it changed most, in units of its band."""
    difference: Number
    """After less before, there."""
    half: _Figure
    """Half of the band of 90 % of that difference; null without bands."""
    level: Literal["changed", "perhaps", "re-measuring"] | None
    """`changed`: more than re-measuring would; null where that is not known."""
    tested: Flag
    """Whether the cycles were tested, and differ there."""
    by_speed: _Figure
    """What the difference of walking speeds does to healthy adults there."""
    words: str


class ChangedCurve(Result):
    """A curve before and after, 0 to 100 % of its side's cycle."""

    unit: str
    before: _Points
    after: _Points
    half: _Points | None
    """Half of the band of 90 % of the difference: of re-measuring, or of the cycles alone where the
    markers are the same."""
    limit: _Points | None
    """Beyond it is more than re-measuring would do to any of the curves, with 95 %."""
    t: _Points | None
    p: Share | None
    """Of the largest |t| among those of all curves; null where the cycles are not tested."""
    regions: list[ChangedRegion]


class ChangedParameter(Result):
    """A spatiotemporal parameter of a side, or of both."""

    name: str
    unit: str
    before: Number
    after: Number
    before_sd: _Figure
    after_sd: _Figure


class ChangedProfile(Result):
    """Gait Profile Scores of the angles that both sessions have."""

    before: GaitProfile
    after: GaitProfile
    smallest_difference: Size
    """That matters clinically, deg (Baker et al. 2012)."""


class ChangeResult(Result):
    """What changed between two sessions of one person."""

    schema_version: Literal[2]
    versions: dict[str, str]
    before: SessionResult
    after: SessionResult
    same_markers: Flag
    """Both of one standing trial: then the cycles alone say what changed."""
    speed: str
    notes: list[str]
    alpha: Share
    threshold: _Figure
    """|t| above which a point of any curve differs; null where nothing was tested."""
    permutations: Count
    stride_correlation: Share | None
    """Of a stride with the next one, which the test allows for; null where nothing was tested."""
    at_once: _Figure
    """Standard deviations of re-measuring that hold all curves with 95 %."""
    curves: dict[str, ChangedCurve]
    parameters: list[ChangedParameter]
    profile: ChangedProfile | None
    findings: list[str]
    """In words, the largest first."""
