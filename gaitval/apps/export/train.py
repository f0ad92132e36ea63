"""Train the exported person with plain stable-baselines3: `python train.py --steps 200000`.

Needs gaitval with the extra `export`. Prints the mean return of the first and the last hundred
episodes and writes `policy.zip` and `normalisation.pkl`, which stable-baselines3 reads.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

import gaitval.apps.export.environment  # registers gaitval/Walker-v0

HERE = Path(__file__).resolve().parent
EPISODES = 100
SECONDS = 5.0
"""Between two lines of progress."""
REPEATED = 5
"""Steps of the environment for which an action is held: 30 ms, in which a joint can follow."""


class RepeatedAction(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An action acts for several steps, whose rewards are added."""

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """`REPEATED` steps, or as many as there are before the episode ends."""
        total = 0.0
        for _ in range(REPEATED):
            observation, reward, fell, over, info = self.env.step(action)
            total += float(reward)
            if fell or over:
                break
        return observation, total, fell, over, info


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description="Train with stable-baselines3's PPO.")
    parser.add_argument("--steps", type=int, default=200_000, help="actions to learn from")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--walker", default=str(HERE / "walker"), help="folder, or subject")
    parser.add_argument("--out", type=Path, default=HERE, help="folder for what was learned")
    arguments = parser.parse_args()
    environments = make_vec_env(
        gaitval.apps.export.environment.NAME,
        n_envs=8,
        seed=arguments.seed,
        env_kwargs={"walker": arguments.walker, "render_mode": None},
        wrapper_class=RepeatedAction,
    )
    normalised = VecNormalize(environments, gamma=0.97)
    learner = PPO(
        "MlpPolicy",
        normalised,
        n_steps=256,
        batch_size=256,
        n_epochs=10,
        gamma=0.97,
        learning_rate=5e-4,
        # A joint's target moves by 0.2 rad for an action of 1: small steps from the reference.
        policy_kwargs={"log_std_init": -1.5, "net_arch": [128, 128]},
        seed=arguments.seed,
        device="cpu",
    )
    returns: list[float] = []
    shown = time.monotonic()

    def count(scope: dict[str, object], _: object) -> bool:
        nonlocal shown
        infos = scope["infos"]
        assert isinstance(infos, list)
        returns.extend(info["episode"]["r"] for info in infos if "episode" in info)
        if time.monotonic() - shown > SECONDS:
            shown = time.monotonic()
            mean = f"{np.mean(returns[-EPISODES:]):.1f}" if returns else "none has ended"
            print(
                f"{learner.num_timesteps} of {arguments.steps} actions, {len(returns)} episodes, "
                f"mean return of the last {EPISODES}: {mean}",
                flush=True,
            )
        return True

    learner.learn(arguments.steps, callback=count)
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name, write in (("policy.zip", learner.save), ("normalisation.pkl", normalised.save)):
        part = arguments.out / f".partial-{name}"
        write(str(part))
        part.replace(arguments.out / name)  # whole or not at all
    first, last = (float(np.mean(part)) for part in (returns[:EPISODES], returns[-EPISODES:]))
    found = {"steps": arguments.steps, "episodes": len(returns), "first": first, "last": last}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
