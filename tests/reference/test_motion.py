"""The reference motion: periodic, consistent with itself, with Newton and with the record."""

from dataclasses import fields

import numpy as np
import pytest
from reference_figures import figures, of_s05, same
from scipy.spatial.transform import Rotation
from simulation_fixtures import mirror_image, standing_moments, symmetric, task_of_subject

from gaitval.configuration import ContactSettings
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES
from gaitval.model.body import SEGMENTS
from gaitval.model.rotations import pelvis_angles
from gaitval.model.tree import segment_frames, tree_arrays
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import BUILTIN, load_subject
from gaitval.walk.reference.hip_moments import about_record
from gaitval.walk.reference.motion import MOTION, ReferenceMotion, build_reference

GRAVITY = 9.81
RECORDED = [
    f"{name}_{side}"
    for name in (
        "hip_flexion",
        "hip_adduction",
        "hip_rotation",
        "knee_angle",
        "ankle_angle",
        "subtalar_angle",
    )
    for side in "rl"
]


def without_travel(reference: ReferenceMotion, values: np.ndarray) -> np.ndarray:
    """Forward places (N, …) less the steady progress at the mean speed."""
    travel = reference.speed * reference.stride_time * reference.phase
    return values - travel.reshape(-1, *[1] * (values.ndim - 1))


def periodic_positions(reference: ReferenceMotion) -> np.ndarray:
    positions = reference.positions.copy()
    positions[:, 3] = without_travel(reference, positions[:, 3])
    return positions


def central_difference(values: np.ndarray, reference: ReferenceMotion) -> np.ndarray:
    """d/dt of one cycle of samples, sixth order: the error of harmonic k is (2πk/N)⁶/140 of its
    rate, below 1e-7 for the twenty harmonics that carry the motion."""
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    difference = sum(
        w * (np.roll(values, -n, axis=0) - np.roll(values, n, axis=0)) for n, w in weights.items()
    )
    return difference * len(values) / reference.stride_time


@pytest.fixture(scope="module")
def reference(task):
    """As built from the record, before it is fitted to the laws of motion."""
    return build_reference(task.record, task.model)


@pytest.fixture(scope="module", params=list(BUILTIN))
def subject(request):
    """Every built-in subject: its model, record and reference."""
    loaded = load_subject(request.param)
    model, record = scale_subject(loaded).model, loaded.record()
    return model, record, build_reference(record, model)


# ---- One cycle joins the next. ----


def test_every_subject_has_a_reference_that_closes_to_machine_precision(subject):
    """A step of size s where the cycle closes would leave s/(πk) in every harmonic k. Less than
    1e-13 (m, rad) is left in the upper half of them, so there is no step and no kink."""
    _, _, reference = subject
    assert all(np.isfinite(getattr(reference, f.name)).all() for f in fields(reference))
    places = without_travel(reference, reference.centre_of_mass[:, :1])
    effectors = without_travel(reference, reference.end_effectors[..., 0])
    for values in (
        periodic_positions(reference),
        reference.velocities,
        places,
        reference.centre_of_mass[:, 1:],
        effectors,
        reference.moments / 1000.0,  # Nm: three digits larger than angles
    ):
        spectrum = np.abs(np.fft.rfft(values, axis=0)) / len(values)
        assert spectrum[len(spectrum) // 2 :].max() < 1e-13


def test_the_walk_goes_on_where_the_cycle_ends(reference):
    """Extrapolating the last samples to phase 1 meets the first one, one stride ahead."""
    stride = reference.speed * reference.stride_time
    # Sixth-order extrapolation (binomial weights): its error is the sixth difference, 1e-8 here.
    weights = np.array([-1.0, 6.0, -15.0, 20.0, -15.0, 6.0])
    at_one = weights @ reference.positions[-6:]
    at_one[3] -= stride
    np.testing.assert_allclose(at_one, reference.positions[0], atol=1e-7)


def test_one_cycle_travels_speed_times_stride_time(subject):
    _, record, reference = subject
    assert (reference.speed, reference.stride_time) == (record.speed, record.stride_time)
    assert reference.velocities[:, 3].mean() == pytest.approx(record.speed, rel=1e-12)
    assert reference.velocities[:, 4:6].mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)


# ---- Velocities are the rates of positions. ----


