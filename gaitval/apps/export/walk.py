"""Walk in plain MuJoCo, as a person whom gaitval exported: `python walk.py --cycles 100`.

Needs mujoco, numpy and safetensors, and the files beside it; nothing of gaitval. `MujocoWalker` is
the person: `reset`, `act`, `step`, as an environment.

The joints are springs and dampers of `person.xml`; its actuators move their targets. The damping
there has the time step times the stiffness added: MuJoCo's Euler integrates damping implicitly, and
that much makes the spring implicit too. So a step of 2 ms suffices, as in gaitval's own engine.

The ground is a smooth Hunt-Crossley law (Serrancoli et al. 2019), or a cubic one, which MuJoCo's
contact cannot express: `GroundContact` computes it and applies it to the feet, and MuJoCo's own
contact is off. Opened without this script, `person.xml` stands on MuJoCo's own contact, which is
similar.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from safetensors.numpy import load_file

ACTUATED = 25


def hunt_crossley(law: Any, radius: Any, height: Any, velocity: Any) -> Any:
    """Force of the ground on K spheres: the normal force N, friction over slip Ns/m, and slope of
    the normal force Ns/m, (K,) each. `law` has the numbers of `walker.json`; `radius` and `height`
    (K,) m are those of the spheres and of their centres above the ground; `velocity` (K, 3) m/s is
    of their lowest points.
    """
    depth, rate = radius - height, -velocity[:, 2]
    root = np.sqrt(depth * depth + law["smoothing"])
    slope = law["penetration_slope"]
    elastic = 4.0 / 3.0 * law["k"] * np.sqrt(radius * law["k"]) * root * np.sqrt(root)
    elastic = elastic / (1.0 + np.exp(np.minimum(-2.0 * slope * depth, 700.0)))
    elastic[depth < law["faded"]] = 0.0
    c = law["dissipation"]
    normal = elastic * (1.0 + 1.5 * c * rate)
    exponent = -2.0 * law["rate_slope"] * (rate + 2.0 / (3.0 * c))
    normal = normal / (1.0 + np.exp(np.minimum(exponent, 700.0)))
    square = velocity[:, 0] ** 2 + velocity[:, 1] ** 2 + law["smoothing"]
    slip, least = np.sqrt(square), law["transition_velocity"]
    dynamic, extra = law["dynamic_friction"], law["static_friction"] - law["dynamic_friction"]
    whole = least * least + square
    coefficient = (dynamic * whole + 2.0 * extra * least * least) / (
        whole * np.maximum(slip, least)
    )
    return normal, normal * (coefficient + law["viscous_friction"]), 1.5 * c * elastic


def cubic(law: Any, radius: Any, height: Any, velocity: Any) -> Any:
    """As `hunt_crossley`, with a cubic spring (Ackermann and van den Bogert 2010)."""
    depth = np.maximum(radius - height, 0.0)
    spring = law["stiffness"] * depth**3
    normal = spring * np.maximum(1.0 - law["dissipation"] * velocity[:, 2], 0.0)
    slip = np.sqrt(velocity[:, 0] ** 2 + velocity[:, 1] ** 2 + law["slowest"])
    share = 2.0 / (1.0 + np.exp(-slip / law["friction_velocity"])) - 1.0
    return normal, law["friction"] * normal * share / slip, law["dissipation"] * spring


LAWS = {"hunt_crossley": hunt_crossley, "cubic": cubic}


class GroundContact:
    """The contact of the feet: computes the law and applies it as forces on their bodies.

    The force is linearly implicit in the velocity: f = (f(v) + a f') / (1 + a), with f' the force
    of the step before, a = slope x step / mass that a foot's contact moves. Otherwise friction
    would chatter at steps above 0.25 ms.
    """

    def __init__(self, model: Any, numbers: Any) -> None:
        spheres = [model.geom(name) for name in numbers["spheres"]]
        self.law, self.numbers = LAWS[numbers["law"]], numbers["law_numbers"]
        self.body = np.array([sphere.bodyid[0] for sphere in spheres])
        self.place = np.array([sphere.pos for sphere in spheres])
        self.radius = np.array([sphere.size[0] for sphere in spheres])
        self.lag = np.array(numbers["lag"])
        self.feet = np.repeat(np.eye(2), len(spheres) // 2, axis=1)
        self.bodies = np.unique(self.body)
        self.on = (self.bodies[:, None] == self.body).astype(float)
        self.memory = np.zeros((len(spheres), 3))

    def forces(self, data: Any, lag: Any) -> tuple[Any, Any]:
        """Places m and forces N (K, 3) on the spheres; kinematics must be those of the state."""
        arm = np.einsum("kij,kj->ki", data.xmat.reshape(-1, 3, 3)[self.body], self.place)
        point = data.xpos[self.body] + arm
        height = point[:, 2].copy()
        # The force acts in the middle of the overlap.
        point[:, 2] = 0.5 * (height - self.radius)
        spin = data.cvel[self.body, :3]
        away = point - data.subtree_com[1]
        velocity = data.cvel[self.body, 3:] + _cross(spin, away)
        normal, along, slope = self.law(self.numbers, self.radius, height, velocity)
        force = np.column_stack([-along * velocity[:, 0], -along * velocity[:, 1], normal])
        part = lag[:, None] * (self.feet @ np.column_stack([along, slope]))
        part = self.feet.T @ (part / (1.0 + part))
        share = part[:, [0, 0, 1]]
        self.memory = force + share * (self.memory - force)
        return point, self.memory

    def apply(self, data: Any, push: Any) -> Any:
        """Set all external forces for the next step, those of the ground and `push` (bodies, 6);
        returns those of the ground on right and left foot, (2, 3) N.
        """
        point, force = self.forces(data, self.lag)
        torque = _cross(point - data.xipos[self.body], force)
        data.xfrc_applied[:] = push
        data.xfrc_applied[self.bodies, :3] += self.on @ force
        data.xfrc_applied[self.bodies, 3:] += self.on @ torque
        return self.feet @ force


class MujocoWalker:
    """The person in MuJoCo.

    Parameters
    ----------
    folder : with `person.xml`, `walker.json`, `reference.safetensors` and `policy.safetensors`.

    Attributes
    ----------
    model, data : MuJoCo's own.
    phase : of the right gait cycle, counting on over cycles.
    moments : (25,) Nm, net joint moments of the last physics step.
    ground_reaction : (2, 3) N, on right and left foot, of the last physics step.
    push : (bodies, 6) N and Nm, force on each body at its centre of mass and torque, until changed.
    """

    def __init__(self, folder: Path) -> None:
        self.numbers: Any = json.loads((folder / "walker.json").read_text(encoding="utf-8"))
        self.tables = load_file(folder / "reference.safetensors")
        self.policy = load_file(folder / "policy.safetensors")
        self.model = mujoco.MjModel.from_xml_path(str(folder / "person.xml"))
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        self.data = mujoco.MjData(self.model)
        self.ground = GroundContact(self.model, self.numbers)
        n = self.numbers
        self.stiffness, self.damping = np.array(n["stiffness"]), np.array(n["damping"])
        self.total_damping = np.array(n["total_damping"])
        self.shares, self.signs = np.array(n["shares"]), np.array(n["mirror_signs"])
        self.order = np.array(n["mirror_order"])
        self.action_order = self.order[-26:] - (len(self.order) - 26)
        names = n["coordinates"]
        self.joints = np.array([self.model.joint(name).qposadr[0] for name in names])
        self.rates = np.array([self.model.joint(name).dofadr[0] for name in names])
        self.ends = np.array([self.model.body(name).id for name in n["end_effectors"]])
        first = self.tables["positions"].shape[1] - ACTUATED
        self.servo = np.hstack(
            [
                self.tables["positions"][:, first:],
                self.tables["velocities"][:, first:],
                self.tables["feed_forward"],
            ]
        )
        self.phase = 0.0
        self.push = np.zeros_like(self.data.xfrc_applied)

    def reset(self, phase: float = 0.0) -> Any:
        """Place the person on the reference at a phase; returns the observation."""
        n, data = self.numbers, self.data
        mujoco.mj_resetData(self.model, data)
        q, rate = _row(self.tables["positions"], phase), _row(self.tables["velocities"], phase)
        q[3] += n["stride_length"] * phase
        q[5] += n["lift"]
        turn, matrix = np.empty(4), np.empty(9)
        angle = float(np.linalg.norm(q[:3]))
        mujoco.mju_axisAngle2Quat(turn, q[:3] / angle if angle else np.array([1.0, 0, 0]), angle)
        mujoco.mju_quat2Mat(matrix, turn)
        data.qpos[:3], data.qpos[3:7], data.qpos[self.joints] = q[3:6], turn, q[6:]
        # MuJoCo's angular velocity of a free joint is in the body's axes.
        data.qvel[:3], data.qvel[3:6] = rate[3:6], matrix.reshape(3, 3).T @ rate[:3]
        data.qvel[self.rates] = rate[6:]
        self.phase = phase
        self.action, self.offset = np.zeros(26), np.zeros(ACTUATED)
        self._kinematics()
        # The feet carry the body from the first step on, as if it had been walking.
        self.ground.memory[:] = 0.0
        _, force = self.ground.forces(data, np.zeros(2))
        self.ground_reaction = self.ground.feet @ force
        self.moments = np.zeros(ACTUATED)
        self.mean_ground = n["weight"] * _row(self.tables["ground_reaction"], phase).reshape(2, 3)
        return self.observe()

    def act(self, observation: Any) -> Any:
        """The policy's action (A,): a network of two layers on the normalised observation."""
        t = self.policy
        x = (observation - t["observation_mean"]) / np.sqrt(t["observation_variance"] + 1e-8)
        x = np.clip(x, -10.0, 10.0).astype(np.float32)
        for layer in (0, 2):
            name = f"mlp_extractor.policy_net.{layer}"
            x = np.tanh(x @ t[f"{name}.weight"].T + t[f"{name}.bias"])
        return x @ t["action_net.weight"].T + t["action_net.bias"]

    def step(self, action: Any, recording: list[Any] | None = None) -> tuple[Any, bool]:
        """Advance by an action; returns the observation, and whether the person fell."""
        n = self.numbers
        bias = self.tables["action_bias"][int(self.phase % 1.0 * len(self.tables["action_bias"]))]
        requested = np.zeros(26, dtype=np.float32)
        requested[: len(action)] = action - bias
        requested = np.clip(requested, -n["action_limit"], n["action_limit"]).astype(float)
        if self._mirrored():
            requested = self.signs[-26:] * requested[self.action_order]
        # An action enters through a filter, as a muscle is activated.
        requested *= self.shares
        self.action = requested + (1.0 - n["entering"]) * (self.action - requested)
        pace = 1.0 + n["pace_scale"] * self.action[-1]
        slope = n["action_scale"] * self.action[:-1] - self.offset
        target = self.offset.copy()
        self.offset = n["action_scale"] * self.action[:-1]
        ground = []
        for _ in range(n["steps_per_action"]):
            target += slope / n["steps_per_action"]
            self._physics_step(target, pace)
            ground.append(self.ground_reaction)
            if recording is not None:
                recording.append(self._sample())
        self.mean_ground = np.mean(ground, axis=0)
        self._kinematics()
        return self.observe(), self.fallen()

    def _physics_step(self, offset: Any, pace: float) -> None:
        data, n = self.data, self.numbers
        requested = _row(self.servo, self.phase)
        angle, rate, moment = requested[:25], requested[25:50], requested[50:]
        command = self.stiffness * (angle + offset) + self.damping * pace * rate + moment
        mujoco.mj_step1(self.model, data)
        self.ground_reaction = self.ground.apply(data, self.push)
        # The actuators' gain is the stiffness, so that they take a target, in rad.
        data.ctrl[:] = command / self.stiffness
        mujoco.mj_step2(self.model, data)
        self.phase += pace * n["phase_step"]
        self.moments = (
            command
            - self.stiffness * data.qpos[self.joints]
            - self.total_damping * data.qvel[self.rates]
        )

    def _sample(self) -> Any:
        data = self.data
        turn = np.empty(3)
        mujoco.mju_quat2Vel(turn, data.qpos[3:7], 1.0)
        q = np.concatenate([turn, data.qpos[:3], data.qpos[self.joints]])
        return data.time, self.phase, q, self.moments, self.ground_reaction.copy()

    def _kinematics(self) -> None:
        """What `observe` reads, of the state after the step."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_comVel(self.model, self.data)
        mujoco.mj_subtreeVel(self.model, self.data)

    def _mirrored(self) -> bool:
        return bool(self.numbers["mirrors"] and (self.phase + 0.25) % 1.0 >= 0.5)

    def _differences(self) -> tuple[Any, ...]:
        """Reference at the phase, less travel and lift, and the pelvis's rotation from it."""
        n, pace = self.numbers, 1.0 + self.numbers["pace_scale"] * self.action[-1]
        q = _row(self.tables["positions"], self.phase)
        rate = pace * _row(self.tables["velocities"], self.phase)
        q[3] += n["stride_length"] * self.phase
        q[5] += n["lift"]
        pelvis = self.data.xmat[1].reshape(3, 3)
        turn, wanted, matrix = np.empty(4), np.empty(4), np.empty(9)
        angle = float(np.linalg.norm(q[:3]))
        mujoco.mju_axisAngle2Quat(wanted, q[:3] / angle if angle else np.array([1.0, 0, 0]), angle)
        mujoco.mju_quat2Mat(matrix, wanted)
        mujoco.mju_mat2Quat(turn, (pelvis @ matrix.reshape(3, 3).T).ravel())
        away = np.empty(3)
        mujoco.mju_quat2Vel(away, turn, 1.0)
        return q, rate, away, pelvis

    def fallen(self) -> bool:
        """Whether height, rotation or drift of the pelvis are outside their tolerance."""
        q, _, away, _ = self._differences()
        place = self.data.qpos[:3] - q[3:6]
        off = abs(place[2]), np.linalg.norm(away), np.hypot(place[0], place[1])
        return not all(np.array(off) < self.numbers["tolerances"])

    def observe(self) -> Any:
        """The observation, mirrored in the left leg's half of the cycle; float32."""
        n, data = self.numbers, self.data
        q_ref, rate_ref, away, pelvis = self._differences()
        angles, rates = data.qpos[self.joints], data.qvel[self.rates]
        seen = self.phase % 1.0
        head = [data.subtree_linvel[1], self._spin(), [seen], n["parameters"]]
        if not n["extended"]:
            return np.concatenate([angles, rates, *head]).astype(np.float32)
        if n["mirrors"]:
            seen = (seen + 0.25) % 0.5
        turn = 2.0 * np.pi * seen
        ends = data.xpos[self.ends[:2]] - _row(self.tables["end_effectors"], self.phase)[
            :6
        ].reshape(2, 3)
        place = data.qpos[:3] - q_ref[3:6]
        ends[:, 0] -= n["stride_length"] * self.phase + place[0]
        ends[:, 1] -= place[1]
        found = np.concatenate(
            [
                angles - q_ref[6:],
                0.1 * (rates - rate_ref[6:]),
                *head,
                [np.sin(turn), np.cos(turn), np.sin(2.0 * turn), np.cos(2.0 * turn)],
                away,
                place,
                pelvis @ data.qvel[3:6] - rate_ref[:3],
                data.qvel[:3] - rate_ref[3:6],
                ends.ravel(),
                self.mean_ground.ravel() / n["weight"],
                [n["speed"]],
                self.action,
            ]
        )
        if self._mirrored():
            found = self.signs * found[self.order]
        return found.astype(np.float32)

    def _spin(self) -> Any:
        """Angular velocity of a rigid body with the person's inertia and angular momentum."""
        data, mass = self.data, self.model.body_mass[1:]
        arm = data.xipos[1:] - data.subtree_com[1]
        turn = data.ximat[1:].reshape(-1, 3, 3)
        own = np.einsum("bij,bj,bkj->ik", turn, self.model.body_inertia[1:], turn)
        far = np.sum(mass * np.sum(arm * arm, axis=1)) * np.eye(3) - (mass * arm.T) @ arm
        return np.linalg.solve(own + far, data.subtree_angmom[1])


def _cross(a: Any, b: Any) -> Any:
    """a x b of rows; numpy's own takes longer for so few."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


def _row(table: Any, phase: float) -> Any:
    """Row of a table over one cycle, whose last row repeats the first, interpolated linearly."""
    count = len(table) - 1
    place = phase % 1.0 * count
    row = int(place)
    part = place - row
    return (1.0 - part) * table[row] + part * table[row + 1]


def walk(
    walker: MujocoWalker, cycles: float, start_phase: float = 0.0
) -> tuple[dict[str, Any], bool]:
    """Walk; returns time s, phase, positions (T, 31) rad and m (rotation vector and place of the
    pelvis, joint angles), joint moments (T, 25) Nm, ground reaction (T, 2, 3) N; and a fall.
    """
    observation, fell = walker.reset(start_phase), False
    recording: list[Any] = []
    while not fell and walker.phase < start_phase + cycles:
        observation, fell = walker.step(walker.act(observation), recording)
    names = "time", "phase", "positions", "moments", "ground_reaction"
    walked = dict(zip(names, map(np.array, zip(*recording, strict=True)), strict=True))
    # What acts at a state is what the step that follows it applies.
    acting = ("moments", "ground_reaction")
    return {n: a[1:] if n in acting else a[:-1] for n, a in walked.items()}, fell


def dragged(walker: MujocoWalker, drag: Any) -> Any:
    """`MujocoWalker.push` of a drag with the mouse, which is MuJoCo's `MjvPerturb`."""
    walker.data.xfrc_applied[:] = 0.0
    mujoco.mjv_applyPerturbForce(walker.model, walker.data, drag)
    return walker.data.xfrc_applied.copy()


def look(camera: Any, options: Any) -> None:
    """Let a camera of MuJoCo follow the person from the side, and draw the forces on it."""
    camera.type, camera.trackbodyid = mujoco.mjtCamera.mjCAMERA_TRACKING, 1
    camera.distance, camera.azimuth, camera.elevation = 3.0, 60.0, -10.0
    options.flags[mujoco.mjtVisFlag.mjVIS_PERTFORCE] = True


def view(walker: MujocoWalker, start_phase: float = 0.0) -> None:
    """Show the walk in MuJoCo's viewer, at the speed of life, until it is closed. A body that is
    dragged there is pushed; after a fall the walk begins again.
    """
    import time

    import mujoco.viewer

    observation = walker.reset(start_phase)
    with mujoco.viewer.launch_passive(
        walker.model, walker.data, show_left_ui=False, show_right_ui=False
    ) as window:
        look(window.cam, window.opt)
        while window.is_running():
            started, before = time.perf_counter(), walker.data.time
            with window.lock():
                walker.push = dragged(walker, window.perturb)
            observation, fell = walker.step(walker.act(observation))
            if fell:
                observation = walker.reset(start_phase)
                window.perturb.active = 0  # the body is no longer where it was held
            window.sync()
            time.sleep(max(0.0, walker.data.time - before - time.perf_counter() + started))


def main() -> int:
    """The command; exit code 1 after a fall."""
    parser = argparse.ArgumentParser(description="Walk in plain MuJoCo.")
    parser.add_argument("--cycles", type=float, default=10.0, help="gait cycles")
    parser.add_argument("--start-phase", type=float, default=0.0, help="of the right cycle, 0 to 1")
    parser.add_argument("--out", type=Path, help="write the walk as .npz")
    parser.add_argument("--view", action="store_true", help="show it in MuJoCo's viewer")
    arguments = parser.parse_args()
    if not 0.0 < arguments.cycles < 1e6:
        parser.error(f"--cycles {arguments.cycles:g}: give a number of gait cycles above 0")
    if not 0.0 <= arguments.start_phase <= 1.0:
        parser.error(f"--start-phase {arguments.start_phase:g}: give a share of the cycle, 0 to 1")
    if arguments.out:
        try:  # before the walk, which would be lost
            arguments.out.parent.mkdir(parents=True, exist_ok=True)
            arguments.out.touch()
        except OSError as error:
            parser.error(f"--out {arguments.out}: cannot be written ({error.strerror})")
    walker = MujocoWalker(Path(__file__).resolve().parent)
    if arguments.view:
        view(walker, arguments.start_phase)
        return 0
    walked, fell = walk(walker, arguments.cycles, arguments.start_phase)
    seconds, cycles = walked["time"][-1], walker.phase - arguments.start_phase
    far = walked["positions"][-1, 3] - walked["positions"][0, 3]
    print(
        f"{cycles:.1f} cycles, {seconds:.1f} s, {far:.1f} m, {'fell' if fell else 'did not fall'}"
    )
    if arguments.out:
        part = arguments.out.with_name(f".partial-{arguments.out.name}")
        with part.open("wb") as file:
            np.savez(file, **walked, fell=fell)
        part.replace(arguments.out)  # whole or not at all
    return int(fell)


if __name__ == "__main__":
    raise SystemExit(main())
