"""The report of devices on a person: without and with, side by side."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitval.apps.devices.answer import answer, torques
from gaitval.apps.devices.costs import UNKNOWN, cost_change, signed
from gaitval.apps.devices.curves import JOINTS, WalkCurves
from gaitval.apps.devices.results import TITLES, DeviceResult, figures, figures_of
from gaitval.apps.devices.study import CYCLES, DeviceOutcome, Wearer, at_kept_speed
from gaitval.coordinates import SIDES, Side
from gaitval.model.devices.device import Device, write_devices
from gaitval.quantities.metabolic_cost import LEFT_OUT
from gaitval.reporting.drawing import legend_above, link, new_figure, svg

LINES: Final = {
    "without": {"color": "#1a1a1a", "linestyle": "-"},
    "with": {"color": "#d55e00", "linestyle": "-."},
}
"""Of each walk; told apart without colours, too, and where they lie on each other."""
ROWS: Final = {
    "angles": ("Angle (°)", 180.0 / np.pi),
    "own": ("Moment of the muscles (Nm/kg)", 1.0),
    "own_power": ("Power of the muscles (W/kg)", 1.0),
}
OF_DEVICE: Final = {
    "device": ("torque of the device (Nm/kg)", 1.0),
    "device_power": ("power of the device (W/kg)", 1.0),
}
NO_TORQUE: Final = 1e-6
"""Nm/kg, up to which a torque is the rounding of a difference of two moments."""


def _with_device(curves: Mapping[str, WalkCurves], side: Side) -> list[str]:
    """The joints of a `side` at which a device has a torque in any of the walks."""
    return [
        joint
        for joint in JOINTS
        if any(np.abs(each.device[joint, side]).max() > NO_TORQUE for each in curves.values())
    ]


def _figure(curves: Mapping[str, WalkCurves], side: Side, name: str) -> str:
    """Every curve of the person on a side, a line for each walk."""
    with new_figure(1.8 * len(ROWS)) as figure:
        panels = figure.subplots(len(ROWS), len(JOINTS), sharex=True)
        for row, (kind, (label, factor)) in zip(panels, ROWS.items(), strict=True):
            for axes, joint in zip(row, JOINTS, strict=True):
                _lines(axes, curves, kind, (joint, side), factor)
            row[0].set_ylabel(label, fontsize=7)
        for column, joint in enumerate(JOINTS):
            panels[0][column].set_title(TITLES[joint])
            panels[-1][column].set_xlabel("Gait cycle (%)")
        for number, axes in enumerate(panels.flat):
            link(axes, "cycle", side, number)
        _legend(figure, panels[0][0])
        return svg(figure, name)


def _device_figure(curves: Mapping[str, WalkCurves], side: Side, name: str) -> str:
    """Torque and power of the devices at the joints of a side at which they act."""
    joints = _with_device(curves, side)
    worn = {each: own for each, own in curves.items() if each != "without"}
    with new_figure(1.9 * len(joints) + 0.2) as figure:
        panels = figure.subplots(len(joints), len(OF_DEVICE), sharex=True, squeeze=False)
        for row, joint in zip(panels, joints, strict=True):
            for axes, (kind, (label, factor)) in zip(row, OF_DEVICE.items(), strict=True):
                _lines(axes, worn, kind, (joint, side), factor)
                axes.set_title(f"{TITLES[joint]}: {label}")
        for axes in panels[-1]:
            axes.set_xlabel("Gait cycle (%)")
        for number, axes in enumerate(panels.flat):
            link(axes, "cycle", side, number)
        _legend(figure, panels[0][0])
        return svg(figure, name)


def _lines(
    axes: Axes,
    curves: Mapping[str, WalkCurves],
    kind: str,
    of: tuple[str, Side],
    factor: float,
) -> None:
    """The curve of a joint and side (`of`) of each walk."""
    for walk, each in curves.items():
        curve = factor * getattr(each, kind)[of]
        look: Any = LINES[walk]
        axes.plot(np.linspace(0.0, 100.0, 101), curve, label=walk, **look)
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)


def _legend(figure: Figure, axes: Axes) -> None:
    """Say above a `figure` which line of its `axes` is which walk."""
    legend_above(figure, axes.get_legend_handles_labels()[0], columns=4, size=8.0)


def _force_figure(curves: Mapping[str, WalkCurves]) -> str:
    phase = np.linspace(0.0, 100.0, 101)
    with new_figure(2.6) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, side in zip(panels, SIDES, strict=True):
            for walk, each in curves.items():
                axes.plot(phase, each.forces[side], label=walk, **LINES[walk])
            link(axes, "cycle", side, 0)
            axes.set_title(f"{side} foot")
            axes.set_xlabel("Gait cycle (%)")
        panels[0].set_ylabel("Vertical force (BW)")
        _legend(figure, panels[0])
        return svg(figure, "forces")


def write_report(
    folder: Path,
    person: Wearer,
    devices: Sequence[Device],
    without: DeviceOutcome,
    worn: DeviceOutcome,
) -> None:
    """Write device.html, device.pdf, device.csv, device.json and devices.toml, the `devices`, into
    `folder`; walks are of `CYCLES`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_devices(folder / "devices.toml", devices)
    outcomes = {"without": without, "with": worn}
    curves = {name: each.curves for name, each in outcomes.items() if each.curves is not None}
    fitted = {side: [TITLES[joint] for joint in _with_device(curves, side)] for side in SIDES}
    tables = {}
    for side in SIDES:
        found = [figures_of(each, side) for each in outcomes.values()]
        tables[side] = [
            (name, [each.get(name) for each in found])
            for name in next((each for each in found if each), {})
            if "of the device" not in name or name.partition(":")[0] in fitted[side]
        ]
    result = DeviceResult.made(
        person=person.name, walker=person.origin, cycles=CYCLES, figures=figures(without, worn)
    )
    change = cost_change(without, worn)
    context: dict[str, Any] = {
        "person": person.name,
        "devices": devices,
        "mass": sum(device.mass for device in devices),
        "outcomes": outcomes,
        "answer": answer(without, worn),
        "torques": torques(worn),
        "held": worn.held,
        "kept": at_kept_speed(worn, without),
        "cost": change,
        "cost_words": UNKNOWN if change is None else change.words(),
        "left_out": LEFT_OUT,
        "signed": signed,
        "tables": tables,
        "drawings": {
            "right": partial(_figure, curves, "right", "right"),
            "left": partial(_figure, curves, "left", "left"),
            **{
                f"device-{side}": partial(_device_figure, curves, side, f"device-{side}")
                for side in SIDES
                if fitted[side]
            },
            "forces": partial(_force_figure, curves),
        },
    }
    result.write(folder, **context)
