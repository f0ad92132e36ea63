"""The faults of a session in words and figures: warnings, and a table of what was looked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from gaitval.gait.quality_flags import QualityFlag
from gaitval.measurement.estimate import (
    UNSOUND,
    Cause,
    Examined,
    FoundFault,
    alone,
    likeness,
    one_foot,
)
from gaitval.measurement.expected import USUAL
from gaitval.measurement.likelihood import kind_of
from gaitval.session.trial import WalkingTrial

CHECK: Final = "measurement"
"""First word of the check of a warning; the kind of the fault follows."""
UNSOUND_BESIDE: Final = 0.0004
"""Probability that nothing else is wrong beside a force of the wrong sign, below which another
fault of a plate is told: in five walks of two boys with such plates, who land on their toes, 0.004
at least, of which this is as small a share as `UNSOUND` is of what others have."""
SECOND: Final = 0.05
"""Probability among all causes from which on a second one is named, too."""


class FaultText(NamedTuple):
    """How a kind of fault is said: factor and unit of its figure, what it is, what to do."""

    factor: float
    unit: str
    what: str
    remedy: str


CORNERS: Final = "measure the plate's corners with markers again, or correct it with --correct "
ONE_FOOT: Final = (
    "; or the markers of the foot on it are, which one foot alone cannot tell: look at these "
    "markers, measure the plate's corners again, or give a trial with both feet on plates"
)
"""What to do about a turned plate that only one foot stepped on."""
OF_WEIGHT: Final = ("gain", "offset", "mass")
"""Faults that the vertical force shows."""
OF_A_PLATE: Final = (
    "place",
    "rotation",
    "gain",
    "fore-aft gain",
    "cross-talk",
    "offset",
    "mirrored moment",
    "plate delay",
)
"""Faults of one plate, or of all."""
LIKE_A_GAIN: Final = (
    "what the person carried counts in the mass that is given, and what a handrail, a hand or a "
    "crutch carried is not on the plates (aid in a session file): make sure of both before a plate "
    "is corrected"
)
"""What changes the vertical force as a plate's fault does, and must not be taken for one."""
LIKE_A_PLACE: Final = (
    "forces that are late, a plate that is turned, a wrong scale of the cameras or length of the "
    "wand, and a cane or hand on the plate beside the foot look alike: make sure of these, and "
    "measure the corners with markers, before anything is corrected"
)
"""What moves the centre of pressure under the foot as a plate's place does."""
WORDS: Final[Mapping[str, FaultText]] = {
    "delay": FaultText(
        1000.0,
        "ms",
        "the forces come {later} than the markers",
        "synchronise force plates and cameras, or correct it with --correct delay",
    ),
    "plate delay": FaultText(
        1000.0,
        "ms",
        "its forces come {later} than those of the other plates and the markers",
        "synchronise its amplifier or converter with the others, and look at the filter of its "
        "channels",
    ),
    "place": FaultText(
        1000.0,
        "mm",
        "its place in the file is {size} of where the feet show it",
        f"{CORNERS}place",
    ),
    "rotation": FaultText(
        180.0 / np.pi, "deg", "it is turned by {size} about the vertical", f"{CORNERS}rotation"
    ),
    "gain": FaultText(
        100.0,
        "%",
        "it shows forces {size} too {large}",
        "check its sensitivity and the range of its amplifier, or correct it with --correct gain",
    ),
    "fore-aft gain": FaultText(
        100.0,
        "%",
        "it shows forces along the walk {size} too {large}",
        "check its calibration matrix and the range of this channel's amplifier",
    ),
    "cross-talk": FaultText(
        100.0,
        "%",
        "it shows a share of the vertical force as a horizontal one: {size}",
        "check that it is level, and its calibration matrix, or correct it with --correct "
        "cross-talk",
    ),
    "offset": FaultText(
        100.0,
        "% of the weight",
        "it adds {size} while it is loaded",
        "zero the plate before the trial",
    ),
    "mirrored moment": FaultText(
        1.0,
        "times",
        "its centre of pressure moves to the wrong side under the foot, as if the moment about the "
        "direction of the walk had the wrong sign ({size} mirrored)",
        "look at the sign of this channel, at the plate's corners, and at how the centre of "
        "pressure was computed",
    ),
    "mass": FaultText(
        100.0,
        "%",
        "the body mass that was given is {size} too {large}, or the forces of all plates are too "
        "{small}",
        "weigh the person on the plates",
    ),
    "scale": FaultText(
        100.0,
        "%",
        "the cameras' volume is {size} too {large} (length of the calibration wand)",
        "calibrate the cameras again",
    ),
    "rate": FaultText(
        100.0,
        "%",
        "the frame rate of the file is {size} too {high}",
        "check the frame rate in the recording program",
    ),
    "tilt": FaultText(
        180.0 / np.pi,
        "deg",
        "the laboratory's vertical axis is tilted by {size}",
        "level the calibration frame of the cameras",
    ),
    "camera tilt": FaultText(
        180.0 / np.pi,
        "deg",
        "the cameras are tilted by {size} beside the plates: the body leans over its feet",
        "level the calibration frame of the cameras",
    ),
    "forces low-passed": FaultText(
        5.0,
        "",
        "the forces were low-passed before, at a few Hz",
        "export the forces as they were recorded",
    ),
    "markers low-passed": FaultText(
        3.0,
        "",
        "the markers were low-passed before, at a few Hz",
        "export the markers as they were recorded",
    ),
}


