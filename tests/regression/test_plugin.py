"""What the pytest plug-in writes into a baseline."""

import shutil
from pathlib import Path

from gaitval._internal.io.build_info import source_commit
from gaitval.apps.regression import plugin
from gaitval.apps.regression.baseline import changed_inputs, installed_versions, seal_again
from gaitval.apps.regression.seal import read_seal, seal
from gaitval.metrics.results import read_metrics

STORED = Path(__file__).parents[2] / "reports" / "S05" / "baseline"


def test_an_updated_baseline_was_walked_by_the_installed_versions(tmp_path: Path) -> None:
    """Its figures are new, so a later check compares with the versions that made them."""
    folder = tmp_path / "baseline"
    shutil.copytree(STORED, folder)
    installed = installed_versions()
    older = {**installed, "simulate": installed["simulate"] - 1}
    seal(folder, versions=older, commit="b" * 40)
    now = read_metrics(folder)
    changed = [f"stage simulate at version {older['simulate']}, now {installed['simulate']}"]
    assert changed_inputs(folder, now) == changed
    seal_again(folder)  # by hand: nothing has walked
    assert changed_inputs(folder, now) == changed
    assert read_seal(folder).commit == "b" * 40
    plugin._update(folder, now)
    assert read_seal(folder).versions == installed
    assert read_seal(folder).commit == source_commit()
    assert changed_inputs(folder, now) == []
