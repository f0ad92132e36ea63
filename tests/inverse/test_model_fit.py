"""The joint fit of lengths, marker places and poses: made-up bodies back, and recorded walks."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from marked_walk import LEG_SEGMENTS, moving_walk, spread_markers
from scipy.spatial.transform import Rotation

from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.errors import ModelError, RecordError, ScalingError
from gaitval.gait.filters import low_pass
from gaitval.inverse import model_fit as module
from gaitval.inverse.inverse_kinematics import (
    inverse_kinematics,
    marker_errors,
    marker_positions,
    place,
)
from gaitval.inverse.marker_placement import place_markers
from gaitval.inverse.model_fit import ANATOMICAL_SD, LENGTH_SD, fit_model, lengths_of, with_lengths
from gaitval.mocap.axes import detect_axes
from gaitval.mocap.reading import read_recording
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.marker_sets import recognise
from gaitval.scaling.scaling import build_body

FREE = {name: (-4.0, 4.0) for name in ACTUATED}

CHANGE = {
    "thigh": 0.009,
    "shank": -0.007,
    "hip_half_width": 0.006,
    "lumbar_forward": -0.012,
    "lumbar_up": 0.010,
    "shoulder_half_width": -0.009,
    "shoulder_up": 0.012,
    "upper_arm": 0.010,
}
"""m, of the made-up body against the model; the hips' place in the pelvis is not among them,
because it is told from the pelvis's markers by their priors alone."""


def standing_pose() -> np.ndarray:
    pose = np.zeros((1, 31))
    pose[0, 5] = 0.9
    for i, name in enumerate(ACTUATED):
        pose[0, COORDINATES.index(name)] = 0.05 * np.cos(i)
    return pose


def made_up(noise: float, *, segments=SEGMENTS, change=CHANGE, misplaced=0.004, seed=0):
    """A person of other lengths than the model: the model, the markers as standing would place
    them on it, the true body and markers, and what a standing and a walking trial show."""
    random = np.random.default_rng(seed)
    model, positions = moving_walk()
    body = with_lengths(model, {k: v + change.get(k, 0.0) for k, v in lengths_of(model).items()})
    placed = spread_markers(model, segments)
    lengths = np.array([change.get(name, 0.0) for name in LENGTH_SD])
    shift = module._coupling(model, placed) @ lengths
    true = [
        replace(m, position=m.position + s + random.normal(0.0, misplaced, 3))
        for m, s in zip(placed, shift, strict=True)
    ]
    stand = marker_positions(body, true, standing_pose().repeat(20, axis=0))
    walk = marker_positions(body, true, positions)
    stand += random.normal(0.0, noise, stand.shape)
    walk += random.normal(0.0, noise, walk.shape)
    return model, placed, body, true, stand, walk


@pytest.mark.parametrize(("noise", "tolerance"), [(0.0, 0.001), (0.003, 0.005)])
def test_the_lengths_of_a_made_up_body_come_back(noise, tolerance):
    model, placed, body, _, stand, walk = made_up(noise)
    fit = fit_model(model, placed, stand, walk, ranges=FREE, soft_tissue_sd=0.0)
    assert fit.converged
    truth = lengths_of(body)
    pelvis = fit["hip_forward"].fitted, fit["hip_up"].fitted
    for name in CHANGE:
        length = fit[name]
        value = length.fitted
        if name.startswith("lumbar"):  # from the hips as they are, not from where they were
            value -= pelvis[name.endswith("up")]
        assert value == pytest.approx(truth[name], abs=tolerance), name
        assert not length.at_bound
    assert fit.rms_after < 0.2 * fit.rms_before + 1.9 * noise
    assert fit.measurement_sd == pytest.approx(max(noise, 1e-5), rel=0.1)


def test_angles_come_back_with_the_body():
    """Walking angles on the unfitted model are wrong by degrees, on the fitted one nearly right:
    what stays is the standing pose's share of the misplaced markers."""
    model, placed, body, true, stand, walk = made_up(0.0, misplaced=0.0)
    fit = fit_model(model, placed, stand, walk, ranges=FREE, soft_tissue_sd=0.0)
    exact = inverse_kinematics(body, true, walk, ranges=FREE).positions[:, 6:]
    before = inverse_kinematics(model, placed, walk, ranges=FREE).positions[:, 6:]
    after = inverse_kinematics(fit.model, fit.markers, walk, ranges=FREE).positions[:, 6:]
    assert np.degrees(np.abs(before - exact).max()) > 2.0
    assert np.degrees(np.abs(after - exact).max()) < 0.3


