"""What the pytest plug-in writes into a baseline."""

import shutil
from pathlib import Path

from gaitval.apps.regression import plugin
from gaitval.apps.regression.baseline import changed_inputs, installed_code, seal_again
from gaitval.apps.regression.seal import read_seal, seal
from gaitval.metrics.results import read_metrics

STORED = Path(__file__).parents[2] / "reports" / "S05" / "baseline"


def test_an_updated_baseline_was_walked_by_the_installed_code(tmp_path: Path) -> None:
    """Its figures are new, so a later check compares with the code that made them."""
    folder = tmp_path / "baseline"
    shutil.copytree(STORED, folder)
    seal(folder, code={**installed_code(), "gaitval/model": "0" * 64})
    now = read_metrics(folder)
    assert changed_inputs(folder, now) == ["the code in gaitval/model"]
    seal_again(folder)  # by hand: nothing has walked
    assert changed_inputs(folder, now) == ["the code in gaitval/model"]
    plugin._update(folder, now)
    assert read_seal(folder).code == installed_code()
    assert changed_inputs(folder, now) == []
