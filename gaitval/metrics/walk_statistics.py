"""What `metrics.json` says of whole curves: where the walk differs, how alike it is, and how far
both walk and record are from healthy gait.

The record is a mean curve without its strides, so the only scatter that the test knows is that of
the walk's cycles: a region says that the walk, repeated, would differ there again; whether the
person would, it cannot say. Cycles follow one another and are a little alike, which makes regions a
little too wide.
"""

import csv
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from importlib import resources
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import Field

from gaitval.arrays import Array, Flags
from gaitval.coordinates import SIDES
from gaitval.gait.mean_curves import STANCE_THRESHOLD
from gaitval.gait.record import GaitRecord
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.comparison import Curves
from gaitval.metrics.curve_statistics import ALPHA, CurveTest, one_sample_test
from gaitval.metrics.cycles import GaitCycles, cut
from gaitval.metrics.gait_profile import (
    PROFILE_ANGLES,
    GaitProfile,
    gait_profile,
    load_controls,
)
from gaitval.metrics.origin import Origins, curve_origin
from gaitval.metrics.record_results import Kinds
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.typed import Count, Result, Size
from gaitval.metrics.unseen import multiple_correlation
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.simulation.rollout import Rollout

PERMUTATIONS: Final = 2_000
"""Of the test of each curve; the SD of a p of 0.05 is 0.005."""

BAND: Final = 2.0
"""Standard deviations between healthy people on both sides of their mean; 95 % of them."""

Percent = Annotated[Count, Field(le=100)]
Share = Annotated[Size, Field(le=1)]


class RegionResult(Result):
    """A part of the cycle where the walk differs from the record."""

    first: Percent
    last: Percent
    p: Share


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
    regions: list[RegionResult]


class ProfileResult(Result):
    """Gait Profile Score and its variables, deg, see gaitval/metrics/gait_profile.py."""

    scores: dict[str, Size]
    right: Size
    left: Size
    total: Size


class ProfilesResult(Result):
    """Of the record and of the walk, from the same variables."""

    variables: list[str]
    record: ProfileResult | None
    """Null unless the angles of both sides were recorded."""
    walk: ProfileResult


People = Literal["adults", "children"]
"""Whose band it is: 42 adults over ground (Fukuchi et al. 2018), or typically developing children
(Schwartz et al. 2008)."""

ADULT: Final = 18.0
"""Years of age from which a person is held against adults, where there are any."""


class BandPeople(Result):
    """Whose bands they are, by kind of curve."""

    angles: People = "children"
    moments: People = "children"


class BandShares(Result):
    """Shares of the cycle within `BAND` SD of healthy people's mean."""

    record: Share | None
    """Null where the curve was not recorded."""
    walk: Share


class WalkStatistics(Result):
    """Statistics of whole curves of the final walk."""

    alpha: Share
    permutations: Count
    curves: Kinds[CurveStatistics]
    profiles: ProfilesResult
    bands: dict[str, dict[str, BandShares]]
    """By kind and curve, of those that have a band."""
    band_people: BandPeople = BandPeople()
    """Files without it are from when all bands were those of children."""


Bands = dict[str, dict[str, tuple[Array, Array]]]
"""Mean and standard deviation, (101,) each, by kind and curve."""


@cache
def healthy_bands() -> Bands:
    """Angles and moments of typically developing children: `healthy_bands.csv`."""
    return _read_bands("healthy_bands.csv")


@cache
def adult_bands() -> Bands:
    """Angles of 42 adults: `adult_bands.csv`. No moments of as many adults may be shipped."""
    return _read_bands("adult_bands.csv")


def bands_beside(age_years: float | None) -> tuple[Bands, dict[str, People]]:
    """The bands that a person is held against, and whose they are by kind of curve.

    Parameters
    ----------
    age_years : a person of unknown age counts as an adult.
    """
    grown = age_years is None or age_years >= ADULT
    bands = {**healthy_bands(), **(adult_bands() if grown else {})}
    people: dict[str, People] = {
        kind: "adults" if grown and kind in adult_bands() else "children" for kind in bands
    }
    return bands, people


def _read_bands(name: str) -> Bands:
    text = resources.files("gaitval.metrics").joinpath(name).read_text("utf-8")
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    table = np.array(rows[1:], dtype=float)
    at, found = np.arange(SAMPLES), dict[str, dict[str, tuple[Array, Array]]]()
    for column in range(1, len(rows[0]), 2):
        kind, name, _ = rows[0][column].split("/")
        mean, spread = (np.interp(at, table[:, 0], table[:, column + i]) for i in (0, 1))
        found.setdefault(kind, {})[name] = mean, spread
    return found


def foot_progression(rollout: Rollout, cycles: GaitCycles, model: BodyModel) -> dict[str, Array]:
    """Direction of both feet seen from above, toes towards the midline positive: (n, 101) rad."""
    found = {}
    frames = segment_frames(model, rollout.positions)
    for side in SIDES:
        forward = frames[:, SEGMENTS.index(f"foot_{side[0]}"), :2, 0]
        angle = np.arctan2(forward[:, 1], forward[:, 0]) * (1.0 if side == "right" else -1.0)
        found[f"foot_progression_{side[0]}"] = cut(angle, cycles.starts[side], cycles.ends[side])
    return found


