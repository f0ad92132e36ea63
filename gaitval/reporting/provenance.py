"""What a report was made from: the date of the run, the code, and the hash of every file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from gaitval.artefacts import file_hash
from gaitval.build_info import minute_of

Json = Mapping[str, Any]

FILES: Final = (
    *("subject.toml", "configuration.toml", "model.urdf", "scaling.csv", "reference.npz"),
    *("policy/policy.json", "policy/policy.safetensors", "identification.json", "identified.npz"),
    *("correction.json", "rollouts/nominal.npz", "rollouts/identified.npz"),
    *("rollouts/witness.npz", "push.json", "metrics.json"),
)
"""What the numbers of a report come from, in the order in which it is made. `policy/training.csv`
and `provenance.json` hold times, so that equal runs differ in them; they are not listed."""


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of each of `FILES` that a run `folder` has, as `sha256sum FILE` prints it."""
    return {name: file_hash(folder / name) for name in FILES if (folder / name).is_file()}


def dates(provenance: Json | None) -> tuple[str, str] | None:
    """When the first stage in `provenance` (`credibility.provenance_before`) started and the last
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