def test_the_standard_errors_hold():
    """Noisy trials of bodies drawn from the prior: errors are of the size of standard errors."""
    ratios = []
    model, _ = moving_walk()
    names = ("thigh", "shank", "hip_half_width")
    placement = {m.name: 0.004 for m in spread_markers(model, LEG_SEGMENTS)}
    for seed in range(6):
        random = np.random.default_rng(100 + seed)
        change = {name: random.normal(0.0, LENGTH_SD[name]) for name in names}
        _, placed, body, _, stand, walk = made_up(
            0.003, segments=LEG_SEGMENTS, change=change, seed=seed
        )
        fit = fit_model(
            model,
            placed,
            stand,
            walk[::8],
            placement_sd=placement,
            length_sd={"hip_forward": 0.0, "hip_up": 0.0},
            ranges=FREE,
            soft_tissue_sd=0.0,
        )
        ratios += [
            (fit[name].fitted - lengths_of(body)[name]) / fit[name].standard_error for name in names
        ]
    # Of 18 normal numbers the root mean square is within these in 99.9 % of cases (chi-squared).
    assert 0.51 < np.sqrt(np.mean(np.square(ratios))) < 1.56


def test_a_body_that_fits_already_stays_as_it_is():
    """Also with the soft tissue of real markers allowed for."""
    model, placed, _, _, stand, walk = made_up(0.0, change={}, misplaced=0.0)
    fit = fit_model(model, placed, stand, walk, ranges=FREE)
    for length in fit.lengths:
        assert length.fitted == pytest.approx(length.prior, abs=1e-5), length.name
    assert np.abs(fit.standing_change).max() < 1e-4
    assert fit.marker_shift.max() < 1e-4
    assert fit.rms_after < 1e-4


def test_soft_tissue_leaves_more_to_the_priors():
    model, placed, _, _, stand, walk = made_up(0.003)
    bones = fit_model(model, placed, stand, walk, ranges=FREE, soft_tissue_sd=0.0)
    skin = fit_model(model, placed, stand, walk, ranges=FREE)
    for name in ("thigh", "shank", "hip_half_width"):
        assert abs(skin[name].fitted - skin[name].prior) > 0.0
        assert abs(skin[name].fitted - skin[name].prior) < abs(CHANGE[name])
        assert skin[name].standard_error > 1.3 * bones[name].standard_error
        assert skin[name].standard_error < skin[name].prior_sd


def test_lengths_that_no_marker_shows_stay_with_their_priors():
    model, placed, _, _, stand, walk = made_up(0.003, segments=LEG_SEGMENTS)
    fit = fit_model(model, placed, stand, walk, ranges=FREE)
    for name in ("lumbar_forward", "lumbar_up", "shoulder_half_width", "shoulder_up", "upper_arm"):
        assert fit[name].fitted == pytest.approx(fit[name].prior, abs=1e-9)
        assert fit[name].standard_error == pytest.approx(LENGTH_SD[name], rel=1e-9)
    # the thigh's prior is that of the knee, and the hip adds its own
    assert fit["thigh"].prior_sd == pytest.approx(np.hypot(LENGTH_SD["thigh"], LENGTH_SD["hip_up"]))


def test_a_length_can_be_kept_and_stops_at_four_deviations():
    far = {"thigh": 0.004, "shank": 0.05}  # 8 standard deviations
    model, placed, _, _, stand, walk = made_up(0.0, segments=LEG_SEGMENTS, change=far)
    fit = fit_model(
        model,
        placed,
        stand,
        walk,
        length_sd={"thigh": 0.0},
        ranges=FREE,
        soft_tissue_sd=0.0,
    )
    assert fit["thigh"].fitted == fit["thigh"].prior
    assert (fit["thigh"].standard_error, fit["thigh"].prior_sd) == (0.0, 0.0)
    assert not fit["thigh"].at_bound
    assert fit["shank"].at_bound
    assert fit["shank"].fitted == pytest.approx(fit["shank"].prior + 4 * LENGTH_SD["shank"])


