"""A range-of-motion trial narrows the posterior of the hip and of the leg, for both sides alike."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.coordinates import COORDINATES
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.errors import ArtefactError
from gaitval.identification.body_fit import BodyPosterior
from gaitval.identification.joints import (
    JOINT_ERRORS,
    FunctionalLeg,
    judged_lengths,
    legs_of_session,
    lengths,
    with_joints,
)
from gaitval.identification.prior import prior_sd
from gaitval.identification.verdicts import IDENTIFIED
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import ROOT_DOFS, segment_frames
from gaitval.scaling.joint_centres import locate, measure
from gaitval.scaling.measurements import with_fitted_lengths
from gaitval.scaling.scaling import scale_subject

SUBJECT = load_subject("S05")
MODEL = scale_subject(SUBJECT).model


def unseen() -> BodyPosterior:
    """The prior, as if there were no record."""
    sd, none = prior_sd(SUBJECT), np.zeros(0)
    return BodyPosterior(
        mean=nominal_parameters(), covariance=np.diag(sd**2), prior_mean=nominal_parameters(),
        prior_sd=sd, log_posterior=0.0, plates=np.zeros(2), extended_mean=none, extended_sd=none,
    )  # fmt: skip


def legs(forward=0.0, out=0.0, longer=0.0, shank=None, error=JOINT_ERRORS.knee):
    """Of a person whose legs both are so."""
    return {
        side: FunctionalLeg(np.array([forward, sign * out, 0.0]), longer, 0.0, shank, error)
        for side, sign in (("right", -1.0), ("left", 1.0))
    }


def test_a_hip_that_lies_forward_and_further_out_is_moved_by_what_the_trial_knows():
    found = with_joints(unseen(), MODEL, legs(forward=0.01, out=0.01))
    error = JOINT_ERRORS.missed / np.sqrt(2)
    kept = 0.01**2 / (0.01**2 + error**2)
    hip = PARAMETERS.index("hip_x")
    assert found.mean[hip] == pytest.approx(0.01 * kept)
    # to the left is inwards for the right leg
    assert found.mean[hip + 1] == pytest.approx(-0.01 * kept)
    assert found.sd[hip] == pytest.approx(error * np.sqrt(kept))


def test_a_longer_leg_is_shared_among_what_makes_it():
    found = with_joints(unseen(), MODEL, legs(longer=0.02))
    leg, reach = judged_lengths(found, MODEL)[:2]
    assert 0.0 < leg.mean < reach.mean < 0.02
    assert reach.sd == pytest.approx(
        np.hypot(JOINT_ERRORS.missed, JOINT_ERRORS.ankle) / np.sqrt(2), rel=0.15
    )
    foot = PARAMETERS.index("foot_length")
    assert found.sd[foot] == prior_sd(SUBJECT)[foot]


def test_a_knee_that_is_known_tells_shank_from_thigh_and_no_more_of_the_leg():
    without, known = (
        with_joints(unseen(), MODEL, legs(longer=0.02, shank=shank, error=0.001))
        for shank in (None, 0.02)
    )
    before, after = judged_lengths(without, MODEL), judged_lengths(known, MODEL)
    reach, thigh, shank = after[1:]
    assert shank.sd < JOINT_ERRORS.ankle / np.sqrt(2)
    assert shank.mean == pytest.approx(0.02, abs=0.003)
    assert reach.mean == pytest.approx(thigh.mean + shank.mean)
    assert reach.sd == pytest.approx(before[1].sd, rel=0.1)
    # what the knee is too low in the thigh, the thigh is too short: only their sum is seen
    alone = known.sd[PARAMETERS.index("thigh_length")]
    assert alone / prior_sd(SUBJECT)[PARAMETERS.index("thigh_length")] > 0.4


def test_errors_of_hip_and_ankle_are_in_all_that_is_measured_from_them():
    """A hip that is found too high is as much too far from its ankle, and an ankle that is found
    too low from hip and knee: with nothing known before, what is left is those errors."""
    wide = replace(unseen(), covariance=np.diag((1e3 * prior_sd(SUBJECT)) ** 2))
    images = 0.006
    known = {
        side: replace(leg, standard_error=images)
        for side, leg in legs(shank=0.0).items()
    }  # fmt: skip
    found = with_joints(wide, MODEL, known)
    message = np.zeros((5, len(PARAMETERS)))
    message[range(3), [PARAMETERS.index(f"hip_{axis}") for axis in "xyz"]] = 1.0
    message[3], message[4] = (lengths(MODEL)[index].weights for index in (1, 3))
    # columns: hip forward, aside and up, ankle down, knee up
    errors = np.array(
        [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 1, 1, 0], [0, 0, 0, 1, 1]]
    )
    hip_error = JOINT_ERRORS.missed**2 + images**2 / 3.0  # each way
    one = (
        errors @ np.diag([*3 * [hip_error], JOINT_ERRORS.ankle**2, JOINT_ERRORS.knee**2]) @ errors.T
    )
    left = message @ found.covariance @ message.T
    np.testing.assert_allclose(left, one / 2.0, rtol=1e-3, atol=1e-9)


def test_a_trial_is_compared_with_the_body_as_scaled_wherever_the_prior_is():
    """What is wrong on everybody moves the prior; joints are where scaling put them, or not."""
    hip = PARAMETERS.index("hip_x")
    moved = nominal_parameters()
    moved[hip] += 0.01
    sd = prior_sd(SUBJECT)[hip]
    kept = sd**2 / (sd**2 + JOINT_ERRORS.missed**2 / 2.0)
    found = with_joints(replace(unseen(), mean=moved, prior_mean=moved), MODEL, legs())
    assert found.mean[hip] == pytest.approx(0.01 * (1.0 - kept))


def test_lengths_are_the_slopes_of_distances_in_the_body():
    """Of straight legs, mean of both sides, by every parameter."""

    def heights(mu):
        frames = segment_frames(apply_parameters(MODEL, mu), np.zeros((1, len(COORDINATES))))[0]
        return [
            np.mean([frames[SEGMENTS.index(f"{name}_{side}"), 2, 3] for side in "rl"])
            for name in ("thigh", "shank", "foot")
        ]

    nominal, step = nominal_parameters(), 1e-3
    slopes = np.array(
        [
            (np.array(heights(nominal + each)) - heights(nominal - each)) / (2.0 * step)
            for each in step * np.eye(len(PARAMETERS))
        ]
    )
    hip, knee, ankle = slopes.T
    reach, thigh, shank = lengths(MODEL)[1:]
    for found, slope in ((reach, hip - ankle), (thigh, hip - knee), (shank, knee - ankle)):
        np.testing.assert_allclose(found.weights, slope, atol=1e-9)


def test_one_knee_alone_does_not_count():
    both = legs(longer=0.02, shank=0.02)
    one = both | {"left": legs(longer=0.02)["left"]}
    expected = with_joints(unseen(), MODEL, legs(longer=0.02))
    np.testing.assert_allclose(with_joints(unseen(), MODEL, one).mean, expected.mean)
    assert not np.allclose(with_joints(unseen(), MODEL, both).mean, expected.mean)


def places(mu, poses):
    """Of all joints and of the sole in these poses, m, in one row."""
    body = apply_parameters(MODEL, mu)
    frames = segment_frames(body, poses)[:, :, :3]
    ground = [
        frames[:, SEGMENTS.index(each.segment)] @ np.append(each.position, 1.0)
        for each in body.spheres
    ]
    return np.concatenate([frames[..., 3].ravel(), np.ravel(ground)])


@pytest.mark.parametrize("scaled_by", ["markers", "stature"])
def test_places_of_joints_in_any_pose_tell_all_lengths_and_offsets_but_two_sums(scaled_by):
    subject = SUBJECT if scaled_by == "markers" else SUBJECT.model_copy(update={"markers": {}})
    poses = np.zeros((20, len(COORDINATES)))
    poses[:, ROOT_DOFS:] = np.random.default_rng(0).uniform(-0.5, 0.5, poses[:, ROOT_DOFS:].shape)
    mu, step = nominal_parameters(), 1e-4
    slopes = np.stack([(places(mu + each, poses) - places(mu - each, poses)) / (2 * step)
                       for each in step * np.eye(len(mu))], axis=1)  # fmt: skip
    sizes = prior_sd(subject)
    _, values, rows = np.linalg.svd(slopes * sizes)
    # damping, friction, and what a thigh and a shank are longer while knee and ankle are higher
    unseen = rows[values < 1e-6 * values[0]]
    left = dict(zip(PARAMETERS, np.sqrt(np.sum(unseen**2, axis=0)), strict=True))
    assert len(unseen) == 4
    pairs = {"damping", "friction", "thigh_length", "knee_z", "shank_length", "ankle_z"}
    assert {name for name, each in left.items() if each > 1e-6} == pairs
    # so however well joints are found, neither of a pair is identified
    assert min(left[name] for name in pairs) > IDENTIFIED


def hip(side, error, forward):
    return {
        "trial": "rom.c3d", "side": side, "joint": "hip", "refused": "",
        "hip": {
            "difference_m": [forward, 0.0, 0.0], "standard_error_m": error,
            "images_apart_m": 0.0, "to_ankle_m": 0.81, "regression_to_ankle_m": 0.80,
        },
    }  # fmt: skip


def knee(side, bent, higher):
    """Without `higher_m` if it is None, as an import before had it."""
    found = {"ranges_deg": [bent, 5.0, 3.0]} | ({} if higher is None else {"higher_m": higher})
    return {"trial": "rom.c3d", "side": side, "joint": "knee", "refused": "", "knee": found}


def session(*joints):
    return {"measurements": {"sources": {"thigh": "markers"}}, "functional": list(joints)}


def test_of_several_trials_of_a_session_the_best_counts():
    joints = [hip("right", 0.004, 0.02), hip("right", 0.002, 0.01), hip("left", 0.003, 0.0)]
    found = legs_of_session(session(*joints), "here")
    assert found["right"].difference[0] == 0.01
    assert found["left"].longer == pytest.approx(0.01)


def test_images_of_a_hip_that_are_apart_are_an_error_of_half_as_much():
    joints = [hip(side, 0.003, 0.0) for side in ("right", "left")]
    joints[0]["hip"]["images_apart_m"] = 0.008
    found = legs_of_session(session(*joints), "here")
    assert found["right"].standard_error == pytest.approx(0.005)
    assert found["left"].standard_error == pytest.approx(0.003)


def test_the_knee_that_bent_furthest_counts():
    joints = [hip(side, 0.002, 0.0) for side in ("right", "left")]
    joints += [knee("right", 60.0, 0.02), knee("right", 90.0, 0.01), knee("left", 80.0, None)]
    found = legs_of_session(session(*joints), "here")
    assert found["right"].shank_longer == 0.01
    assert found["left"].shank_longer is None


def test_a_hip_that_is_missing_or_counts_already_is_said():
    with pytest.raises(ArtefactError, match="left hip"):
        legs_of_session(session(hip("right", 0.002, 0.0), knee("left", 80.0, 0.0)), "here")
    # What an import stores: hips as measured, and a thigh that was fitted to the walk since.
    subject = next(each for each in builtin_subjects() if each.markers)
    points = locate(subject.markers)
    hips = {name: points[name] for name in ("R.Hip.Centre", "L.Hip.Centre")}
    measured = measure(subject.markers, centres=hips)
    fitted = with_fitted_lengths(measured, {"thigh": measured.right.thigh}, "joint fit")
    assert fitted.sources["thigh"] == "joint fit"
    for each in (measured, fitted):
        stored = {**session(), "measurements": each.to_dict()}
        with pytest.raises(ArtefactError, match="count twice"):
            legs_of_session(stored, "here")
