"""The pytest plug-in in a project of somebody else, which has a test of two lines."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BASELINE = ROOT / "reports" / "S05" / "baseline"
TEST = """def test_knee(gaitval_check):
    gaitval_check("baseline", quantities=["knee_angle"])
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with a baseline and a test."""
    shutil.copytree(BASELINE, tmp_path / "baseline")
    (tmp_path / "test_gait.py").write_text(TEST)
    return tmp_path


def run(project: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run pytest there, with no other plug-in."""
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "gaitval.apps.regression.plugin", *arguments],
        cwd=project,
        env={
            **os.environ,
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            "PYTHONPATH": str(ROOT),
        },
        capture_output=True,
        text=True,
        check=False,
    )


def weaken(project: Path, factor: float) -> None:
    """Scale the last layer of the stored policy, and seal it as if it had been so."""
    from safetensors.numpy import load_file, save_file

    from gaitval.apps.regression.baseline import seal_again

    (file,) = (project / "baseline" / "policy").glob("*.safetensors")
    tensors = load_file(file)
    (last,) = (name for name in tensors if name.endswith("action_net.weight"))
    save_file(tensors | {last: factor * tensors[last]}, file)
    seal_again(project / "baseline")


@pytest.mark.slow  # walks twice; what it refuses is tested always
def test_two_lines_check_a_walk_and_two_tests_walk_once(project: Path) -> None:
    (project / "test_more.py").write_text(
        "def test_all(gaitval_check):\n"
        '    rows = gaitval_check("baseline")\n'
        "    assert len(rows) > 100\n"
        "def test_sides(gaitval_check):\n"
        '    assert {r.target for r in gaitval_check("baseline", quantities=["knee_angle"])} == '
        '{"knee_angle", "knee_angle_r", "knee_angle_l"}\n'
        "def test_other():\n    pass\n"
    )
    done = run(project, "--basetemp", str(project / "temporary"), "--junitxml", "results.xml")
    assert done.returncode == 0, done.stdout
    assert "4 passed" in done.stdout
    assert len(list((project / "temporary").glob("gaitval-*.json"))) == 1
    assert 'name="inputs of the walk"' in (project / "results.xml").read_text()
    left_out = run(project, "-m", "not gaitval")
    assert "1 passed, 3 deselected" in left_out.stdout


@pytest.mark.slow
def test_a_loss_fails_with_its_figures(project: Path) -> None:
    weaken(project, -2.0)
    done = run(project)
    assert done.returncode == 1
    assert "measures are worse than stored by more" in done.stdout
    assert "angle_rmse of knee_angle_" in done.stdout
    assert "Traceback" not in done.stdout


@pytest.mark.slow
def test_what_cannot_be_compared_is_said_in_words_and_nothing_walks(project: Path) -> None:
    shutil.copytree(project / "baseline", project / "broken")
    (project / "broken" / "metrics.json").write_text("{}")
    (project / "test_gait.py").write_text(
        "def test_name(gaitval_check):\n"
        '    gaitval_check("baseline", quantities=["kne_angle"])\n'
        "def test_broken(gaitval_check):\n"
        '    gaitval_check("broken", quantities=["knee_angle"])\n'
    )
    done = run(project, "--basetemp", str(project / "temporary"))
    assert done.returncode == 1
    assert "2 failed" in done.stdout
    assert "no quantity 'kne_angle'" in done.stdout
    assert "did you mean knee_angle" in done.stdout
    assert "broken/metrics.json" in done.stdout
    assert "Traceback" not in done.stdout
    assert not list((project / "temporary").glob("gaitval-*.json"))


@pytest.mark.slow
def test_a_test_that_would_compare_nothing_fails_and_nothing_walks(project: Path) -> None:
    """It would pass whatever was lost."""
    (project / "test_gait.py").write_text(
        "def test_long(gaitval_check):\n"
        '    gaitval_check("baseline", quantities=["push_survival"])\n'
        "def test_one_of_two(gaitval_check):\n"
        '    gaitval_check("baseline", quantities=["knee_angle", "start phase 0"])\n'
        "def test_none(gaitval_check):\n"
        '    gaitval_check("baseline", quantities=[])\n'
    )
    done = run(project, "--basetemp", str(project / "temporary"))
    assert done.returncode == 1
    assert "3 failed" in done.stdout
    assert "push_survival is only measured with --gaitval-full" in done.stdout
    assert "gaitval_check: start phase 0 is only measured with --gaitval-full" in done.stdout
    assert "name at least one, or leave it out for all" in done.stdout
    assert "Traceback" not in done.stdout
    assert not list((project / "temporary").glob("gaitval-*.json"))


@pytest.mark.slow  # where baselines are found: `tests/study/test_stored_baseline.py`
def test_a_missing_baseline_is_said_once_and_those_of_gaitval_are_found(project: Path) -> None:
    (project / "test_gait.py").write_text(
        "def test_nowhere(gaitval_check):\n"
        '    gaitval_check("nowhere", quantities=["knee_angle"])\n'
        "def test_find(gaitval_check):\n"
        '    gaitval_check("S05", quantities=["push_survival"])\n'
    )
    done = run(project)
    assert done.returncode == 1
    assert "2 failed" in done.stdout
    assert "push_survival is only measured with --gaitval-full" in done.stdout  # so it was found
    assert "During handling" not in done.stdout
    body = done.stdout.partition("short test summary")[0]
    assert body.count("no stored baseline. Looked for") == 1
    assert "S05" in body


def test_the_plug_in_is_installed_with_the_package() -> None:
    text = (ROOT / "pyproject.toml").read_text()
    assert '[project.entry-points.pytest11]\ngaitval = "gaitval.apps.regression.plugin"' in text