@pytest.mark.parametrize("seed", range(2))
def test_the_derivatives_are_those_of_the_model_markers(seed):
    random = np.random.default_rng(seed)
    model, _ = moving_walk()
    markers = spread_markers(model)
    tree = module.tree_arrays(model)
    shifts = module._joint_shifts()
    segment = np.array([SEGMENTS.index(m.segment) for m in markers])
    places = np.array([m.position for m in markers])
    pose = random.uniform(-0.9, 0.9, (1, 31))

    def points(pose, lengths):
        out = np.empty((1, len(markers), 3))
        place(tree.joint_position + shifts @ lengths, segment, places, pose, out)
        return out

    zero = np.zeros(len(LENGTH_SD))
    at = points(pose, zero)
    by_place = np.empty((1, len(markers), 3, 3))
    by_pose = np.zeros((1, len(markers), 3, 31))
    by_length = np.zeros((1, len(markers), 3, len(LENGTH_SD)))
    module._derivatives(
        tree.joint_position, shifts, segment, pose, at, by_place, by_pose, by_length
    )
    h = 1e-6
    wide = np.full(31, np.inf)
    for j in range(31):
        ends = np.empty((2, 1, 31))
        for end, sign in zip(ends, (1, -1), strict=True):
            module.moved(pose[0], sign * h * np.eye(31)[j], -wide, wide, end[0])
        numeric = (points(ends[0], zero) - points(ends[1], zero)) / (2 * h)
        np.testing.assert_allclose(by_pose[..., j], numeric, atol=1e-8)
    for k in range(len(LENGTH_SD)):
        step = h * np.eye(len(LENGTH_SD))[k]
        numeric = (points(pose, step) - points(pose, -step)) / (2 * h)
        np.testing.assert_allclose(by_length[..., k], numeric, atol=1e-8)
    frames = segment_frames(model, pose)[:, segment]
    np.testing.assert_allclose(by_place, frames[..., :3, :3], atol=1e-12)


@pytest.mark.parametrize("side", ["r", "l"])
def test_skin_stays_where_it_is_when_the_standing_trials_joints_move(side):
    """The places that standing gives on a body with other joints, by geometry: the thigh's frame
    has its origin at the hip and its z from the knee, and the skin does not move."""
    model, _ = moving_walk()
    hip = model[f"thigh_{side}"].joint_position
    knee = hip + model[f"shank_{side}"].joint_position
    down = np.linspace(0.0, 1.0, 5)[:, None]
    skin = hip + down * (knee - hip)  # along the thigh, seen from the pelvis as it was
    markers = [ModelMarker(f"{i}", f"thigh_{side}", at - hip) for i, at in enumerate(skin)]
    markers.append(ModelMarker("asis", "pelvis", np.array([0.08, 0.1, 0.07])))
    names = list(LENGTH_SD)
    coupling = module._coupling(model, markers)
    outwards = -1.0 if side == "r" else 1.0
    for change in (
        {"hip_up": 0.01, "thigh": 0.01},
        {"hip_forward": 0.01},
        {"hip_half_width": 0.01},
    ):
        lengths = np.array([change.get(name, 0.0) for name in names])
        moved = np.array(
            [
                change.get("hip_forward", 0.0),
                outwards * change.get("hip_half_width", 0.0),
                change.get("hip_up", 0.0),
            ]
        )
        z = hip + moved - knee
        turn, _ = Rotation.align_vectors(z[None] / np.linalg.norm(z), [[0.0, 0.0, 1.0]])
        places = turn.inv().apply(skin - hip - moved)
        expected = places - np.array([m.position for m in markers[:-1]])
        # to first order in 10 mm over the length of the thigh
        np.testing.assert_allclose(coupling[:-1] @ lengths, expected, atol=0.0003)
        # the pelvis's origin is between the hips, in the middle of the body
        np.testing.assert_allclose(
            coupling[-1] @ lengths, -moved * np.array([1.0, 0.0, 1.0]), atol=1e-12
        )
    longer = np.array([0.01 * (name == "thigh") for name in names])
    # A thigh that is longer at the knee takes the skin there along.
    np.testing.assert_allclose((coupling[:-1] @ longer)[:, 2], -0.01 * down[:, 0], atol=1e-12)


def test_the_skin_of_shank_arm_and_trunk_goes_with_their_joints():
    model, _ = moving_walk()
    ends = {"shank_r": ("foot_r", "shank"), "upper_arm_l": ("forearm_l", "upper_arm")}
    for segment, (below, length) in ends.items():
        end = ModelMarker("end", segment, model[below].joint_position)
        (row,) = module._coupling(model, [end])
        step = row @ np.array([0.01 * (name == length) for name in LENGTH_SD])
        np.testing.assert_allclose(step, [0.0, 0.0, -0.01], atol=1e-12)
    (row,) = module._coupling(model, [ModelMarker("c7", "torso", np.array([-0.1, 0.0, 0.4]))])
    lumbar = {"lumbar_forward": 0.01, "lumbar_up": 0.02}
    step = row @ np.array([lumbar.get(name, 0.0) for name in LENGTH_SD])
    np.testing.assert_allclose(step, [-0.01, 0.0, -0.02], atol=1e-12)