def test_velocities_are_the_rates_of_the_positions(subject):
    _, _, reference = subject
    rates = central_difference(periodic_positions(reference), reference)
    rates[:, 3] += reference.speed
    np.testing.assert_allclose(reference.velocities[:, 3:], rates[:, 3:], atol=1e-6)


def test_the_pelvis_turns_at_its_angular_velocity(subject):
    """Its velocity is the world angular velocity, not the rate of the rotation vector."""
    _, _, reference = subject
    rotation = Rotation.from_rotvec(reference.positions[:, :3]).as_matrix()
    step = reference.stride_time / len(reference.phase)

    def turn(n):
        after, before = np.roll(rotation, -n, axis=0), np.roll(rotation, n, axis=0)
        turned = Rotation.from_matrix(after @ np.swapaxes(before, 1, 2))
        return turned.as_rotvec() / (2 * n * step)

    # Richardson: the errors of order h² cancel, (2πk/N)⁴ of the rate stays.
    angular_velocity = (4.0 * turn(1) - turn(2)) / 3.0
    np.testing.assert_allclose(reference.velocities[:, :3], angular_velocity, atol=1e-5)


# ---- Forces, feet and heights. ----


def test_the_centre_of_mass_is_that_of_the_model(task, reference, peer):
    for t in range(0, len(reference.phase), 100):
        peer.set(reference.positions[t])
        np.testing.assert_allclose(reference.centre_of_mass[t], peer.skeleton.getCOM(), atol=1e-12)


def test_the_centre_of_mass_accelerates_as_the_recorded_force_says(subject):
    """Newton: acceleration = force / mass + gravity. The vertical force of the record has a
    mean below one body weight and is scaled to it. What is left is a residual force; Hicks et al.
    2015 (J Biomech Eng 137:020905) ask for less than 5 % of the peak external force. The worst
    axis of the worst subject (fore-aft of S01) leaves 5.03 % root mean square."""
    _, _, reference = subject
    places = reference.centre_of_mass.copy()
    places[:, 0] = without_travel(reference, places[:, 0])
    acceleration = central_difference(central_difference(places, reference), reference)
    force = reference.ground_reaction.sum(axis=1)
    force[:, 2] /= force[:, 2].mean()
    expected = GRAVITY * (force - force.mean(axis=0))
    peak = GRAVITY * np.linalg.norm(force, axis=1).max()
    residual = np.sqrt(np.mean((acceleration - expected) ** 2, axis=0)) / peak
    assert residual.max() < 0.051
    for axis in range(3):  # no axis is swapped, turned round or late
        assert np.corrcoef(acceleration[:, axis], expected[:, axis])[0, 1] > 0.8


def test_the_flat_foot_stands_still(subject):
    """Between 15 and 40 % of its cycle a foot drifts less than OpenSim's checklist allows a
    marker: 2 cm root mean square and 4 cm at most."""
    model, record, reference = subject
    frames = segment_frames(model, reference.positions)
    for side in SIDES:
        ankle = frames[:, SEGMENTS.index(f"foot_{side[0]}"), :3, 3].copy()
        ankle[:, 0] = without_travel(reference, ankle[:, 0])
        at = np.mod(reference.phase - (record.left_phase if side == "left" else 0.0), 1.0)
        flat = (at > MOTION.flat_foot[0]) & (at < MOTION.flat_foot[1])
        ankle[:, 0] += reference.speed * reference.stride_time * at  # the progress since its strike
        drift = ankle[flat] - ankle[flat].mean(axis=0)
        assert np.abs(drift).max() < 0.04
        assert np.sqrt((drift**2).sum(axis=1).mean()) < 0.02


def test_the_mean_contact_force_is_one_body_weight(task, reference):
    """The published static law F = 4/3 k sqrt(R k) x^1.5 with k = E^(2/3) / 2, at every phase."""
    contact, tree = ContactSettings(), tree_arrays(task.model)
    frames = segment_frames(task.model, reference.positions)
    k = 0.5 * contact.stiffness ** (2 / 3)
    force = np.zeros(len(frames))
    for segment, position, radius in zip(
        tree.sphere_segment, tree.sphere_position, tree.sphere_radius, strict=True
    ):
        height = (frames[:, segment] @ [*position, 1.0])[:, 2]
        depth = np.maximum(radius - height, 0.0)
        force += 4 / 3 * k * np.sqrt(radius * k) * depth**1.5
    assert force.mean() == pytest.approx(task.model.mass * GRAVITY, rel=1e-9)