def walk_statistics(
    curves: Curves,
    progression: Mapping[str, Array],
    record: GaitRecord,
    recorded: Mapping[str, Any],
    origins: Origins,
    *,
    age_years: float | None = None,
) -> dict[str, Any] | None:
    """The statistics of a walk's cycles, to be written as JSON; None with fewer than two cycles.

    Parameters
    ----------
    curves : of the walk, (n, 101) each.
    progression : of its feet, see `foot_progression`.
    recorded : curves of the record by kind and name, in their units.
    origins : where they come from; nothing is tested against what was not recorded.
    age_years : of the person, who is held against adults or children (`bands_beside`).
    """
    cycles = by_kind(curves)
    if min(len(curve) for kind in cycles.values() for curve in kind.values()) < 2:
        return None
    found = {
        kind: {
            name: _of_curve(curve, recorded[kind][name], _tested(kind, name, curves, recorded))
            if curve_origin(kind, name, origins) == "recorded"
            else _untested(curve)
            for name, curve in each.items()
        }
        for kind, each in cycles.items()
    }
    walked = {
        kind: {name: curve.mean(axis=0) for name, curve in each.items()}
        for kind, each in cycles.items()
    }
    bands, people = bands_beside(age_years)
    return {
        "alpha": ALPHA,
        "permutations": PERMUTATIONS,
        "curves": found,
        "profiles": _profiles(walked["angles"], progression, record, origins),
        "bands": _bands(walked, recorded, origins, bands),
        "band_people": people,
    }


def _tested(kind: str, name: str, curves: Curves, recorded: Mapping[str, Any]) -> Flags:
    """Points at which a curve is tested: of forces those where walk or record is in stance."""
    if kind != "forces":
        return np.ones(SAMPLES, dtype=bool)
    vertical = f"vertical_{name[-1]}"
    on_ground: Flags = curves.forces[vertical].mean(axis=0) > STANCE_THRESHOLD
    recorded_on: Flags = np.asarray(recorded["forces"][vertical]) > 100.0 * STANCE_THRESHOLD
    return on_ground | recorded_on


def _of_curve(cycles: Array, expected: Array, where: Any) -> dict[str, Any]:
    test: CurveTest = one_sample_test(cycles, expected, where=where, permutations=PERMUTATIONS)
    return {
        "multiple_correlation": multiple_correlation([np.asarray(expected), cycles.mean(axis=0)]),
        "repeatability": multiple_correlation(list(cycles)),
        "threshold": test.threshold,
        "normal_threshold": test.normal_threshold,
        "p": test.p,
        "regions": [asdict(region) for region in test.regions],
    }


def _untested(cycles: Array) -> dict[str, Any]:
    """What is said of a curve that was not recorded: how the walk repeats itself."""
    return {
        "multiple_correlation": None,
        "repeatability": multiple_correlation(list(cycles)),
        "threshold": None,
        "normal_threshold": None,
        "p": None,
        "regions": [],
    }


def _profiles(
    walked: Mapping[str, Array],
    progression: Mapping[str, Array],
    record: GaitRecord,
    origins: Origins,
) -> dict[str, Any]:
    phase, controls = np.linspace(0.0, 1.0, SAMPLES), load_controls().curves
    of_record = {name: np.degrees(curve(phase)) for name, curve in record.angles.items()}
    turned = {name: np.degrees(curve.mean(axis=0)) for name, curve in progression.items()}
    both = {name: curve for name, curve in {**walked, **turned}.items() if name in of_record}
    variables = [name for name in PROFILE_ANGLES if f"{name}_r" in both and f"{name}_l" in both]
    same = {name: of_record[name] for name in both}
    recorded = set(origins["angles"].values()) == {"recorded"}
    return {
        "variables": variables,
        "record": _profile(gait_profile(same, controls)) if recorded else None,
        "walk": _profile(gait_profile(both, controls)),
    }


def _profile(found: GaitProfile) -> dict[str, Any]:
    sides = {str(side): score for side, score in found.sides.items()}
    return {"scores": found.scores, **sides, "total": found.total}


def _bands(
    walked: Mapping[str, Any], recorded: Mapping[str, Any], origins: Origins, bands: Bands
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for kind, each in bands.items():
        found[kind] = {}
        for name, (mean, spread) in each.items():
            for side in "rl":
                key = f"{name}_{side}"
                shares = {
                    which: float(np.mean(np.abs(curves[kind][key] - mean) <= BAND * spread))
                    if which == "walk" or curve_origin(kind, key, origins) == "recorded"
                    else None
                    for which, curves in (("record", recorded), ("walk", walked))
                }
                found[kind][key] = shares
    return found
