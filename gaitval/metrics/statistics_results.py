"""What `metrics.json` says of whole curves; `gaitval.metrics.walk_statistics` works it out."""

from typing import Literal

from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.record_results import Kinds
from gaitval.metrics.typed import Count, Result, Share, Sides, Size

AgeGroup = Literal["adults", "children"]
"""Whose band it is: 42 adults over ground (Fukuchi et al. 2018), or typically developing children
(Schwartz et al. 2008)."""


class Region(Result):
    """Neighbouring points at which curves differ."""

    first: Count
    """Index of the first point; % of the gait cycle where there are 101."""
    last: Count
    """Of the last one, which is part of the region."""
    p: Share
    """Probability that the cycle has a |t| as large as the largest here by chance."""


class CurveStatistics(Result):
    """What is said of one curve, see gaitval/metrics/walk_statistics.py."""

    multiple_correlation: Share | None
    """Of record and mean of the walk (Kadaba 1989); null where they differ more than they move, and
    where the curve was not recorded."""
    repeatability: Share | None
    """The same of the cycles of the walk."""
    threshold: Size | None
    """|t| above which the walk differs at `alpha`; null with too few cycles."""
    normal_threshold: Size | None
    """The same by random field theory, which takes the cycles for normal."""
    p: Share | None
    """Null where the curve was not recorded: nothing is tested there."""
    regions: list[Region]
    """Where the walk differs from the record."""

    @property
    def share(self) -> float | None:
        """% of the points of the cycle at which the walk differs; None where nothing is tested."""
        width = sum(each.last - each.first + 1 for each in self.regions)
        return None if self.p is None else 100.0 * width / SAMPLES


class GaitProfile(Sides[Size]):
    """Gait Profile Score of each side, deg, and its variables."""

    scores: dict[str, Size]
    """Gait variable scores by name with `_r` or `_l`: the Movement Analysis Profile."""
    total: Size
    """Of both sides."""


class GaitProfiles(Result):
    """Of the record and of the walk, from the same variables."""

    variables: list[str]
    record: GaitProfile | None
    """Null unless the angles of both sides were recorded."""
    walk: GaitProfile


class BandPeople(Result):
    """Whose bands they are, by kind of curve."""

    angles: AgeGroup = "children"
    moments: AgeGroup = "children"


class BandShares(Result):
    """Shares of the cycle within `BAND` SD of healthy people's mean."""

    record: Share | None
    """Null where the curve was not recorded."""
    walk: Share


class StatisticsOfCurves(Kinds[CurveStatistics]):
    """What is said of every curve."""


class WalkStatistics(Result):
    """Statistics of whole curves of the final walk."""

    alpha: Share
    permutations: Count
    curves: StatisticsOfCurves
    profiles: GaitProfiles
    bands: dict[str, dict[str, BandShares]]
    """By kind and curve, of those that have a band."""
    band_people: BandPeople = BandPeople()
    """Files without it are from when all bands were those of children."""
