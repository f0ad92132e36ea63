"""A plate under both feet is divided: the parts add up, and are those of two plates."""

from pathlib import Path

import numpy as np
import pytest

from evidence.measurement.one_plate import as_one, errors
from gaitval.artefacts import read_json
from gaitval.configuration import load_configuration
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.session import trial
from gaitval.session.importing import import_files
from gaitval.session.request import ImportOptions
from gaitval_curves.sample import copy_sample
from gaitval_measurement.divided import _parts, _share


def test_the_parts_add_up_and_their_forces_meet_with_the_sums():
    rng = np.random.default_rng(1)
    wrench = rng.normal(0.0, 50.0, (30, 6))
    wrench[:, 2] += 700.0
    level = 0.1  # m, of the plate above the origin
    at = np.stack([-wrench[:, 4], wrench[:, 3]], axis=1) + level * wrench[:, :2]
    at /= wrench[:, 2:3]
    behind, ahead = at - np.array([0.3, 0.1]), at + np.array([0.2, -0.1])
    arms = [np.column_stack([each, np.full(30, level)]) for each in (behind, ahead)]
    share, height = np.linspace(0.0, 1.0, 30), 1.2
    parts = _parts(wrench, at, arms, share, height, 1)
    np.testing.assert_allclose(parts.sum(axis=1), wrench, atol=1e-9)
    np.testing.assert_allclose(parts[:, 0, 2], share * wrench[:, 2])
    # The lines of the sum's force and of that in front are at one place at this height.
    meet = at + height * wrench[:, :2] / wrench[:, 2:3]
    there = ahead[1:] + height * parts[1:, 0, :2] / parts[1:, 0, 2:3]
    np.testing.assert_allclose(there, meet[1:], atol=1e-9)
    assert not parts[0, 0, :3].any()


def test_the_load_goes_over_once():
    found = _share(np.array([-0.1, 0.1, 0.05, 0.3, 0.25, 0.6]), np.full(6, 0.5), 0.02)
    assert (np.diff(found) >= 0.0).all()
    assert (found[0], found[-1]) == (0.0, 1.0)
    assert found[1] == pytest.approx(0.15)  # between 0.2 and 0.1
    assert np.isfinite(_share(np.array([0.0, 0.1]), np.zeros(2), 0.02)).all()


@pytest.mark.slow  # three imports
def test_of_one_plate_each_foot_has_what_its_own_plate_measured(tmp_path: Path, monkeypatch):
    copy_sample(tmp_path / "sample")
    about = read_json(tmp_path / "sample" / "truth.json")
    options = ImportOptions(
        static=tmp_path / "sample" / "standing.c3d",
        trials=(tmp_path / "sample" / "walking.c3d",),
        mass=about["mass_kg"],
        height=about["height_m"],
        sex=about["sex"],
    )

    def imported(options, out):
        return import_files(options, tmp_path / out, configuration=load_configuration())

    own = imported(options, "own")
    zeroed = trial.zero_plates

    def made_one(recording, **given):
        recording, findings = zeroed(recording, **given)
        return as_one(recording), findings

    monkeypatch.setattr(trial, "zero_plates", made_one)
    with pytest.raises(RecordError, match=r"both feet on this plate.*--divide-plates") as refused:
        imported(options, "plain")
    assert refused.value.goes_on == ("--divide-plates", "--kinematics-only")
    found = imported(options.model_copy(update={"divide_plates": True}), "divided")
    (walk,) = found.found.trials
    for side in SIDES:
        assert sum(not cycle.reasons for cycle in walk.cycles[side]) >= 2
    wrong = errors(own.subject.record(), found.subject.record())
    assert wrong["vertical"] < 3.0
    assert wrong["forward"] < 2.0
    assert wrong["sideways"] < 1.5
    assert wrong["moments"] < 0.08
