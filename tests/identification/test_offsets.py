"""What is wrong on everybody: estimated, shipped as measured, and nobody corrects themselves."""

import json
from pathlib import Path

import numpy as np
import pytest

from gaitval.identification.offsets import MOVED, OFFSETS, estimated, offset_of
from gaitval.subjects.subject_file import load_subject

ROOT = Path(__file__).parents[2]
STORED = json.loads((ROOT / "reports" / "identification" / "ten_shared.json").read_text())


def test_a_common_error_is_found_among_draws_and_no_other_parameter_is_moved():
    random, true = np.random.default_rng(0), np.zeros(len(OFFSETS))
    true[[OFFSETS.index(name) for name in MOVED]] = 1.0, -1.0, 0.5, -1.5
    joint = np.diag(random.uniform(0.3, 0.9, len(OFFSETS)))
    message = np.eye(len(OFFSETS)) - joint
    shifts = [message @ true + random.multivariate_normal(0.0 * true, message) for _ in range(200)]
    found = estimated(shifts, [joint] * len(shifts))
    assert np.abs(found - true).max() < 0.3
    assert set(np.flatnonzero(found)) == {OFFSETS.index(name) for name in MOVED}


@pytest.mark.parametrize("name", ["S01", "S05"])
def test_a_built_in_person_has_the_offset_of_the_nine_others(name):
    others = [each for each in STORED["alone"] if each["name"] != name]
    expected = estimated(*([np.array(each[key]) for each in others] for key in ("shift", "joint")))
    np.testing.assert_allclose(offset_of(load_subject(name)), expected, atol=6e-4)


def test_a_stranger_has_that_of_all_and_a_virtual_person_none():
    subject = load_subject("S05")
    expected = estimated(
        *([np.array(each[key]) for each in STORED["alone"]] for key in ("shift", "joint"))
    )
    stranger = subject.model_copy(update={"person": "somebody"})
    np.testing.assert_allclose(offset_of(stranger), expected, atol=6e-4)
    virtual = subject.model_copy(update={"laboratory": "virtual"})
    assert not offset_of(virtual).any()