def test_with_lengths_gives_those_lengths_and_keeps_mass_and_symmetry():
    model, _ = moving_walk()
    lengths = {k: v + 0.01 * (i + 1) for i, (k, v) in enumerate(lengths_of(model).items())}
    lengths["hip_forward"], lengths["hip_up"] = 0.0, 0.0
    changed = with_lengths(model, lengths)
    for name, value in lengths_of(changed).items():
        assert value == pytest.approx(lengths[name], abs=1e-12), name
    assert changed.mass == pytest.approx(model.mass, rel=1e-12)
    mirror = np.array([1.0, -1.0, 1.0])
    for name in SEGMENTS:
        if name.endswith("_r"):
            right, left = changed[name], changed[f"{name[:-1]}l"]
            np.testing.assert_allclose(right.joint_position, mirror * left.joint_position)
            np.testing.assert_allclose(right.centre_of_mass, mirror * left.centre_of_mass)
    for name, length in (("thigh_r", "thigh"), ("shank_l", "shank"), ("upper_arm_r", "upper_arm")):
        ratio = lengths[length] / lengths_of(model)[length]
        assert changed[name].centre_of_mass[2] == pytest.approx(
            ratio * model[name].centre_of_mass[2]
        )
        # a thin rod's inertia grows with the square of its length
        assert changed[name].inertia[1, 1] > 1.5 * (ratio - 1) * model[name].inertia[1, 1]
    same = with_lengths(model, {})
    for segment in same.segments:
        np.testing.assert_allclose(segment.inertia, model[segment.name].inertia)


def test_moving_the_hips_in_the_pelvis_leaves_the_rest_of_the_pelvis_and_trunk_in_place():
    model, _ = moving_walk()
    hips = np.array([0.007, 0.0, -0.004])
    moved = with_lengths(model, {"hip_forward": hips[0], "hip_up": hips[2]})
    # The pelvis's origin is between the hips; put it where they are now.
    for name in ("pelvis", "torso"):
        attribute = "centre_of_mass" if name == "pelvis" else "joint_position"
        np.testing.assert_allclose(
            getattr(moved[name], attribute) + hips, getattr(model[name], attribute), atol=1e-12
        )
    np.testing.assert_array_equal(moved["thigh_r"].joint_position, model["thigh_r"].joint_position)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"length_sd": {"femur": 0.01}}, ScalingError, "no such lengths: femur"),
        ({"length_sd": {"thigh": -0.01}}, ScalingError, "thigh -0.01"),
        ({"placement_sd": {"nose": 0.01}}, ScalingError, "nose: no such marker"),
        ({"placement_sd": {"pelvis 0": 0.0}}, ScalingError, "pelvis 0: 0.0 m"),
        ({"held": {"knee": 0.0}}, ModelError, "knee"),
    ],
)
def test_settings_that_cannot_be_used_are_refused(options, error, message):
    model, placed, _, _, stand, walk = made_up(0.0, segments=LEG_SEGMENTS)
    with pytest.raises(error, match=message):
        fit_model(model, placed, stand, walk, **options)


FEW = ("pelvis 0", "pelvis 1", "pelvis 2", *(f"thigh_{side} {i}" for side in "rl" for i in "01"))


def test_trials_that_cannot_be_used_are_refused():
    model, placed, _, _, stand, walk = made_up(0.0, segments=LEG_SEGMENTS)
    with pytest.raises(RecordError, match="no frame shows enough markers"):
        fit_model(model, placed, np.nan * stand, walk)
    with pytest.raises(RecordError, match="no frame shows enough markers"):
        fit_model(model, placed, stand, np.nan * walk)
    with pytest.raises(RecordError, match="shape"):
        fit_model(model, placed, stand[:, 1:], walk)
    with pytest.raises(ScalingError, match="1 frames that show the markers"):
        fit_model(model, placed, stand, walk[:1])
    few = [i for i, m in enumerate(placed) if m.name in FEW]
    with pytest.raises(ScalingError, match="42 marker coordinates in the 2 frames used, too few"):
        fit_model(model, [placed[i] for i in few], stand[:, few], walk[:2, few])
    with pytest.raises(ScalingError, match="no such lengths: femur"):
        with_lengths(model, {"femur": 0.4})
    with pytest.raises(ScalingError, match="above zero"):
        with_lengths(model, {"thigh": -0.4})