@dataclass(frozen=True)
class FaultRow:
    """A fault that was looked for: a line of the table.

    Attributes
    ----------
    name : what, and of which plate.
    value, deviation : in `unit`.
    unit : of both.
    said : "warning", "small" (may be there, and does not matter), "" otherwise.
    like : the fault that looks most like it in this session.
    correlation : of the errors of both, −1 to 1.
    """

    name: str
    value: float
    deviation: float
    unit: str
    said: str
    like: str
    correlation: float


def title(name: str) -> str:
    """A fault's name for a reader: "place x 1" becomes "plate 1: place forward"."""
    kind = kind_of(name)
    rest = name.removeprefix(kind).strip()
    axis, _, plate = (
        rest.partition(" ") if rest[:1] in "xyz" and rest[1:2] in (" ", "") else ("", "", rest)
    )
    word = {"x": " forward", "y": " left", "z": " up", "": ""}[axis]
    if kind in OF_A_PLATE:
        return f"{_whose(plate)}: {kind.removeprefix('plate ')}{word}"
    return {
        "delay": "delay of the forces",
        "mass": "body mass",
        "scale": "scale of the volume",
        "rate": "frame rate",
        "tilt forward": "tilt forward",
        "tilt left": "tilt to the left",
        "camera tilt left": "cameras' tilt to the left",
    }.get(name, name)


def rows(seen: Examined) -> tuple[FaultRow, ...]:
    """Every fault that was looked for, beside those found."""
    found = {part: f for f in seen.found for part in f.cause.parts}
    alike = likeness(seen)
    table = []
    for name, (value, deviation) in alone(seen).items():
        words = WORDS[kind_of(name)]
        f = found.get(name)
        factor = 1.0 if not words.unit else words.factor
        like, correlation = alike.get(name, ("", float("nan")))
        table.append(
            FaultRow(
                title(name),
                factor * value,
                factor * deviation,
                words.unit or "of a low-pass",
                "" if f is None else ("warning" if f.matters else "small"),
                title(like) if like else "",
                correlation,
            )
        )
    return tuple(table)


def warnings(
    seen: Examined, saturated: Sequence[str] = (), corrected: Sequence[str] = ()
) -> tuple[QualityFlag, ...]:
    """A warning for each fault that was `seen` and matters. `saturated` are plates with a channel
    that is cut off: what is missing of it looks like another fault of the vertical force, also of
    another plate. `corrected` are kinds of faults that are taken away where they are found.
    """
    single = one_foot(seen.data)
    plates_too = not seen.undone or seen.sound < UNSOUND_BESIDE
    found = [
        _warning(f, saturated, corrected, single=single)
        for f in seen.found
        if f.matters and (plates_too or kind_of(f.cause.name) not in OF_A_PLATE)
    ]
    if causes := seen.unexplained:
        found.append(_unexplained(seen, causes))
    if not seen.undone:
        return tuple(found)
    beside = f" (beside {undone_text(seen)}, which has the wrong sign)"
    return tuple(replace(flag, message=flag.message + beside) for flag in found)


def undone_text(seen: Examined) -> str:
    """The forces that were reversed before anything else was looked for."""
    forces = [
        f"the {'sideways' if axis else 'fore-aft'} force of plate {plate}"
        for plate, axes in sorted(seen.undone.items())
        for axis in sorted(axes)
    ]
    return " and ".join(forces)


def _unexplained(seen: Examined, causes: Sequence[Cause]) -> QualityFlag:
    """A warning that something is wrong, and that none of the most probable `causes` is certain."""
    return QualityFlag(
        f"{CHECK}: unexplained",
        "forces and markers",
        1.0 - seen.sound,
        1.0 - UNSOUND,
        "1",
        "they contradict each other more than in sound recordings, and no one fault explains it. "
        f"Most like it: {'; '.join(_bare(cause) for cause in causes)}. Look at these, and give "
        "more trials if there are: each shows other steps on the plates",
    )


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


