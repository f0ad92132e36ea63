"""Gait Profile Score and Movement Analysis Profile: how far gait is from that of healthy adults.

The gait variable score of an angle is the RMS difference over the cycle from the mean of healthy
people; the nine of a side are the Movement Analysis Profile, their RMS is the side's Gait Profile
Score, and the RMS of both sides' the person's (Baker et al. 2009, Gait Posture 30:265, who take the
pelvis of one side only for the latter: up to a degree more). A difference of 1.6 degrees is the
smallest that matters clinically (Baker et al. 2012, Gait Posture 35:612). The healthy people are 42
adults at their own speed over ground (Fukuchi et al. 2018), in `gps_controls.csv`;
`experiments/gps_controls.py` makes it.
"""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import Curves
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.gait.record import GaitRecord
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import GaitProfile, GaitProfiles, by_kind
from gaitval.metrics.origin import Origins
from gaitval.subjects.identity import WBDS
from gaitval.subjects.subject import Subject

SMALLEST_DIFFERENCE: Final = 1.6
"""Degrees: minimal clinically important difference of the score (Baker et al. 2012)."""


def is_control(subject: Subject) -> bool:
    """Whether `subject` is one of the controls, who are people of WBDS.

    Their own curves are then in the mean they are compared with: with N controls, the distance from
    the mean of the others is N / (N - 1) times as large.
    """
    numbers = range(1, load_controls().people + 1)
    return subject.laboratory == WBDS and subject.person in {f"WBDS{each:02d}" for each in numbers}


def gait_profile(angles: Mapping[str, Array], controls: Mapping[str, Array]) -> GaitProfile:
    """Score mean curves of both sides, `angles` (101,) deg by name of `PROFILE_ANGLES` with `_r` or
    `_l`, signs of `GaitRecord`, against `controls` (101,) deg by name, such as `Controls.curves`. A
    variable that a side lacks is left out; the total then cannot be compared with one of nine.
    Raises ValueError if no variable is there for both.
    """
    used = [
        name
        for name in PROFILE_ANGLES
        if name in controls and f"{name}_r" in angles and f"{name}_l" in angles
    ]
    if not used:
        raise ValueError(
            f"none of the angles of a gait profile ({', '.join(PROFILE_ANGLES)}) is there for both "
            f"sides; seen: {', '.join(sorted(angles)) or 'none'}."
        )
    scores = {
        f"{name}_{side[0]}": rms(np.asarray(angles[f"{name}_{side[0]}"]) - controls[name])
        for name in used
        for side in SIDES
    }
    right, left = (rms(np.array([scores[f"{name}_{side[0]}"] for name in used])) for side in SIDES)
    # RMS over both sides, which have the same variables
    total = math.hypot(right, left) / math.sqrt(2.0)
    return GaitProfile(scores=scores, right=right, left=left, total=total)


def walk_profiles(
    curves: Curves, progression: Mapping[str, Array], record: GaitRecord, origins: Origins
) -> GaitProfiles | None:
    """The scores of a walk's `curves` (n, 101) and of `record`, whose angles come from `origins`,
    with the `progression` of the feet (`foot_progression`); None with fewer than two cycles.
    """
    cycles = by_kind(curves)
    if min(len(curve) for kind in cycles.values() for curve in kind.values()) < 2:
        return None
    walked = {name: curve.mean(axis=0) for name, curve in cycles["angles"].items()}
    phase, controls = np.linspace(0.0, 1.0, SAMPLES), load_controls().curves
    of_record = {name: np.degrees(curve(phase)) for name, curve in record.angles.items()}
    turned = {name: np.degrees(curve.mean(axis=0)) for name, curve in progression.items()}
    both = {name: curve for name, curve in {**walked, **turned}.items() if name in of_record}
    # scored on the same variables, else the two totals could not be compared
    same = {name: of_record[name] for name in both}
    recorded = set(origins["angles"].values()) == {"recorded"}
    return GaitProfiles(
        variables=[n for n in PROFILE_ANGLES if f"{n}_r" in both and f"{n}_l" in both],
        record=gait_profile(same, controls) if recorded else None,
        walk=gait_profile(both, controls),
    )
