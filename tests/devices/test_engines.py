import numpy as np
import pytest

from gaitval.apps.devices.engines import ENGINES, differences, in_engines, passive_motion
from gaitval.datasets.subject_file import load_subject
from gaitval.model.devices.composite import fitted
from gaitval.model.devices.device import load_devices
from gaitval.scaling.scaling import scale_subject


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("S08")).model


@pytest.mark.parametrize("name", ["hip_exo", pytest.param("above_knee", marks=pytest.mark.slow)])
def test_four_programs_find_the_same_body(model, name, tmp_path):
    found = in_engines(model, load_devices(name), tmp_path, seed=3, seconds=1.0, rows=6)
    assert set(found) == set(ENGINES)
    # 1e-6 is the goal; what remains is rounding, and yourdfpy's differences for velocities.
    assert max(differences(found).values()) < 1e-9


def test_a_part_that_is_forgotten_is_noticed(model, tmp_path):
    found = in_engines(model, load_devices("foot_2kg"), tmp_path, seconds=0.2, rows=2)
    without = in_engines(model, load_devices("thigh_2kg"), tmp_path, seconds=0.2, rows=2)
    assert differences(found | {"DART": without["DART"]})["inertia"] > 1e-3


def test_passive_motion_turns_and_loses_energy_only_to_its_joints(model):
    body = fitted(model, load_devices("backpack"))
    positions, _ = passive_motion(body, seed=1, seconds=0.5, rows=6)
    assert np.ptp(positions[:, 6:], axis=0).max() > 0.05
    # Nothing pushes: the pelvis does not fall.
    assert np.abs(positions[-1, 5]) < 1.0
