"""A person of whom only strides are known walks without training, near the strides."""

import pytest

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.patients.cohort import found_patients, walked


@pytest.mark.slow
def test_a_person_walks_from_angles_alone_and_is_not_walked_twice(
    strides_table, people_table, tmp_path
):
    patients = found_patients(strides_table, [people_table], ["P2=1.1"], ["well"], ["P1_off"])
    messages = []
    (found,) = walked(patients, tmp_path, messages.append)
    assert (found["falls"], found["starts"]) == (0, 8)
    assert found["cycles"] >= 100
    assert found["angle"] < 2.5
    assert abs(found["scores"]["walk"] - found["scores"]["stride"]) < 2.0
    first, *_, last = found["correction"]["errors"]
    assert last < first
    assert found["correction"]["refused"] is None
    stored = read_json(tmp_path / "walks" / "P1_off.json")
    assert walked(patients, tmp_path, messages.append) == [stored]