@dataclass(frozen=True)
class Trials:
    """A recorded person: the model scaled by the standing trial, markers placed, both trials."""

    model: BodyModel
    markers: tuple[ModelMarker, ...]
    anatomical: dict[str, float]
    standing: np.ndarray
    walking: np.ndarray


def trials(standing: Path, walking: Path, *, mass: float, height: float) -> Trials:
    static, walk = read_recording(standing), read_recording(walking)
    marker_set = recognise(static.names)
    names = marker_set.renamed(static.names)
    names_of = {marker: name for name, marker in names.items()}
    landmarks = {d: names_of[m] for d, m in marker_set.landmarks.items() if m in names_of}
    axes = detect_axes(static, landmarks).rotation
    static, walk = static.turned(axes), walk.turned(axes)
    stand = {marker: np.nanmedian(static.marker(name), axis=0) for name, marker in names.items()}
    measured = measure(marker_set.on_landmarks({n: at.tolist() for n, at in stand.items()}))
    person = SimpleNamespace(identifier="walker", sex="M", mass_kg=mass, height_m=height)
    model = build_body(person, measured).model
    placed = place_markers(model, measured, stand, marker_set).markers

    def columns(trial):
        gap = np.full((len(trial.markers), 3), np.nan)
        known = {names.get(name, name): name for name in trial.names}
        found = [trial.marker(known[m.name]) if m.name in known else gap for m in placed]
        return np.stack(found, axis=1)

    return Trials(
        model=model,
        markers=placed,
        anatomical={
            m.name: ANATOMICAL_SD for m in placed if marker_set.markers[m.name].role == "anatomical"
        },
        standing=columns(static),
        walking=low_pass(columns(walk), rate=walk.marker_rate, cutoff_hz=6.0),
    )


def fit_of(person):
    """The fit to a person's trials, and the marker errors in walking before and after it."""
    fit = fit_model(
        person.model,
        person.markers,
        person.standing,
        person.walking,
        placement_sd=person.anatomical,
    )
    assert fit.converged
    before = marker_errors(inverse_kinematics(person.model, person.markers, person.walking))
    after = marker_errors(inverse_kinematics(fit.model, fit.markers, person.walking))
    return fit, before, after


def test_the_markers_of_wbds01_fit_within_the_published_limits(gait_data):
    """OpenSim's checklist: RMS below 2 cm, largest below 4 cm; a third party's OpenSim
    result on this trial has 1.5 cm and 2.8 cm."""
    raw = gait_data / "wbds" / "raw"
    person = trials(raw / "WBDS01static1.c3d", raw / "WBDS01walkT01.c3d", mass=74.3, height=1.725)
    fit, before, after = fit_of(person)
    assert after.whole_rms < 0.8 * before.whole_rms
    assert after.whole_rms < 0.015
    assert after.whole_largest < 0.028
    # The fit must not draw the body to the skin's motion: lengths within two deviations (95 %) of
    # what the standing trial says, standing angles within 2°.
    for length in fit.lengths:
        assert abs(length.fitted - length.prior) < 2 * length.prior_sd, length.name
    assert np.degrees(np.abs(fit.standing_change[6:])).max() < 2.0
    # What it found holds for a trial that it has not seen, overground and 2.6 times as fast.
    other = trials(
        raw / "WBDS01static1.c3d", raw / "WBDS01walkO01Cmkr.txt", mass=74.3, height=1.725
    ).walking
    unfitted = marker_errors(inverse_kinematics(person.model, person.markers, other))
    fitted = marker_errors(inverse_kinematics(fit.model, fit.markers, other))
    assert fitted.whole_rms < 0.9 * unfitted.whole_rms
    assert fitted.whole_largest < 0.9 * unfitted.whole_largest


def test_the_markers_of_the_rajagopal_walk_fit_better(gait_data):
    """Its left thigh cluster slipped by 3-4 cm between the trials."""
    data = gait_data / "opensim_rajagopal" / "ExpData"
    person = trials(
        data / "static_walk_1.trc", data / "motion_capture_walk.trc", mass=85.0668, height=1.829
    )
    fit, before, after = fit_of(person)
    assert before.whole_largest > 0.04
    assert after.whole_largest < 0.04
    assert after.whole_rms < 0.02
    assert after.whole_rms < 0.6 * before.whole_rms
    legs = ("thigh", "shank", "hip_half_width", "hip_forward", "hip_up")
    for name in legs:
        assert abs(fit[name].fitted - fit[name].prior) < 2 * fit[name].prior_sd, name
