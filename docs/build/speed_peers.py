"""A training's samples a second beside those of other tools: the table "peers" of docs/speed.md.

    python docs/build/speed_peers.py                 # 5 min on an otherwise idle machine
    python docs/build/speed_peers.py --jax PYTHON    # with MuJoCo XLA, in another installation

All learn to follow the same reference with the same body, step and duration of an action, with the
same network and settings of PPO, one after the other in one run:

* gaitval: a training with the default settings;
* stable-baselines3 with DART: its own PPO and its SubprocVecEnv, on our environment in DART;
* stable-baselines3 with MuJoCo: the same, with MuJoCo's C step and contact and an observation and a
  reward of a few numpy operations, which cost less than ours;
* MuJoCo XLA on the processor: the physics steps of a sample alone, without observation, reward and
  learning, for the batch that does most. A training can only be slower.

MuJoCo XLA is no dependency of gaitval. PYTHON is that of an environment with it:

    python -m venv peers && peers/bin/pip install jax mujoco-mjx
    python docs/build/speed_peers.py --jax peers/bin/python
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import gymnasium
import mujoco
import numpy as np
import torch
from numpy.typing import NDArray
from speed_tables import PAGE, training_seconds, walking_task
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import SubprocVecEnv, VecNormalize

from evidence.marked_table import with_table
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED
from gaitval.model.body import BodyModel
from gaitval.policy.environment import WalkingEnvironment
from gaitval.simulation.mujoco_body import MujocoBody, mjcf
from gaitval.simulation.walker import Walker, WalkingTask

PROCESSES: Final = 8
"""Environments, a process each, of stable-baselines3."""
BATCHES: Final = (16, 64, 256)
"""Walkers side by side in MuJoCo XLA."""
PATIENCE: Final = 150.0
"""s that a batch may take, compilation included: on two processors large ones wait for themselves
for ever."""

Observation = NDArray[np.float32]


@dataclass(frozen=True)
class MujocoTask:
    """What `MujocoWalk` needs; it can be sent to a process.

    Attributes
    ----------
    model : the body.
    option : of MuJoCo: its step and its integrator.
    stiffness, damping : (25,) of the joints.
    positions, velocities : (T, 31) of the reference over a cycle.
    moments : (T, 25) Nm, likewise.
    rows : of the reference in an action.
    steps : physics steps of an action.
    limit, scale : of actions, and rad a unit.
    """

    model: BodyModel
    option: str
    stiffness: Array
    damping: Array
    positions: Array
    velocities: Array
    moments: Array
    rows: float
    steps: int
    limit: float
    scale: float

    @classmethod
    def of(cls, task: WalkingTask) -> "MujocoTask":
        """The same body, reference and durations."""
        walker, reference = Walker(task), task.reference
        stiffness, damping = walker.gains
        option = f'timestep="{walker.physics_step}" integrator="Euler"'
        rows = walker.action_seconds / reference.stride_time * len(reference.phase)
        constants = task.configuration.environment
        return cls(
            task.model, option, stiffness, damping,
            reference.positions, reference.velocities, reference.moments,
            rows, walker.steps_per_action, constants.action_limit, constants.action_scale,
        )  # fmt: skip


class MujocoWalk(gymnasium.Env[Observation, Observation]):
    """Follow the reference in MuJoCo: targets of the joints are offset, nearness is rewarded."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 (Gymnasium's own form)

    def __init__(self, task: MujocoTask) -> None:
        self.task = task
        self.peer = MujocoBody(task.model, option=task.option, floor=True)
        self.peer.set_servo(task.stiffness, task.damping)
        size = 2 * len(ACTUATED) + 2 * 6 + len(ACTUATED) + 2
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
        limit = task.limit
        self.action_space = gymnasium.spaces.Box(-limit, limit, (len(ACTUATED),), np.float32)
        self.row, self.count = 0.0, 0

    def _seen(self) -> tuple[Observation, Array]:
        q, qd = self.peer.state()
        at = int(self.row) % len(self.task.positions)
        errors = q[6:] - self.task.positions[at, 6:]
        turn = 2.0 * np.pi * self.row / len(self.task.positions)
        seen = np.concatenate([q[:6], qd[:6], q[6:], qd[6:], errors, [np.sin(turn), np.cos(turn)]])
        return seen.astype(np.float32), errors

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start in a random state of the reference."""
        super().reset(seed=seed)
        mujoco.mj_resetData(self.peer.model, self.peer.data)
        at = int(self.np_random.integers(len(self.task.positions)))
        self.peer.set(self.task.positions[at], self.task.velocities[at])
        self.row, self.count = float(at), 0
        return self._seen()[0], {}

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One action of several physics steps."""
        task, peer = self.task, self.peer
        at = int(self.row) % len(task.positions)
        target = task.positions[at, 6:] + task.scale * np.clip(action, -task.limit, task.limit)
        peer.data.qfrc_applied[peer.rates] = (
            task.stiffness * target + task.damping * task.velocities[at, 6:] + task.moments[at]
        )
        mujoco.mj_step(peer.model, peer.data, nstep=task.steps)
        self.row += task.rows
        self.count += 1
        seen, errors = self._seen()
        fell = bool(abs(seen[5] - task.positions[0, 5]) > 0.2) or not np.isfinite(seen).all()
        return seen, float(np.exp(-4.0 * np.mean(errors**2))), fell, self.count >= 1000, {}


