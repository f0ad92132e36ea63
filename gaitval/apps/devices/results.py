"""The result of devices on a person as a file: its figures, walked again, and beside others.

A figure of a device is neither better nor worse than another, so a change in either direction
counts.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from gaitval._internal.io.artefacts import read_json, write_json, write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ArtefactError

if TYPE_CHECKING:
    from gaitval.apps.devices.study import DeviceOutcome, Say, Wearer

RESULT: Final = "device.json"
"""The figures of a result, in its folder, and what they were made from."""
VERSION: Final = 3
"""3: walks are held to the speed without devices, and powers are filtered."""
TITLES: Final = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
MARGINS: Final = {
    "cycles": 0.5,
    "pushes": 2.0,
    "m/s": 0.02,
    "s": 0.01,
    "% of the cycle": 0.5,
    "BW": 0.02,
    "Nm/kg": 0.03,
    "J/kg a stride": 0.02,
    "W/kg": 0.1,
}
"""By which a figure may move, by its unit, before it is another: a few hundredths of the largest
value in ordinary walking. Cycles and pushes are counts that hang on single falls."""


class DeviceFigure(NamedTuple):
    """A figure of a result.

    Attributes
    ----------
    quantity, unit : what it is.
    of : side and assumption.
    value : None where nothing walked.
    """

    quantity: str
    of: str
    unit: str
    value: float | None


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
    from gaitval.musculature.paths import table

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


def figures(outcomes: "Sequence[DeviceOutcome]") -> list[DeviceFigure]:
    """All figures of a result."""
    found = []
    for outcome in outcomes:
        found.append(
            DeviceFigure("gait cycles walked", outcome.assumption, "cycles", outcome.cycles)
        )
        if outcome.survived is not None:
            survived = float(outcome.survived)
            found.append(DeviceFigure("pushes survived", outcome.assumption, "pushes", survived))
        for model, rate in ({} if outcome.cost is None else outcome.cost.gross).items():
            of = f"{model}, {outcome.assumption}"
            found.append(DeviceFigure("gross metabolic rate", of, "W/kg", rate))
        for side in SIDES:
            for name, value in figures_of(outcome, side).items():
                quantity, _, unit = name.rpartition(" (")
                found.append(
                    DeviceFigure(quantity, f"{side}, {outcome.assumption}", unit[:-1], value)
                )
    return found


def write_result(
    folder: Path,
    person: "Wearer",
    outcomes: "Sequence[DeviceOutcome]",
    cycles: float,
) -> None:
    """Write the `RESULT` of a `folder`; numbers with six digits."""
    about: dict[str, Any] = {"version": VERSION, "person": person.name, "walker": person.origin}
    about |= {"cycles": cycles, "figures": _rounded(figures(outcomes))}
    write_json(folder / RESULT, about)


def _rounded(rows: Sequence[DeviceFigure]) -> list[dict[str, Any]]:
    return [
        each._replace(value=None if each.value is None else float(f"{each.value:.6g}"))._asdict()
        for each in rows
    ]


def _read(folder: Path) -> tuple[dict[str, Any], list[DeviceFigure]]:
    path = folder / RESULT
    values = read_json(path)
    try:
        if values["version"] != VERSION:
            raise ValueError(f"version {values['version']}, not {VERSION}")
        rows = [DeviceFigure(**each) for each in values["figures"]]
        for each in rows:
            if each.unit not in MARGINS:
                raise ValueError(f"{each.quantity} is in {each.unit!r}")
            if not (each.value is None or math.isfinite(each.value)):
                raise ValueError(f"{each.quantity} of {each.of} is {each.value}")
        if not (float(values["cycles"]) > 0.0 and isinstance(values["walker"], str) and rows):
            raise ValueError("no figures, or not of whom")
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path}: not the result of devices on a person ({error}). Make it again with `gaitval "
            "device`."
        ) from None
    return values, rows


def stored(folder: Path) -> list[DeviceFigure]:
    """The figures of a stored result. Raises ArtefactError."""
    return _read(folder)[1]


def person_of(folder: Path) -> str:
    """Who wears the devices of a stored result. Raises ArtefactError."""
    return str(_read(folder)[0].get("person", ""))


def walk_again(folder: Path, say: "Say" = lambda _: None) -> list[DeviceFigure]:
    """The figures of a stored result, with everything but the learned policy worked out again.
    Raises GaitvalError.
    """
    from gaitval.apps.devices.study import outcomes, wearer
    from gaitval.model.devices.drawn import devices_in
    from gaitval.policy.storage import load_policy

    about, _ = _read(folder)
    own = folder / about["walker"]
    person = wearer(str(own) if own.is_file() else about["walker"])
    learned = folder / "policy"
    found, _ = outcomes(
        person,
        devices_in(folder),
        samples=0,
        learned=load_policy(learned) if learned.is_dir() else None,
        cycles=float(about["cycles"]),
        say=say,
    )
    return figures(found)


def table(
    results: Mapping[str, Sequence[DeviceFigure]],
) -> tuple[list[str], list[list[str | None]]]:
    """Columns and rows of results side by side, by the names of their folders."""
    keys = dict.fromkeys(
        (row.quantity, row.of, row.unit) for each in results.values() for row in each
    )
    found = {
        name: {(row.quantity, row.of, row.unit): row.value for row in each}
        for name, each in results.items()
    }
    rows = [
        [
            *key,
            *(
                None if (value := found[name].get(key)) is None else f"{value:.6g}"
                for name in found
            ),
        ]
        for key in keys
    ]
    return ["quantity", "of", "unit", *found], rows


def write_table(path: Path, results: Mapping[str, Sequence[DeviceFigure]]) -> None:
    """Write results side by side as CSV."""
    columns, rows = table(results)
    write_text(path, csv_text([columns, *rows]))


def write_side_by_side(
    folder: Path, name: str, results: Mapping[str, Sequence[DeviceFigure]]
) -> None:
    """Write results side by side as `name`.html, `name`.pdf and `name`.csv into `folder`."""
    from gaitval import __version__
    from gaitval.reporting.page import write_page

    columns, rows = table(results)
    folder.mkdir(parents=True, exist_ok=True)
    context = {"version": __version__, "names": columns[3:], "rows": rows}
    write_page(folder, name, "gaitval.apps.devices:side_by_side.html.j2", context)
    write_table(folder / f"{name}.csv", results)
