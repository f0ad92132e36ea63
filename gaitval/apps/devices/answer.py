"""What devices do, in words: changes of work and force, and torques."""

from collections.abc import Iterator

import numpy as np

from gaitval._internal.text.number_text import number
from gaitval.apps.devices.curves import JOINTS, WalkCurves
from gaitval.apps.devices.results import MARGINS, TITLES
from gaitval.apps.devices.study import DeviceOutcome, at_kept_speed, slower
from gaitval.coordinates import SIDES


def answer(without: DeviceOutcome, worn: DeviceOutcome) -> str:
    """What changes with devices, by side and in per cent; or why nothing can be said."""
    if worn.fell or worn.curves is None or without.curves is None:
        cycles = number(worn.cycles, 0)
        return f"The walker falls after {cycles} gait cycle{'' if cycles == '1' else 's'}."
    if not at_kept_speed(worn, without):
        part = slower(worn, without) or 0.0
        now, before = (number(each.curves.speed, 2) for each in (worn, without) if each.curves)
        return (
            f"The walker does not keep the speed: {now} instead of {before} m/s, "
            f"{number(100.0 * abs(part), 0)} % {'slower' if part > 0.0 else 'faster'}. What is "
            "less at another speed is no saving, so no change of work or force is given."
        )
    found = ", ".join(_changes(worn.curves, without.curves))
    return f"{found[:1].upper()}{found[1:]}." if found else (
        "No work of muscles and no peak of force moves by more than the margin of its figure."
    )  # fmt: skip


def _changes(now: WalkCurves, before: WalkCurves) -> Iterator[str]:
    """Every change beyond the margin of its unit, such as "left hip positive work −35 %"."""
    work, weights = "J/kg a stride", "BW"
    both, alone = (sum(each.work.values()) for each in (now, before))
    values = [("positive work of the muscles of both legs", work, both, alone)]
    for side in SIDES:
        for joint in JOINTS:
            after, first = (each.work[joint, side] for each in (now, before))
            values.append((f"{side} {TITLES[joint]} positive work", work, after, first))
        after, first = (float(each.forces[side].max()) for each in (now, before))
        values.append((f"{side} vertical peak", weights, after, first))
    for what, unit, after, first in values:
        if first > 0.0 and abs(after - first) > MARGINS[unit]:
            percent = 100.0 * (after / first - 1.0)
            yield f"{what} {'+' if percent > 0.0 else '−'}{abs(percent):.0f} %"


def torques(worn: DeviceOutcome) -> list[str]:
    """Of each joint at which a device acts, a sentence on its largest torque."""
    if worn.curves is None:
        return []
    device = worn.curves.device
    sizes = {
        joint: max(float(np.abs(device[joint, side]).max()) for side in SIDES) for joint in JOINTS
    }
    return [
        f"Largest torque of the device at the {TITLES[joint]}: {number(size, 2)} Nm/kg."
        for joint, size in sizes.items()
        if size >= 0.5 * 10.0**-2  # less is nothing that two digits show
    ]
