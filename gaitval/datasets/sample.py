"""The line that imports a recording of `gaitval virtual --c3d`, or the sample that is one."""

from pathlib import Path


def import_line(folder: Path, mass_kg: float, height_m: float, sex: str) -> str:
    """The command that imports the recording in `folder` of `gaitval virtual --c3d`, of a person of
    `mass_kg`, `height_m` and `sex`.
    """
    out = Path("reports") / "sample"
    files = f"--static {folder / 'standing.c3d'} --trial {folder / 'walking.c3d'}"
    return (
        f"gaitval import {files} --mass {mass_kg:g} --height {height_m:g} --sex {sex} --out {out}"
    )
