"""The grids of one person's walk before and now, with the norm and where the two differ.

Where both folders have the rollout, each curve is tested over its whole cycle: strides are
exchanged between the walks (`two_sample_test`). A stored baseline has means alone: no test.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitval.apps.regression.versions import StoredWalk, WalkPair
from gaitval.arrays import Array, sample_deviation
from gaitval.coordinates import SIDES, Side
from gaitval.datasets.subject_file import load_subject
from gaitval.gait.mean_curves import STANCE_THRESHOLD
from gaitval.metrics.curve_statistics import two_sample_test
from gaitval.metrics.norms import Norm, norms
from gaitval.metrics.record_results import KINDS
from gaitval.metrics.shown_quantities import of_walk
from gaitval.metrics.typed import array
from gaitval.quantities import BY_NAME
from gaitval.reporting import grids
from gaitval.reporting.grids import DrawnCurve, Panel
from gaitval.reporting.run_grids import strides_of

PAIRS: Final = 3
"""Most people whose grids are drawn: the page of each run has its own."""
GRIDS: Final = {
    "kinematics": grids.KINEMATICS,
    "kinetics": grids.WITH_QUANTITIES,
    "forces": grids.FORCES,
    "muscles": grids.MUSCLES,
}

_Strides = Mapping[str, Array]


def pair_grids(pairs: Sequence[WalkPair]) -> list[dict[str, Any]]:
    """For the template: of each of the first `PAIRS` people the subject, whether the curves were
    tested and with how many strides, and the figures by name.
    """
    found = []
    for number, pair in enumerate(pairs[:PAIRS]):
        before, now = (strides_of(each.folder, each.metrics) for each in (pair.before, pair.now))
        rows = panels(pair, before, now)
        found.append(
            {
                "subject": pair.now.subject,
                "strides": [len(next(iter(each.values()))) for each in (before, now) if each],
                "figures": {
                    name: grids.grid(
                        each,
                        height=1.27 if name == "kinematics" else 1.6,
                        figure_name=f"pair-{number}-{name}",
                        words=("before", "now"),
                        linked=False,
                    )
                    for name, each in rows.items()
                    # older baselines have no muscles
                    if any(panel.curves for row in each for panel in row)
                },
            }
        )
    return found


def panels(pair: WalkPair, before: _Strides, now: _Strides) -> dict[str, list[list[Panel]]]:
    """The panels of each of `GRIDS`; `before` and `now` are strides as `strides_of` has them."""
    normal = _norms(pair.now)
    return {
        name: [[_panel(pair, before, now, normal, each) for each in row] for row in layout]
        for name, layout in GRIDS.items()
    }


def _panel(
    pair: WalkPair, before: _Strides, now: _Strides, normal: Mapping[str, Norm], name: str
) -> Panel:
    kind, _, curve = name.partition("/")
    curves: list[DrawnCurve] = []
    regions: dict[Side, list[tuple[float, float]]] = {}
    for side in SIDES:
        key = f"{kind}/{curve}_{side[0]}"
        first, second = (
            _mean(walk, kind, f"{curve}_{side[0]}") for walk in (pair.before, pair.now)
        )
        if first is None or second is None:
            continue
        own = now.get(key)
        curves.append(DrawnCurve(side, first, which="record"))
        deviation = None if own is None else sample_deviation(own)
        curves.append(DrawnCurve(side, second, deviation, own))
        if key in before and own is not None:
            regions[side] = differing(before, now, key)
    return Panel(
        name,
        tuple(curves),
        normal.get(name),
        regions=regions,
    )


def differing(before: _Strides, now: _Strides, key: str) -> list[tuple[float, float]]:
    """First and last % of the cycle where the curve `key`, "kind/name_side", of two walks differs,
    at 5 % over the whole cycle; of forces over the stance of either.
    """
    first, second = before[key], now[key]
    if min(len(first), len(second)) < 2:
        return []
    where: NDArray[np.bool_] | None = None
    if key.startswith("forces/"):
        vertical = f"forces/vertical_{key[-1]}"
        means = np.array([each[vertical].mean(axis=0) for each in (before, now)])
        where = np.asarray((means > 100.0 * STANCE_THRESHOLD).any(axis=0))
    return [(each.first, each.last) for each in two_sample_test(first, second, where=where).regions]


def _mean(walk: StoredWalk, kind: str, key: str) -> Array | None:
    """Mean over the cycles of a walk, in the units of the page; None where it was not measured."""
    results = walk.metrics.walk
    if kind in BY_NAME:
        found = of_walk(results, BY_NAME[kind])
        return None if found is None else found.curves.get(key)
    for each in KINDS:
        if each == kind and key in results.curves.of(each):
            mean = results.curves.of(each)[key].mean
            return None if mean is None else array(mean)
    return None


def _norms(walk: StoredWalk) -> Mapping[str, Norm]:
    path = walk.folder / "subject.toml"
    return norms(load_subject(path)) if path.is_file() else {}
