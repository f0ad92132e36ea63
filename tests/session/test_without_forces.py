"""An import without force plates ends in a subject, whose walk predicts moments and forces."""

import numpy as np
import pytest
from recorded_sessions import wbds01_t01

from gaitval.configuration import Configuration, RecordSettings
from gaitval.session.importing.importing import work_out
from gaitval.session.subject import subject_of
from gaitval.subjects.prediction.known import known_record, quantities_known
from gaitval.subjects.subject_file import builtin_subjects, parse_subject


@pytest.fixture(scope="module")
def subject(gait_data):
    request = wbds01_t01(gait_data)
    request = request.model_copy(update={"consistent": False, "kinematics_only": True})
    return subject_of(work_out(request, Configuration().processing))


def test_it_has_angles_and_timing_and_no_kinetics(subject):
    assert not subject.has_kinetics
    assert subject.mean_vertical_force is None
    assert 0.6 < subject.stance_fraction.right < 0.75  # slow: 0.49 m/s
    assert parse_subject(subject.to_toml(), "again").to_toml() == subject.to_toml()


def test_its_run_is_told_what_was_recorded_and_expects_the_rest(subject):
    settings = RecordSettings()
    assert quantities_known(subject, settings) == ("angles", "timing")
    record = known_record(subject, settings, builtin_subjects()).record
    knee = subject.gait.angles["knee_angle_r"].periodic()
    phase = np.arange(50) / 50
    np.testing.assert_array_equal(record.angles["knee_angle_r"](phase), knee(phase))
    force = sum(record.ground_reaction(side, phase)[:, 2].mean() for side in ("right", "left"))
    assert force == pytest.approx(1.0, abs=0.03)
