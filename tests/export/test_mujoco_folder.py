"""The person in plain MuJoCo: the same body, the same observations, the same walk."""

import ast
import json
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from safetensors.numpy import load_file

from gaitval.apps.export import walk as plain
from gaitval.apps.export.mujoco_folder import FILES, write_mujoco
from gaitval.apps.export.walked import ExportedWalk
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED
from gaitval.errors import PolicyError
from gaitval.gait.record import LowPass
from gaitval.metrics.comparison import rms, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.results import read_metrics
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.policy.environment import WalkingEnvironment
from gaitval.walk.simulation.rollout import Rollout

NO_CONTACT = mujoco.mjtDisableBit.mjDSBL_CONTACT


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The script as somebody else runs it: isolated from PYTHONPATH and this folder."""
    return subprocess.run(
        [sys.executable, "-I", str(folder / "walk.py"), *arguments],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_a_policy_that_feels_its_body_late_is_refused(walked: ExportedWalk, tmp_path: Path) -> None:
    late = walked.environment.task.with_environment(observation_delays=(0.05, 0.1, 0.15))
    made = ExportedWalk(walked.stored)
    made.__dict__["environment"] = WalkingEnvironment(late)
    with pytest.raises(PolicyError, match="observation_delays") as refused:
        write_mujoco(tmp_path, made)
    assert str(walked.stored.folder) in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_the_script_imports_no_gaitval(mujoco_folder: Path) -> None:
    tree = ast.parse((mujoco_folder / "walk.py").read_text(encoding="utf-8"))
    names = {
        name.partition(".")[0]
        for node in ast.walk(tree)
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [str(node.module)]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }
    assert names - set(sys.stdlib_module_names) == {"mujoco", "numpy", "safetensors"}
    assert {path.name for path in mujoco_folder.iterdir()} == set(FILES)


def test_it_walks_as_the_compiled_engine_does(
    walked: ExportedWalk, mujoco_folder: Path, tmp_path: Path
) -> None:
    """A second of it to rounding: MuJoCo solves the same equations with the same step. Later the
    policy's single precision lets rounding grow, as it does between any two engines."""
    done = run(mujoco_folder, "--cycles", "1.2", "--out", str(tmp_path / "walk.npz"))
    assert done.returncode == 0, done.stderr
    assert "did not fall" in done.stdout
    theirs, rows = np.load(tmp_path / "walk.npz"), 500
    for name in ("time", "phase", "positions"):
        expected = getattr(walked.walk, name)[:rows]
        np.testing.assert_allclose(theirs[name][:rows], expected, atol=1e-9, rtol=0, err_msg=name)
    for name in ("moments", "ground_reaction"):
        expected = getattr(walked.walk, name)[:rows]
        np.testing.assert_allclose(theirs[name][:rows], expected, atol=1e-6, rtol=0, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("environment", "law"),
    [
        ({"observation": "extended", "mirror": True}, "hunt_crossley"),
        ({"observation": "extended", "mirror": False}, "cubic"),
        ({"observation": "paper", "pace_scale": 0.0}, "hunt_crossley"),
    ],
    ids=["as trained", "cubic", "paper"],
)
def test_it_observes_and_acts_in_every_configuration(
    walked: ExportedWalk, tmp_path: Path, environment: dict[str, object], law: str
) -> None:
    task = walked.stored.corrected_task
    settings = task.configuration
    changed = settings.model_copy(
        update={
            "environment": settings.environment.model_copy(
                # The network is for the observation it was trained with; its bias is left out.
                update={**environment, "centring": 0.0}
            ),
            "contact": settings.contact.model_copy(update={"law": law}),
        }
    )
    other = ExportedWalk(replace(walked.stored, configuration=changed))
    other.stored.__dict__["corrected_task"] = replace(task, configuration=changed)
    write_mujoco(tmp_path, other)
    theirs, ours = plain.MujocoWalker(tmp_path), WalkingEnvironment(other.stored.corrected_task)
    options = {"phase": 0.3, "mu": other.mu, "push": None, "noise": 0.0}
    expected, _ = ours.reset(seed=0, options=options)
    seen = theirs.reset(0.3)
    random = np.random.default_rng(0)
    for _ in range(30):
        assert seen.dtype == expected.dtype
        np.testing.assert_allclose(seen, expected, atol=1e-5)
        action = random.normal(0.0, 0.3, ours.action_space.shape).astype(np.float32)
        expected, _, fell, _, _ = ours.step(action)
        seen, fallen = theirs.step(action)
        assert fallen == fell
    np.testing.assert_allclose(theirs.data.qpos[theirs.joints], ours.walker.state[0, 6:], atol=1e-8)


