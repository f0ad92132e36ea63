"""Faults that `gate_mutations.py` plants in the files of a stored baseline."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from safetensors.numpy import load_file, save_file

from gaitval.arrays import Array
from gaitval.model.parameters import PARAMETERS

Fault = Callable[[Path], None]
"""Changes a copy of a baseline."""

Tensors = dict[str, Array]
_NETS: Final = ("mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2", "action_net")


def _policy(change: Callable[[Tensors], object]) -> Fault:
    def plant(baseline: Path) -> None:
        path = baseline / "policy" / "policy.safetensors"
        tensors = load_file(path)
        change(tensors)
        save_file({name: np.ascontiguousarray(value) for name, value in tensors.items()}, path)

    return plant


def _scaled(factor: float, *names: str) -> Fault:
    def scale(tensors: Tensors) -> None:
        for name in names:
            for part in ("weight", "bias"):
                tensors[f"{name}.{part}"] *= factor

    return _policy(scale)


def _shifted(name: str, shift: float, *, only: int | None = None) -> Fault:
    def move(tensors: Tensors) -> None:
        tensors[name][slice(None) if only is None else only] += shift

    return _policy(move)


def _json(name: str, change: Callable[[dict[str, Any]], object]) -> Fault:
    def plant(baseline: Path) -> None:
        values = json.loads((baseline / name).read_text(encoding="utf-8"))
        change(values)
        (baseline / name).write_text(json.dumps(values), encoding="utf-8")

    return plant


def _mu(parameter: str, change: Callable[[float], float]) -> Fault:
    def edit(values: dict[str, Any]) -> None:
        mu = values["identified"]
        mu[PARAMETERS.index(parameter)] = change(mu[PARAMETERS.index(parameter)])

    return _json("identification.json", edit)


def _correction(change: Callable[[Array, list[str]], Array]) -> Fault:
    def edit(values: dict[str, Any]) -> None:
        found = change(np.array(values["harmonics"]), values["joints"])
        values["harmonics"] = found.tolist()

    return _json("correction.json", edit)


def _text(name: str, old: str, new: str) -> Fault:
    def plant(baseline: Path) -> None:
        text = (baseline / name).read_text(encoding="utf-8")
        assert old in text, old
        (baseline / name).write_text(text.replace(old, new, 1), encoding="utf-8")

    return plant


def _halved(tensors: Tensors) -> None:
    """As a policy stored in half the precision."""
    for name in _NETS:
        tensors[f"{name}.weight"] = tensors[f"{name}.weight"].astype(np.float16).astype(np.float32)


def _exchanged(tensors: Tensors) -> None:
    tensors["action_net.weight"][[0, 7]] = tensors["action_net.weight"][[7, 0]]
    tensors["action_net.bias"][[0, 7]] = tensors["action_net.bias"][[7, 0]]


def _sides(harmonics: Array, joints: list[str]) -> Array:
    swapped = [name[:-1] + {"r": "l", "l": "r"}.get(name[-1], name[-1]) for name in joints]
    order = [joints.index(name) if name in joints else joints.index(joint)
             for joint, name in zip(joints, swapped, strict=True)]  # fmt: skip
    return harmonics[order]


def _without_knees(harmonics: Array, joints: list[str]) -> Array:
    knees = [name.startswith("knee") for name in joints]
    return np.where(np.array(knees)[:, None], 0.0, harmonics)


def _record(table: str, curve: str, factor: float) -> Fault:
    """A curve of the record x a factor."""

    def plant(baseline: Path) -> None:
        import tomllib

        import tomli_w

        values = tomllib.loads((baseline / "subject.toml").read_text(encoding="utf-8"))
        for name, series in values["gait"][table].items():
            if name.startswith(curve):
                series["mean"] *= factor
                for part in ("cosine", "sine"):
                    series[part] = [factor * value for value in series[part]]
        (baseline / "subject.toml").write_text(tomli_w.dumps(values), encoding="utf-8")

    return plant


FAULTS: Final[Mapping[str, Fault]] = {
    "weights x 1.02": _scaled(1.02, *_NETS),
    "weights x 1.05": _scaled(1.05, *_NETS),
    "action net x 0.9": _scaled(0.9, "action_net"),
    "action net x 0.98": _scaled(0.98, "action_net"),
    "action bias + 0.05": _shifted("action_net.bias", 0.05),
    "bias of the first layer + 0.05": _shifted("mlp_extractor.policy_net.0.bias", 0.05),
    "bias of the second layer + 0.05": _shifted("mlp_extractor.policy_net.2.bias", 0.05),
    "one action's bias + 0.3": _shifted("action_net.bias", 0.3, only=3),
    "pace's bias + 0.2": _shifted("action_net.bias", 0.2, only=25),
    "observation mean + 0.05": _shifted("observation_mean", 0.05),
    "observation variance x 1.2": _policy(lambda t: t["observation_variance"].__imul__(1.2)),
    "weights in half precision": _policy(_halved),
    "hips exchanged in the action net": _policy(_exchanged),
    "exploration x 2": _shifted("log_std", float(np.log(2.0))),
    "mu: damping x 1.5": _mu("damping", lambda v: 1.5 * v),
    "mu: friction x 0.98": _mu("friction", lambda v: 0.98 * v),
    "mu: friction x 0.5": _mu("friction", lambda v: 0.5 * v),
    "mu: thigh + 2 %": _mu("thigh_length", lambda v: 1.02 * v),
    "mu: shank + 2 %": _mu("shank_length", lambda v: 1.02 * v),
    "mu: foot + 2 %": _mu("foot_length", lambda v: 1.02 * v),
    "mu: ankle 5 mm forward": _mu("ankle_x", lambda v: v + 0.005),
    "mu: hip 5 mm to the side": _mu("hip_y", lambda v: v + 0.005),
    "mu: knee 5 mm up": _mu("knee_z", lambda v: v + 0.005),
    "correction zeroed": _correction(lambda h, _: 0.0 * h),
    "correction x 1.1": _correction(lambda h, _: 1.1 * h),
    "correction with the other sign": _correction(lambda h, _: -h),
    "correction of the other side": _correction(_sides),
    "correction without the knees": _correction(_without_knees),
    "height + 5 mm": _json("correction.json", lambda v: v.update(height=v["height"] + 0.005)),
    "filter cut-off x 0.5": _text(
        "configuration.toml", "filter_frequency = ", "filter_frequency = 5.0 # "
    ),
    "12 of 24 cycles": _text("configuration.toml", "\ncycles = 24", "\ncycles = 12"),
    "hip servo x 0.9": _text("configuration.toml", "hip = 320.0", "hip = 288.0"),
    "events at 100 N": _text(
        "configuration.toml", "event_threshold = 20.0", "event_threshold = 100.0"
    ),
    "record: sign of the hip adduction moment": _record("moments", "hip_adduction", -1.0),
    "record: moments x 0.95": _record("moments", "", 0.95),
    "record: knee angle x 1.03": _record("angles", "knee_angle", 1.03),
    "mass + 2 %": _text("subject.toml", "mass_kg = 64.95", "mass_kg = 66.25"),
}
