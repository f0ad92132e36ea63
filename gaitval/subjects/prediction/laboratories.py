"""What angles say of kinetics in several laboratories, pooled: more people than the ten, who differ
in more.

Of 34 people of six other laboratories gait is known with plates. How their moments and forces
differ from what is expected of anybody goes with how their angles do, as it does in the built-in
people: of those, each left out, the mean skill of an estimate rises from 0.26 to 0.32 with them,
and of a laboratory that is left out the hip's moment is a quarter nearer
(docs/what-we-tried.md).

`laboratories.json` has no person's own curve: a person is a row of numbers times the root of the
weight, and the rows are turned among each other (an orthogonal matrix). A regression by least
squares sees only sums of products of rows, which turning leaves as they are. What a row differs
from is linear in speed (`gaitval.subjects.prediction.population`), so that the built-in person who
is estimated can be left out of it: the rows have one and the speed among their numbers.
"""

from collections.abc import Sequence
from functools import cache
from importlib import resources
from json import loads
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.subjects.prediction.deviations import (
    KINETICS,
    OTHER,
    SAGITTAL,
    Deviation,
    DeviationTrial,
    angles_of,
    deviation,
    kinetics_of,
    usual_gait,
)
from gaitval.subjects.prediction.normal_form import SAMPLES, NormalForm

STORE: Final = "laboratories.json"
UNIT: Final = 5e-4
"""Of the whole numbers in `STORE`: rad, Nm/kg, body weights."""
SHARE: Final = 0.5
"""What people of other laboratories count in a regression through all: as much as the built-in.
With 0.3 or 0.7 the estimates of these are as near within 0.01 of mean skill. Convention."""
_ANGLES: Final = (*SAGITTAL, *OTHER)


class Laboratories(NamedTuple):
    """Rows of people of other laboratories, k, whose squared weights add up to one.

    Attributes
    ----------
    angles : (k, 2, 8, n) rad, `SAGITTAL` and `OTHER`, right and left.
    kinetics : (k, 2, 7, n) `KINETICS`, in the units of a `NormalForm`.
    ones, speeds, stride_times : (k,) 1, dimensionless speed and stride time.
    wider, wider_speeds : (k,) share by which steps are wider than expected of anybody; that times
        the speed.
    """

    angles: Array
    kinetics: Array
    ones: Array
    speeds: Array
    stride_times: Array
    wider: Array
    wider_speeds: Array


def pooled(
    trials: Sequence[DeviationTrial],
    laboratories: Sequence[str],
    people: Sequence[Sequence[DeviationTrial]],
) -> Laboratories:
    """Of `trials` of as many `laboratories`, every laboratory as heavy as another; `people` say how
    wide steps are expected.
    """
    weight = np.array([laboratories.count(name) for name in laboratories], float) ** -0.5
    weight /= np.sqrt(len(set(laboratories)))
    speeds = np.array([trial.gait.speed for trial in trials])
    wider = np.array([deviation(trial, people).step_width for trial in trials])
    gaits = [trial.gait for trial in trials]
    rows = np.concatenate(
        [
            np.array([angles_of(gait, _ANGLES).ravel() for gait in gaits]),
            np.array([kinetics_of(gait).ravel() for gait in gaits]),
            np.stack([np.ones(len(gaits)), speeds], axis=1),
            np.array([[gait.stride_time] for gait in gaits]),
            np.stack([wider, wider * speeds], axis=1),
        ],
        axis=1,
    )
    # turned onto their principal directions, which are nobody's
    weighted = weight[:, None] * rows
    directions, _, _ = np.linalg.svd(weighted, full_matrices=False)
    turned = directions.T @ weighted
    largest = np.take_along_axis(turned, np.argmax(np.abs(turned), axis=1)[:, None], axis=1)
    return of_rows(turned * np.sign(largest))


def of_rows(rows: Array) -> Laboratories:
    """`Laboratories` of `rows` (k, q), as `to_rows` has them."""
    angles, kinetics, numbers = np.split(
        rows, np.cumsum([2 * len(_ANGLES) * SAMPLES, 2 * len(KINETICS) * SAMPLES]), axis=1
    )
    return Laboratories(
        angles.reshape(-1, 2, len(_ANGLES), SAMPLES),
        kinetics.reshape(-1, 2, len(KINETICS), SAMPLES),
        *numbers.T,
    )


def to_rows(of: Laboratories) -> Array:
    """(k, q), one for each row."""
    return np.concatenate(
        [of.angles.reshape(len(of.ones), -1), of.kinetics.reshape(len(of.ones), -1)]
        + [each[:, None] for each in of[2:]],
        axis=1,
    )


@cache
def stored() -> Laboratories:
    """Those that come with the package (experiments/forces_elsewhere.py)."""
    text = (resources.files("gaitval.subjects.prediction") / STORE).read_text(encoding="utf-8")
    found: dict[str, Any] = loads(text)
    return of_rows(UNIT * np.array(found["rows"], float))


def differences(of: Laboratories, people: Sequence[Sequence[DeviationTrial]]) -> list[Deviation]:
    """How the rows differ from what is expected of anybody, by `people`; mechanics and the width of
    the pelvis, which laboratories put elsewhere, are not known of them.
    """
    # what is expected is a + b · speed
    begin, end = (usual_gait(people, speed) for speed in (0.0, 1.0))

    def expected(take: Any, ones: Array, speeds: Array) -> Array:
        first = take(begin)
        return np.asarray(
            np.multiply.outer(ones, first) + np.multiply.outer(speeds, take(end) - first)
        )

    usual = expected(kinetics_of, of.ones, of.speeds)
    angles = of.angles - expected(lambda gait: angles_of(gait, _ANGLES), of.ones, of.speeds)
    times = of.stride_times - expected(_stride_time, of.ones, of.speeds)
    # of the product of how much wider a step is and what is expected, as one number times another
    long = expected(kinetics_of, of.wider, of.wider_speeds)
    sagittal = len(SAGITTAL)
    return [
        Deviation(
            angles[i, :, :sagittal],
            angles[i, :, sagittal:],
            float(times[i]),
            of.kinetics[i] - usual[i],
            np.zeros_like(usual[i]),
            long[i],
            1.0,
            0.0,
        )
        for i in range(len(of.ones))
    ]


def _stride_time(gait: NormalForm) -> float:
    return gait.stride_time
