"""A finished run, as far as `baseline` and `compare` look at it, without the hour that it takes."""

from collections.abc import Callable
from pathlib import Path

import pytest

import gaitval.cli  # noqa: F401 - fills the table of commands
from gaitval._internal.io.artefacts import (
    copy_files,
    file_hash,
    read_json,
    value_hash,
    write_json,
    write_text,
)
from gaitval.study.inputs import STORED_FILES

REPORTS = Path(__file__).parents[2] / "reports"

POLICY = ("policy/policy.safetensors", "policy/policy.json", "policy/gain.json")
STAGES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "scale": (("subject.toml",), ("model.urdf",)),
    "train-1": (("model.urdf", "start/policy.json"), ("rounds/1/trained/policy.json",)),
    "identify-1": (("model.urdf",), ("rounds/1/identification/identification.json",)),
    "keep-1": (("rounds/1/trained/policy.json",), ("rounds/1/policy/policy.json",)),
    "choose": (
        ("rounds/1/policy/policy.json", "rounds/1/identification/identification.json"),
        (*POLICY, "identification.json"),
    ),
    "correct": (("subject.toml", "identification.json", *POLICY[:2]), ("correction.json",)),
    "simulate": (("correction.json", *POLICY[:2]), ("rollouts/identified.npz",)),
    "validate": (
        ("correction.json", "identification.json", "rollouts/identified.npz", POLICY[2]),
        ("metrics.json",),
    ),
    "report": (("metrics.json",), ("report.html",)),
}
"""Some stages of a run: what each reads, and what it writes."""

MakeRun = Callable[..., Path]


def record(folder: Path, stage: str) -> None:
    """Write into the records of a run that a stage has just run."""
    inputs, outputs = STAGES[stage]
    path = folder / "stages.json"
    records = read_json(path) if path.exists() else {}
    records[stage] = {
        "inputs": {
            "seed": value_hash(0),
            **{name: file_hash(folder / name) for name in inputs},
        },
        "outputs": {name: file_hash(folder / name) for name in outputs},
        "version": 1,
    }
    write_json(path, records)


@pytest.fixture
def make_run() -> MakeRun:
    """Makes a finished run of a built-in subject in a folder, from its stored baseline."""

    def make(folder: Path, name: str = "S05") -> Path:
        copy_files(REPORTS / name / "baseline", folder, STORED_FILES)
        files = {"start/policy.json", *(each for both in STAGES.values() for each in sum(both, ()))}
        for file in files - {*STORED_FILES}:
            write_text(folder / file, f'{{"file": "{file}"}}')
        write_json(folder / "provenance.json", {"commit": "a" * 40, "stages": {}})
        for stage in STAGES:
            record(folder, stage)
        return folder

    return make
