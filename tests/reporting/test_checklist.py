"""The checklists of Hicks 2015 and V&V 40."""

import csv
import io
import json
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from newton_walk import newton_walk

from gaitval.metrics.results import read_metrics
from gaitval.metrics.verdicts import limit_verdicts
from gaitval.reporting.checklist import NOT_DONE, as_csv, beside_metrics, checklist
from gaitval.reporting.run_files import read_walk

ROOT = Path(__file__).parents[2]
STORED = ROOT / "reports" / "S05" / "baseline" / "metrics.json"
BESIDE = {"momentum": "0.050 % of body weight", "seed": "0"}


def test_every_row_has_a_value_or_says_why_it_has_none() -> None:
    rows = checklist(read_metrics(STORED), BESIDE)
    wanted = tomllib.loads((ROOT / "gaitval/reporting/checklist.toml").read_text("utf-8"))["row"]
    assert [row.item for row in rows] == [row["item"] for row in wanted]
    assert {row.source for row in rows} == {"Hicks 2015", "V&V 40"}
    assert all(row.value for row in rows)
    assert all(row.evidence for row in rows if row.value == NOT_DONE)


def test_values_are_those_of_the_file_at_the_place_that_is_named() -> None:
    metrics = json.loads(STORED.read_text("utf-8"))
    found = {row.item: row for row in checklist(read_metrics(STORED), BESIDE)}
    mass = found["Equivalency of inputs: mass of the model"]
    assert mass.value == f"{metrics['method']['model_mass_kg']:.2f} kg"
    counts = metrics["summary"]
    output = found["Output comparison: values within their tolerance"]
    assert output.value == f"{counts['accepted']} of {counts['accepted'] + counts['refused']}"
    verdicts = metrics["identification"]["verdicts"]
    inputs = found["Model inputs: body parameters that the record determines"]
    assert inputs.value == f"{verdicts.count('identified')} of {len(verdicts)}"
    limits = {each.first.id: each for each in limit_verdicts(read_metrics(STORED))}
    angles = found["Joint angles against the record, sagittal"]
    assert (angles.value, angles.limit) == (
        limits["sagittal-angles"].value_text(),
        limits["sagittal-angles"].limit_text(),
    )
    shares = metrics["curve_statistics"]["bands"]["moments"]
    least = min(row["walk"] for row in shares.values())
    (bands,) = (row for item, row in found.items() if "literature" in item)
    assert bands.value == f"{100 * least:.0f} %"


def test_what_a_run_lacks_is_not_done() -> None:
    metrics = read_metrics(STORED).model_copy(
        update={"second_engine": None, "identification": None}
    )
    found = {row.item: row for row in checklist(metrics, {"momentum": "", "seed": ""})}
    for item in (
        "Software verified: the same walk in a second engine, goals reached",
        "Model inputs: body parameters that the record determines",
        "Seed of this run",
    ):
        assert found[item].value == NOT_DONE


def test_momentum_and_seed_are_read_beside_the_metrics(tmp_path: Path) -> None:
    metrics = read_metrics(STORED)

    def beside() -> dict[str, str]:
        walk, origin = read_walk(tmp_path, metrics), SimpleNamespace(provenance={"seed": 7})
        return beside_metrics(SimpleNamespace(metrics=metrics, walk=walk, origin=origin))

    assert beside() == {"momentum": "", "seed": "7"}
    newton_walk(np.zeros(3)).save(tmp_path / "rollouts" / f"{metrics.final}.npz")
    # of another body: only that it is there
    assert 0.0 < float(beside()["momentum"].split()[0]) < 100.0


def test_the_table_has_the_same_rows() -> None:
    rows = checklist(read_metrics(STORED), BESIDE)
    read = list(csv.reader(io.StringIO(as_csv(rows))))
    # A spreadsheet would take "= 0 walks" for a formula.
    guarded = [tuple(f"'{c}" if c.startswith("=") else c for c in row) for row in rows]
    assert [tuple(row) for row in read[1:]] == guarded