def test_a_person_that_falls_says_so(mujoco_folder: Path) -> None:
    walker = plain.MujocoWalker(mujoco_folder)
    walker.reset()
    fell = False
    for _ in range(300):  # without the policy, 3 s
        _, fell = walker.step(np.zeros(26))
        if fell:
            break
    assert fell


def held(walker: plain.MujocoWalker, body: str, apart: tuple[float, float, float]) -> Any:
    """The mouse holds the middle of a body, and is `apart` m from it."""
    drag, number = mujoco.MjvPerturb(), walker.model.body(body).id
    drag.select, drag.active = number, int(mujoco.mjtPertBit.mjPERT_TRANSLATE)
    drag.localpos[:] = walker.model.body_ipos[number]
    drag.localmass = walker.model.body_mass[number]
    drag.refselpos[:] = walker.data.xipos[number] + apart
    return drag


def velocity(walker: plain.MujocoWalker, body: int) -> Any:
    """m/s, of a body's centre of mass."""
    found = np.zeros(6)
    mujoco.mj_forward(walker.model, walker.data)
    mujoco.mj_objectVelocity(
        walker.model, walker.data, mujoco.mjtObj.mjOBJ_BODY, body, found, flg_local=0
    )
    return found[3:]


@pytest.mark.parametrize("body", ["pelvis", "foot_r"])  # the ground acts on a foot as well
def test_a_drag_of_the_mouse_is_added_to_the_forces_of_the_ground(mujoco_folder: Path, body):
    at_rest, pushed = plain.MujocoWalker(mujoco_folder), plain.MujocoWalker(mujoco_folder)
    for walker in (at_rest, pushed):
        walker.reset()
    pushed.push = plain.dragged(pushed, held(pushed, body, (0.0, 0.3, 0.0)))
    number = pushed.model.body(body).id
    assert pushed.push[number, 1] > 10.0  # N, to the left
    assert not np.delete(pushed.push, number, axis=0).any()
    for walker in (at_rest, pushed):
        walker._physics_step(np.zeros(len(ACTUATED)), 1.0)
    np.testing.assert_allclose(
        pushed.data.xfrc_applied - at_rest.data.xfrc_applied, pushed.push, atol=1e-9
    )
    assert velocity(pushed, number)[1] > velocity(at_rest, number)[1]


class Window:
    """In the place of MuJoCo's window, for 60 actions: in the middle the pelvis is held."""

    def __init__(self, walker: plain.MujocoWalker) -> None:
        self.walker, self.perturb = walker, mujoco.MjvPerturb()
        self.cam, self.opt = mujoco.MjvCamera(), mujoco.MjvOption()
        self.sideways: list[float] = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None

    def is_running(self) -> bool:
        return len(self.sideways) < 60

    def lock(self):
        return nullcontext()

    def sync(self) -> None:
        self.sideways.append(float(self.walker.push[1, 1]))
        if len(self.sideways) == 20:
            self.perturb = held(self.walker, "pelvis", (0.0, 0.05, 0.0))
        if len(self.sideways) == 40:
            self.perturb.active = 0


def test_who_is_dragged_in_the_viewer_is_pushed_until_released(mujoco_folder, monkeypatch):
    import mujoco.viewer

    walker = plain.MujocoWalker(mujoco_folder)
    window = Window(walker)
    monkeypatch.setattr(mujoco.viewer, "launch_passive", lambda *_, **__: window)
    plain.view(walker)
    force = np.array(window.sideways)
    assert (force[20:40] > 5.0).any()
    assert not force[:20].any()
    assert not force[40:].any()
    assert not walker.fallen()  # the policy walks on
    assert window.cam.trackbodyid == walker.model.body("pelvis").id


def test_the_model_is_the_person_by_itself(walked: ExportedWalk, mujoco_folder: Path) -> None:
    """Without the script: mass, joints, actuators that take a target, and the start of the walk."""
    model = mujoco.MjModel.from_xml_path(str(mujoco_folder / "person.xml"))
    data = mujoco.MjData(model)
    assert model.body_mass.sum() == pytest.approx(walked.stored.subject.mass_kg, rel=1e-9)
    assert {model.actuator(i).name for i in range(model.nu)} == set(ACTUATED)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    walker = plain.MujocoWalker(mujoco_folder)
    walker.reset()
    np.testing.assert_allclose(data.qpos, walker.data.qpos, atol=1e-12)
    np.testing.assert_allclose(data.qvel, walker.data.qvel, atol=1e-12)


