"""The slope of the ground of an import, found from the direction of the mean force."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_sessions import rajagopal_walk

from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError
from gaitval.model.ground import LEVEL, Ground
from gaitval.scaling.scaling import scale_subject
from gaitval.session.incline import SAME, found_incline, ground_of
from gaitval.session.request import Request
from gaitval.session.session import Import, work_out_trials
from gaitval.session.subject import subject_of


def silent(step: str, message: str) -> None:
    pass


def level_walk(gait_data: Path) -> Request:
    return rajagopal_walk(gait_data).model_copy(update={"consistent": False})


@pytest.fixture(scope="module")
def level(gait_data) -> Import:
    return work_out_trials(level_walk(gait_data), ProcessingSettings(), silent)


def turned(found: Import, ground: Ground) -> list:
    """The walks with forces as they are in the axes of a belt with a slope."""
    return [
        replace(walk, forces=replace(walk.forces, force=walk.forces.force @ ground.from_level.T))
        for walk in found.trials
    ]


@pytest.mark.slow
@pytest.mark.parametrize("slope", [-10.0, -5.0, 0.0, 5.0, 10.0])
def test_the_slope_of_turned_forces_is_found_within_half_a_degree(level, slope):
    found = found_incline(turned(level, Ground(slope)), level.request.mass_kg)
    assert found is not None
    assert found.degrees == pytest.approx(np.rad2deg(np.arctan(slope / 100.0)), abs=0.5)


@pytest.mark.slow
def test_level_ground_stays_level(level):
    assert level.body.model.ground == LEVEL
    assert ground_of(level.request, level.trials, silent) == LEVEL
    assert not [step for step, _ in level.decisions if step == "incline"]


def test_a_said_slope_that_the_forces_contradict_is_refused(level):
    """Both angles, how many cycles, what to give instead."""
    said = level.request.model_copy(update={"incline": 5.0})
    with pytest.raises(
        RecordError, match=r"incline = 5.*\+2\.9 degrees.*cycles.*[+-]0\.\d degrees"
    ):
        ground_of(said, level.trials, silent)
    assert ground_of(said, turned(level, Ground(5.0)), silent) == Ground(5.0)
    near = level.request.model_copy(update={"incline": 100.0 * np.tan(np.deg2rad(0.5 * SAME))})
    assert ground_of(near, level.trials, silent).slope == near.incline


def turned_file(path: Path, out: Path, ground: Ground) -> Path:
    """A copy of a MOT file of ground reactions, in OpenSim's axes, in those of a slope."""
    lines = path.read_text("utf-8").splitlines()
    head = next(i for i, line in enumerate(lines) if "time" in line.split())
    names = lines[head].split()
    rows = np.array([line.split() for line in lines[head + 1 :]], dtype=float)
    turn = ground.from_level
    for name in names:
        if re.search(r"(_v|moment|torque)x$|torque_x$", name):
            x, y = names.index(name), names.index(name[:-1] + "y")
            rows[:, x], rows[:, y] = (
                turn[0, 0] * rows[:, x] + turn[0, 2] * rows[:, y],
                turn[2, 0] * rows[:, x] + turn[2, 2] * rows[:, y],
            )
    body = ["\t".join(f"{value:.8f}" for value in row) for row in rows]
    out.write_text("\n".join([*lines[: head + 1], *body]) + "\n", "utf-8")
    return out


@pytest.mark.slow
def test_a_whole_import_finds_it_and_its_moments_know_it(gait_data, level, tmp_path):
    """Forces turned by 5 %, not said: what the segments weigh is turned with them, so that the
    residual force on the pelvis stays as small as on the level; the subject keeps the slope."""
    request = level_walk(gait_data)
    forces = turned_file(request.forces[0], tmp_path / "turned.mot", Ground(5.0))
    request = request.model_copy(update={"forces": (forces,)})
    said = []
    found = work_out_trials(request, ProcessingSettings(), lambda *each: said.append(each))
    assert found.body.model.ground.slope == pytest.approx(5.0, abs=0.9)
    assert [message for step, message in said if step == "incline"]
    walk, before = found.trials[0], level.trials[0]
    residual, was = (np.nanmean(each.dynamics.residual_force, axis=0)[0] for each in (walk, before))
    # gravity that was not turned would leave 5 % of the weight
    assert abs(residual - was) < 0.015 * request.mass_kg * 9.81
    subject = subject_of(found)
    assert subject.slope_percent == pytest.approx(found.body.model.ground.slope)
    assert scale_subject(subject).model.ground == Ground(subject.slope_percent)