def sb3_samples_per_second(
    make: Sequence[Callable[[], gymnasium.Env[Any, Any]]], task: WalkingTask
) -> float:
    """Of stable-baselines3's own PPO, in a process an environment, after a first rollout."""
    training = task.configuration.training
    samples = training.environments * training.rollout_steps
    environments = VecNormalize(SubprocVecEnv(list(make), start_method="spawn"))
    try:
        learner = PPO(
            "MlpPolicy",
            environments,
            n_steps=samples // len(make),
            batch_size=training.batch_size,
            n_epochs=training.epochs,
            learning_rate=training.learning_rate,
            policy_kwargs={"net_arch": 2 * [training.hidden_units]},
            device="cpu",
        )
        learner.learn(samples)
        began = time.perf_counter()
        learner.learn(samples, reset_num_timesteps=False)
        return samples / (time.perf_counter() - began)
    finally:
        environments.close()


class _InDart:
    """Makes our environment in DART, in another process."""

    def __init__(self, task: WalkingTask) -> None:
        self.task = task

    def __call__(self) -> WalkingEnvironment:
        return WalkingEnvironment(self.task, engine="dart")


class _InMujoco:
    """Makes the environment of MuJoCo, in another process."""

    def __init__(self, task: WalkingTask) -> None:
        self.task = MujocoTask.of(task)

    def __call__(self) -> MujocoWalk:
        return MujocoWalk(self.task)


XLA: Final = """
import json, sys, time
import jax, jax.numpy as jnp, mujoco, numpy as np
from mujoco import mjx

order, batch = json.loads(open(sys.argv[1]).read()), int(sys.argv[2])
model = mujoco.MjModel.from_xml_string(order["xml"])
data = mujoco.MjData(model)
data.qpos[:] = order["qpos"]
model.jnt_stiffness[:] = order["stiffness"]
model.dof_damping[:] = order["damping"]
applied = jnp.array(order["applied"])
on_device, start = mjx.put_model(model), mjx.put_data(model, data)

def action(state):
    state = state.replace(qfrc_applied=applied)
    return jax.lax.fori_loop(0, order["steps"], lambda _, s: mjx.step(on_device, s), state)

states = jax.vmap(lambda _: start)(jnp.arange(batch))
go = jax.jit(jax.vmap(action))
states = jax.block_until_ready(go(states))  # compiles
seconds = []
for _ in range(5):
    began = time.perf_counter()
    states = jax.block_until_ready(go(states))
    seconds.append(time.perf_counter() - began)
assert np.isfinite(np.asarray(states.qpos)).all()
print(json.dumps({"rate": batch / min(seconds)}))
"""
"""What the other installation runs: an action of a batch of walkers, compiled before."""


def xla_samples_per_second(python: Path, task: WalkingTask) -> dict[int, float]:
    """Samples a second of MuJoCo XLA's physics steps alone, by batch, of those that end."""
    made = MujocoTask.of(task)
    walk = MujocoWalk(made)
    walk.reset(seed=0)
    peer = walk.peer
    at = int(walk.row)
    applied = np.zeros(peer.model.nv)
    applied[peer.rates] = made.stiffness * made.positions[at, 6:] + made.moments[at]
    order = {
        "xml": mjcf(made.model, option=made.option, floor=True),
        "qpos": peer.data.qpos.tolist(),
        "stiffness": peer.model.jnt_stiffness.tolist(),
        "damping": peer.model.dof_damping.tolist(),
        "applied": applied.tolist(),
        "steps": made.steps,
    }
    found: dict[int, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "order.json"
        path.write_text(json.dumps(order), encoding="utf-8")
        for batch in BATCHES:
            command = [str(python), "-c", XLA, str(path), str(batch)]
            try:
                done = subprocess.run(
                    command, check=True, capture_output=True, text=True, timeout=PATIENCE
                )
            except subprocess.TimeoutExpired:
                print(f"MuJoCo XLA: {batch} walkers not done in {PATIENCE:g} s", file=sys.stderr)
                continue
            found[batch] = float(json.loads(done.stdout.splitlines()[-1])["rate"])
            print(f"MuJoCo XLA: {batch} walkers, {found[batch]:.0f} samples/s", file=sys.stderr)
    return found


def table(task: WalkingTask, python: Path | None) -> list[str]:
    """The lines of the table, gaitval first."""
    training = task.configuration.training
    walked, learned = training_seconds(task)
    ours = training.environments * training.rollout_steps / (walked + learned)
    found = [("gaitval", ours)]
    torch.set_num_threads(2)
    for title, maker in (
        ("stable-baselines3 with DART", _InDart),
        ("stable-baselines3 with MuJoCo", _InMujoco),
    ):
        rate = sb3_samples_per_second([maker(task)] * PROCESSES, task)
        found.append((f"{title}, {PROCESSES} processes", rate))
    rates = {} if python is None else xla_samples_per_second(python, task)
    if rates:
        batch, rate = max(rates.items(), key=lambda each: each[1])
        found.append((f"MuJoCo XLA (mjx), physics steps alone, {batch:,} walkers at once", rate))
    return [
        "| training with | samples/s | gaitval's, times |",
        "|---|---|---|",
        *(f"| {title} | {rate:,.0f} | {ours / rate:.1f} |" for title, rate in found),
    ]


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jax", type=Path, help="python that has jax and mujoco-mjx")
    arguments = parser.parse_args()
    lines = "\n".join(table(walking_task(), arguments.jax))
    if arguments.jax is None:
        print("MuJoCo XLA is left out: give --jax.", file=sys.stderr)
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "peers", lines), encoding="utf-8")
    print(lines)


if __name__ == "__main__":
    main()
