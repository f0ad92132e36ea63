"""Whether stored metrics can be believed: complete, finite, and in agreement with themselves.

A baseline that is damaged, or mended by hand, would let every later walk pass. What a file says of
a walk is there more than once: errors follow from the curves, measures from errors, cycles and
pushes. All of it is worked out again and compared.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from gaitval.errors import ArtefactError
from gaitval.metrics.comparison import rms
from gaitval.metrics.joint_power import JointPower, power_measures
from gaitval.metrics.origin import is_judged, measure_origin, origins_in
from gaitval.metrics.results import check_metrics
from gaitval.metrics.rollouts import Endurance
from gaitval.metrics.tolerances import UNITS, Measure
from gaitval.metrics.unrecorded import NOTHING
from gaitval.metrics.validation import (
    RMSE,
    endurance_measures,
    push_measures,
    skill_measures,
    spatiotemporal_measures,
)
from gaitval.metrics.whole_body import whole_body_measures

AGREES: Final = 1e-3
"""Relative; stored numbers have six digits, and an error of curves that nearly agree loses some."""
DIFFERENCE: Final = 1e-3
"""In the unit of a difference of stored numbers: the errors of speed, stance and steps."""

MEND: Final = (
    "Restore the file, for instance with `git checkout`, or store the baseline again with "
    "`gaitval baseline SUBJECT`."
)

Json = Mapping[str, Any]


def believe(metrics: Json, origin: str, *, fewer: bool = False) -> None:
    """Raise ArtefactError where stored metrics are incomplete or contradict themselves.

    Parameters
    ----------
    metrics : content of `metrics.json`.
    origin : the file, for the message.
    fewer : measures may be missing.
    """
    check_metrics(metrics, origin)
    _check_curves(metrics, origin)
    judged = {(row["measure"], row["target"]): row["value"] for row in metrics["tolerances"]}
    origins = origins_in(metrics)
    for kind, target in judged:
        if not is_judged(measure_origin(kind, target, origins)):
            raise ArtefactError(
                f"{origin}: {kind} of {target} has a verdict, but what it is compared with was not "
                f"recorded. {MEND}"
            )
    found: dict[tuple[str, str], float] = {}
    for row in metrics["measures"]:
        name = f"{row['measure']} of {row['target']}"
        place = (row["measure"], row["target"])
        if place in found:
            raise ArtefactError(f"{origin}: {name} is there twice. {MEND}")
        if row["unit"] != UNITS[row["measure"]]:
            raise ArtefactError(
                f"{origin}: {name} is in {row['unit']}, but that measure is in "
                f"{UNITS[row['measure']]}. {MEND}"
            )
        if row["value"] is None or not math.isfinite(row["value"]):
            raise ArtefactError(
                f"{origin}: {name} has no value, so a walk cannot be compared with it. {MEND}"
            )
        if place in judged and judged[place] != row["value"]:
            raise ArtefactError(
                f"{origin}: {name} is {row['value']:g} among the measures, but {judged[place]} was "
                f"judged by its limit. {MEND}"
            )
        found[place] = row["value"]
    for measure in _implied(metrics):
        needed = is_judged(measure_origin(measure.measure, measure.target, origins))
        name = f"{measure.measure} of {measure.target}"
        stored = found.pop((measure.measure, measure.target), None)
        if stored is None and (fewer or not needed):
            continue
        if stored is None:
            raise ArtefactError(f"{origin}: {name} is missing from the measures. {MEND}")
        expected = measure.value
        if expected is not None and _differ(
            stored, expected, DIFFERENCE if measure.measure.endswith("_error") else 0.1 * AGREES
        ):
            raise ArtefactError(
                f"{origin}: {name} is {stored:g}, but {expected:.6g} follows from the curves and "
                f"counts in the same file. {MEND}"
            )
    for kind, target in found:
        raise ArtefactError(
            f"{origin}: {kind} of {target} is among the measures, but nothing in the file says "
            f"that it was measured. {MEND}"
        )


def _differ(stored: float, expected: float, slack: float) -> bool:
    return not abs(stored - expected) <= AGREES * abs(expected) + slack


def _check_curves(metrics: Json, origin: str) -> None:
    """The errors of curves are those of the stored curves."""
    walk = metrics["walks"][metrics["final"]]
    for kind, errors in walk["errors"].items():
        for name, error in errors.items():
            mean = walk["curves"][kind][name]["mean"]
            if error is None or mean is None:
                raise ArtefactError(
                    f"{origin}: there is no simulated {name} ({kind}), so no walk can be compared "
                    f"with it. {MEND}"
                )
            recorded = metrics["record"]["curves"][kind][name]
            rmse = rms(np.array(mean, dtype=float) - np.array(recorded, dtype=float))
            if _differ(error["rmse"], rmse, 0.1 * AGREES):
                raise ArtefactError(
                    f"{origin}: the RMSE of {name} ({kind}) is {error['rmse']:g}, but that of the "
                    f"curves in the same file is {rmse:.6g}. {MEND}"
                )


def _implied(metrics: Json) -> list[Measure]:
    """The measures that a file must have, with their values where the file tells them too."""
    walk = metrics["walks"][metrics["final"]]
    starts = tuple(Endurance.from_dict(start) for start in walk["starts"])
    only_in_the_walk = [
        *(Measure("unfiltered_force_rmse", f"vertical_{side}", None) for side in "rl"),
        *(replace(measure, value=None) for measure in NOTHING.measures()),
        Measure("step_width", "walk", None),
    ]
    return [
        *(
            Measure(RMSE[kind], name, error["rmse"])
            for kind, errors in walk["errors"].items()
            for name, error in errors.items()
        ),
        *skill_measures(walk["errors"], metrics["predictions"]),
        *only_in_the_walk,
        *_mechanics(walk, metrics["record"]),
        *spatiotemporal_measures(walk["spatiotemporal"]),
        *endurance_measures(starts),
        Measure("epsilon", "walk", walk["epsilon"]["total"] if walk["epsilon"] else None),
        *push_measures(metrics["push_recovery"]),
    ]


def _mechanics(walk: Json, record: Json) -> list[Measure]:
    """Power, work, centre of mass and loading, from what is stored of walk and record."""

    def kinetics(kinds: Json, mean: bool) -> dict[str, Any]:
        return {
            name: np.array(curve["mean"] if mean else curve, dtype=float) * scale
            for kind, scale in (("moments", 1.0), ("forces", 0.01))
            for name, curve in kinds[kind].items()
        }

    power, path = walk["joint_power"], walk["centre_of_mass"]
    return [
        *power_measures(
            None if power is None else JointPower(**power), JointPower(**record["joint_power"])
        ),
        *whole_body_measures(
            None if path is None else np.array(path),
            np.array(record["centre_of_mass"]),
            kinetics(walk["curves"], mean=True),
            kinetics(record["curves"], mean=False),
        ),
    ]