def named(found: FoundFault) -> tuple[Cause, ...]:
    """The cause of a warning, and the second if the data fit it nearly as well."""
    second = [cause for cause, share in found.others[:1] if share >= SECOND]
    return found.cause, *second


def _warning(
    found: FoundFault, saturated: Sequence[str], corrected: Sequence[str], *, single: bool
) -> QualityFlag:
    kind = kind_of(found.cause.name)
    words = WORDS[kind]
    size = float(np.linalg.norm(found.values))
    text = _phrase(found.cause, found.values.tolist(), found.deviations.tolist())
    for cause in named(found)[1:]:
        share = next(s for c, s in found.others if c == cause)
        text += (
            f"; or {_bare(cause)}, which the data cannot separate from it "
            f"({100 * found.share:.0f} to {100 * share:.0f})"
        )
    if saturated and kind in OF_WEIGHT:
        text += (
            f"; or it is what the saturated plate {' and '.join(saturated)} does not show: record "
            "again with a larger range before you change anything else"
        )
    elif single and kind == "rotation":
        text += ONE_FOOT
    else:
        text += f": {'corrected, as --correct asks' if kind in corrected else words.remedy}"
        if kind not in corrected:
            text += f"; {LIKE_A_GAIN}" if kind in OF_WEIGHT else ""
            text += f"; {LIKE_A_PLACE}" if kind == "place" else ""
    factor = words.factor if words.unit else 1.0
    return QualityFlag(
        f"{CHECK}: {kind}",
        _where(found.cause),
        factor * size,
        factor * USUAL[kind].matters,
        words.unit or "1",
        text,
    )


def _where(cause: Cause) -> str:
    kind = kind_of(cause.name)
    plate = cause.name.removeprefix(kind).strip()
    return _whose(plate) if kind in OF_A_PLATE else "forces and markers"


def _whose(plate: str) -> str:
    return "all plates" if plate == "all" else f"plate {plate}"


def _phrase(cause: Cause, values: Sequence[float], deviations: Sequence[float]) -> str:
    kind = kind_of(cause.name)
    words = WORDS[kind]
    value = float(values[0])
    figures = [
        f"{abs(words.factor * v):.0f} ± {words.factor * d:.0f} {words.unit}"
        if words.factor * d >= 1.0 or abs(words.factor * v) >= 10.0
        else f"{abs(words.factor * v):.1f} ± {words.factor * d:.1f} {words.unit}"
        for v, d in zip(values, deviations, strict=True)
    ]
    directions = {
        "place": (("forward", "back"), ("left", "right")),
        "cross-talk": (("forward", "back"), ("left", "right")),
        "offset": (("forward", "back"), ("left", "right"), ("up", "down")),
        "tilt": (("forward", "back"), ("left", "right")),
        "camera tilt": (("left", "right"),),
    }.get(kind)
    if directions is None:
        size = figures[0]
    else:
        # only what is more than its own error, or the largest
        largest = int(np.argmax(np.abs(values)))
        size = " and ".join(
            f"{figure} {way[int(v < 0)]}"
            for i, (figure, way, v, d) in enumerate(
                zip(figures, directions, values, deviations, strict=True)
            )
            if i == largest or abs(v) > 2.0 * d
        )
    return words.what.format(
        size=size,
        later=f"{size} {'later' if value > 0 else 'earlier'}",
        large="large" if value > 0 else "small",
        small="small" if value > 0 else "large",
        high="high" if value > 0 else "low",
    )


def _bare(cause: Cause) -> str:
    """A cause without its figures."""
    kind = kind_of(cause.name)
    of = _where(cause)
    plain = {
        "delay": "the forces are late or early",
        "plate delay": f"{of}: its forces alone are late or early",
        "place": f"{of}: its place",
        "rotation": f"{of}: turned about the vertical",
        "gain": f"{of}: its sensitivity",
        "fore-aft gain": f"{of}: the gain of its fore-aft force",
        "cross-talk": f"{of}: cross-talk",
        "offset": f"{of}: an offset under load",
        "mirrored moment": f"{of}: a moment of the wrong sign",
        "mass": "the body mass",
        "scale": "the cameras' volume",
        "rate": "the frame rate",
        "tilt": "the vertical axis of the laboratory",
        "camera tilt": "the vertical axis of the cameras",
    }
    return plain.get(kind, WORDS[kind].what)
