"""A measurement that physics, or everybody's walking, contradicts."""

from collections.abc import Sequence
from dataclasses import dataclass
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


def refuse_certain(source: str, warnings: Sequence[QualityFlag], plates: int) -> None:
    """Refuse a trial, from the file `source`, with a value that cannot be right: raises
    RecordError, which names every `certain` one of its `warnings` and the options to continue
    without it. The last of its `plates`, by their number, cannot be left out.
    """
    wrong = [warning for warning in warnings if warning.certain]
    if not wrong:
        return
    named = sorted({warning.plate for warning in wrong if warning.plate})
    without = [f"--no-plate {quote(name)}" for name in named]
    # To leave plates out helps only if one remains, and if every wrong value is that of a plate.
    spare = len(named) < plates and all(warning.plate for warning in wrong)
    ways = ([" ".join(without)] if spare else []) + ["--kinematics-only"]
    raise RecordError(
        "\n".join(
            [f"{source}: the forces cannot be right.", *(f"  {warning}" for warning in wrong)]
        )
    ).with_way_on(*ways)
