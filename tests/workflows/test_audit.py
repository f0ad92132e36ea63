"""An audit that could not be made is not taken for one that found nothing."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_every_lock_is_audited_and_what_cannot_be_looked_up_fails(tmp_path):
    """pip-audit passes over packages that its database does not know, unless it is strict."""
    done = subprocess.run(
        ["make", "--dry-run", "audit", f"GAITVAL_VENV={tmp_path / 'none'}"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    (audited,) = (line for line in done.stdout.replace("\\\n", " ").splitlines()
                  if "pip-audit --" in line)  # fmt: skip
    assert "--strict" in audited.split()
    assert "--require-hashes" in audited.split()
    for lock in (ROOT / "locks").glob("*.txt"):
        assert f"--requirement {lock.relative_to(ROOT)}" in audited
