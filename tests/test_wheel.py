"""The wheel holds all that the installed command needs."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Folder with the contents of the wheel, as pip would place them."""
    pytest.importorskip("build", reason="the extra `dev` has what builds a wheel")
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT],
        check=True,
        capture_output=True,
    )
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def test_models_and_policies_are_inside(installed):
    assert (installed / "gaitval/models/xacro/humanoid.urdf.xacro").is_file()
    assert (installed / "gaitval/data/builtin/S05.toml").is_file()
    for name in ("metrics.json", "policy/policy.safetensors", "policy/policy.json"):
        assert (installed / "gaitval/baselines/S05" / name).is_file()
    assert (installed / "gaitval/baselines/general/policy.safetensors").is_file()
    assert (installed / "gaitval/configurations/paper.toml").is_file()


def test_scales_a_subject_away_from_the_checkout(installed, tmp_path):
    """From the wheel's files alone, in an empty folder."""
    code = (
        f"import sys; sys.path.insert(0, {str(installed)!r});"
        "sys.argv = ['gaitval', 'scale', '5']; import gaitval.cli as c;"
        f"assert c.__file__.startswith({str(installed)!r}), c.__file__; c.main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "reports/S05/model.urdf").is_file()
