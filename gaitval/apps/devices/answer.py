"""What devices change, in a sentence for each assumption: the first lines of their page.

A figure is named only if it moved by more than a figure of a device may move by itself
(`results.MARGINS`), and work and force only of a walk at the speed without devices: who walks
slower does less work and lands softer for that alone.
"""

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.text.number_text import number
from gaitval.apps.devices.curves import JOINTS, WalkCurves
from gaitval.apps.devices.results import MARGINS, TITLES
from gaitval.apps.devices.study import DeviceOutcome, at_kept_speed, slower
from gaitval.coordinates import SIDES
from gaitval.model.devices.device import Device

MOST: Final = 4
"""Most changes in a sentence, the largest first: all are in the tables."""
ALIKE: Final = 5.0
"""Percent, up to which the changes of both sides are one."""
WORDS: Final = {
    "kinematics kept": "If the motion is kept",
    "moments kept": "If the control is kept",
    "learned": "Once walking with it is learned",
}
WORK: Final = "J/kg a stride"
LEGS: Final = "positive work of the muscles of both legs"
"""Named first: what a joint saves, another may have to do."""


class Answer(NamedTuple):
    """What one assumption says.

    Attributes
    ----------
    assumption, words : its name, and as the beginning of a sentence.
    changes : in words, with sign and per cent, the largest first; empty if nothing changed, or if
        nothing can be held beside the walk without.
    warning : why nothing can be, or what to keep in mind; empty if there is nothing.
    """

    assumption: str
    words: str
    changes: tuple[str, ...]
    warning: str = ""


class _Change(NamedTuple):
    what: str
    size: float  # in margins
    percent: dict[str, float]  # by side, "" where it is of both


def answers(outcomes: Sequence[DeviceOutcome], devices: Sequence[Device]) -> list[Answer]:
    """What each of `outcomes` with `devices` but the first, which is without, says; the one nearest
    to people who have got used to a device first.
    """
    without, *others = outcomes
    lost = any(
        hinge.joint in JOINTS and not hinge.muscles for each in devices for hinge in each.hinges
    )
    return [_answer(each, without, lost=lost) for each in reversed(others)]


def _answer(outcome: DeviceOutcome, without: DeviceOutcome, *, lost: bool) -> Answer:
    """`lost`: whether a prosthesis has a joint's place, whose muscles are not there."""
    words = WORDS[outcome.assumption]
    if lost and outcome.assumption == "kinematics kept":
        message = "nothing can be said: what the prosthesis does not give, no muscle can"
        return Answer(outcome.assumption, words, (), message)
    if outcome.curves is None or without.curves is None or outcome.fell:
        cycles = number(outcome.cycles, 0)
        message = f"the walker falls after {cycles} gait cycle{'' if cycles == '1' else 's'}"
        return Answer(outcome.assumption, words, (), message)
    if not at_kept_speed(outcome, without):
        part = slower(outcome, without)
        assert part is not None
        now, before = (number(each.speed, 2) for each in (outcome.curves, without.curves))
        way = "slower" if part > 0.0 else "faster"
        message = (
            f"the walker does not keep the speed: {now} instead of {before} m/s, "
            f"{number(100.0 * abs(part), 0)} % {way}. What is less at another speed is no saving, "
            "so no change of work or force is given"
        )
        return Answer(outcome.assumption, words, (), message)
    found = sorted(
        _changes(outcome.curves, without.curves), key=lambda each: (each.what != LEGS, -each.size)
    )
    return Answer(outcome.assumption, words, tuple(map(_in_words, found[:MOST])))


def _changes(now: WalkCurves, before: WalkCurves) -> Iterator[_Change]:
    """Every change beyond the margin of its unit."""
    of_legs = [sum(each.work.values()) for each in (now, before)]
    yield from _change(LEGS, {"": of_legs}, WORK)
    for joint in JOINTS:
        pairs: dict[str, list[float]] = {
            side: [each.work[joint, side] for each in (now, before)] for side in SIDES
        }
        yield from _change(f"{TITLES[joint]} positive work", pairs, WORK)
    peaks: dict[str, list[float]] = {
        side: [float(each.forces[side].max()) for each in (now, before)] for side in SIDES
    }
    yield from _change("vertical peak", peaks, "BW")


def _change(what: str, pairs: dict[str, list[float]], unit: str) -> Iterator[_Change]:
    """What became of a quantity, by side values with and without a device, if it is a change."""
    moved = {
        side: (now - before, 100.0 * (now / before - 1.0))
        for side, (now, before) in pairs.items()
        if before > 0.0 and abs(now - before) > MARGINS[unit]
    }
    if moved:
        size = max(abs(by) for by, _ in moved.values()) / MARGINS[unit]
        yield _Change(what, size, {side: percent for side, (_, percent) in moved.items()})


def _in_words(change: _Change) -> str:
    """Such as "left hip positive work −35 %"."""
    values, of_sides = change.percent, list(change.percent.values())
    if len(values) == 2 and abs(of_sides[0] - of_sides[1]) <= ALIKE:
        return f"{change.what} {_percent(float(np.mean(of_sides)))} on both sides"
    return ", ".join(
        f"{side} {change.what} {_percent(percent)}".strip() for side, percent in values.items()
    )


def _percent(value: float) -> str:
    return f"{'+' if value > 0.0 else '−'}{abs(value):.0f} %"


def torques(outcomes: Sequence[DeviceOutcome]) -> list[str]:
    """Of each joint at which a device acts, a sentence on its largest torque."""
    sentences = []
    for joint in JOINTS:
        largest = max(
            (
                float(np.abs(each.curves.device[joint, side]).max())
                for each in outcomes[1:]
                if each.curves is not None
                for side in SIDES
            ),
            default=0.0,
        )
        if largest >= 0.5 * 10.0**-2:  # less is nothing that two digits show
            sentences.append(
                f"Largest torque of the device at the {TITLES[joint]}: {number(largest, 2)} Nm/kg."
            )
    return sentences


def kept_in_words(outcomes: Sequence[DeviceOutcome]) -> str:
    """How the speed is kept and how well; empty where no walk is held to it."""
    held = [each for each in outcomes[1:] if each.held]
    if not held:
        return ""
    apart = [abs(found) for each in held if (found := slower(each, outcomes[0])) is not None]
    return (
        "Walks with the device are held to the speed and cadence of the walk without, as on a "
        f"treadmill; what is left of a difference of speed is at most "
        f"{number(100.0 * max(apart, default=0.0), 1)} %. Pushes are at the speed that comes."
    )
