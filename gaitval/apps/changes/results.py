"""What changed between two sessions, as typed models: `change.json`, its tables, its page."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from gaitval.metrics.curve_results import GaitProfile
from gaitval.metrics.typed import Count, Flag, Number, Result, Sha256, Share, Size
from gaitval.reporting.written import Written

Level = Literal["changed", "perhaps", "re-measuring"]
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
    level: Level | None
    """`changed`: more than re-measuring would; `perhaps`: more than it usually would of this curve;
    null where that is not known."""
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


class ChangeRow(Result):
    """A row of `change.csv`: a region, or the change of a parameter, which has no place."""

    curve: str
    unit: str
    first: Count | None = None
    last: Count | None = None
    at: Count | None = None
    difference: Number
    half: _Figure = None
    level: str | None = None
    tested: Flag | None = None
    by_speed: _Figure = None
    words: str | None = None


class CurvePoint(Result):
    """A row of `change_curves.csv`."""

    curve: str
    percent: Count
    unit: str
    before: Number
    after: Number
    difference: Number
    half: _Figure
    limit: _Figure
    t: _Figure


class ChangeResult(Written):
    """What changed between two sessions of one person."""

    NAME: ClassVar[str] = "change"
    TEMPLATE: ClassVar[str] = "gaitval.apps.changes:change.html.j2"
    TABLES: ClassVar[Mapping[str, tuple[str, type[Result]]]] = {
        "change": ("rows", ChangeRow),
        "change_curves": ("points", CurvePoint),
    }

    schema_version: Literal[2]
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

    @property
    def rows(self) -> list[ChangeRow]:
        """Rows of `change.csv`: every region, then the parameters."""
        regions = [
            ChangeRow(curve=name, unit=curve.unit, **dict(region))
            for name, curve in self.curves.items()
            for region in curve.regions
        ]
        order = {words: place for place, words in enumerate(self.findings)}
        return [
            *sorted(regions, key=lambda row: order[row.words or ""]),
            *(
                ChangeRow(curve=each.name, unit=each.unit, difference=each.after - each.before)
                for each in self.parameters
            ),
        ]

    @property
    def points(self) -> list[CurvePoint]:
        """Rows of `change_curves.csv`: every percent of every curve."""
        return [
            CurvePoint(
                curve=name,
                percent=at,
                unit=curve.unit,
                before=curve.before[at],
                after=curve.after[at],
                difference=round(curve.after[at] - curve.before[at], 6),
                half=None if curve.half is None else curve.half[at],
                limit=None if curve.limit is None else curve.limit[at],
                t=None if curve.t is None else curve.t[at],
            )
            for name, curve in self.curves.items()
            for at in range(101)
        ]
