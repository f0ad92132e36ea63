"""What a report was made from."""

from pathlib import Path

import numpy as np
from newton_walk import newton_walk

from gaitval._internal.io.artefacts import write_json
from gaitval.metrics.results import read_metrics
from gaitval.reporting import credibility
from gaitval.reporting.figure_data import _push_velocity

ROOT = Path(__file__).parents[2]
STORED = ROOT / "reports" / "S05" / "baseline" / "metrics.json"


def test_momentum_and_seed_are_read_beside_the_metrics(tmp_path: Path) -> None:
    metrics = read_metrics(STORED)
    assert credibility.beside_metrics(tmp_path, metrics) == {"momentum": "", "seed": ""}
    newton_walk(np.zeros(3)).save(tmp_path / "rollouts" / f"{metrics.final}.npz")
    write_json(tmp_path / "provenance.json", {"seed": 7, "stages": {"train": {"seconds": 1800.5}}})
    found = credibility.beside_metrics(tmp_path, metrics)
    assert found["seed"] == "7"
    assert float(found["momentum"].split()[0]) < 100.0  # of another body: only that it is there


def test_the_pushes_of_a_walker_that_fell_are_a_table_without_rows():
    head, *rows = _push_velocity([]).splitlines()
    assert head.startswith("phase,direction_deg")
    assert rows == []
