"""A range-of-motion trial narrows the posterior of the hip and of the leg, for both sides alike."""

import numpy as np
import pytest

from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ArtefactError
from gaitval.identification.body_fit import BodyPosterior
from gaitval.identification.prior import prior_sd
from gaitval.identification.verdicts import judged_combinations
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval_bodies.joints import (
    ANKLE,
    MISSED,
    FunctionalHip,
    hips_of_session,
    with_joints,
)

SUBJECT = load_subject("S05")
MODEL = scale_subject(SUBJECT).model


def unseen() -> BodyPosterior:
    """The prior, as if there were no record."""
    sd, none = prior_sd(SUBJECT), np.zeros(0)
    return BodyPosterior(
        mean=nominal_parameters(), covariance=np.diag(sd**2), prior_mean=nominal_parameters(),
        prior_sd=sd, log_posterior=0.0, plates=np.zeros(2), extended_mean=none, extended_sd=none,
    )  # fmt: skip


def hips(forward=0.0, out=0.0, longer=0.0):
    """Of a person whose hips both lie so."""
    return {
        side: FunctionalHip(np.array([forward, sign * out, 0.0]), longer, 0.0)
        for side, sign in (("right", -1.0), ("left", 1.0))
    }


def test_a_hip_that_lies_forward_and_further_out_is_moved_by_what_the_trial_knows():
    found = with_joints(unseen(), MODEL, hips(forward=0.01, out=0.01))
    error = MISSED / np.sqrt(2)
    kept = 0.01**2 / (0.01**2 + error**2)
    hip = PARAMETERS.index("hip_x")
    assert found.mean[hip] == pytest.approx(0.01 * kept)
    # to the left is inwards for the right leg
    assert found.mean[hip + 1] == pytest.approx(-0.01 * kept)
    assert found.sd[hip] == pytest.approx(error * np.sqrt(kept))


def test_a_longer_leg_is_shared_among_what_makes_it():
    found = with_joints(unseen(), MODEL, hips(longer=0.02))
    leg, reach = judged_combinations(found, MODEL)
    assert 0.0 < leg.mean < reach.mean < 0.02
    assert reach.sd == pytest.approx(np.hypot(MISSED, ANKLE) / np.sqrt(2), rel=0.15)
    foot = PARAMETERS.index("foot_length")
    assert found.sd[foot] == prior_sd(SUBJECT)[foot]


def hip(side, error, forward):
    return {
        "trial": "rom.c3d", "side": side, "joint": "hip", "refused": "",
        "hip": {
            "difference_m": [forward, 0.0, 0.0], "standard_error_m": error,
            "images_apart_m": 0.0, "to_ankle_m": 0.81, "regression_to_ankle_m": 0.80,
        },
    }  # fmt: skip


def session(*joints, thigh="markers"):
    return {"measurements": {"sources": {"thigh": thigh}}, "functional": list(joints)}


def test_of_several_trials_of_a_session_the_best_counts():
    joints = [hip("right", 0.004, 0.02), hip("right", 0.002, 0.01), hip("left", 0.003, 0.0)]
    found = hips_of_session(session(*joints), "here")
    assert found["right"].difference[0] == 0.01
    assert found["left"].longer == pytest.approx(0.01)


def test_a_hip_that_is_missing_or_counts_already_is_said():
    knee = {"trial": "rom.c3d", "side": "left", "joint": "knee", "refused": "", "knee": {}}
    with pytest.raises(ArtefactError, match="left hip"):
        hips_of_session(session(hip("right", 0.002, 0.0), knee), "here")
    used = session(thigh="markers, hip functional (Ehrig 2006)")
    with pytest.raises(ArtefactError, match="count twice"):
        hips_of_session(used, "here")
