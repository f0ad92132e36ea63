"""Training: it learns, it repeats itself, it goes on after a kill."""

import csv
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from safetensors.numpy import save_file
from simulation_fixtures import changed, random_policy

from gaitval._internal.numba.lanes import WIDTH
from gaitval.configuration import Configuration
from gaitval.errors import PolicyError
from gaitval.model.parameters import nominal_parameters
from gaitval.model.urdf import model_hash
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollout_buffer import RolloutBuffer, _shapes, _walk
from gaitval.policy.storage import Policy, load_policy, save_policy
from gaitval.policy.training import _read_checkpoint, read_log, train
from gaitval.policy.training_log import LOG_COLUMNS, write_log
from gaitval.policy.walking_group import WalkingGroup

EASY = {
    # actions of 30 ms: the same seconds of walking in a third of the samples
    "environment": {"push_probability": 0.0, "initial_noise": 0.0, "steps_per_action": 15},
    "training": {
        "workers": 1,
        "environments": 16,
        "rollout_steps": 64,
        "batch_size": 256,
        "epochs": 8,
        "discount": 0.95,
        "gae_lambda": 0.95,
        "learning_rate": 2e-3,
        "final_learning_rate": 3e-4,
        "hidden_units": 64,
        "initial_log_std": -1.0,
        "final_log_std": -1.0,
        "difficulty_ramp": (0.0, 0.001),
    },
}
"""No pushes, no noise at the start, a high learning rate: what can be learnt in 40 updates."""

UPDATES, SAMPLES = 60, 60 * 16 * 64

TINY = {**EASY, "training": {**EASY["training"], "environments": 4, "hidden_units": 8}}
TINY["training"] |= {"rollout_steps": 32, "batch_size": 64}
UPDATE = 4 * 32

SCHEDULED = {
    "checkpoint_samples": 2 * UPDATE,
    "difficulty_ramp": (0.25, 0.7),
    "initial_log_std": -1.0,
    "final_log_std": -1.8,
    "exploration_hold": 0.2,
}
INTERRUPTED = {**TINY, "training": {**TINY["training"], **SCHEDULED}}


class Stopped(Exception):
    """Stands for what ends a training."""


