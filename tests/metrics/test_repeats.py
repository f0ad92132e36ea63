"""The compared walk, repeated from every start phase with noise."""

import numpy as np
import pytest
from simulation_fixtures import changed

from gaitval.metrics.comparator import compared_with
from gaitval.metrics.repeats import repeated_walks
from gaitval.metrics.verdict_rows import ENDURANCE, repeated_values
from gaitval.model.parameters import nominal_parameters
from gaitval.study.stored_policy import general_walker
from gaitval.subjects.subject_file import load_subject

MU = nominal_parameters()
SUBJECT = load_subject("5")


@pytest.fixture(scope="module")
def short(task):
    return changed(
        task,
        validation={
            "start_phases": (0.0, 0.3, 0.7),
            "cycles": 2,
            "settling_cycles": 1,
            "consecutive_cycles": 3,
        },
        training={"workers": 1},
    )


@pytest.fixture(scope="module")
def compared(short):
    return compared_with(SUBJECT, short.record, [], short.model, short.configuration)


@pytest.fixture(scope="module")
def rows(short, compared):
    return repeated_walks(short, general_walker(short.configuration.environment), MU, compared)


def test_every_start_is_walked_with_noise_of_its_own(rows, short):
    assert [row.start_phase for row in rows] == [0.0, 0.3, 0.7]
    assert len({row.seed for row in rows}) == 3
    assert {row.noise for row in rows} == {short.configuration.environment.initial_noise}
    assert not any(row.fell for row in rows)


def test_what_is_measured_of_a_walk_is_measured_of_each_repeat_and_differs(rows):
    values = repeated_values(rows)
    for target in ("knee_angle_r", "hip_flexion_l"):
        found = values["angle_rmse", target]
        assert len(set(found)) == 3
        assert np.all(np.array(found) < 10.0)
    assert not any(measure in ENDURANCE for measure, _ in values)


def test_neither_workers_nor_another_call_change_a_number(rows, short, compared):
    walker = general_walker(short.configuration.environment)
    two = changed(short, training={"workers": 2})
    assert repeated_walks(two, walker, MU, compared) == rows


def test_without_noise_walks_from_one_phase_would_be_equal_and_with_it_they_are_not(
    short, compared
):
    walker = general_walker(short.configuration.environment)
    still = changed(short, environment={"initial_noise": 0.0})
    quiet = repeated_walks(still, walker, MU, compared)
    other = repeated_walks(changed(short, seed=7), walker, MU, compared)
    assert quiet != other
    assert repeated_walks(changed(still, seed=7), walker, MU, compared)[0].measures == (
        quiet[0].measures
    )
