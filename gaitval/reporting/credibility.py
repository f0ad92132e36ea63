"""What a report was made from: the date of the run, the code, and the hash of every file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from gaitval._internal.io.artefacts import file_hash, read_json
from gaitval._internal.io.build_info import minute_of
from gaitval.errors import ArtefactError
from gaitval.metrics.results import Metrics
from gaitval.metrics.whole_body import momentum_residual
from gaitval.model.ground import LEVEL
from gaitval.model.urdf import read_urdf
from gaitval.reporting.facts import shown
from gaitval.simulation.rollout import Rollout

PROVENANCE: Final = "provenance.json"

FILES: Final = (
    *("subject.toml", "configuration.toml", "model.urdf", "scaling.csv", "reference.npz"),
    *("policy/policy.json", "policy/policy.safetensors", "identification.json", "identified.npz"),
    *("correction.json", "rollouts/nominal.npz", "rollouts/identified.npz"),
    *("rollouts/second_engine.npz", "push.json", "metrics.json"),
)
"""What the numbers of a report come from, in the order in which it is made. `policy/training.csv`
and `provenance.json` hold times, so that equal runs differ in them; they are not listed."""


def beside_metrics(folder: Path, metrics: Metrics) -> dict[str, str]:
    """What the checklist takes beside `metrics` from other files of a run `folder`, by name; empty
    where they are not there: the force that would be needed beside ground and gravity, its largest
    mean over a second, and the seed.
    """
    path, momentum = folder / "rollouts" / f"{metrics.final}.npz", None
    if path.exists():
        model = folder / "model.urdf"
        ground = read_urdf(model).ground if model.exists() else LEVEL
        momentum = momentum_residual(Rollout.load(path), metrics.method.model_mass_kg, ground)
    return {
        "momentum": "" if momentum is None else shown(momentum, "% of body weight", 3),
        "seed": str((provenance_before(folder) or {}).get("seed", "")),
    }


def provenance_before(folder: Path) -> dict[str, Any] | None:
    """`provenance.json` of a run `folder` without the report's own stage, so that a report written
    again is the same; None without the file. Raises ArtefactError if it is no JSON object.
    """
    path = folder / PROVENANCE
    if not path.exists():
        return None
    found = read_json(path)
    if not isinstance(found, dict):
        raise ArtefactError(
            f"{path}: not a JSON object. Delete it and run `gaitval subject` again."
        )
    stages = found.get("stages")
    if isinstance(stages, dict):
        found["stages"] = {name: each for name, each in stages.items() if name != "report"}
    return found


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of each of `FILES` that a run `folder` has, as `sha256sum FILE` prints it."""
    return {name: file_hash(folder / name) for name in FILES if (folder / name).is_file()}


def dates(provenance: Mapping[str, Any] | None) -> tuple[str, str] | None:
    """When the first stage in `provenance` (`provenance_before`) started and the last
    one ended; None where that was not stored.
    """
    stages = (provenance or {}).get("stages")
    if not isinstance(stages, Mapping):
        return None
    began, ended = (
        [str(each[name]) for each in stages.values() if isinstance(each, Mapping) and name in each]
        for name in ("started", "finished")
    )
    first, last = minute_of(min(began, default="")), minute_of(max(ended, default=""))
    return (first, last) if first and last else None