def rows_of(folder):
    with (folder / "training.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def with_seed(task, seed):
    values = task.configuration.model_dump() | {"seed": seed}
    return replace(task, configuration=Configuration.model_validate(values))


class LocalWorkers:
    """What `WalkingWorkers` does, in this process, which starts sooner."""

    def __init__(self, tasks, *, count, workers, steps):
        del workers
        constants = tasks[0].configuration.environment
        arrays = {n: np.zeros(*shape) for n, shape in _shapes(steps, count, constants).items()}
        self.experience = RolloutBuffer(**arrays)
        every = [tasks[i % len(tasks)] for i in range(count)]
        self.groups = {i: WalkingGroup(every[i : i + WIDTH]) for i in range(0, count, WIDTH)}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def set_curriculum(self, difficulty, tolerance_share):
        for group in self.groups.values():
            for environment in group.environments:
                environment.difficulty, environment.tolerance_share = difficulty, tolerance_share

    def begin(self, seed):
        self.seen = {
            first: np.array(
                [group.reset(e, seed=seed + first + e) for e in range(len(group.environments))]
            )
            for first, group in self.groups.items()
        }

    def walk(self, tensors, noise):
        self.experience.actions[:] = noise
        policy = Policy(tensors, {})
        for first, group in self.groups.items():
            _walk(group, self.seen[first], policy, self.experience, first)
        return self.experience


@pytest.fixture
def local(monkeypatch):
    monkeypatch.setattr("gaitval.policy.training.WalkingWorkers", LocalWorkers)


def test_episodes_may_go_worse_as_the_pushes_grow(task, monkeypatch, tmp_path):
    """They end at the first share of what is a fall, and with all difficulty at the last one."""
    messages = []

    class Watched(LocalWorkers):
        def set_curriculum(self, difficulty, tolerance_share):
            messages.append(tolerance_share)
            super().set_curriculum(difficulty, tolerance_share)

    monkeypatch.setattr("gaitval.policy.training.WalkingWorkers", Watched)
    training = {**TINY["training"], "tolerance_shares": (0.4, 0.8), "difficulty_ramp": (0.25, 0.75)}
    tiny = changed(task, **{**TINY, "training": training})
    policy = train(tiny, tmp_path / "new", samples=4 * UPDATE)
    assert messages == pytest.approx([0.4, 0.4, 0.6, 0.8])
    messages.clear()
    train(tiny, tmp_path / "warm", samples=4 * UPDATE, start=policy)
    assert messages == [0.8] * 4


# ---- A real training, short. ----


@pytest.fixture(scope="module")
def trained(task, tmp_path_factory):
    folder = tmp_path_factory.mktemp("training")
    progress = []
    policy = train(
        changed(task, **EASY),
        folder,
        samples=SAMPLES,
        subject="S05",
        on_progress=lambda values: progress.append(dict(values)),
    )
    return policy, folder, progress


@pytest.fixture(scope="module")
def learnt(task, trained, tmp_path_factory):
    """Policies of three seeds, and how far each walks: one may learn little in a short time."""
    easy, policies = changed(task, **EASY), [trained[0]]
    for seed in (1, 2):
        again = replace(easy, configuration=easy.configuration.model_copy(update={"seed": seed}))
        policies.append(
            train(again, tmp_path_factory.mktemp("training"), samples=SAMPLES, subject="S05")
        )
    return [(policy, steps_walked(easy, policy).mean()) for policy in policies]


def steps_walked(task, policy):
    """Actions until the fall, from twenty phases of the cycle, deterministic."""
    environment, lengths = WalkingEnvironment(task), []
    for phase in (np.arange(20) + 0.5) / 20:
        options = {"phase": phase, "mu": nominal_parameters(), "push": None, "noise": 0.0}
        observation, _ = environment.reset(seed=0, options=options)
        ended, length = False, 0
        while not ended:
            observation, _, fell, over, _ = environment.step(policy.act(observation))
            ended, length = fell or over, length + 1
        lengths.append(length)
    return np.array(lengths)


def test_a_short_training_raises_the_episode_length(trained):
    """The mean of the last 100 episodes against the first 100 (which 5 updates complete):
    29 to 33 % longer, and 24 to 29 % more reward, with the three seeds tried."""
    _, folder, _ = trained
    rows = rows_of(folder)
    before, after = (float(rows[i]["episode_length"]) for i in (4, -1))
    assert after > 1.15 * before
    assert float(rows[-1]["episode_reward"]) > 1.15 * float(rows[4]["episode_reward"])


@pytest.mark.slow
def test_learnt_policies_walk_longer_than_the_servo_alone(task, learnt):
    """Without the noise of exploration, against actions of zero from the same starts: 4, 42 and
    18 % further with the three seeds."""
    easy = changed(task, **EASY)
    alone = steps_walked(easy, random_policy(easy, scale=0.0)).mean()
    assert np.mean([length for _, length in learnt]) > 1.15 * alone


def test_the_policy_says_what_it_is_for(task, trained):
    policy, _, _ = trained
    easy = changed(task, **EASY)
    about = policy.about
    assert about["subject"] == "S05"
    assert about["model_hash"] == model_hash(task.model)
    assert about["observation"] == "extended"
    assert about["action_scale"] == task.configuration.environment.action_scale
    assert about["samples"] == SAMPLES
    assert about["device"] == "cpu"
    assert about["seed"] == easy.configuration.seed
    assert about["configuration"] == easy.configuration.model_dump(mode="json")
    assert {"torch", "stable-baselines3", "dartpy"} <= set(about["versions"])
    json.dumps(about)


def test_the_log_has_a_row_for_each_update(trained):
    _, folder, progress = trained
    rows = rows_of(folder)
    assert tuple(rows[0]) == LOG_COLUMNS
    assert [int(row["samples"]) for row in rows] == [(i + 1) * 1024 for i in range(UPDATES)]
    wall = [float(row["wall_seconds"]) for row in rows]
    assert wall == sorted(wall)
    rates = [float(row["learning_rate"]) for row in rows]
    assert rates == sorted(rates, reverse=True)
    # Linear in what remains after the samples of the update.
    remaining = 1 - 1 / UPDATES
    assert rates[0] == pytest.approx(3e-4 + remaining * (2e-3 - 3e-4), rel=1e-6)
    assert rates[-1] == pytest.approx(3e-4, rel=1e-6)
    assert [float(row["difficulty"]) for row in rows] == [0.0] + [1.0] * (UPDATES - 1)
    terms = [sum(float(row[name]) for name in LOG_COLUMNS[9:]) for row in rows]
    assert all(0.0 < term < 1.0 for term in terms)
    assert any((folder / "tensorboard").iterdir())

    assert [values["samples"] for values in progress] == [int(row["samples"]) for row in rows]
    assert {values["total"] for values in progress} == {SAMPLES}
    assert all({"reward", "cycles"} <= set(values) for values in progress)


def test_a_finished_training_is_not_repeated(task, trained):
    """The checkpoint stays until the caller has stored the policy: asking again gives it."""
    policy, folder, _ = trained
    progress = []
    again = train(
        changed(task, **EASY), folder, samples=SAMPLES, subject="S05", on_progress=progress.append
    )
    assert progress == []
    assert again.about == policy.about
    for name, value in policy.tensors.items():
        np.testing.assert_array_equal(again.tensors[name], value)
    assert len(rows_of(folder)) == UPDATES


@pytest.mark.slow
def test_a_warm_start_goes_on_where_the_policy_stands(task, trained, learnt, tmp_path):
    """Also after a stay in files: the first 4096 samples are those of a trained policy, the one of
    three that walks furthest, and no longer those of a new one."""
    folder = trained[1]
    policy, _ = max(learnt, key=lambda each: each[1])
    save_policy(policy, tmp_path / "policy")
    stored = load_policy(tmp_path / "policy")
    easy = changed(task, **EASY)
    warm = train(easy, tmp_path / "warm", samples=4 * 1024, start=stored)
    rows, scratch = rows_of(tmp_path / "warm"), rows_of(folder)
    for name in ("episode_length", "episode_reward"):
        assert float(rows[3][name]) > 1.1 * float(scratch[3][name])
    assert float(rows[0]["difficulty"]) == 1.0
    assert float(rows[0]["learning_rate"]) < 0.5 * float(scratch[0]["learning_rate"])
    # The statistics of observations go on counting: all samples, and 1e-4 to begin with.
    count = (UPDATES + 4) * 1024
    assert warm.tensors["observation_count"][0] == pytest.approx(count, abs=1.0)
    assert np.abs(warm.tensors["action_net.bias"] - stored.tensors["action_net.bias"]).max() > 0.0


@pytest.mark.usefixtures("local")
def test_a_warm_start_with_another_observation_is_refused(task, trained, tmp_path):
    paper = changed(task, environment={"observation": "paper"}, training=TINY["training"])
    with pytest.raises(PolicyError, match="does not fit this task"):
        train(paper, tmp_path, samples=UPDATE, start=trained[0])


# ---- The same again. ----


def test_one_seed_gives_one_policy(task, tmp_path):
    """Bit for bit, and however many processes share the work."""
    policies = []
    for workers, seed in ((1, 3), (2, 3), (1, 4)):
        settings = {**TINY, "training": {**TINY["training"], "workers": workers}}
        chosen = with_seed(changed(task, **settings), seed)
        policies.append(train(chosen, tmp_path / f"{workers}-{seed}", samples=2 * UPDATE))
    first, second, other = policies
    for name, value in first.tensors.items():
        np.testing.assert_array_equal(second.tensors[name], value, err_msg=name)
    assert not np.array_equal(
        first.tensors["action_net.weight"], other.tensors["action_net.weight"]
    )


def test_each_seed_and_each_checkpoint_has_episodes_of_its_own(task, monkeypatch, tmp_path):
    """Not only weights: what a training meets on its way follows from the seed as well."""
    messages = []

    class Watched(LocalWorkers):
        def begin(self, seed):
            messages.append(seed)
            super().begin(seed)

    monkeypatch.setattr("gaitval.policy.training.WalkingWorkers", Watched)
    tiny = changed(task, **INTERRUPTED)
    for seed, name in ((3, "a"), (4, "b"), (3, "c")):
        train(with_seed(tiny, seed), tmp_path / name, samples=4 * UPDATE)
    first, second, again = messages[:2], messages[2:4], messages[4:]
    assert first == again
    assert len({*first, *second}) == 4


# ---- Interrupted. ----


@pytest.fixture(scope="module")
def uninterrupted(task, tmp_path_factory):
    """A training of eight updates, a checkpoint after each two."""
    folder = tmp_path_factory.mktemp("uninterrupted")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gaitval.policy.training.WalkingWorkers", LocalWorkers)
        return train(changed(task, **INTERRUPTED), folder, samples=8 * UPDATE), folder


def assert_the_same(policy, rows, uninterrupted):
    """Bit for bit; the log but for its times."""
    expected, folder = uninterrupted
    assert policy.about == expected.about
    assert set(policy.tensors) == set(expected.tensors)
    for name, value in expected.tensors.items():
        np.testing.assert_array_equal(policy.tensors[name], value, err_msg=name)
    wall = [float(row.pop("wall_seconds")) for row in rows]
    assert wall == sorted(wall)
    for row, other in zip(rows, rows_of(folder), strict=True):
        assert row == {name: value for name, value in other.items() if name != "wall_seconds"}


@pytest.mark.parametrize("update", [1, 6])
@pytest.mark.usefixtures("local")
def test_a_training_that_stopped_gives_the_same_policy(task, uninterrupted, tmp_path, update):
    """Before the first checkpoint, and just before a later one is written."""
    tiny, seen = changed(task, **INTERRUPTED), []

    def stop(progress):
        seen.append(progress["samples"])
        if len(seen) == update:
            raise Stopped

    with pytest.raises(Stopped):
        train(tiny, tmp_path, samples=8 * UPDATE, on_progress=stop)
    again = []
    policy = train(tiny, tmp_path, samples=8 * UPDATE, on_progress=again.append)
    done = (update - 1) // 2 * 2  # updates at the last checkpoint
    assert [p["samples"] for p in again] == [(i + 1) * UPDATE for i in range(done, 8)]
    assert_the_same(policy, rows_of(tmp_path), uninterrupted)


def test_noise_and_difficulty_of_an_update_are_those_of_the_samples_before_it(uninterrupted):
    """Noise is kept for a fifth of the training, then falls; pushes grow from 25 to 70 % of it."""
    before = np.arange(8) / 8
    rows = rows_of(uninterrupted[1])
    noise = np.interp(before, [0.2, 1.0], [-1.0, -1.8])
    np.testing.assert_allclose([float(row["log_std"]) for row in rows], noise, atol=1e-6)
    ramp = np.interp(before, [0.25, 0.7], [0.0, 1.0])
    np.testing.assert_allclose([float(row["difficulty"]) for row in rows], ramp, atol=1e-6)


def test_rows_that_no_checkpoint_has_are_left_out_of_the_log(tmp_path):
    """The log is written before the checkpoint: a kill between both leaves rows that are made
    again."""
    path = tmp_path / "training.csv"
    write_log(path, [dict.fromkeys(LOG_COLUMNS, 0) | {"samples": n} for n in (100, 200, 300)])
    assert [row["samples"] for row in read_log(path, 200)] == ["100", "200"]


@pytest.mark.parametrize("damage", ["length", "empty", "truncated", "unlabelled", "log"])
def test_an_unusable_checkpoint_is_not_gone_on_from(uninterrupted, tmp_path, damage):
    folder = tmp_path / "training"
    shutil.copytree(uninterrupted[1], folder)
    assert _read_checkpoint(folder, 8 * UPDATE).samples == 8 * UPDATE
    path = folder / "checkpoint.safetensors"
    if damage == "empty":
        path.write_bytes(b"")
    elif damage == "truncated":
        path.write_bytes(path.read_bytes()[:-8])
    elif damage == "unlabelled":
        save_file({"numbers": np.zeros(3)}, path)
    elif damage == "log":
        (folder / "training.csv").unlink()
    assert _read_checkpoint(folder, (7 if damage == "length" else 8) * UPDATE) is None


# ---- Devices. ----


# ---- One policy for several people. ----