def test_a_stiffer_ground_carries_the_reference_higher(task, reference):
    stiff = build_reference(task.record, task.model, ContactSettings(stiffness=1e7))
    lift = stiff.positions[:, 5] - reference.positions[:, 5]
    assert np.ptp(lift) < 1e-12
    assert 0.0 < lift[0] < 0.02


# ---- What is the record's comes through unchanged. ----


def test_recorded_joint_angles_are_reproduced_each_side_on_its_own_cycle(subject):
    _, record, reference = subject
    for name in RECORDED:
        at = reference.phase - (record.left_phase if name.endswith("_l") else 0.0)
        seen = reference.positions[:, COORDINATES.index(name)]
        offset = reference.offsets[ACTUATED.index(name)]
        np.testing.assert_allclose(seen - offset, record.angles[name](at), atol=1e-12)


def test_the_left_heel_strikes_at_the_left_phase(subject):
    """The left foot's force starts from zero where the left cycle begins: half a stride after
    the right one, within the asymmetry of a healthy walk."""
    _, record, reference = subject
    assert record.left_phase == pytest.approx(0.5, abs=0.03)
    for i, start in enumerate((0.0, record.left_phase)):
        vertical = reference.ground_reaction[:, i, 2]
        middle = np.mod(start + 0.5 * record.stance_fraction[SIDES[i]], 1.0)
        before = np.mod(start - 0.1, 1.0)  # late swing
        assert vertical[int(middle * len(vertical))] > 0.5
        assert vertical[int(before * len(vertical))] == 0.0


def test_recorded_moments_are_fed_forward_in_newton_metres(task, reference):
    """The mean of both sides' curves, at the phase of its own side: those of the right and the left
    differ by a shift of the centre of pressure between the force plates."""
    names = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")
    for side in "rl":
        at = reference.phase - (task.record.left_phase if side == "l" else 0.0)
        for name in names:
            views = [task.record.moments[f"{name}_{view}"](at) for view in "rl"]
            np.testing.assert_allclose(
                reference.moments[:, ACTUATED.index(f"{name}_{side}")],
                np.mean(views, axis=0) * task.model.mass,
                atol=1e-10,
            )
    fed = {f"{name}_{side}" for name in names for side in "rl"}
    for i, name in enumerate(ACTUATED):
        assert reference.moments[:, i].any() == (name in fed)


def test_the_pelvis_turns_as_both_sides_of_the_record_say(subject):
    """The record sees the pelvis from each side; the reference is the mean of both views, which
    differ by less than a degree or two."""
    _, record, reference = subject
    seen = pelvis_angles(Rotation.from_rotvec(reference.positions[:, :3]).as_matrix())
    right, left = reference.phase, reference.phase - record.left_phase
    for i, (name, sign) in enumerate((("tilt", 1), ("list", -1), ("rotation", -1))):
        views = (
            record.angles[f"pelvis_{name}_r"](right),
            sign * record.angles[f"pelvis_{name}_l"](left),
        )
        np.testing.assert_allclose(seen[:, i], np.mean(views, axis=0), atol=1e-12)


# ---- What is derived. ----


def test_the_trunk_is_upright_and_faces_forward(subject):
    model, _, reference = subject
    torso = segment_frames(model, reference.positions)[:, SEGMENTS.index("torso"), :3, :3]
    np.testing.assert_allclose(torso, np.broadcast_to(np.eye(3), torso.shape), atol=1e-12)


def test_each_arm_swings_against_the_leg_of_its_side(subject):
    _, _, reference = subject
    for side in "rl":
        arm, leg = (
            reference.positions[:, COORDINATES.index(f"{name}_{side}")]
            for name in ("arm_flex", "hip_flexion")
        )
        assert np.corrcoef(arm, leg)[0, 1] < -0.7


def test_toes_stay_near_the_ground_when_the_heel_rises(task, reference):
    """In late stance the toes extend; in the middle of stance they are straight."""
    for side in "rl":
        at = np.mod(reference.phase - (task.record.left_phase if side == "l" else 0.0), 1.0)
        toes = np.rad2deg(reference.positions[:, COORDINATES.index(f"mtp_angle_{side}")])
        toe_off = task.record.stance_fraction["right" if side == "r" else "left"]
        assert toes[np.argmin(np.abs(at - toe_off))] > 15.0
        # Ten harmonics ring by a degree or two.
        assert np.abs(toes[(at > 0.1) & (at < 0.2)]).max() < 3.0
        assert toes.max() < 50.0


