"""What a range-of-motion trial adds to the posterior of a body: functional hip centres.

An import (`gaitval import --functional`) finds both hips' centres beside those of the regression
that the body was scaled with, and their distances from the ankles. They are four measurements of
mu: the hip forward, aside and up, and hip to ankle. A record and a range-of-motion trial are
independent, so Gaussians are multiplied: it is as if the trial's covariance had been the prior.

The standard error that SCoRE gives is not the error: skin that follows the swing is a movement of
the segment for it. So what functional centres miss by in living people is added to it, and what the
palpation of the ankle misses by.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ArtefactError
from gaitval.identification.body_fit import BodyPosterior
from gaitval.identification.verdicts import combinations
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, nominal_parameters

MISSED: Final = 0.0134 / 3**0.5
"""m each way, of a functional hip centre, from ultrasound (Hicks and Richards 2005, Gait Posture
22:138: 13.4 mm in space)."""
ANKLE: Final = 0.005
"""m, of the ankle's height by malleoli (Della Croce et al. 2005, Gait Posture 21:226)."""
_MEASURED: Final = ("hip_x", "hip_y", "hip_z")


@dataclass(frozen=True)
class FunctionalHip:
    """One functional hip against the body as scaled.

    Attributes
    ----------
    difference : (3,) m, from the scaled centre, in axes of the pelvis: forward, left, up.
    longer : m, from hip to ankle, than as scaled.
    standard_error : m, of the centre in space, with half the distance of its images.
    """

    difference: Array
    longer: float
    standard_error: float


def hips_of_session(record: Mapping[str, Any], where: str) -> dict[Side, FunctionalHip]:
    """Both hips of an import, each of the trial with the smallest error.

    Parameters
    ----------
    record : contents of `import.json`, see `session.stored.Session`.
    where : the session's folder, for messages.

    Raises
    ------
    ArtefactError : a hip was not found, or the body was scaled with functional hips already.
    """
    if "hip functional" in record["measurements"]["sources"].get("thigh", ""):
        raise ArtefactError(
            f"{where}: the body was scaled with functional hips (--hip-centre functional), so its "
            "range-of-motion trial would count twice. Leave --session out, or import again without "
            "--hip-centre functional."
        )
    found: dict[Side, FunctionalHip] = {}
    for side in SIDES:
        hips = [
            FunctionalHip(
                difference=np.array(hip["difference_m"]),
                longer=hip["to_ankle_m"] - hip["regression_to_ankle_m"],
                standard_error=float(np.hypot(hip["standard_error_m"], hip["images_apart_m"] / 2)),
            )
            for each in record["functional"]
            if each["side"] == side and (hip := each.get("hip"))
        ]
        if not hips:
            raise ArtefactError(
                f"{where}: no functional centre of the {side} hip. Import the session with "
                "--functional FILE, a range-of-motion trial in which both legs swing forward, "
                "backward and aside; the import says why a hip was not found."
            )
        found[side] = min(hips, key=lambda hip: hip.standard_error)
    return found


def with_joints(
    posterior: BodyPosterior, model: BodyModel, hips: Mapping[Side, FunctionalHip]
) -> BodyPosterior:
    """The posterior of record and range-of-motion trial together.

    Parameters
    ----------
    posterior : of the record.
    model : the body as scaled.
    hips : of both sides; their mean counts, because mu is common to them.
    """
    values, covariance = np.zeros(4), np.zeros((4, 4))
    for side in SIDES:
        hip = hips[side]
        # mu counts to the left for the right leg and mirrors the left one.
        mirrored = hip.difference * [1.0, 1.0 if side == "right" else -1.0, 1.0]
        values += np.array([*mirrored, hip.longer]) / len(SIDES)
        variance = MISSED**2 + hip.standard_error**2 / 3.0
        one = variance * np.eye(4)
        one[3, 3] += ANKLE**2
        # A hip that is found too high is too far from the ankle by as much.
        one[2, 3] = one[3, 2] = variance
        covariance += one / len(SIDES) ** 2
    told = np.zeros((4, len(PARAMETERS)))
    told[range(3), [PARAMETERS.index(name) for name in _MEASURED]] = 1.0
    told[3] = combinations(model)[1].weights
    before = posterior.covariance
    gain = before @ told.T @ np.linalg.inv(told @ before @ told.T + covariance)
    left = values - told @ (posterior.mean - nominal_parameters())
    after = before - gain @ told @ before
    return replace(posterior, mean=posterior.mean + gain @ left, covariance=(after + after.T) / 2)
