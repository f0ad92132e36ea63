"""A measurement that physics, or everybody's walking, contradicts."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from shlex import quote

from gaitval.errors import RecordError


@dataclass(frozen=True)
class QualityFlag:
    """A warning: one value of a recording that is beyond its limit.

    Attributes
    ----------
    check : what was looked at.
    where : the plate, foot or markers concerned.
    value, limit, unit : the value, and the limit that it is beyond.
    message : what was seen, why it is implausible, and what to look at.
    certain : True if it cannot be right, so that nothing may be computed with it.
    plate : name of the plate without which the trial can be used; empty where there is none.
    """

    check: str
    where: str
    value: float
    limit: float
    unit: str
    message: str
    certain: bool = False
    plate: str = ""

    def __str__(self) -> str:
        return f"{self.where}: {self.message}"


def told_once(
    warnings: Iterable[tuple[str, QualityFlag]],
) -> tuple[tuple[str, QualityFlag], ...]:
    """The `warnings`, each with its trial, but one of those that say the same of several trials or
    plates but for its figures: what one cause does in every trial is one thing to look at. It is
    the one farthest beyond its limit, and names the others.
    """
    alike: dict[tuple[str, str, str], list[tuple[str, QualityFlag]]] = {}
    for trial, warning in warnings:
        # what is wrong at one place of the body is not what is wrong at another
        where = "" if warning.plate else warning.where
        words = re.sub(r"[\d.]+", "", warning.message)
        alike.setdefault((warning.check, where, words), []).append((trial, warning))
    found = []
    for members in alike.values():
        trial, worst = max(members, key=lambda each: abs(each[1].value - each[1].limit))
        others = [f"{each.where} in {name}" for name, each in members if each is not worst]
        if others:
            worst = replace(worst, message=f"{worst.message}; so too {', '.join(others)}")
        found.append((trial, worst))
    return tuple(found)


def refuse_certain(source: str, warnings: Sequence[QualityFlag], plates: int) -> None:
    """Refuse a trial, from the file `source`, with a value that cannot be right: raises
    RecordError, which names every `certain` one of its `warnings` and the options to continue
    without it. The last of its `plates`, by their number, cannot be left out.
    """
    wrong = [warning for warning in warnings if warning.certain]
    if not wrong:
        return
    named = sorted({warning.plate for warning in wrong if warning.plate})
    without = [f"--plate {quote(name)}=none" for name in named]
    # To leave plates out helps only if one remains, and if every wrong value is that of a plate.
    spare = len(named) < plates and all(warning.plate for warning in wrong)
    ways = ([" ".join(without)] if spare else []) + ["--kinematics-only"]
    raise RecordError(
        "\n".join(
            [f"{source}: the forces cannot be right.", *(f"  {warning}" for warning in wrong)]
        )
    ).with_way_on(*ways)
