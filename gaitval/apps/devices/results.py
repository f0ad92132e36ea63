"""The result of devices on a person: its figures."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Final, Literal

from gaitval.coordinates import SIDES, Side
from gaitval.metrics.typed import Number, Result, StrictPositive
from gaitval.reporting.written import Written

if TYPE_CHECKING:
    from gaitval.apps.devices.study import DeviceOutcome

TITLES: Final = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
MARGINS: Final = {
    "cycles": 0.5,
    "m/s": 0.02,
    "s": 0.01,
    "% of the cycle": 0.5,
    "BW": 0.02,
    "Nm/kg": 0.03,
    "J/kg a stride": 0.02,
    "W/kg": 0.1,
}
"""By which a figure may move, by its unit, before it is another: a few hundredths of the largest
value in ordinary walking. Cycles are a count that hangs on single falls."""


class DeviceFigure(Result):
    """A figure of a walk."""

    walk: Literal["without", "with"]
    """The devices."""
    side: Side | None
    """None of what is of the whole walk."""
    quantity: str
    unit: str
    value: Number


class DeviceResult(Written):
    """What devices do to a person."""

    NAME: ClassVar[str] = "device"
    TEMPLATE: ClassVar[str] = "gaitval.apps.devices:device.html.j2"
    TABLES: ClassVar[Mapping[str, tuple[str, type[Result]]]] = {"device": ("figures", DeviceFigure)}

    schema_version: Literal[5]
    """5: of two walks, without and with the devices."""
    person: str
    walker: str
    """Subject or folder that the person is of."""
    cycles: StrictPositive
    """Gait cycles that were asked for."""
    figures: list[DeviceFigure]


def figures_of(outcome: "DeviceOutcome", side: Side) -> dict[str, float]:
    """Figures of an outcome on a side, by name with unit; empty without a complete gait cycle."""
    from gaitval.apps.devices.curves import JOINTS

    curves = outcome.curves
    if curves is None:
        return {}
    found = {
        "speed (m/s)": curves.speed,
        "stride time (s)": curves.stride_time[side],
        "stance (% of the cycle)": 100.0 * curves.stance[side],
        "largest vertical force (BW)": float(curves.forces[side].max()),
    }
    for joint in JOINTS:
        name = TITLES[joint]
        for what, curve, unit in (
            ("moment of the muscles", curves.own[joint, side], "Nm/kg"),
            ("torque of the device", curves.device[joint, side], "Nm/kg"),
            ("power of the device", curves.device_power[joint, side], "W/kg"),
        ):
            # Both ends: of two about as far from 0, which is farther hangs on rounding.
            found[f"{name}: highest {what} ({unit})"] = float(curve.max())
            found[f"{name}: lowest {what} ({unit})"] = float(curve.min())
        found[f"{name}: positive work of the muscles (J/kg a stride)"] = curves.work[joint, side]
    return found | _of_muscles(outcome, side)


LOADED: Final = {"hip": "hip contact force", "knee": "knee contact force, axial"}
LOADED_MUSCLES: Final = {"soleus": "soleus", "gasmed": "medial gastrocnemius"}


def _of_muscles(outcome: "DeviceOutcome", side: Side) -> dict[str, float]:
    """Largest forces of muscles of the calf and of contact, body weights."""
    from gaitval.kinetics.musculature.paths import table

    leg = None if outcome.muscles is None else outcome.muscles.legs.get(side)
    if leg is None:
        return {}
    names = table().names
    found = {
        f"{title}: largest force (BW)": float(leg.force[names.index(name)].max())
        for name, title in LOADED_MUSCLES.items()
        if leg.present[names.index(name)]
    }
    return found | {
        f"largest {title} (BW)": float(leg.contact[name].max())
        for name, title in LOADED.items()
        if name in leg.contact
    }


def figures(without: "DeviceOutcome", worn: "DeviceOutcome") -> list[DeviceFigure]:
    """All figures of a result."""
    found = []
    of_walk: tuple[tuple[Literal["without", "with"], DeviceOutcome], ...]
    of_walk = (("without", without), ("with", worn))
    for walk, outcome in of_walk:
        whole = {"gait cycles walked (cycles)": outcome.cycles}
        for model, rate in ({} if outcome.cost is None else outcome.cost.gross).items():
            whole[f"gross metabolic rate, {model} (W/kg)"] = rate
        sides: dict[Side | None, dict[str, float]] = {None: whole}
        sides |= {side: figures_of(outcome, side) for side in SIDES}
        for of, values in sides.items():
            for name, value in values.items():
                quantity, _, unit = name.removesuffix(")").rpartition(" (")
                found.append(
                    DeviceFigure(walk=walk, side=of, quantity=quantity, unit=unit, value=value)
                )
    return found