def test_joints_and_soles_have_the_numbers_of_the_person(
    walked: ExportedWalk, mujoco_folder: Path
) -> None:
    """Ranges to be seen that do not push, the friction that was found on both of a pair (MuJoCo
    takes the larger), and targets whose springs give what the servos ask for at the start."""
    model = mujoco.MjModel.from_xml_path(str(mujoco_folder / "person.xml"))
    for name, ends in MEASURED_RANGES.items():
        np.testing.assert_array_equal(model.joint(name).range, ends)
    assert not model.jnt_limited.any()
    soles = [model.geom(sphere.name) for sphere in walked.body.spheres]
    for geom in (model.geom("floor"), *soles):
        assert geom.friction[0] == walked.friction
    servo = json.loads((mujoco_folder / "walker.json").read_text(encoding="utf-8"))
    stiffness, damping = (np.array(servo[name]) for name in ("stiffness", "damping"))
    tables = load_file(mujoco_folder / "reference.safetensors")
    angle, rate = (tables[name][0, -len(ACTUATED) :] for name in ("positions", "velocities"))
    wanted = stiffness * angle + damping * rate + tables["feed_forward"][0]
    assert np.abs(tables["feed_forward"][0]).max() > 5.0  # Nm, a sign would be seen
    np.testing.assert_allclose(
        model.key("start").ctrl * model.actuator_gainprm[:, 0], wanted, atol=1e-9
    )
    assert [model.actuator(i).name for i in range(model.nu)] == list(ACTUATED)


def test_mujocos_own_contact_carries_the_person(walked: ExportedWalk, mujoco_folder: Path) -> None:
    """For a step, from the keyframe; another law, so only as much as a body weight needs."""
    model = mujoco.MjModel.from_xml_path(str(mujoco_folder / "person.xml"))
    assert not model.opt.disableflags & NO_CONTACT
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    upward = []
    for _ in range(100):
        mujoco.mj_step(model, data)
        force = np.zeros(6)
        total = 0.0
        for contact in range(data.ncon):
            mujoco.mj_contactForce(model, data, contact, force)
            total += force[0]  # the contact's first axis is its normal
        upward.append(total)
    weight = walked.stored.subject.mass_kg * GRAVITY
    assert 0.7 < np.mean(upward) / weight < 1.4


@pytest.mark.slow  # half a minute of walking
def test_the_cycles_of_the_report_are_walked(
    walked: ExportedWalk, mujoco_folder: Path, tmp_path: Path
) -> None:
    """Each mean angle is the stored report's."""
    configuration = walked.stored.configuration
    cycles = configuration.validation.settling_cycles + configuration.validation.cycles + 1
    done = run(mujoco_folder, "--cycles", str(cycles), "--out", str(tmp_path / "walk.npz"))
    assert done.returncode == 0, done.stderr
    theirs = dict(np.load(tmp_path / "walk.npz"))
    assert not theirs["fell"]
    count = len(theirs["time"])
    own = {name: theirs[name] for name in
           ("time", "phase", "positions", "moments", "ground_reaction")}  # fmt: skip
    walk = Rollout(
        **own,
        velocities=np.zeros_like(theirs["positions"]),
        centre_of_pressure=np.zeros((count, 2, 3)),
        free_moment=np.zeros((count, 2)),
        centre_of_mass=theirs["positions"][:, 3:6],
        root_force=np.zeros((count, 6)),
        mu=walked.mu,
        start_phase=np.zeros(1),
        fell=np.zeros(1),
    )
    filters = LowPass(*[configuration.validation.filter_frequency] * 2)
    cut = find_cycles(walk, configuration)
    found = simulated_curves(walk, cut, mass=walked.stored.model.mass, filters=filters)
    metrics = read_metrics(walked.stored.folder)
    for name, each in metrics.walk.curves.angles.items():
        apart = np.rad2deg(found.angles[name].mean(axis=0)) - np.array(each.mean)
        assert rms(apart) < 0.5, name


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--cycles", "0"), "--cycles 0: give a number of gait cycles above 0"),
        (("--cycles", "nan"), "--cycles nan"),
        (("--start-phase", "37"), "--start-phase 37: give a share of the cycle, 0 to 1"),
        (("--out", "/proc/none/walk.npz"), "--out /proc/none/walk.npz: cannot be written"),
    ],
)
def test_what_the_script_cannot_do_is_said_before_the_walk(mujoco_folder, words, message):
    done = run(mujoco_folder, *words)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_the_folder_of_the_walk_is_made(mujoco_folder, tmp_path):
    out = tmp_path / "new" / "walk.npz"
    assert run(mujoco_folder, "--cycles", "0.1", "--out", str(out)).returncode == 0
    assert len(np.load(out)["time"]) > 0
