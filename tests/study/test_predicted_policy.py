"""The walk of a prediction is a walk like another: what walks a run walks it, too."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from gaitval.errors import PolicyError
from gaitval.model.parameters import nominal_parameters
from gaitval.study.inputs import CENTRING, walked_files
from gaitval.study.stored_policy import StoredPolicy, page_folder

BASELINE = Path(__file__).parents[2] / "reports/S05/baseline"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """That of a prediction at .95 m/s, with the policy of a baseline."""
    made = Path(shutil.copytree(BASELINE, tmp_path / "at-0.95"))
    (made / "identification.json").unlink()
    (made / CENTRING).write_text(json.dumps({"centring": 0.25}))
    settings = made / "configuration.toml"
    settings.write_text(settings.read_text().replace("\nspeed = 0.0\n", "\nspeed = 0.95\n"))
    return made


def test_it_walks_with_the_body_as_scaled_and_its_own_share_of_bias(folder: Path) -> None:
    loaded = StoredPolicy.load(folder)
    assert np.array_equal(loaded.identified, nominal_parameters())
    assert loaded.identified_model is loaded.model
    assert loaded.configuration.environment.centring == 0.25
    assert loaded._target[0].speed == 0.95


def test_it_is_saved_and_read_again(folder: Path, tmp_path: Path) -> None:
    StoredPolicy.load(folder).save(tmp_path / "copy")
    assert StoredPolicy.load(tmp_path / "copy").configuration.environment.centring == 0.25


def test_what_is_missing_is_what_a_prediction_would_have(folder: Path) -> None:
    assert set(walked_files(folder)) ^ set(walked_files(BASELINE)) == {
        CENTRING,
        "identification.json",
    }
    (folder / "correction.json").unlink()
    with pytest.raises(PolicyError, match=r"correction\.json missing") as refused:
        StoredPolicy.load(folder)
    assert "identification" not in str(refused.value)


def test_pages_of_two_runs_of_one_person_do_not_replace_each_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("reports/S05/baseline", "reports/S05-range/at-0.95", "5"):
        Path(name).mkdir(parents=True)
    found = {
        given: page_folder(given, "S05", "perturbed").as_posix()
        for given in ("5", "reports/S05", "reports/S05/baseline", "reports/S05-range/at-0.95/")
    }
    assert found.pop("reports/S05-range/at-0.95/") == "reports/S05-range/at-0.95-perturbed"
    assert {*found.values()} == {"reports/S05-perturbed"}
