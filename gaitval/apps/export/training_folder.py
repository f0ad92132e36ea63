"""The person as a Gymnasium environment: what it is made of, and a script that trains in it."""

from importlib.resources import files
from pathlib import Path

from gaitval.apps.export.walked import ExportedWalk
from gaitval.artefacts import write_text


def write_training(folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write `walker/`, which `gaitval/Walker-v0` takes, and `train.py`; returns the paths of all
    files. Raises ArtefactError.
    """
    walker, script = folder / "walker", folder / "train.py"
    walked.stored.save(walker)
    write_text(script, files("gaitval.apps.export").joinpath("train.py").read_text("utf-8"))
    return [*sorted(path for path in walker.rglob("*") if path.is_file()), script]
