"""Joint power and work over the gait cycle, and the bursts of power that gait analysis names.

Power is moment times angular velocity of hip, knee and ankle in the sagittal plane, from the curves
over the gait cycle, alike for the walk and the record: positive where the joint adds energy.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from scipy.signal import find_peaks

from gaitval.arrays import Array
from gaitval.gait.cycle_curves import Curves
from gaitval.quantities.quantity import (
    Compared,
    FigureTable,
    Found,
    OverTime,
    Quantity,
    QuantityMeasure,
    StrideTimes,
)

JOINTS: Final[tuple[str, ...]] = ("hip_flexion", "knee_angle", "ankle_angle")


class Burst(NamedTuple):
    """A peak of power with a name (Winter 1991; Eng and Winter 1995, J Biomech 28:753).

    Attributes
    ----------
    joint : whose power it is.
    first, last : % of the gait cycle between which it is looked for; convention.
    sign : 1 if energy is generated, -1 if it is absorbed.
    spread : W/kg, standard deviation between typically developing children at their own speed
        (Schwartz et al. 2008, J Biomech 41:1639, half the width of the bands that come with it), at
        the peak of their mean curve. No such spread between adults may be shipped.
    after : the burst of the same joint that it follows.
    """

    joint: str
    first: int
    last: int
    sign: float
    spread: float
    after: str | None = None


BURSTS: Final[Mapping[str, Burst]] = {
    "H1": Burst("hip_flexion", 0, 35, 1.0, 0.34),
    "H2": Burst("hip_flexion", 20, 60, -1.0, 0.26),
    "H3": Burst("hip_flexion", 45, 85, 1.0, 0.41),
    "K1": Burst("knee_angle", 2, 20, -1.0, 0.46),
    "K2": Burst("knee_angle", 8, 35, 1.0, 0.27, after="K1"),
    "K3": Burst("knee_angle", 45, 75, -1.0, 0.42),
    "K4": Burst("knee_angle", 75, 99, -1.0, 0.40),
    "A1": Burst("ankle_angle", 5, 50, -1.0, 0.48),
    "A2": Burst("ankle_angle", 40, 70, 1.0, 1.01),
}


def joint_power(curves: Curves, stride_time: StrideTimes) -> Found | None:
    """Power of the `curves` of a walk (n, 101) or a record (101,), W/kg, its bursts, and the work
    in a gait cycle, J/kg; None without a cycle, or where a joint was not measured.
    """
    powers: dict[str, Array] = {}
    generated, absorbed = dict[str, float | None](), dict[str, float | None]()
    for side, time in stride_time.items():
        for joint in JOINTS:
            name = f"{joint}_{side}"
            if name not in curves.angles or name not in curves.moments:
                return None
            angle, moment = np.atleast_2d(curves.angles[name]), curves.moments[name]
            if len(angle) == 0 or time is None:
                return None
            # neighbouring points are 1 % of the stride apart
            rate = np.gradient(angle, 0.01 * time, axis=1, edge_order=2)
            power = (np.atleast_2d(moment) * rate).mean(axis=0)
            powers[name] = power
            # J/kg: mean power times stride time; 100 % is 0 % of the next cycle, so it is left out
            generated[name] = float(np.clip(power[:-1], 0.0, None).mean() * time)
            absorbed[name] = float(np.clip(-power[:-1], 0.0, None).mean() * time)
    return Found(
        powers, {"bursts": bursts_of(powers), "generated": generated, "absorbed": absorbed}
    )


def bursts_of(powers: Mapping[str, Array]) -> dict[str, float | None]:
    """Power at each of `BURSTS` of both sides, W/kg, from `powers` (101,) W/kg of `JOINTS` by name
    with `_r` or `_l`; None where a curve has no such burst.
    """
    found: dict[str, float | None] = {}
    for side in "rl":
        own = {joint: powers[f"{joint}_{side}"] for joint in JOINTS}
        for burst, at in burst_places(own).items():
            found[f"{burst}_{side}"] = None if at is None else float(own[BURSTS[burst].joint][at])
    return found


def burst_places(powers: Mapping[str, Array]) -> dict[str, int | None]:
    """Where the bursts of one side are, % of the gait cycle, from `powers` (101,) W/kg of `JOINTS`;
    None where there is none.

    A burst is the largest local extremum of its sign within its part of the cycle, after the burst
    that it follows. The edge of the part is no extremum: there the curve only passes through, on
    its way to or from another burst.
    """
    places: dict[str, int | None] = {}
    for name, burst in BURSTS.items():
        # `BURSTS` is in order, so the burst that this one follows has been found already
        begin = max(burst.first, (places[burst.after] or 0) if burst.after else 0)
        part = burst.sign * np.asarray(powers[burst.joint], dtype=float)[begin : burst.last + 1]
        peaks, _ = find_peaks(part, height=0.0)
        places[name] = begin + int(peaks[np.argmax(part[peaks])]) if len(peaks) else None
    return places


def _burst_errors(walked: Found | None, recorded: Found) -> Compared:
    """Differences between the bursts, in units of their spread between people. A burst that the
    record does not show is not compared. One that only the walk lacks differs by all of the
    recorded power: nothing is generated or absorbed in it.
    """
    for name, expected in recorded.figures["bursts"].items():
        if expected is None:
            continue
        value = None
        if walked is not None:
            spread = BURSTS[name.split("_")[0]].spread
            # a missing burst is one of no power
            value = abs((walked.figures["bursts"][name] or 0.0) - expected) / spread
        yield name, value


def _work_errors(walked: Found | None, recorded: Found) -> Compared:
    """Differences between the work of each joint: the larger of generated and absorbed."""
    for name in recorded.curves:
        error = None
        if walked is not None:
            error = max(
                abs((walked.figures[kind][name] or 0.0) - (recorded.figures[kind][name] or 0.0))
                for kind in ("generated", "absorbed")
            )
        yield name, error


def _over_time(motion: OverTime) -> dict[str, Array]:
    names = (f"{joint}_{side}" for joint in JOINTS for side in "rl")
    return {name: motion.power(name) for name in names}


_LABELS: Final = dict(zip(JOINTS, ("Hip", "Knee", "Ankle"), strict=True))

JOINT_POWER: Final = Quantity(
    name="power",
    title="Joint power, sagittal",
    axis="power",
    unit="W/kg",
    note="Power of a joint is moment times angular velocity in the sagittal plane, positive where "
    "the joint adds energy. Like the moment, that of the hip is about the record’s hip centre. H1 "
    "to A2 are its bursts in their order: H of the hip, K of the knee, A of the ankle.",
    needs=("angles", "moments"),
    curves={joint: f"{label} power" for joint, label in _LABELS.items()},
    of_curves=joint_power,
    figures={"bursts": "W/kg", "generated": "J/kg", "absorbed": "J/kg"},
    figures_of=lambda curves: {"bursts": bursts_of(curves)},
    tables=(
        FigureTable(
            "Burst in a gait cycle, sagittal",
            "W/kg",
            2,
            tuple((burst, "bursts", burst) for burst in BURSTS),
            missing="not found",
        ),
        FigureTable(
            "Work in a gait cycle, sagittal",
            "J/kg",
            3,
            tuple(
                (f"{label}, {kind}", kind, joint)
                for joint, label in _LABELS.items()
                for kind in ("generated", "absorbed")
            ),
        ),
    ),
    measures=(
        QuantityMeasure("power_burst_error", "SD", _burst_errors),
        QuantityMeasure("joint_work_error", "J/kg", _work_errors),
    ),
    of_time=_over_time,
    time_unit="W",
)
