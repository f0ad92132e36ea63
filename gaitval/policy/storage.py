"""Store trained policies: a small network, with the statistics that normalise its observations.

They are stored as `policy.safetensors` (the numbers) and `policy.json` (what they are for), never
pickled.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import safetensors
from numpy.typing import NDArray
from safetensors.numpy import load_file, save_file

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import read_json, replacing, versions, write_json
from gaitval.arrays import Array
from gaitval.configuration import Configuration, EnvironmentSettings
from gaitval.errors import ArtefactError, PolicyError
from gaitval.model.body import BodyModel
from gaitval.model.urdf import model_hash
from gaitval.policy.observation import normalise
from gaitval.policy.senses import observation_size

FORMAT = 2
NETWORK = (
    "mlp_extractor.policy_net.0.weight",
    "mlp_extractor.policy_net.0.bias",
    "mlp_extractor.policy_net.2.weight",
    "mlp_extractor.policy_net.2.bias",
    "action_net.weight",
    "action_net.bias",
)
"""Tensors of the action network, first layer first (stable-baselines3's names)."""
NORMALISATION = ("observation_mean", "observation_variance")
MEANING = ("observation", "mirror", "action_scale", "action_limit", "pace_scale")
"""Settings of the environment that define what a policy's numbers mean."""


@dataclass(frozen=True)
class Policy:
    """Deterministic walking policy π(a | s, μ).

    Attributes
    ----------
    tensors : all numbers of the network (including the critic, so that training can continue), the
        observation mean and variance, and the variance of returns.
    about : what the policy was trained for: `subject` and `model_hash`, or `general`; and
        `observation`, `action_scale`, `samples`, `seed`, `device`, `configuration`, `versions`.
    """

    tensors: Mapping[str, NDArray[Any]]
    about: Mapping[str, Any]

    @property
    def hidden_units(self) -> int:
        """Units of each hidden layer."""
        return len(self.tensors[NETWORK[1]])

    @cached_property
    def deviation(self) -> Array:
        """(size,) by which observations are divided. 1e-8 is VecNormalize's."""
        return np.asarray(np.sqrt(self.tensors["observation_variance"] + 1e-8))

    @cached_property
    def _layers(self) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
        """Matrix (inputs, outputs) and shift of each layer."""
        return [
            (self.tensors[weight].T, self.tensors[bias])
            for weight, bias in zip(NETWORK[::2], NETWORK[1::2], strict=True)
        ]

    @property
    def key(self) -> str:
        """Hash of the numbers that actions depend on."""
        numbers = hashlib.blake2b(digest_size=16)
        for name in (*NETWORK, *NORMALISATION):
            numbers.update(np.ascontiguousarray(self.tensors[name]).tobytes())
        return numbers.hexdigest()

    def act(self, observation: NDArray[Any]) -> NDArray[np.float32]:
        """Mean action (A,) or (B, A) for an `observation` (size,) or (B, size), not normalised."""
        x = np.empty(observation.shape, dtype=np.float32)
        size = observation.shape[-1]
        normalise(
            observation.reshape(-1, size), self.tensors["observation_mean"], self.deviation,
            x.reshape(-1, size),
        )  # fmt: skip
        *hidden, (weight, bias) = self._layers
        for matrix, shift in hidden:
            x = x @ matrix
            x += shift
            np.tanh(x, x)
        x = x @ weight
        x += bias
        return x


def of_body(model: BodyModel, subject: str) -> dict[str, str]:
    """What the policy of a `subject`, with the body `model`, says of whom it is for."""
    return {"subject": subject, "model_hash": model_hash(model)}


def description(
    configuration: Configuration, about: Mapping[str, Any], samples: int, *, device: str = "cpu"
) -> dict[str, Any]:
    """What a policy says of itself (`Policy.about`) after a training of `samples` environment steps
    with `configuration` on a `device`; `about` says whom it is for.
    """
    return {
        **about,
        "observation": configuration.environment.observation,
        "action_scale": configuration.environment.action_scale,
        "samples": samples,
        "seed": configuration.seed,
        "device": device,
        "configuration": configuration.model_dump(mode="json"),
        "versions": versions(),
    }


def save_policy(policy: Policy, folder: Path) -> None:
    """Write `policy.safetensors` and `policy.json` of `policy` into `folder`. Raises ArtefactError
    if the disk is full, or the folder may not be written to.
    """
    folder = Path(folder)
    with replacing(folder / "policy.safetensors") as temporary:
        save_file({k: np.ascontiguousarray(v) for k, v in policy.tensors.items()}, temporary)
    write_json(folder / "policy.json", {"format": FORMAT, **policy.about})


def load_policy(
    folder: Path, *, model_hash: str | None = None, environment: EnvironmentSettings | None = None
) -> Policy:
    """Read what `save_policy` wrote into `folder`, to walk with. Raises PolicyError if the policy
    is missing, damaged or general, was trained for another body model than `model_hash`, or to
    observe or act otherwise than in `environment`, if these are given.
    """
    policy = _read(Path(folder))
    about = policy.about
    if about.get("general"):
        raise PolicyError(
            f"{folder}: this is a general policy, which was trained on several people and is only "
            "a start for a training. Train a policy for this body from it."
        )
    if model_hash is not None and about.get("model_hash") != model_hash:
        raise PolicyError(
            f"{folder}: this policy was trained for {about.get('subject', 'another subject')} with "
            f"the body model {str(about.get('model_hash'))[:12]}, but the model here is "
            f"{model_hash[:12]}. Train a policy for this model, or use the model it was made for."
        )
    if environment is not None:
        _check_meaning(policy, environment, folder)
    return policy


def load_start(
    folder: Path,
    environment: EnvironmentSettings,
    *,
    model_hash: str | None = None,
    hidden_units: int | None = None,
) -> Policy:
    """Read a policy in `folder` that a training may start from: a general one, or one of the same
    body, by `model_hash`. Raises PolicyError if the policy is missing, damaged, has another network
    than `hidden_units`, if given, was trained to observe or act otherwise than in `environment`, or
    is neither general nor for this body.
    """
    policy = _read(Path(folder))
    about = policy.about
    if not about.get("general") and (model_hash is None or about.get("model_hash") != model_hash):
        raise PolicyError(
            f"{folder}: this policy was trained for {about.get('subject', 'another subject')} "
            f"only (body model {str(about.get('model_hash'))[:12]}). Start from a general policy, "
            "from one for the same body, or from nothing (--scratch)."
        )
    if hidden_units is not None and policy.hidden_units != hidden_units:
        raise PolicyError(
            f"{folder}: this policy has {policy.hidden_units} hidden units, but "
            f"training.hidden_units is {hidden_units}. Set it to the policy's number, or start "
            "from nothing (--scratch)."
        )
    _check_meaning(policy, environment, folder)
    return policy


def _check_meaning(policy: Policy, environment: EnvironmentSettings, folder: Path) -> None:
    """Refuse a policy whose numbers mean something other than `environment` says."""
    from gaitval.policy.environment import action_size

    trained: Any = policy.about
    for table in ("configuration", "environment"):
        trained = trained.get(table, {})
        if not isinstance(trained, Mapping):
            raise PolicyError(
                f"{folder / 'policy.json'}: {table} is {trained!r:.80}, not a table of settings; "
                "the file was edited. Train the policy again."
            )
    for name in MEANING:
        seen, wanted = trained.get(name), getattr(environment, name)
        if seen != wanted:
            raise PolicyError(
                f"{folder}: this policy was trained with environment.{name} = {seen!r}, but the "
                f"configuration has {wanted!r}. Set it to the value that the policy was trained "
                "with, or train a policy with --scratch."
            )
    # The settings can agree and the sizes differ: a later version may have added to an observation
    # of the same name.
    seen_size = policy.tensors[NETWORK[0]].shape[1]
    wanted_size = observation_size(environment)
    if seen_size != wanted_size:
        raise PolicyError(
            f"{folder}: this policy observes {seen_size} numbers, but a walker here has "
            f"{wanted_size} (environment.observation = {environment.observation!r}). It was "
            "trained with another observation, or by another version of gaitval. Train a policy "
            "with --scratch."
        )
    actions, wanted_actions = len(policy.tensors[NETWORK[5]]), action_size(environment)
    if actions != wanted_actions:
        raise PolicyError(
            f"{folder}: this policy chooses {actions} numbers, but a walker here takes "
            f"{wanted_actions} (a joint each, and the pace). It was made for another body or "
            "another version of gaitval. Train a policy with --scratch."
        )


def _check_shapes(tensors: Mapping[str, NDArray[Any]], path: Path) -> None:
    """Refuse tensors that do not fit each other, or are no real numbers."""
    for name, value in tensors.items():
        if value.dtype not in (np.float32, np.float64):
            raise PolicyError(
                f"{path}: {name} is of type {value.dtype}, but a policy has float32 or float64. "
                "Train it again."
            )
    # All sizes follow from the first and the last weights; every other tensor is held against them.
    first, last = tensors[NETWORK[0]].shape, tensors[NETWORK[4]].shape
    units, size = first if len(first) == 2 else (0, 0)
    wanted = ((units, size), (units,), (units, units), (units,), (*last[:1], units), last[:1])
    for name, shape in zip((*NETWORK, *NORMALISATION), (*wanted, (size,), (size,)), strict=True):
        seen = tensors[name].shape
        if seen != shape or not seen or 0 in seen:
            raise PolicyError(
                f"{path}: {name} has the shape {seen}, which does not fit a network of {size} "
                f"observations and {units} hidden units: {shape}. It is damaged or of another "
                "program. Train the policy again."
            )
    if not all(np.isfinite(value).all() for value in tensors.values()):
        raise PolicyError(f"{path}: some of its numbers are not finite. Train it again.")
    if (tensors["observation_variance"] < 0).any():
        raise PolicyError(f"{path}: observation_variance is negative. Train it again.")


def _read(folder: Path) -> Policy:
    path = folder / "policy.safetensors"
    if not path.exists():
        raise PolicyError(
            f"{path}: there is no policy here. Train one with `gaitval stage train SUBJECT`."
        )
    try:
        about = read_json(folder / "policy.json")
    except ArtefactError as error:
        raise PolicyError(str(error)) from None
    if not isinstance(about, dict) or about.pop("format", None) != FORMAT:
        raise PolicyError(
            f"{folder / 'policy.json'}: not a policy description of format {FORMAT}. "
            "Train the policy again with this version of gaitval."
        )
    try:
        tensors = load_file(file_gate.passed(path, PolicyError, largest=file_gate.SIZES.unpacked))
    except (safetensors.SafetensorError, OSError, KeyError, TypeError, ValueError) as error:
        raise PolicyError(
            f"{path}: cannot be read as safetensors ({error}); it is truncated or damaged. Train "
            "the policy again."
        ) from None
    missing = [name for name in (*NETWORK, *NORMALISATION) if name not in tensors]
    if missing:
        raise PolicyError(f"{path}: the tensors {', '.join(missing)} are missing. Train it again.")
    _check_shapes(tensors, path)
    return Policy(tensors, about)
