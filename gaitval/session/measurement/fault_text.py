"""The faults of a session in words and figures: warnings, and a table of what was looked for."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.consistency import NAMED, OTHER
from gaitval.gait.quality_flags import QualityFlag
from gaitval.session.measurement.estimate import Examined, FoundFault, alone
from gaitval.session.measurement.kinds import BOTH, KINDS, OF_PART, kind_of
from gaitval.session.trial import WalkingTrial

CHECK: Final = "measurement"
"""First word of the check of a warning; the kinds of what is named follow."""
OTHERWISE: Final = (
    "look at these, and give more trials if there are: each shows other steps on the plates"
)


@dataclass(frozen=True)
class FaultRow:
    """A fault that was looked for: a line of the table.

    Attributes
    ----------
    name : what, and of which plate.
    value, deviation : in `unit`, if it is there.
    limit : from where on it matters.
    unit : of these.
    probability : that it is there.
    """

    name: str
    value: float
    deviation: float
    limit: float
    unit: str
    probability: float


def rows(seen: Examined) -> tuple[FaultRow, ...]:
    """Every fault that was looked for."""
    table = []
    for part, (fault, value, deviation, probability) in alone(seen).items():
        kind = KINDS[fault.kind]
        table.append(
            FaultRow(
                title(part),
                kind.factor * value,
                kind.factor * deviation,
                kind.factor * kind.matters,
                kind.unit,
                probability,
            )
        )
    return tuple(table)


def title(part: str) -> str:
    """An effect's name for a reader: "place x 1" becomes "plate 1: place forward"."""
    name = max((each for each in OF_PART if f"{part} ".startswith(f"{each} ")), key=len)
    whose = part[len(name) :].strip()
    for axis, word in (("x", "forward"), ("y", "left"), ("z", "up")):
        if name.endswith(f" {axis}"):
            name = f"{name[:-2]} {word}"
    if not whose:
        return {"delay": "delay of the forces", "mass": "body mass"}.get(name, name)
    of = {"all": "all plates", "left": "left", "right": "right"}.get(whose, f"plate {whose}")
    return f"{of}: {name.removeprefix('plate ')}"


def warnings(found: Sequence[FoundFault], corrected: Sequence[str] = ()) -> list[QualityFlag]:
    """A warning for each fault that was `found` and matters. `corrected` are kinds of faults that
    are taken away where they are found. Nothing is to be corrected beside a fault that cannot be:
    their sizes are known together only.
    """
    some = [each for each in found if each.matters]
    only = all(each.fault is not None and KINDS[each.fault.kind].corrected for each in some)
    return [_warning(each, corrected, advised=only) for each in some]


def unused(walks: Sequence[WalkingTrial]) -> QualityFlag:
    """A warning that of all forces which the plates of the `walks` show none is used, and why."""
    why = [finding for walk in walks for finding in walk.findings if finding.kind == "contact"]
    plates = [f"{', '.join(f.names)}: {f.action}" for f in why if f.names[0].startswith("plate")]
    seen = "; ".join(dict.fromkeys(plates)) or "no foot is on a plate by its markers"
    return QualityFlag(
        f"{CHECK}: forces not used",
        "all plates",
        0.0,
        1.0,
        "cycles",
        f"they show a force, and no gait cycle with it can be used, so there are no moments ({seen}"
        "): check the corners of the plates in the file, and give a trial in which each foot lands "
        "whole on a plate of its own",
    )


def _warning(found: FoundFault, corrected: Sequence[str], *, advised: bool) -> QualityFlag:
    verdict, fault = found.verdict, found.fault
    names = [each.change.name for each in verdict.named]
    if fault is None:
        return QualityFlag(
            f"{CHECK}: unexplained", BOTH, 1.0 - verdict.sound, NAMED, "1",
            f"they contradict each other more than in sound recordings: {verdict}: {OTHERWISE}",
        )  # fmt: skip
    kind, text, where = KINDS[fault.kind], str(verdict), BOTH
    if len(names) == 1:
        where, text = fault.where, text.removeprefix(f"{fault.where}: ")
        remedy = verdict.remedy if advised or not kind.corrected else ""
        of_it = "corrected, as --correct asks" if fault.kind in corrected else remedy
        text += f": {of_it}" if of_it else ""
    kinds = ["unexplained" if name == OTHER.name else kind_of(name) for name in names]
    return QualityFlag(
        f"{CHECK}: {' or '.join(dict.fromkeys(kinds))}",
        where,
        kind.factor * float(np.linalg.norm(found.values)),
        kind.factor * kind.matters,
        kind.unit,
        text,
    )
