"""What was learned of a person's body, in sentences."""

from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.identification.verdicts import Judged, judged_combinations
from gaitval.model.body import BodyModel
from gaitval_bodies.shared_errors import Shared

_LITTLE: Final = 0.9
"""Contraction from which on a record adds next to nothing."""


def sentences(found: Shared, model: BodyModel) -> str:
    """Two sentences: how long the legs are, and whether they differ.

    Parameters
    ----------
    found : of the record.
    model : the body as scaled.
    """
    leg = judged_combinations(found.posterior, model)[0]
    scaled = model.leg_length
    length = f"Legs: {100 * (scaled + leg.mean):.1f} ± {100 * leg.sd:.1f} cm, thigh and shank"
    before = f"scaled: {100 * scaled:.1f} ± {100 * leg.prior_sd:.1f}"
    added = ", so the record adds next to nothing" if leg.contraction > _LITTLE else ""
    mean, sd = found.legs.estimate
    side = "left" if mean > 0 else "right"
    differs = f"The {side} leg is longer by {1000 * abs(mean):.0f} ± {1000 * sd:.0f} mm"
    if found.legs.differ:
        said = (
            "more than people's legs differ, or that hip centre lies as much lower than the other: "
            "measure both legs, because a walk cannot tell these apart"
        )
    else:
        said = "within what people's legs differ"
    return f"{length} ({before}){added}. {differs}: {said}."


NEXT: Final = {
    "this record": (1.0, {}),
    "another trial of the session, at another speed": (1.09, {}),
    "a range-of-motion trial (hips, knees, ankles)": (
        1.0,
        {"thigh_length": 0.020, "shank_length": 0.016, "hip_x": 0.006, "hip_y": 0.006,
         "hip_z": 0.006},
    ),
}  # fmt: skip
"""Trials: by how much each multiplies what the record says, and SDs of what it measures by itself.
Trials of one session share their markers and their skin: of the variance of what three people's
trials said, 83 % was common to them, so a second one is worth 2 / (1 + 0.83). Of functional
centres it is assumed that they are within 6 mm at the hip, 5 at the knee and 4 at the ankle, so a
thigh of 40 cm within 8 mm and a shank within 6 mm."""


def next_trials(found: Shared, names: tuple[str, ...], model: BodyModel) -> list[list[str]]:
    """What each trial would leave of the prior's SD: a header and a row for each of `NEXT`.
    Calculated by adding information, not simulated.

    Parameters
    ----------
    found : of the record.
    names : parameters in the order of mu.
    model : the body as scaled.
    """
    posterior = found.posterior
    prior = np.diag(1.0 / posterior.prior_sd**2)
    told = np.linalg.inv(posterior.covariance) - prior
    shown = ("thigh_length", "shank_length", "foot_length", "hip_y")
    rows = [["trials", "leg", *shown]]
    for title, (times, measured) in NEXT.items():
        information = prior + times * told
        for name, sd in measured.items():
            information[names.index(name), names.index(name)] += 1.0 / sd**2
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        after = replace(posterior, covariance=covariance)
        leg: Judged = judged_combinations(after, model)[0]
        parts = [leg.contraction, *(after.contraction[names.index(name)] for name in shown)]
        rows.append([title, *(f"{each:.2f}" for each in parts)])
    return rows