def test_both_feet_are_on_the_ground_in_double_support(subject):
    """The posture offsets are small and close the gap between the soles that the record's angles
    leave on the scaled model."""
    body, record, reference = subject
    assert np.abs(reference.offsets).max() < np.deg2rad(6.0)
    tree = tree_arrays(body)
    left = np.mod(reference.phase - record.left_phase, 1.0)
    both = (reference.phase <= record.stance_fraction["right"]) & (
        left <= record.stance_fraction["left"]
    )

    def gap(positions):
        frames = segment_frames(body, positions[both])[:, tree.sphere_segment]
        centres = np.einsum("tkij,kj->tki", frames[..., :3, :3], tree.sphere_position)
        heights = centres[..., 2] + frames[..., 2, 3] - tree.sphere_radius
        right, left = heights[:, :6].min(axis=1), heights[:, 6:].min(axis=1)
        return np.sqrt(np.mean((right - left) ** 2))

    recorded = reference.positions.copy()
    recorded[:, len(COORDINATES) - len(ACTUATED) :] -= reference.offsets
    assert gap(reference.positions) < max(0.012, 0.8 * gap(recorded))


def test_a_symmetric_person_walks_symmetrically(task):
    """With the right side's curves on the left, half a cycle later, and a body that is its own
    mirror image, the motion half a cycle later is the mirror image."""

    model, record = symmetric(task.model, task.record)
    reference = build_reference(record, model)
    half = len(reference.phase) // 2
    for values in (periodic_positions(reference), reference.velocities):
        later = np.roll(values, -half, axis=0)
        # The posture offsets are found by least squares with finite differences, to 1e-8 rad.
        np.testing.assert_allclose(later, mirror_image(values), atol=1e-7)


# ---- Files. ----


def test_a_reference_comes_back_from_its_file(reference, tmp_path):
    reference.save(tmp_path / "reference.npz")
    loaded = ReferenceMotion.load(tmp_path / "reference.npz")
    for field in fields(reference):
        np.testing.assert_array_equal(getattr(loaded, field.name), getattr(reference, field.name))


@pytest.mark.parametrize("column", [0, 1])
def test_a_moment_moves_to_another_hip_centre(column):
    """By inverse dynamics: a hip centre further forward or outward has the force under its foot
    further back or inward, on either side."""
    model = task_of_subject("S05").model
    side = "rl"[column]
    outward = -1.0 if side == "r" else 1.0
    weight = model.mass * GRAVITY

    def moments(shift):
        q = np.zeros(31)
        q[5] = 0.85
        return standing_moments(model, q, column, np.array([0.05, 0.08 * outward, 0.0]) + shift)

    for name, shift, centre in (
        ("hip_flexion", [-0.01, 0.0, 0.0], [0.01, 0.0]),
        ("hip_adduction", [0.0, -0.01 * outward, 0.0], [0.0, 0.01]),
    ):
        row = COORDINATES.index(f"{name}_{side}")
        about_model, moved_force = moments(np.zeros(3))[row], moments(np.array(shift))[row]
        found = about_record(about_model, name, np.array(centre), weight)
        assert abs(moved_force - about_model) > 0.005 * weight
        assert found == pytest.approx(moved_force, abs=1e-6 * weight)
    assert about_record(np.float64(3.0), "knee_angle", np.array([0.01, 0.01]), weight) == 3.0


def test_a_reference_of_an_earlier_version_has_the_model_s_hip_centres(tmp_path):
    reference = task_of_subject("S05").reference
    reference.save(tmp_path / "new.npz")
    assert np.array_equal(
        ReferenceMotion.load(tmp_path / "new.npz").hip_centre, reference.hip_centre
    )
    assert np.any(reference.hip_centre)
    with np.load(tmp_path / "new.npz") as file:
        np.savez(tmp_path / "old.npz", **{k: v for k, v in file.items() if k != "hip_centre"})
    assert not np.any(ReferenceMotion.load(tmp_path / "old.npz").hip_centre)


def test_no_number_of_a_built_reference_changes():
    """A change that is meant is written by `tests/support/reference_figures.py`."""
    same(figures(of_s05()[2]), "built")
