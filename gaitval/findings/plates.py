"""What physics says of the forces of a walk: plates that are implausible or cannot be right.

A wrong sign, two exchanged axes or a dead channel of a force plate give wrong moments and no other
sign of it. The limits were measured on recordings whose forces agree with the motion: WBDS01 T01
(treadmill, 0.49 m/s), the walk of Rajagopal et al. 2016, two of Plug-in Gait's samples and eleven
children of biomechZoo (1.1 to 1.5 m/s). `source` gives the values nearest to a limit there.

Axes: the project's (REP-103), the person walks along +x. Forces act on the person.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.findings.finding import Finding, Limits, Seen
from gaitval.mocap.force_plates import CERTAIN_LOAD_N, RENUMBER, numbered_other_way, plate_axes
from gaitval.mocap.recording import Plate


@dataclass(frozen=True)
class Plates:
    """The force plates of a walk, zeroed, in the project's axes.

    Attributes
    ----------
    rate : Hz, of their samples.
    used, outside : number of stances that each shows, and of contacts left out because their centre
        of pressure is not under the foot, by the plate's name; those of a foot whose markers are
        hidden are not among them.
    """

    plates: tuple[Plate, ...]
    rate: float
    used: Mapping[str, int]
    outside: Mapping[str, int]


def _seen(plate: Plate, value: float, **words: object) -> Seen:
    return Seen(value, f"plate {plate.name}", words, plate=plate.name)


def _loaded(plate: Plate) -> tuple[Flags, float] | None:
    """(T,) whether something heavy is on a plate, and what stands for the body weight, N, which a
    single plate does not know: the peaks of stance are near it. None where hardly anything was.
    """
    loaded: Flags = plate.force[:, 2] > CERTAIN_LOAD_N / 2
    if np.count_nonzero(loaded) < 20:
        return None
    return loaded, float(np.percentile(plate.force[loaded, 2], 95.0))


def _dead(of: Plates, *, limits: Mapping[str, Limits]) -> Iterator[Seen]:
    """Ranges under load of what a plate shows, each over its least one in walking: horizontal
    forces and the vertical moment about the middle over the vertical force (of a foot in the very
    middle of a plate only the free moment is left), and the centre of pressure along the plate's
    axes, m. The vertical force is held against the horizontal one of who pushes along.
    """
    for plate in of.plates:
        known = _loaded(plate)
        ranges = dict[str, tuple[float, Limits]]()
        if known is None:
            along = float(np.ptp(plate.force[:, :2], axis=0).max())
            if along > CERTAIN_LOAD_N / 4:
                down = float(np.abs(plate.force[:, 2]).max())
                ranges["the vertical force"] = down / along, limits["vertical"]
        else:
            loaded, weight = known
            axes, centre = _own_axes(plate)
            force = np.ptp(plate.force[loaded], axis=0) / weight
            point = np.ptp((plate.centre_of_pressure[loaded] - centre) @ axes, axis=0)
            ranges["the fore-aft force"] = float(force[0]), limits["force"]
            ranges["the sideways force"] = float(force[1]), limits["force"]
            for axis, name in enumerate(("first", "second")):
                what = f"the centre of pressure along the {name} axis"
                ranges[what] = float(point[axis]), limits["point"]
            if plate.moment is not None:
                about = (plate.moment - np.cross(centre, plate.force)) @ axes
                ranges["the vertical moment"] = (
                    float(np.ptp(about[loaded, 2])) / weight, limits["moment"],
                )  # fmt: skip
        for what, (value, (least, possible)) in ranges.items():
            words = {"what": what}
            yield Seen(
                value, f"plate {plate.name}", words, plate.name, (least, np.inf), value < possible
            )


def _own_axes(plate: Plate) -> tuple[Array, Array]:
    """Axes, as columns, and middle of a plate; those of the recording where they are unknown."""
    if np.isfinite(plate.corners).all():
        return plate_axes(plate.corners), plate.corners.mean(axis=0)
    return np.eye(3), np.zeros(3)


def _saturated(of: Plates, *, samples: int, near: float, least: float) -> Iterator[Seen]:
    """s, for which a component of the force stays at its largest or smallest value under load."""
    for plate in of.plates:
        if not (known := _loaded(plate)):
            continue
        loaded, weight = known
        for axis, name in enumerate(("fore-aft", "sideways", "vertical")):
            longest = 0
            for values in (plate.force[:, axis], -plate.force[:, axis]):
                top = float(values[loaded].max())
                # A component that stays near zero is not cut off at its small largest value.
                if top > least * weight:
                    begins, ends = runs(loaded & (values >= (1.0 - near) * top))
                    longest = max(longest, int((ends - begins).max(initial=0)))
            if longest > samples:
                yield _seen(plate, longest / of.rate, what=name)


def _outside(of: Plates) -> Iterator[Seen]:
    """Contacts whose centre of pressure is not under the foot."""
    for plate in of.plates:
        outside, used = of.outside.get(plate.name, 0), of.used.get(plate.name, 0)
        why = (
            f"the plate's corners are {RENUMBER}"
            if numbered_other_way(plate)
            else "the plate's corners, origin or moments are wrong, or somebody else was on it"
        )
        words = {"why": why, "count": outside, "all": outside + used}
        yield Seen(outside, f"plate {plate.name}", words, plate.name, limits=(-np.inf, used))


def _unloaded(of: Plates, *, light: float, least_s: float, window_s: float) -> Iterator[Seen]:
    """N, the largest force of a used plate while it carries no foot. Each window is longer than a
    stride, so that it has a time without a foot.
    """
    for plate in of.plates:
        up, window = plate.force[:, 2], max(round(window_s * of.rate), 1)
        if not len(up) or not of.used.get(plate.name, 0):
            continue
        peak = float(np.percentile(up, 99.0))
        parts = [up[begin : begin + window] for begin in range(0, len(up), window)]
        rests = [part[np.abs(part) < light * peak] for part in parts]
        levels = [float(np.median(rest)) for rest in rests if len(rest) >= least_s * of.rate]
        if peak <= 0.0 or not levels:
            continue
        worst, share = max(levels, key=abs), UNLOADED.high
        drifts = ", and drifts" if np.ptp(levels) > share * peak / 2 else ""
        words = {"newtons": worst, "drifts": drifts}
        yield _seen(plate, abs(worst) / peak, **words)


DEAD: Final[Finding] = Finding(
    name="dead channel",
    needs=Plates,
    values=_dead,
    # the least of walking, and the least that is possible
    numbers={
        "limits": {
            "vertical": (0.5, 0.5),
            "force": (0.01, 0.002),
            "point": (0.005, 0.001),
            "moment": (0.003, 0.0005),
        }
    },
    limits=(0.01, np.inf),
    unit="of the weight, or m",
    sentence=(
        "{what} hardly changes under load (range {value:.2g}, in walking above {limit:g}): its "
        "channel is dead, or has no calibration"
    ),
    source="at least 0.06 sideways and 0.2 along, 0.011 m (point) and 0.008 m (moment)",
)
SATURATED: Final[Finding] = Finding(
    name="saturated channel",
    needs=Plates,
    values=_saturated,
    numbers={"samples": 5, "near": 1e-4, "least": 0.02},
    limits=0.025,
    unit="s",
    sentence=(
        "the {what} force stays at its largest value for {value:.0f ms}: the amplifier or the "
        "converter is saturated there"
    ),
    remedy="Record with a larger range",
    source=(
        "a peak of walking of 3 Hz is within a thousandth of its height for 5 ms, and stored in "
        "steps of 0.5 N for 13 ms"
    ),
)
OUTSIDE_FOOT: Final[Finding] = Finding(
    name="centre of pressure under the foot",
    needs=Plates,
    values=_outside,
    limits=0.0,
    unit="contacts",
    sentence=(
        "the centre of pressure is outside the foot in {count} of {all} contacts, whose forces are "
        "not used: {why}"
    ),
)
UNLOADED: Final[Finding] = Finding(
    name="unloaded plate",
    needs=Plates,
    values=_unloaded,
    numbers={"light": 0.12, "least_s": 0.15, "window_s": 1.5},
    limits=0.025,
    unit="of the largest force",
    sentence=(
        "between the steps it shows {newtons:.0f} N{drifts}: it was not zeroed, or its amplifier "
        "drifts. Events, forces and moments are off by it, and with a centre of pressure instead "
        "of moments the file cannot be put right here"
    ),
    remedy=(
        "Zero the plate before the recording, or subtract what its channels show without a foot "
        "before the centre of pressure is worked out"
    ),
    source="20 N of a grown person, at which forces are taken for a foot's",
)
