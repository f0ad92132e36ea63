"""The line that imports a recording of `gaitval virtual --c3d`, or the sample that is one."""

from pathlib import Path
from typing import Any


def import_line(folder: Path, about: dict[str, Any]) -> str:
    """The command that imports `folder`; `about` is what its `truth.json` holds."""
    files = f"--static {folder / 'standing.c3d'} --trial {folder / 'walking.c3d'}"
    person = f"--mass {about['mass_kg']:g} --height {about['height_m']:g} --sex {about['sex']}"
    return f"gaitval import {files} {person} --belt {about['belt_m_s']:.4f} --out reports/sample"
