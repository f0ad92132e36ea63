"""The scripts of `examples/` are short, run, and write what they say."""

import re
import runpy
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WRITTEN = {
    "c3d_to_joint_moments.py": ("motion.npz", "moments.npz", "moments.csv", "moments.png"),
    "compare_walkers.py": ("comparison.npz", "comparison.csv", "comparison.png"),
    "own_controller.py": (),
    "scale_a_body.py": ("model.urdf", "scaling.csv", "body.png"),
    "walk_a_policy.py": ("walk.npz", "curves.csv", "walk.png"),
}
"""Files that each example writes into the folder that it is given."""

ARGUMENTS = {"c3d_to_joint_moments.py": ("1",), "compare_walkers.py": ("5", "2")}
"""Before the folder; the C3D file comes first of all."""


def example_of(page: str) -> tuple[str, str]:
    """The Python of a page, the block that begins with our import, and the block after it."""
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"(?:^(?: {4}.*)?\n)+", text, re.MULTILINE)
    blocks = [textwrap.dedent(block).strip() for block in blocks if block.strip()]
    (at,) = (i for i, block in enumerate(blocks) if block.startswith("import gaitval as gv"))
    return blocks[at], [*blocks, ""][at + 1]


def test_the_example_of_the_page_on_python_prints_what_it_says(capsys):
    code, printed = example_of("docs/python.md")
    exec(code, {})
    shown = [line.rstrip() for line in capsys.readouterr().out.strip().splitlines()]
    assert shown == [line.rstrip() for line in printed.splitlines()]


@pytest.mark.slow
@pytest.mark.usefixtures("policy")
def test_the_five_lines_of_the_readme_run(capsys):
    code, _ = example_of("README.md")
    assert len(code.splitlines()) == 5
    exec(code, {})
    assert "knee_angle" in capsys.readouterr().out


def test_every_example_is_tested():
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(WRITTEN)


WALKING = ("compare_walkers.py", "own_controller.py", "walk_a_policy.py")
"""The functions that these call also run in the examples of their docstrings."""


@pytest.mark.usefixtures("policy")
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in WALKING else ()) for name in WRITTEN],
)
def test_an_example_runs(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
):
    """In this process: what it imports, and the stored walkers, are loaded once."""
    arguments = [*ARGUMENTS.get(name, ("5",)), str(tmp_path)]
    if name.startswith("c3d"):
        raw: Path = request.getfixturevalue("gait_data") / "wbds" / "raw"
        arguments.insert(0, str(raw / "WBDS01walkT01.c3d"))
    script = str(ROOT / "examples" / name)
    monkeypatch.setattr(sys, "argv", [script, *arguments])
    runpy.run_path(script, run_name="__main__")
    for file in WRITTEN[name]:
        assert (tmp_path / file).stat().st_size > 0
