"""The report of devices on a person: without and with, side by side."""

import shutil
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitval.apps.devices.answer import WORDS, answers, kept_in_words, torques
from gaitval.apps.devices.costs import (
    cost_changes,
    in_words,
    model_names,
    rate_in_words,
    signed,
    unknown_in_words,
)
from gaitval.apps.devices.curves import JOINTS, WalkCurves
from gaitval.apps.devices.replayed import replayed, shown_method
from gaitval.apps.devices.results import TITLES, DeviceResult, figures, figures_of
from gaitval.apps.devices.study import CYCLES, PUSHES, DeviceOutcome, Wearer, at_kept_speed
from gaitval.coordinates import SIDES, Side
from gaitval.model.devices.device import Device, write_devices
from gaitval.model.devices.drawn import DEVICES_FILE
from gaitval.model.urdf import write_urdf
from gaitval.policy.storage import Policy, save_policy
from gaitval.quantities.metabolic_cost import LEFT_OUT
from gaitval.reporting.drawing import legend_above, link, new_figure, svg
from gaitval.reporting.replay import SCRIPTS

LINES: Final = {
    "without": {"color": "#1a1a1a", "linestyle": "-"},
    "kinematics kept": {"color": "#009e73", "linestyle": "--"},
    "moments kept": {"color": "#d55e00", "linestyle": "-."},
    "learned": {"color": "#0072b2", "linestyle": ":"},
}
"""Of each assumption; told apart without colours, too, and where they lie on each other."""
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
    """Every curve of the person on a side, a line for each assumption."""
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
    """The curve of a joint and side (`of`) by each assumption."""
    for assumption, each in curves.items():
        curve = factor * getattr(each, kind)[of]
        look: Any = LINES[assumption]
        axes.plot(np.linspace(0.0, 100.0, 101), curve, label=assumption, **look)
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)


def _legend(figure: Figure, axes: Axes) -> None:
    """Say above a `figure` which line of its `axes` is which assumption."""
    legend_above(figure, axes.get_legend_handles_labels()[0], columns=4, size=8.0)


def _force_figure(curves: Mapping[str, WalkCurves]) -> str:
    phase = np.linspace(0.0, 100.0, 101)
    with new_figure(2.6) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, side in zip(panels, SIDES, strict=True):
            for assumption, each in curves.items():
                axes.plot(phase, each.forces[side], label=assumption, **LINES[assumption])
            link(axes, "cycle", side, 0)
            axes.set_title(f"{side} foot")
            axes.set_xlabel("Gait cycle (%)")
        panels[0].set_ylabel("Vertical force (BW)")
        _legend(figure, panels[0])
        return svg(figure, "forces")


def strap_loads(outcome: DeviceOutcome) -> list[dict[str, Any]]:
    """What the straps of each hinge carry: largest and root mean square torque, Nm, and the largest
    angle by which the device and the joint differ, degrees.
    """
    from gaitval.model.tree import ROOT_DOFS

    walk, rows = outcome.walk, []
    for h, (name, joint) in enumerate(zip(walk.hinges, walk.joints, strict=True)):
        apart = walk.angle[:, h] - walk.rollout.positions[:, ROOT_DOFS + joint]
        rows.append(
            {
                "hinge": name.replace("_", " "),
                "largest": float(np.abs(walk.limb[:, h]).max()),
                "rms": float(np.sqrt(np.mean(walk.limb[:, h] ** 2))),
                "apart": float(np.degrees(np.abs(apart).max())),
            }
        )
    return rows


def write_report(
    folder: Path,
    person: Wearer,
    devices: Sequence[Device],
    outcomes: Sequence[DeviceOutcome],
    policy: Policy | None,
) -> None:
    """Write device.html, device.pdf, device.csv, the devices, the person's body, the learned policy
    and device.json into `folder`; walks are of `CYCLES`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_urdf(person.task.model, folder / "model.urdf")
    write_devices(folder / DEVICES_FILE, devices)
    curves = {each.assumption: each.curves for each in outcomes if each.curves is not None}
    sides = {side: [figures_of(each, side) for each in outcomes] for side in SIDES}
    fitted = {side: [TITLES[joint] for joint in _with_device(curves, side)] for side in SIDES}
    tables = {
        side: [
            (name, [each.get(name) for each in found])
            for name in next((each for each in found if each), {})
            if "of the device" not in name or name.partition(":")[0] in fitted[side]
        ]
        for side, found in sides.items()
    }
    result = DeviceResult.made(
        person=person.name, walker=person.origin, cycles=CYCLES, figures=figures(outcomes)
    )
    context: dict[str, Any] = {
        "person": person.name,
        "devices": devices,
        "mass": sum(device.mass for device in devices),
        "outcomes": outcomes,
        "answers": answers(outcomes, devices),
        "torques": torques(outcomes),
        "held": kept_in_words(outcomes),
        "costs": (changes := cost_changes(outcomes)),
        "cost_words": in_words(changes),
        "cost_rates": [f"{WORDS[each.assumption]} {rate_in_words(each)}" for each in changes],
        "cost_unknown": unknown_in_words(outcomes),
        "cost_models": model_names(changes),
        "left_out": LEFT_OUT,
        "signed": signed,
        "kept": [at_kept_speed(each, outcomes[0]) for each in outcomes],
        "tables": tables,
        "pushes": len(PUSHES),
        "straps": [(each.assumption, strap_loads(each)) for each in outcomes if each.walk.hinges],
        "picture": replayed(folder, person, outcomes),
        "method": shown_method(person, outcomes[0]),
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
    result.write(folder, scripts=SCRIPTS, **context)
    shutil.rmtree(folder / "policy", ignore_errors=True)  # of an earlier run that learned
    if policy is not None:
        save_policy(policy, folder / "policy")
