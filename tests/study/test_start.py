"""A study begins at once: what draws its pages is loaded while others work."""

import subprocess
import sys

PAGES = ("matplotlib", "weasyprint", "mujoco", "torch")


def test_nothing_of_pages_is_loaded_before_the_first_stage() -> None:
    program = f"import gaitval.study.run, sys; print({{*{PAGES!r}}} & {{*sys.modules}} or 'none')"
    found = subprocess.run(
        [sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "none"
