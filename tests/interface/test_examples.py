"""The scripts of `examples/` are short, run, and write what they say."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WRITTEN = {
    "scale_a_body.py": ("model.urdf", "scaling.csv", "body.png"),
    "walk_a_policy.py": ("walk.npz", "curves.csv", "walk.png"),
}
"""Files that each example writes into the folder that it is given."""


def test_every_example_is_tested():
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(WRITTEN)


@pytest.mark.parametrize("name", WRITTEN)
def test_an_example_is_short_and_runs(name: str, tmp_path: Path):
    script = ROOT / "examples" / name
    assert len(script.read_text(encoding="utf-8").splitlines()) <= 40
    subprocess.run(
        [sys.executable, str(script), "5", str(tmp_path)],
        check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    for file in WRITTEN[name]:
        assert (tmp_path / file).stat().st_size > 0
