"""An RO-Crate: every exported file, with its hash, licence and citation, as JSON-LD.

RO-Crate 1.1 (Soiland-Reyes et al. 2022, Data Science 5:97): a file `ro-crate-metadata.json`
describes itself, the folder, and every file in it.
"""

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from gaitval.apps.export.walked import ExportedWalk
from gaitval.artefacts import copy_files, file_hash, versions, write_json

FILE: Final = "ro-crate-metadata.json"
SPECIFICATION: Final = "https://w3id.org/ro/crate/1.1"
LICENCE: Final = "https://spdx.org/licenses/Apache-2.0"
"""Of gaitval and of the scripts in the crate."""
KEPT: Final = ("metrics.json", "seal.json")
"""What a run says of its own accuracy, if it is there."""
_KINDS: Final = {
    ".xml": "application/xml",
    ".osim": "application/xml",
    ".json": "application/json",
    ".toml": "application/toml",
    ".py": "text/x-python",
    ".mot": "text/tab-separated-values",
    ".sto": "text/tab-separated-values",
    ".parquet": "application/vnd.apache.parquet",
    ".bioMod": "text/plain",
    ".npz": "application/zip",
}
_PARTS: Final = {
    "mujoco": "The person in MuJoCo, and a script that walks",
    "urdf": "The person as a URDF, and the walk's joint angles and moments as CSV",
    "gymnasium": "The policy and its settings for gaitval/Walker-v0, and a script that trains",
    "opensim": "Model, motion, joint moments and ground reaction for OpenSim",
    "c3d": "The walk as markers and force plates",
    "biomod": "Model, and the walk's coordinates, rates and moments, for pyomeca",
    "locohub": "Curves over the gait cycle as LocoHub's Parquet",
    "accuracy": "How accurate the walk is: measured errors and limits",
}


def write_crate(
    folder: Path, walked: ExportedWalk, parts: Mapping[str, Sequence[Path]]
) -> list[Path]:
    """Describe the files of `parts`, which are in folders of that name below `folder`; returns the
    paths of all. What the run says of its accuracy is copied to `accuracy/`. Raises ArtefactError.
    """
    kept = tuple(name for name in KEPT if (walked.stored.folder / name).is_file())
    copy_files(walked.stored.folder, folder / "accuracy", kept)
    parts = {**parts, "accuracy": [folder / "accuracy" / name for name in kept]}
    write_json(folder / FILE, {"@context": f"{SPECIFICATION}/context", "@graph": [
        {
            "@id": FILE,
            "@type": "CreativeWork",
            "conformsTo": {"@id": SPECIFICATION},
            "about": {"@id": "./"},
        },
        *_root(walked, parts),
        *(_part(folder, name, paths) for name, paths in parts.items()),
        *(_file(folder, path) for paths in parts.values() for path in paths),
    ]})  # fmt: skip
    return [folder / FILE, *(path for paths in parts.values() for path in paths)]


def _root(walked: ExportedWalk, parts: Mapping[str, Sequence[Path]]) -> list[dict[str, Any]]:
    subject = walked.stored.subject
    made_by, record = "#gaitval", "#record"
    return [
        {
            "@id": "./",
            "@type": "Dataset",
            "name": f"Simulated walk of {subject.identifier}",
            "description": f"A simulated walker that walks as {subject.source} was recorded, "
            "validated against the record by gaitval.",
            "datePublished": datetime.datetime.now(datetime.UTC).date().isoformat(),
            "license": {"@id": LICENCE},
            "isBasedOn": {"@id": record},
            "citation": {"@id": record},
            "creator": {"@id": made_by},
            "hasPart": [{"@id": f"{name}/"} for name in parts],
        },
        {
            "@id": made_by,
            "@type": "SoftwareApplication",
            "name": "gaitval",
            "version": versions()["gaitval"],
            "license": {"@id": LICENCE},
        },
        {
            "@id": record,
            "@type": "Dataset",
            "name": f"Recorded gait: {subject.source}",
            "creditText": subject.citation,
            "license": subject.licence,
        },
        {"@id": LICENCE, "@type": "CreativeWork", "name": "Apache License 2.0"},
    ]


def _part(folder: Path, name: str, paths: Sequence[Path]) -> dict[str, Any]:
    return {
        "@id": f"{name}/",
        "@type": "Dataset",
        "name": _PARTS[name],
        "hasPart": [{"@id": path.relative_to(folder).as_posix()} for path in paths],
    }


def _file(folder: Path, path: Path) -> dict[str, Any]:
    return {
        "@id": path.relative_to(folder).as_posix(),
        "@type": "File",
        "name": path.name,
        "contentSize": str(path.stat().st_size),
        "encodingFormat": _KINDS.get(path.suffix, "application/octet-stream"),
        "sha256": file_hash(path),
    }
