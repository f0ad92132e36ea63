"""What the replay shows is what was simulated: the same poses, forces and moments of the cycle."""

import base64
import hashlib
import json
import re
from dataclasses import replace

import numpy as np
import pytest
import vendor_three
from html_page import only_html, without_figures
from report_run import build_run
from scipy.spatial.transform import Rotation
from synthetic_walk import MODEL, perfect_walk, synthetic_record

from gaitval._internal.io.artefacts import read_json
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.metrics.results import read_metrics
from gaitval.model.body import SEGMENTS
from gaitval.model.ground import Ground
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.reporting import replay
from gaitval.reporting.report import write_report
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.skeleton import HumanSkeleton


def shown(folder, rollout):
    """The walk beside the record of a run folder."""
    metrics = read_metrics(folder)
    reference = ReferenceMotion.load(folder / "reference.npz")
    recorded = replay.recorded_motion(metrics, reference)
    return replay.shown_walk(MODEL, rollout, metrics.method, recorded)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run whose body is not the one that was scaled: longer thighs, knees moved."""
    folder = tmp_path_factory.mktemp("replay")
    build_run(folder)
    path = folder / "rollouts" / "identified.npz"
    mu = nominal_parameters()
    mu[PARAMETERS.index("thigh_length")] = 1.06
    mu[PARAMETERS.index("knee_y")] = 0.012
    replace(Rollout.load(path), mu=mu).save(path)
    with pytest.MonkeyPatch.context() as patch:
        only_html(patch)
        without_figures(patch)
        write_report(folder)
    return folder


@pytest.fixture(scope="module")
def rollout(folder) -> Rollout:
    return Rollout.load(folder / "rollouts" / "identified.npz")


@pytest.fixture(scope="module")
def metrics(folder) -> dict:
    return read_json(folder / "metrics.json")


@pytest.fixture(scope="module")
def walk(folder, rollout, metrics) -> replay.ShownWalk:
    found = shown(folder, rollout)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def html(folder) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def scene(html) -> dict:
    """As the page's script reads it."""
    return json.loads(re.search(r'id="replay-scene">(.*?)</script>', html, re.DOTALL)[1])


def unpacked(array: dict) -> np.ndarray:
    kind = {"int16": "<i2", "float32": "<f4"}[array["type"]]
    values = np.frombuffer(base64.b64decode(array["data"]), dtype=kind)
    return values.reshape(array["shape"]) * array["unit"]


def test_every_joint_is_where_the_simulated_body_has_it(scene, rollout, walk):
    """Against DART's own transforms of the body with the rollout's parameters, to 0.1 mm."""
    body = HumanSkeleton(apply_parameters(MODEL, rollout.mu), physics_step=0.001).skeleton
    origin, turn = (unpacked(scene["body"][name]) for name in ("origin", "quaternion"))
    travel = unpacked(scene["travel"])
    assert scene["body"]["segments"] == list(SEGMENTS)
    for stride, frame in ((0, 0), (1, 37), (3, 62), (5, 100)):
        body.setPositions(rollout.positions[walk.strides.rows[stride, frame]])
        for index, name in enumerate(SEGMENTS):
            pose = body.getBodyNode(name).getWorldTransform()
            shown = origin[stride, frame, index].copy()
            shown[:2] += travel[stride, frame]
            np.testing.assert_allclose(shown, pose.translation(), atol=1e-4, err_msg=name)
            off = Rotation.from_quat(turn[stride, frame, index]).inv() * Rotation.from_matrix(
                pose.rotation()
            )
            assert np.rad2deg(off.magnitude()) < 0.01


def test_right_is_right_and_forward_is_forward(scene):
    origin = unpacked(scene["body"]["origin"])
    recorded = unpacked(scene["recorded"]["origin"])
    for names, places in (
        (scene["body"]["segments"], origin),
        (scene["recorded"]["segments"], recorded),
    ):
        right, left = (places[..., names.index(f"thigh_{side}"), 1] for side in "rl")
        assert (right < left).all()  # y is to the left
    forward, sideways = np.diff(unpacked(scene["travel"])[0, [0, -1]], axis=0)[0]
    assert forward > 1.0
    assert abs(sideways) < 0.2
    assert (origin[..., 2] > 0).all()


