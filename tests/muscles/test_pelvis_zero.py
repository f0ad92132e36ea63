"""At which angle a person's pelvis is as the published one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_walk import loaded_walk

from experiments.gps_controls import strides
from gaitval.coordinates import COORDINATES
from gaitval.kinetics.musculature import gait
from gaitval.kinetics.musculature.pelvis_zero import PELVIS, pelvis_zero, tilts, walking_tilt
from gaitval.model.ground import Ground
from gaitval.subjects.subject_file import builtin_subjects

PITCH = COORDINATES.index("pelvis_ry")


@pytest.fixture(scope="module")
def motion():
    walk = loaded_walk()
    positions = walk.positions.copy()
    flexions = [COORDINATES.index(f"hip_flexion_{side}") for side in "rl"]
    # The pelvis lies as people's usually does, and the thighs where they were.
    more = PELVIS.usual - walking_tilt([walk])
    positions[:, [PITCH, *flexions]] += more
    return replace(walk, positions=positions)


def _tilted(motion, more):
    """The walk of a person the plane of whose ASIS and PSIS is tilted by `more` rad."""
    positions = motion.positions.copy()
    for name in ("hip_flexion_r", "hip_flexion_l"):
        positions[:, COORDINATES.index(name)] += more
    positions[:, PITCH] += more
    return replace(motion, positions=positions)


def test_who_walks_as_usual_is_taken_as_is_and_crouch_for_posture():
    assert pelvis_zero(PELVIS.usual) == 0.0
    less = pelvis_zero(PELVIS.usual - 0.1)
    assert 0.05 < less < 0.1
    # Beyond 95 % of healthy people more tilt says nothing more about the shape of the bone.
    assert (
        pelvis_zero(PELVIS.usual + 2.0 * PELVIS.spread)
        == pelvis_zero(PELVIS.usual + 5.0 * PELVIS.spread)
        < -0.1
    )


def test_the_shape_of_a_pelvis_hardly_changes_what_muscles_do(motion, monkeypatch):
    flat = _tilted(motion, np.radians(-8.0))
    assert walking_tilt([flat]) - PELVIS.usual == pytest.approx(
        np.radians(-8.0), abs=np.radians(0.3)
    )

    def changed():
        before, after = (
            gait.muscles_of([each]).pieces[0][2].legs["right"].passive for each in (motion, flat)
        )
        return float(np.abs(after - before).sum(axis=1).max())

    known = changed()
    monkeypatch.setattr(gait, "pelvis_zero", lambda _: 0.0)
    assert known < 0.3 * changed()


def test_a_tilt_is_to_gravity(motion):
    level = tilts(motion.model, motion.positions)
    up = replace(motion.model, ground=Ground(slope=10.0))
    # Up a slope the ground's axis forward points up, and so does a pelvis that lies along it.
    np.testing.assert_allclose(
        level - tilts(up, motion.positions), np.arctan(0.1), atol=np.radians(0.3)
    )


def test_part_of_a_stride_does_not_say(motion):
    assert walking_tilt([replace(motion, cycles={})]) is None


def test_what_is_usual_is_of_people_outside_the_table(gait_data: Path):
    tilt = strides(gait_data).xs("control").xs("pelvis_tilt", level="angle").mean(axis=1)
    people = tilt.groupby(level="subject").mean()
    known = {subject.person for subject in builtin_subjects()}
    found = np.array([value for name, value in people.items() if name not in known])
    assert len(found) == 32
    assert np.degrees(PELVIS.usual) == pytest.approx(found.mean(), abs=0.05)
    assert np.degrees(PELVIS.spread) == pytest.approx(found.std(ddof=1), abs=0.05)
