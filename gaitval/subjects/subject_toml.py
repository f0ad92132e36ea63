"""A subject as a TOML file: numbers have six significant digits, each curve is one line."""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import tomli_w
from pydantic import BaseModel

from gaitval.gait.record import FittedCurve
from gaitval.model.devices.device import tables_of


def _figure(value: float) -> str:
    return f"{value:.6g}"


def _figures(values: Iterable[float]) -> str:
    return "[" + ", ".join(_figure(value) for value in values) + "]"


def _curve_line(name: str, curve: FittedCurve) -> str:
    return (
        f"{name} = {{ mean = {_figure(curve.mean)}, residual = {curve.residual:.3g}, "
        f"cosine = {_figures(curve.cosine)}, sine = {_figures(curve.sine)} }}"
    )


def _table_lines(values: BaseModel) -> list[str]:
    lines = []
    for name in type(values).model_fields:
        value = getattr(values, name)
        if not isinstance(value, str | int | float):
            continue  # a table of its own
        # JSON's string escapes are a subset of TOML's.
        text = json.dumps(value, ensure_ascii=False) if isinstance(value, str) else _figure(value)
        lines.append(f"{name} = {text}")
    return lines


def _value_line(name: str, value: "float | Sequence[float] | Mapping[str, str]") -> str:
    if isinstance(value, Mapping):
        texts = (f"{json.dumps(key)} = {json.dumps(text)}" for key, text in value.items())
        return f"{name} = {{ {', '.join(texts)} }}"
    return f"{name} = {_figure(value) if isinstance(value, float) else _figures(value)}"


def toml_of(subject: Any) -> str:
    """The text of the file of a `gaitval.subjects.subject.Subject`, which uses this."""
    lines = [
        "# m, kg, s, rad; axes x forward, y left, z up; moments Nm/kg; forces in body weights.",
        "# Curves: mean + sum over k of cosine[k] cos(2 pi k phase) + sine[k] sin(2 pi k phase).",
    ]
    lines += _table_lines(subject)
    tables = {"devices": tables_of(subject.devices)}
    devices = tomli_w.dumps(tables).rstrip() if subject.devices else ""
    lines += [devices] if devices.startswith("devices") else []  # short tables are a key
    lines += ["", "[stance_fraction]", *_table_lines(subject.stance_fraction)]
    for part in ("low_pass", "plates", "paper"):
        if (value := getattr(subject, part)) is not None:
            lines += ["", f"[{part}]", *_table_lines(value)]
    if subject.markers:
        lines += ["", "[markers]"]
        lines += [f'"{name}" = {_figures(at)}' for name, at in subject.markers.items()]
    for part in ("tape", "measurements", "uncertainty"):
        if values := getattr(subject, part):
            lines += ["", f"[{part}]", *(_value_line(*each) for each in values.items())]
    lines += _gait_lines(subject.gait, "gait")
    for trial in subject.trials:
        lines += ["", "[[trials]]", *_table_lines(trial)]
        for part in _PARTS:
            value = getattr(trial, part)
            if value is not None:
                lines += ["", f"[trials.{part}]", *_table_lines(value)]
        lines += _gait_lines(trial.gait, "trials.gait")
    lines += ["", devices] if devices.startswith("[") else []
    return "\n".join(lines) + "\n"


_PARTS: Final = ("stance_fraction", "low_pass", "plates")
"""Tables of a trial, besides its gait."""


def _gait_lines(gait: Any, where: str) -> list[str]:
    lines = ["", f"[{where}]", f"samples = {gait.samples}"]
    if gait.not_recorded:
        lines.append(_value_line("not_recorded", gait.not_recorded))
    if gait.mirrored:
        lines.append(_value_line("mirrored", gait.mirrored))
    if gait.steps is not None:
        steps = ", ".join(f"{name} = {value:.6g}" for name, value in gait.steps)
        lines.append(f"steps = {{ {steps} }}")
    lines += ["", f"[{where}.angles]"]
    lines += [_curve_line(name, curve) for name, curve in gait.angles.items()]
    forces = {"total_force": gait.total_force}
    if gait.forces is not None:
        lines += ["", f"[{where}.moments]"]
        lines += [_curve_line(name, curve) for name, curve in gait.moments.items()]
        forces |= {"forces.right": gait.forces.right, "forces.left": gait.forces.left}
    for name, force in forces.items():
        if force is not None:
            lines += ["", f"[{where}.{name}]"]
            lines += [_curve_line(axis, getattr(force, axis)) for axis in ("forward", "left", "up")]
    return lines
