"""Lengths of a body from a tape measure and the stature, without markers.

| measure | where | when not measured |
|---|---|---|
| hip_height | greater trochanter to the floor, standing | ankle height + shank + thigh |
| thigh | greater trochanter to lateral femoral epicondyle | `THIGH` of stature |
| shank | lateral femoral epicondyle to lateral malleolus | `SHANK` of stature |
| ankle_height | lateral malleolus to the floor | 0.039 of stature (Winter) x `ANKLE_FACTOR` |
| foot | heel to the longest toe | 0.152 of stature (Winter) |
| pelvis_width | between the right and left ASIS | `PELVIS_WIDTH` of stature |

The lateral bony points of the legs are at the height of the joint centres, so distances between
them are taken as lengths between joint centres. If the hip height is measured, unmeasured leg
lengths share the rest of it in these proportions. One set of lengths serves both legs.
"""

import math
from typing import Final

from gaitval.errors import ScalingError
from gaitval.scaling.measurements import Measurements
from gaitval.scaling.stature import FRACTIONS, SOURCES, mean_lengths, measurements_of_lengths

AGREEMENT: Final = 0.05
"""Largest plausible difference between a measured hip height and the sum of the measured lengths,
m; people do not stand with perfectly straight legs, and the trochanter can be palpated to within 2
cm."""

PLAUSIBLE: Final = {"ankle_height": (0.6, 1.6), "pelvis_width": (0.6, 1.6)}
"""Measured / expected; for the other measures it is `PLAUSIBLE_LENGTH`."""
PLAUSIBLE_LENGTH: Final = (0.75, 1.33)


def measure_by_tape(
    *,
    height_m: float,
    hip_height: float | None = None,
    thigh: float | None = None,
    shank: float | None = None,
    ankle_height: float | None = None,
    foot: float | None = None,
    pelvis_width: float | None = None,
) -> Measurements:
    """Lengths of a body from a tape measure; the stature gives what was not measured.

    Parameters
    ----------
    height_m : stature, m.
    hip_height, thigh, shank, ankle_height, foot, pelvis_width : m; see the table at the top of the
        module.

    Returns
    -------
    Measurements : right and left alike; `sources` says how each length was found.

    Raises
    ------
    ScalingError : a length is not plausible for the stature (all are listed), or hip height and
        leg lengths contradict each other.
    """
    given = {
        "hip_height": hip_height, "thigh": thigh, "shank": shank, "ankle_height": ankle_height,
        "foot": foot, "pelvis_width": pelvis_width,
    }  # fmt: skip
    measured = {name: value for name, value in given.items() if value is not None}
    expected = mean_lengths(height_m)
    problems = [why for n, value in measured.items() if (why := _problem(n, value, expected[n]))]
    if problems:
        raise ScalingError(
            f"these lengths are implausible for a stature of {height_m:.3f} m:\n"
            "  " + "\n  ".join(problems) + "\nGive metres, and check where each was measured."
        )
    used = {name: measured.get(name, value) for name, value in expected.items()}
    sources = SOURCES | {name.replace("_", " "): "tape" for name in measured}
    if hip_height is None:
        used["hip_height"] = used["ankle_height"] + used["shank"] + used["thigh"]
    else:
        used |= _share(hip_height, used, measured)
        sources |= {
            name: "hip height by tape, shared as in WBDS"
            for name in ("thigh", "shank")
            if name not in measured
        }
    return measurements_of_lengths(used, sources)


def _problem(name: str, value: float, expected: float) -> str:
    low, high = PLAUSIBLE.get(name, PLAUSIBLE_LENGTH)
    if low <= value / expected <= high:
        return ""
    return (
        f"{name} = {value:g} m: about {expected:.3f} m is expected (plausible: "
        f"{low * expected:.3f} to {high * expected:.3f})."
    )


def _share(
    hip_height: float, used: dict[str, float], measured: dict[str, float]
) -> dict[str, float]:
    """Thigh and shank lengths that make the leg as long as measured."""
    open_ = [name for name in ("thigh", "shank") if name not in measured]
    rest = hip_height - used["ankle_height"]
    if not open_:
        total = used["ankle_height"] + used["shank"] + used["thigh"]
        if abs(hip_height - total) > AGREEMENT:
            raise ScalingError(
                f"hip_height = {hip_height:.3f} m, but ankle height, shank and thigh add up to "
                f"{total:.3f} m. Measure again: they are measured between the trochanter, the "
                "lateral epicondyle of the knee, the lateral malleolus and the floor."
            )
        return {}
    rest -= math.fsum(used[name] for name in ("thigh", "shank") if name in measured)
    total = math.fsum(FRACTIONS[name] for name in open_)
    shares = {name: rest * FRACTIONS[name] / total for name in open_}
    expected = {
        name: FRACTIONS[name] * used["hip_height"] / FRACTIONS["hip_height"] for name in open_
    }
    low, high = PLAUSIBLE_LENGTH
    problems = [
        f"{name}: only {value:.3f} m is left for it"
        for name, value in shares.items()
        if not low <= value / expected[name] <= high
    ]
    if problems:
        raise ScalingError(
            f"hip_height = {hip_height:.3f} m does not agree with the other lengths of the leg:\n  "
            + "\n  ".join(problems)
            + "\nMeasure again, in metres."
        )
    return shares
