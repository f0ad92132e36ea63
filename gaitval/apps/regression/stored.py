"""Whether stored metrics can be trusted: complete, finite and consistent with themselves.

A baseline that is damaged or edited by hand would let every later walk pass. A file describes a
walk more than once: errors follow from the curves, measures from errors, cycles and pushes. All of
it is computed again and compared.
"""

from collections.abc import Collection
from typing import Final

import numpy as np

from gaitval.errors import ArtefactError
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import from_kinds
from gaitval.metrics.origin import is_judged, measure_origin
from gaitval.metrics.results import Metrics
from gaitval.metrics.side_measures import side_values
from gaitval.metrics.tolerances import UNITS, Measure, measured
from gaitval.metrics.torques import TORQUES
from gaitval.metrics.typed import array
from gaitval.metrics.unrecorded import UNRECORDED, step_width_measure
from gaitval.metrics.validation import (
    endurance_measures,
    push_measures,
    rmse_measures,
    skill_measures,
    spatiotemporal_measures,
)
from gaitval.metrics.walk_quantities import quantity_measures, stored_quantities
from gaitval.metrics.whole_body import centre_of_mass_measures

AGREES: Final = 1e-3
"""Relative; stored numbers have six digits, and an error of curves that nearly agree loses some."""
DIFFERENCE: Final = 1e-3
"""In the unit of a difference of stored numbers: the errors of speed, stance and steps."""

FIX: Final = (
    "Restore the file, for instance with `git checkout`, or store the baseline again with "
    "`gaitval baseline SUBJECT`."
)


def believe(metrics: Metrics, origin: str, *, known: Collection[str] | None = None) -> None:
    """Raise ArtefactError where the stored `metrics` are incomplete or contradict themselves.
    `origin` is the file, for the message; `known` are the measures of the gaitval that stored it,
    of which none may be missing; by default all of the installed one.
    """
    _check_curves(metrics, origin)
    judged = {(row.measure, row.target): row.value for row in metrics.tolerances}
    origins = metrics.origins
    for kind, target in judged:
        if not is_judged(measure_origin(kind, target, origins)):
            raise ArtefactError(
                f"{origin}: {kind} of {target} has a verdict, but what it is compared with was not "
                f"recorded. {FIX}"
            )
    found: dict[tuple[str, str], float] = {}
    for row in metrics.measures:
        name = f"{row.measure} of {row.target}"
        place = (row.measure, row.target)
        if place in found:
            raise ArtefactError(f"{origin}: {name} is there twice. {FIX}")
        if row.unit != UNITS[row.measure]:
            raise ArtefactError(
                f"{origin}: {name} is in {row.unit}, but that measure is in "
                f"{UNITS[row.measure]}. {FIX}"
            )
        if row.value is None:
            raise ArtefactError(
                f"{origin}: {name} has no value, so a walk cannot be compared with it. {FIX}"
            )
        if place in judged and judged[place] != row.value:
            raise ArtefactError(
                f"{origin}: {name} is {row.value:g} among the measures, but {judged[place]} was "
                f"judged by its limit. {FIX}"
            )
        found[place] = row.value
    for measure in _implied(metrics):
        needed = is_judged(measure_origin(measure.measure, measure.target, origins))
        name = f"{measure.measure} of {measure.target}"
        # popped, so that what is left in the end follows from nothing in the file
        stored = found.pop((measure.measure, measure.target), None)
        is_new = known is not None and measure.measure not in known
        if stored is None and (is_new or not needed):
            continue
        if stored is None:
            raise ArtefactError(f"{origin}: {name} is missing from the measures. {FIX}")
        expected = measure.value
        # an error is a small difference of large stored numbers, each rounded to six digits
        if expected is not None and _differ(
            stored, expected, DIFFERENCE if measure.measure.endswith("_error") else 0.1 * AGREES
        ):
            raise ArtefactError(
                f"{origin}: {name} is {stored:g}, but {expected:.6g} follows from the curves and "
                f"counts in the same file. {FIX}"
            )
    for kind, target in found:
        raise ArtefactError(
            f"{origin}: {kind} of {target} is among the measures, but nothing in the file says "
            f"that it was measured. {FIX}"
        )


def _differ(stored: float, expected: float, slack: float) -> bool:
    # so written, a NaN differs from everything
    return not abs(stored - expected) <= AGREES * abs(expected) + slack


def _check_curves(metrics: Metrics, origin: str) -> None:
    """The errors of curves are those of the stored curves."""
    walk = metrics.walk
    for kind, name, error in walk.errors.items():
        mean = walk.curves.of(kind)[name].mean
        if error is None or mean is None:
            raise ArtefactError(
                f"{origin}: there is no simulated {name} ({kind}), so no walk can be compared "
                f"with it. {FIX}"
            )
        rmse = rms(array(mean) - array(metrics.record.curves.of(kind)[name]))
        if error.rmse is None or _differ(error.rmse, rmse, 0.1 * AGREES):
            raise ArtefactError(
                f"{origin}: the RMSE of {name} ({kind}) is {error.rmse:g}, but that of the "
                f"curves in the same file is {rmse:.6g}. {FIX}"
            )


def _implied(metrics: Metrics) -> list[Measure]:
    """The measures that a file must have, with the values that follow from the rest of the file."""
    walk = metrics.walk
    only_in_the_walk = [
        # the file has no unfiltered or uncut data, from which these would follow
        *(measured("unfiltered_force_rmse", f"vertical_{side}", None) for side in "rl"),
        *(measured(*each, None) for each in (*UNRECORDED, *TORQUES)),
    ]
    (width,) = (row for row in walk.spatiotemporal if row.name == "step_width")
    return [
        *rmse_measures(walk.errors),
        *skill_measures(walk.errors, metrics.predictions),
        *only_in_the_walk,
        # against other people's it is in leg lengths, which the file does not have
        step_width_measure(width.mean, np.nan, width.recorded),
        *quantity_measures(stored_quantities(walk), stored_quantities(metrics.record)),
        *centre_of_mass_measures(
            None if walk.centre_of_mass is None else np.array(walk.centre_of_mass),
            np.array(metrics.record.centre_of_mass),
        ),
        *(
            measured(*each)
            for each in side_values(
                from_kinds(
                    (kind, name, each.mean or ()) for kind, name, each in walk.curves.items()
                ),
                from_kinds(metrics.record.curves.items()),
            )
        ),
        *spatiotemporal_measures(walk.spatiotemporal),
        *endurance_measures(walk.starts),
        measured("epsilon", "walk", walk.epsilon.total if walk.epsilon else None),
        *push_measures(metrics.push_recovery),
    ]
