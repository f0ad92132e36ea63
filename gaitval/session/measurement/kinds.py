"""What may be wrong with the forces and markers of a session: one entry a kind.

Sizes are standard deviations in the unit of SI (s, m, rad) or shares: what a sound session has of a
fault, what one has of which somebody speaks, and from where on it matters. A laboratory's own
mistakes are known by their reports alone, so the probabilities are round numbers: one of twenty
sessions has a plate that is not where the file says, a delay or a wrong mass, one of a hundred each
rarer one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

import numpy as np

from gaitval.arrays import Array

OFTEN: Final = 0.06
COMMON: Final = 0.04
RARE: Final = 0.01
"""Probability, before the data, of a kind of fault; all plates share it."""
Whose = Literal["session", "each plate", "each plate or all", "each foot"]
Shift = Literal["", "late", "early", "either"]
BOTH: Final = "forces and markers"
"""Where a fault is that no plate has alone."""
DEGREE: Final = 180.0 / np.pi


@dataclass(frozen=True)
class Kind:
    """A kind of fault.

    Attributes
    ----------
    sound, faulty, matters : its size where nobody would speak of it, where somebody does (SD both),
        and from where on it matters. What is there whole or not at all has a `mean` where it is
        there, and `faulty` about it.
    prior : probability of it before the data.
    words : what is wrong, with {size}, {large}, {small}, {later} or {high} of the figure, which is
        `factor` times the size in `unit`.
    remedy : what to do.
    parts : its effects in the data (`balance`), where they are not named as it is.
    directions : what a positive and a negative size of each part is called.
    whose : who may have it.
    common : the fault of the session that looks like it if every plate has it.
    shift : which delay of the forces is a part of it.
    channel : whether it is one of a plate's channels; a plate has one such fault at most.
    corrected : whether `--correct` takes it away.
    """

    sound: float
    faulty: float
    matters: float
    prior: float
    words: str
    remedy: str
    factor: float = 100.0
    unit: str = "%"
    mean: float = 0.0
    parts: Sequence[str] = ()
    directions: Sequence[tuple[str, str]] = ()
    whose: Whose = "session"
    common: str = ""
    shift: Shift = ""
    channel: bool = False
    corrected: bool = False


XY: Final = (("forward", "back"), ("left", "right"))
CORNERS: Final = "measure the plate's corners with markers again, or correct it with --correct "
CALIBRATION: Final = "check its calibration matrix and the ranges of its amplifier"
EXPORT: Final = "as they were recorded, without a filter"

KINDS: Final[Mapping[str, Kind]] = {
    "delay": Kind(
        0.003, 0.030, 0.010, COMMON, "the forces come {later} than the markers",
        "synchronise force plates and cameras, or correct it with --correct delay",
        1000.0, "ms", parts=(), shift="either", corrected=True,
    ),
    "one-way filter of the markers": Kind(
        0.0, 0.6, 0.5, 2 * RARE, "a filter that runs one way made the markers late and smooth",
        f"export the markers {EXPORT}", 1.0, "of such a filter", mean=1.0, shift="early",
    ),
    "one-way filter of the forces": Kind(
        0.0, 0.45, 0.5, RARE, "a filter that runs one way made the forces late and smooth",
        f"export the forces {EXPORT}", 1.0, "of such a filter", mean=1.0, shift="late",
    ),
    "clock": Kind(
        0.0, 0.012, 0.002, RARE,
        "the clock of the forces is {size} too {slow} beside that of the markers",
        "correct the rate in the file, or synchronise plates and cameras",
    ),
    "plate delay": Kind(
        0.0, 0.030, 0.010, RARE,
        "its forces come {later} than those of the other plates and the markers",
        "synchronise its amplifier or converter with the others, and look at the filter of its "
        "channels", 1000.0, "ms", whose="each plate", common="delay",
    ),
    "place": Kind(
        0.004, 0.025, 0.010, OFTEN, "its place in the file is {size} of where the feet show it",
        f"{CORNERS}place", 1000.0, "mm", parts=("place x", "place y"), directions=XY,
        whose="each plate or all", common="place all", corrected=True,
    ),
    "rotation": Kind(
        0.010, 0.09, 0.04, COMMON, "it is turned by {size} about the vertical",
        f"{CORNERS}rotation", DEGREE, "deg", whose="each plate or all", common="rotation all",
        corrected=True,
    ),
    "gain": Kind(
        0.008, 0.08, 0.05, COMMON, "it shows forces {size} too {large}",
        "make sure that no handrail, hand or crutch carried weight (aid in a session file), check "
        "its sensitivity and the range of its amplifier, or correct it with --correct gain",
        whose="each plate", common="mass", channel=True, corrected=True,
    ),
    "vertical gain": Kind(
        0.0, 0.10, 0.05, RARE, "it shows its vertical force alone {size} too {large}", CALIBRATION,
        whose="each plate", common="mass", channel=True,
    ),
    "fore-aft gain": Kind(
        0.02, 0.20, 0.10, RARE, "it shows forces along the walk {size} too {large}", CALIBRATION,
        whose="each plate", channel=True,
    ),
    "moment gain": Kind(
        0.0, 0.12, 0.05, RARE,
        "it shows moments {size} too {large}, so that the centre of pressure lies too {far} the "
        "plate's middle", CALIBRATION, whose="each plate or all",
        common="moment gain all", channel=True,
    ),
    "cross-talk": Kind(
        0.006, 0.045, 0.02, COMMON,
        "it shows a share of the vertical force as a horizontal one: {size}",
        "check that it is level, and its calibration matrix, or correct it with --correct "
        "cross-talk", parts=("cross-talk x", "cross-talk y"), directions=XY, whose="each plate",
        common="tilt", channel=True, corrected=True,
    ),
    "offset": Kind(
        0.006, 0.04, 0.025, COMMON, "it adds {size} while it is loaded",
        "zero the plate before the trial", 100.0, "% of the weight",
        parts=("offset x", "offset y", "offset z"), directions=(*XY, ("up", "down")),
        whose="each plate or all", common="offset all", channel=True,
    ),
    "mirrored moment": Kind(
        0.0, 0.15, 0.5, RARE,
        "its centre of pressure moves to the wrong side under the foot, as if the moment about the "
        "direction of the walk had the wrong sign",
        "look at the sign of this channel, at the plate's corners, and at how the centre of "
        "pressure was computed", 1.0, "times", mean=1.0, whose="each plate", channel=True,
    ),
    "fore-aft sign": Kind(
        0.0, 0.1, 0.5, RARE, "its force along the walk has the wrong sign",
        "reverse this channel", 1.0, "times", mean=1.0, whose="each plate or all",
        common="fore-aft sign all", channel=True,
    ),
    "sideways sign": Kind(
        0.0, 0.1, 0.5, RARE, "its sideways force has the wrong sign",
        "reverse this channel", 1.0, "times", mean=1.0, whose="each plate or all",
        common="sideways sign all", channel=True,
    ),
    "free moment sign": Kind(
        0.0, 0.1, 0.5, RARE, "its free moment has the wrong sign",
        "look at the sign of this channel, and at the order of the plate's corners", 1.0, "times",
        mean=1.0, whose="each plate or all", common="free moment sign all", channel=True,
    ),
    "foot": Kind(
        0.0, 0.02, 0.010, RARE,
        "its markers lie {size} of where they are on other people's feet",
        "look at the markers of heel, ankle and forefoot, in standing too", 1000.0, "mm",
        parts=("foot along", "foot across"), directions=(XY[0], ("inwards", "outwards")),
        whose="each foot",
    ),
    "foot turned": Kind(
        0.0, 0.12, 0.06, RARE, "the foot is turned by {size} beside its markers",
        "look at the markers of heel and forefoot, in standing too", DEGREE, "deg",
        whose="each foot",
    ),
    "mass": Kind(
        0.012, 0.09, 0.04, COMMON,
        "the body mass that was given is {size} too {large}, or the forces of all plates are too "
        "{small}",
        "weigh the person with all that they carried; a handrail, a hand or a crutch carries what "
        "no plate shows (aid in a session file)",
    ),
    "stature": Kind(
        0.0, 0.10, 0.05, RARE, "the stature that was given is {size} too {large} for this body",
        "measure it again",
    ),
    "scale": Kind(
        0.003, 0.025, 0.01, RARE,
        "the cameras' volume is {size} too {large} (length of the calibration wand)",
        "calibrate the cameras again",
    ),
    "rate": Kind(
        0.003, 0.08, 0.04, RARE, "the frame rate of the file is {size} too {high}",
        "check the frame rate in the recording program",
    ),
    "tilt": Kind(
        0.004, 0.035, 0.015, RARE, "the laboratory's vertical axis is tilted by {size}",
        "level the calibration frame of the cameras", DEGREE, "deg",
        parts=("tilt forward", "tilt left"), directions=XY,
    ),
    "camera tilt": Kind(
        0.004, 0.035, 0.015, RARE,
        "the cameras are tilted by {size} beside the plates: the body leans over its feet",
        "level the calibration frame of the cameras", DEGREE, "deg", parts=("camera tilt left",),
        directions=XY[1:],
    ),
    "forces low-passed": Kind(
        0.0, 0.4, 0.5, RARE, "the forces were low-passed before, at a few Hz",
        f"export the forces {EXPORT}", 1.0, "of a low-pass", mean=1.0,
    ),
    "markers low-passed": Kind(
        0.0, 0.4, 0.5, RARE, "the markers were low-passed before, at a few Hz",
        f"export the markers {EXPORT}", 1.0, "of a low-pass", mean=1.0,
    ),
}  # fmt: skip
OF_PART: Final = {part: name for name, kind in KINDS.items() for part in (kind.parts or (name,))}


@dataclass(frozen=True)
class Fault:
    """One thing that may be wrong with a session: what is large together.

    Attributes
    ----------
    kind : of `KINDS`.
    whose : name of the plate or foot, "all" plates, "" of a session.
    prior : probability before the data.
    """

    kind: str
    whose: str
    prior: float

    @property
    def name(self) -> str:
        """Of the kind and of whose it is."""
        return f"{self.kind} {self.whose}".strip()

    @property
    def parts(self) -> tuple[str, ...]:
        """Its effects in the data."""
        kind = KINDS[self.kind]
        if self.kind == "delay":
            return ()
        return tuple(f"{part} {self.whose}".strip() for part in kind.parts or (self.kind,))

    @property
    def shifts(self) -> Shift:
        """Which delay of all forces is a part of it."""
        return KINDS[self.kind].shift

    @property
    def where(self) -> str:
        """Whose it is, for a reader."""
        if not self.whose:
            return BOTH
        if KINDS[self.kind].whose == "each foot":
            return f"{self.whose} foot"
        return "all plates" if self.whose == "all" else f"plate {self.whose}"

    def said(self, values: Array, deviations: Array) -> str:
        """What is wrong and how large it is: (p,) its parts with their deviations."""
        kind = KINDS[self.kind]
        figures = [
            f"{abs(value):.{digits}f} ± {deviation:.{digits}f} {kind.unit}"
            for value, deviation in zip(kind.factor * values, kind.factor * deviations, strict=True)
            for digits in [0 if deviation >= 1.0 else 1]
        ]
        size = figures[0]
        if kind.directions:
            # only what is more than its own error, or the largest
            largest = int(np.argmax(np.abs(values)))
            size = " and ".join(
                f"{figure} {way[int(value < 0)]}"
                for i, (figure, way, value, deviation) in enumerate(
                    zip(figures, kind.directions, values, deviations, strict=True)
                )
                if i == largest or abs(value) > 2.0 * deviation
            )
        more = float(values[0]) > 0.0
        said = kind.words.format(
            size=size,
            later=f"{size} {'later' if more else 'earlier'}",
            large="large" if more else "small",
            small="small" if more else "large",
            high="high" if more else "low",
            far="far from" if more else "near",
            slow="slow" if more else "fast",
        )
        return f"{self.where}: {said}" if self.whose else said


@cache
def kind_of(part: str) -> str:
    """The kind of a fault or of one of its effects, by its name."""
    if part.startswith("plate delay"):
        return "plate delay"
    known = (*OF_PART, *KINDS)
    found = max((name for name in known if f"{part} ".startswith(f"{name} ")), key=len)
    return OF_PART.get(found, found)


def faults(names: Sequence[str], feet: Sequence[str]) -> tuple[Fault, ...]:
    """What may be wrong in a session whose data have effects of these `names`, and show pressures
    under these `feet`.
    """
    plates = [name.removeprefix("gain ") for name in names if name.startswith("gain ")]
    found = []
    for name, kind in KINDS.items():
        whose = {"session": [""], "each foot": [*feet]}.get(kind.whose, plates)
        if len(plates) < 2 and name == "plate delay":
            continue
        if kind.whose == "each plate or all" and len(plates) > 1:
            whose = [*plates, "all"]
        of_kind = [Fault(name, each, kind.prior / len(whose)) for each in whose]
        there = {*names, *(f"{part} all" for part in kind.parts or (name,))}
        found += [fault for fault in of_kind if there.issuperset(fault.parts)]
    return tuple(found)
