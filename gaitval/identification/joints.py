"""What a range-of-motion trial adds to the posterior of a body: functional hips and knees.

An import (`functional` of a session file) finds both hips' centres beside those of the regression
that the body was scaled with, their distances from the ankles, and where the knees' axes pass the
palpated centres. They are five measurements of mu: the hip forward, aside and up, hip to ankle, and
knee to ankle. A record and a range-of-motion trial are independent, so Gaussians are multiplied: it
is as if the trial's covariance had been the prior.

The standard errors that SCoRE and SARA give are not the errors: skin that follows the swing is a
movement of the segment for them. So what functional centres miss by in living people is added to
them, and what the palpation of the ankle misses by.

A measured distance is a sum of parameters: a thigh that is longer and a knee that lies lower in it
(`knee_z`) are the same leg. So no trial can distinguish thigh from knee_z; what it determines
are the distances between joint centres, `lengths`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ArtefactError
from gaitval.identification.body_fit import BodyPosterior
from gaitval.identification.combinations import Combination, combinations
from gaitval.identification.verdicts import Judged, verdict_of
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, nominal_parameters


@dataclass(frozen=True)
class JointErrors:
    """m. Errors of joint centres."""

    missed: float = 0.0134 / 3**0.5
    """m each way, of a functional hip centre, from ultrasound (Hicks and Richards 2005, Gait
    Posture 22:138: 13.4 mm in space)."""
    ankle: float = 0.005
    """m, of the ankle's height by malleoli (Della Croce et al. 2005, Gait Posture 21:226)."""
    knee: float = 0.009
    """m, of the height of a functional knee axis: of 60 people whose skin wanders by 5 mm on the
    thigh and 3 mm on the shank in the rhythm of bending, 8.6 mm."""


JOINT_ERRORS: Final = JointErrors()

_MEASURED: Final = ("hip_x", "hip_y", "hip_z")


@dataclass(frozen=True)
class FunctionalLeg:
    """Functional joints of one leg against the body as scaled.

    Attributes
    ----------
    difference : (3,) m, of the hip from the scaled centre, in axes of the pelvis: forward, left,
        up.
    longer : m, from hip to ankle, than as scaled.
    standard_error : m, of the hip in space, with half the distance of its images.
    shank_longer : m, from knee to ankle, than as scaled; None without a functional knee.
    knee_error : m, standard deviation of the knee's height.
    """

    difference: Array
    longer: float
    standard_error: float
    shank_longer: float | None = None
    knee_error: float = JOINT_ERRORS.knee


def legs_of_session(record: Mapping[str, Any], where: str) -> dict[Side, FunctionalLeg]:
    """Both legs of an import, each with the hip of the trial with the smallest error, and the knee
    of the trial in which it bent furthest. `record` is the contents of `import.json`, see
    `importing.stored.Session`; `where` is the session's folder, for messages. Raises ArtefactError
    if a hip was not found, or the body was scaled with functional hips already.
    """
    # The thigh's length may have been fitted since, which says no more of the hips.
    if any("hip functional" in each for each in record["measurements"]["sources"].values()):
        raise ArtefactError(
            f"{where}: the body was scaled with functional hips (--joint-centres functional), so "
            "its range-of-motion trial would count twice. Leave --session out, or import again "
            "without --joint-centres functional."
        )
    found: dict[Side, FunctionalLeg] = {}
    for side in SIDES:
        joints = [each for each in record["functional"] if each["side"] == side]
        hips = [
            FunctionalLeg(
                difference=np.array(hip["difference_m"]),
                longer=hip["to_ankle_m"] - hip["regression_to_ankle_m"],
                standard_error=float(np.hypot(hip["standard_error_m"], hip["images_apart_m"] / 2)),
            )
            for each in joints
            if (hip := each.get("hip"))
        ]
        if not hips:
            raise ArtefactError(
                f"{where}: no functional centre of the {side} hip. Import the session with a "
                'range-of-motion trial (functional = ["FILE"] in a session file) in which both '
                "legs swing forward, backward and aside; the import says why a hip was not found."
            )
        knees = [knee for each in joints if (knee := each.get("knee"))]
        none: Mapping[str, Any] = {}
        furthest = max(knees, key=lambda knee: float(knee["ranges_deg"][0]), default=none)
        found[side] = replace(
            min(hips, key=lambda hip: hip.standard_error), shank_longer=furthest.get("higher_m")
        )
    return found