def test_frames_are_at_percents_of_the_cycle_of_each_foot(scene, walk, metrics):
    record = metrics["record"]
    cycle, stance = unpacked(scene["cycle"]), unpacked(scene["stance"])
    assert walk.strides.rows.shape == (6, 101)
    np.testing.assert_allclose(cycle[2, :, 0], np.arange(101), atol=1e-5)
    # samples are 1 ms apart, 0.1 % of a cycle
    left = (np.arange(101) - 100 * record["left_phase"]) % 100
    wrapped = (cycle[2, :, 1] - left + 50) % 100 - 50
    assert np.abs(wrapped).max() < 0.3
    seconds = record["spatiotemporal"]["stride_time_right"]
    np.testing.assert_allclose(scene["seconds"], seconds, atol=0.002)
    for column, side in enumerate(SIDES):
        own = cycle[1:4, :100, column]
        on = np.isfinite(stance[1:4, :100, column])
        assert own[on].max() == pytest.approx(
            100 * record["spatiotemporal"][f"stance_fraction_{side}"], abs=1.2
        )
        np.testing.assert_allclose(
            stance[1:4, :100, column][on], own[on] / own[on].max() * 100, atol=2.0
        )


def test_left_cycle_before_the_first_and_after_the_last_heel_strike():
    strikes = np.array([100, 200, 310])
    percent = replay._cycle(strikes, np.array([50, 100, 150, 255, 310, 365]))
    np.testing.assert_allclose(percent, [50, 0, 50, 50, 0, 50])
    assert np.isnan(replay._cycle(strikes[:1], strikes)).all()


def test_arrows_are_the_forces_of_the_curves_at_their_centre_of_pressure(
    scene, metrics, rollout, walk
):
    force, pressure = unpacked(scene["force"]), unpacked(scene["pressure"])
    on = np.isfinite(unpacked(scene["stance"]))
    # The same strides as the curves. A frame is the nearest sample, half a millisecond off at most,
    # and the force grows by up to 13 body weights a second.
    mean = np.array(metrics["walks"]["identified"]["curves"]["forces"]["vertical_r"]["mean"])
    steady = on[:, :, 0].all(axis=0)
    assert steady.sum() > 55
    np.testing.assert_allclose(force[:, steady, 0, 2].mean(axis=0), mean[steady] / 100, atol=7e-3)
    for column in (0, 1):
        standing = on[:, :, column]
        raw = rollout.ground_reaction[walk.strides.rows][standing][:, column]
        weights = raw / metrics["method"]["body_weight_n"]
        shown = force[standing][:, column]
        np.testing.assert_allclose(shown.mean(axis=0), weights.mean(axis=0), atol=5e-3)
    row = walk.strides.rows[2, 30]
    place = pressure[2, 30, 0] + unpacked(scene["travel"])[2, 30]
    np.testing.assert_allclose(place, rollout.centre_of_pressure[row, 0, :2], atol=1e-5)
    assert not force[~on].any()
    assert np.isnan(pressure[~on]).all()


def test_the_skeleton_has_the_recorded_angles_each_side_at_its_own_percent(metrics, walk):
    curves = metrics["record"]["curves"]["angles"]
    for name in ("hip_flexion", "knee_angle", "ankle_angle"):
        right = np.rad2deg(walk.recorded[:, COORDINATES.index(f"{name}_r")])
        np.testing.assert_allclose(right, curves[f"{name}_r"], atol=1e-9)
        left = np.rad2deg(walk.recorded[:, COORDINATES.index(f"{name}_l")])
        phase = (np.arange(101) / 100 - metrics["record"]["left_phase"]) % 1.0
        expected = np.interp(100 * phase, np.arange(101), curves[f"{name}_l"])
        np.testing.assert_allclose(left, expected, atol=1e-9)
    middle = walk.positions[:, :-1, 3:5].mean(axis=(0, 1))
    np.testing.assert_allclose(walk.recorded[:-1, 3:5].mean(axis=0), middle, atol=2e-3)


def test_the_walker_stays_on_the_spot(walk, rollout):
    np.testing.assert_allclose(walk.positions[:, [0, -1], 3:5], 0.0, atol=1e-9)
    back = walk.positions.copy()
    back[..., 3:5] += walk.travel
    np.testing.assert_allclose(back, rollout.positions[walk.strides.rows], atol=1e-9)


