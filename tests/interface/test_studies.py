"""The main job and its report from Python."""

import random
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from quick_settings import QUICK

import gaitval as gv
from gaitval._internal.io.artefacts import write_json
from gaitval._internal.text.frames import COLUMNS
from gaitval.errors import ArtefactError
from gaitval.interface.studies import own_random
from gaitval.metrics.results import read_metrics
from gaitval.study.stored_policy import StoredPolicy


def test_a_study_is_read_from_what_is_stored(policy: StoredPolicy, tmp_path: Path):
    study = read_metrics(str(policy.folder))
    assert "limits met" in repr(study)
    frame = study.to_frame()
    assert tuple(frame.columns) == (*COLUMNS, "source")
    knee = frame[(frame.quantity == "knee_angle") & (frame.side == "left")]
    assert knee.groupby("source").size().to_dict() == {"the record of S05": 101, "walk of S05": 101}
    study.save(tmp_path)
    assert read_metrics(tmp_path) == study


def test_there_is_no_report_of_nothing(tmp_path: Path):
    with pytest.raises(ArtefactError, match="nothing to report"):
        gv.write_report(tmp_path)


def test_the_report_of_a_run_builds_on_its_stages(policy: StoredPolicy, tmp_path: Path):
    """As `gaitval report`: a folder with records of stages is a run, and this one is not done."""
    folder = shutil.copytree(policy.folder, tmp_path / "run")
    write_json(folder / "stages.json", {})
    with pytest.raises(ArtefactError, match="report depends on scale"):
        gv.write_report(folder)


@pytest.mark.slow
def test_the_main_job_runs_from_python(tmp_path: Path):
    study = gv.run_study(gv.load_subject(5), out=tmp_path / "S05", settings=QUICK)
    assert study.subject.identifier == "S05"
    page = tmp_path / "S05" / "report.html"
    written = page.stat().st_mtime_ns
    assert gv.write_report(tmp_path / "S05")[0] == page
    assert page.stat().st_mtime_ns == written, "the report was up to date"


def test_the_caller_s_random_numbers_go_on():
    for seed in (1, 2):
        random.seed(seed)
        np.random.seed(seed)  # noqa: NPY002
        torch.manual_seed(seed)
        expected = random.Random(seed).random(), np.random.RandomState(seed).random()
        with own_random():
            random.seed(0)
            np.random.seed(0)  # noqa: NPY002
            torch.manual_seed(0)
        assert (random.random(), np.random.random()) == expected  # noqa: NPY002
        assert torch.rand(1) == torch.rand(1, generator=torch.Generator().manual_seed(seed))
