"""Where markers are while a person stands, also in a trial in which they do other things."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.arrays import Array
from gaitval.mocap.recording import Recording
from gaitval.scaling.markers.frame import stands, stood

UP = 1
DEEP = 0.35
"""m, by how much the pelvis of the person below sinks in a squat."""


def squatted(stander: Recording, depth: Array) -> Recording:
    """The person of `stander` who squats by `depth` (T,) m: what is above the ankles sinks, the
    more the higher, and the knees go forward.
    """
    still = np.median(stander.markers, axis=0)
    floor = still[:, UP].min()
    share = np.clip((still[:, UP] - floor - 0.08) / (np.ptp(still[:, UP]) - 0.08), 0.0, 1.0)
    markers = np.repeat(still[None], len(depth), axis=0)
    markers[:, :, UP] -= depth[:, None] * share
    markers[:, :, 0] += depth[:, None] * 4.0 * share * (1.0 - share)
    return replace(stander, markers=markers)


def test_the_standing_part_of_a_trial_counts_not_its_squats(stander: Recording) -> None:
    # Stands for a second, squats for three, and stands for another second.
    squat = DEEP * np.sin(np.linspace(0.0, 3.0 * np.pi, 300)) ** 2
    trial = squatted(stander, np.concatenate([np.zeros(100), squat, np.zeros(100)]))
    assert stands(trial)
    from_middle = stood(trial) - stood(trial).mean(axis=0)
    still = np.median(stander.markers, axis=0)
    assert np.abs(from_middle - (still - still.mean(axis=0))).max() < 0.01


def test_of_one_who_never_rests_the_tallest_posture_counts(stander: Recording) -> None:
    trial = squatted(stander, DEEP * np.sin(np.linspace(0.0, 8.0 * np.pi, 800)) ** 2)
    # Nobody stands there, so that names have to agree before anything is used.
    assert not stands(trial)
    height = np.ptp(np.median(stander.markers, axis=0)[:, UP])
    assert np.ptp(stood(trial)[:, UP]) == pytest.approx(height, rel=0.02)
    mean = np.mean(trial.markers, axis=0)
    assert np.ptp(mean[:, UP]) < 0.9 * height


def test_a_marker_that_is_hidden_in_standing_is_where_it_is_on_average(stander: Recording) -> None:
    depth = np.concatenate([np.zeros(200), DEEP * np.sin(np.linspace(0.0, 3.0 * np.pi, 300)) ** 2])
    trial = squatted(stander, depth)
    trial.markers[:200, -1] = np.nan
    assert np.isfinite(stood(trial)).all()