def test_the_drawn_bodies_have_the_joints_of_the_models(scene, rollout):
    body = apply_parameters(MODEL, rollout.mu)
    for shape, model in ((scene["body"], body), (scene["recorded"], MODEL)):  # as scaled
        assert shape["segments"] == list(SEGMENTS)
        for name in SEGMENTS:
            np.testing.assert_allclose(shape["joints"][name], model[name].joint_position)
        assert shape["mass"] == pytest.approx(model.mass)
        assert len(shape["spheres"]) == 12
    assert not np.allclose(body["shank_l"].joint_position, MODEL["shank_l"].joint_position)


def test_what_was_not_recorded_is_the_references(folder, walk):
    reference = ReferenceMotion.load(folder / "reference.npz")
    for name in ("lumbar_bending", "elbow_flex_l", "mtp_angle_r"):
        column = COORDINATES.index(name)
        at = np.linspace(0.0, 1.0, 101)
        phase, values = reference.phase, reference.positions[:, column]
        expected = np.interp(at, phase, values, period=1.0)
        np.testing.assert_allclose(walk.recorded[:, column], expected, atol=1e-12)


def test_a_push_is_replayed_behind_the_walk_with_the_stride_before(folder, rollout, metrics):
    """A force at the pelvis in the second stride that is shown."""
    method = read_metrics(folder).method
    whole = shown(folder, rollout)
    force = np.zeros_like(rollout.root_force)
    started = whole.strides.rows[0, 40]
    force[started : started + 50, 4] = 120.0
    pushed = shown(folder, replace(rollout, root_force=force))
    earlier = len(pushed.strides.seconds) - len(whole.strides.seconds)
    assert earlier >= 0
    found = replay.scene(whole, [pushed])
    count = len(whole.strides.seconds)
    (push,) = found["pushes"]
    assert (push["first"], push["end"]) == (count, count + len(pushed.strides.seconds))
    assert push["force"] == pytest.approx(120.0 / method.body_weight_n)
    assert push["degrees"] == 90  # to the left
    arrows = unpacked(found["push"])
    assert not arrows[:count].any()
    assert arrows[count:, :, 1].max() == pytest.approx(push["force"])
    assert found["walked"] == count
    assert unpacked(found["body"]["origin"]).shape[0] == push["end"]


def test_without_a_whole_stride_there_is_nothing_to_replay(folder):
    short = perfect_walk(synthetic_record(), cycles=0.8)
    assert replay.find_strides(short, read_metrics(folder).method) is None


def test_what_does_not_fit_into_16_bits_is_refused():
    with pytest.raises(ValueError, match="beyond 16 bits"):
        replay._packed(np.array([3.5]), "int16", replay.LENGTH_UNIT)


def test_the_scale_of_the_arrows_is_on_the_page(html, metrics):
    weight = f"{metrics['method']['body_weight_n']:.0f} N"
    text = " ".join(html.split())
    assert f"{replay.ARROW} m long at one body weight ({weight})" in text


def test_only_the_scripts_of_the_page_may_run(html):
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', html)
    allowed = set(re.findall(r"sha256-([A-Za-z0-9+/=]+)", policy))
    scripts = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    found = {base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts}
    assert found == allowed
    assert len(scripts) == 4
    assert "default-src &#39;none&#39;" in policy
    assert "unsafe-inline" not in policy.partition("script-src")[2].partition(";")[0]


def test_the_bundle_of_three_js_is_the_recorded_one_with_its_licence(tmp_path, monkeypatch):
    assert vendor_three.problems() == []
    for path in vendor_three.FOLDER.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.setattr(vendor_three, "FOLDER", tmp_path)
    bundle = tmp_path / vendor_three.BUNDLE
    assert b"Permission is hereby granted" in bundle.read_bytes()
    assert b"</script" not in bundle.read_bytes().lower()
    bundle.write_bytes(bundle.read_bytes() + b"\n")
    assert vendor_three.problems() == ["three.min.js has another SHA-256 than three.json says"]


def test_on_a_slope_the_scene_is_turned_into_the_room(folder, walk):
    """The rotation takes the ground's normal to where it points in a room whose z is up; level
    ground says nothing of it."""
    assert "room" not in replay.scene(walk)["body"]
    ground = Ground(10.0, 5.0)
    there = replace(walk, body=replace(walk.body, ground=ground))
    turn = Rotation.from_quat(replay.scene(there)["body"]["room"]).as_matrix()
    np.testing.assert_allclose(turn @ ground.up, [0.0, 0.0, 1.0], atol=1e-12)
    ahead = turn @ [1.0, 0.0, 0.0]
    assert ahead[2] / ahead[0] == pytest.approx(0.1)  # it rises ahead