def lengths(model: BodyModel) -> tuple[Combination, ...]:
    """The combinations of a posterior (`verdicts.combinations`), then the distances from hip to
    knee and from knee to ankle of the body as scaled, m.
    """
    leg, reach = combinations(model)
    thigh, shank = np.zeros(len(PARAMETERS)), np.zeros(len(PARAMETERS))
    for weights, name, below in ((thigh, "thigh_length", "knee_z"),
                                 (shank, "shank_length", "ankle_z")):  # fmt: skip
        for each in (name, below):
            weights[PARAMETERS.index(each)] = reach.weights[PARAMETERS.index(each)]
    return (
        leg,
        reach,
        Combination("hip to knee", "m", thigh),
        Combination("knee to ankle", "m", shank),
    )


def judged_lengths(posterior: BodyPosterior, model: BodyModel) -> tuple[Judged, ...]:
    """The `lengths` of the body `model` with their verdicts."""
    found = []
    for each in lengths(model):
        prior_sd = float(np.linalg.norm(each.weights * posterior.prior_sd))
        sd = float(np.sqrt(each.weights @ posterior.covariance @ each.weights))
        mean = float(each.weights @ (posterior.mean - posterior.prior_mean))
        found.append(Judged(each.name, 0.0, prior_sd, mean, sd, verdict_of(sd / prior_sd)))
    return tuple(found)


def with_joints(
    posterior: BodyPosterior, model: BodyModel, legs: Mapping[Side, FunctionalLeg]
) -> BodyPosterior:
    """The posterior of record and range-of-motion trial together: that of the record (`posterior`),
    about the `model` as scaled, with the `legs` of both sides. Their mean counts, because mu is
    common to them; knees count if both have one.
    """
    knees = all(leg.shank_longer is not None for leg in legs.values())
    values, covariance = np.zeros(5), np.zeros((5, 5))
    for side in SIDES:
        leg = legs[side]
        # mu counts to the left for the right leg and mirrors the left one.
        mirrored = leg.difference * [1.0, 1.0 if side == "right" else -1.0, 1.0]
        values += np.array([*mirrored, leg.longer, leg.shank_longer or 0.0]) / len(SIDES)
        variance = JOINT_ERRORS.missed**2 + leg.standard_error**2 / 3.0
        one = np.diag(
            [
                *3 * [variance],
                variance + JOINT_ERRORS.ankle**2,
                leg.knee_error**2 + JOINT_ERRORS.ankle**2,
            ]
        )
        # A hip that is found too high is too far from the ankle by as much, and an ankle that is
        # found too low from both.
        one[2, 3] = one[3, 2] = variance
        one[3, 4] = one[4, 3] = JOINT_ERRORS.ankle**2
        covariance += one / len(SIDES) ** 2
    observed = np.zeros((5, len(PARAMETERS)))
    observed[range(3), [PARAMETERS.index(name) for name in _MEASURED]] = 1.0
    observed[3], observed[4] = (lengths(model)[index].weights for index in (1, 3))
    kept = slice(0, 5 if knees else 4)
    observed, values, covariance = observed[kept], values[kept], covariance[kept, kept]
    before = posterior.covariance
    gain = before @ observed.T @ np.linalg.inv(observed @ before @ observed.T + covariance)
    left = values - observed @ (posterior.mean - nominal_parameters())
    after = before - gain @ observed @ before
    return replace(posterior, mean=posterior.mean + gain @ left, covariance=(after + after.T) / 2)
