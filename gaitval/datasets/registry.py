"""Published data sets: names, DOIs, files and hashes, from `registry.toml` beside this file."""

import tomllib
from dataclasses import dataclass
from importlib import resources


@dataclass(frozen=True)
class ArchiveFile:
    """One published file.

    Attributes
    ----------
    name : as published, without a folder.
    size : bytes; None if the registry does not state it.
    md5 : hexadecimal; None if the registry does not state it and the repository is asked.
    address : where to download it if the DOI cannot be followed; only with `md5`.
    """

    name: str
    size: int | None = None
    md5: str | None = None
    address: str | None = None


@dataclass(frozen=True)
class Dataset:
    """One version of a published data set; `doi` names that version."""

    name: str
    title: str
    doi: str
    citation: str
    licence: str
    files: tuple[ArchiveFile, ...]

    @property
    def size(self) -> int:
        """Total bytes of the files whose size the registry states."""
        return sum(file.size or 0 for file in self.files)


def registry() -> dict[str, Dataset]:
    """Data sets that can be fetched, by name."""
    text = resources.files("gaitval.datasets").joinpath("registry.toml").read_text("utf-8")
    return {
        name: Dataset(
            name=name,
            title=entry["title"],
            doi=entry["doi"],
            citation=entry["citation"],
            licence=entry["licence"],
            files=tuple(
                ArchiveFile(
                    name=file["name"],
                    size=file.get("bytes"),
                    md5=file.get("md5"),
                    address=file.get("address"),
                )
                for file in entry["files"]
            ),
        )
        for name, entry in tomllib.loads(text).items()
    }
