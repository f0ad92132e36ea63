"""Published data sets: found by their DOI, downloaded, verified and unpacked.

`registry.toml` beside this file says what is published and which hash it must have. pooch finds the
file that belongs to a DOI and verifies it; an interrupted download continues where it stopped,
because the archives are hundreds of megabytes.
"""

from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Final, Literal

import pooch

from gaitval.artefacts import read_json, write_json
from gaitval.datasets.download import DownloadProgress, download_part
from gaitval.datasets.registry import ArchiveFile, Dataset, registry
from gaitval.datasets.repository import Mirror, Repository
from gaitval.datasets.unpacking import check_disk, unpack
from gaitval.errors import ArchiveError

HashFrom = Literal["registry", "repository", "earlier download"]

LOCK: Final = "fetched.json"
"""Beside the files of a data set: the hash of each, and who stated it."""


@dataclass(frozen=True)
class Fetched:
    """One file as it is on this machine, verified.

    Attributes
    ----------
    path : the file as published.
    unpacked : folder with the contents of a ZIP archive; None for another file.
    size : bytes.
    md5 : hexadecimal.
    hash_from : who stated the hash that was verified: the project's registry, the repository now,
        or the repository at an earlier download.
    downloaded : False where the file was already here.
    resumed_from : bytes left by an interrupted download; 0 without one.
    """

    path: Path
    unpacked: Path | None
    size: int
    md5: str
    hash_from: HashFrom
    downloaded: bool
    resumed_from: int


@dataclass(frozen=True)
class DatasetState:
    """A data set, and which of its files are in `folder`: `missing` are those that are not here,
    not of their size, or not unpacked. The hashes are verified by `fetch`, not here.
    """

    dataset: Dataset
    folder: Path
    missing: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """True when nothing is missing."""
        return not self.missing


def default_folder() -> Path:
    """The user's folder for downloaded data; in it each data set has a folder of its name."""
    return Path(pooch.os_cache("gaitval"))


def datasets(folder: Path | None = None) -> list[DatasetState]:
    """Every data set of the registry, and what `folder` (`default_folder()`) has of it."""
    return [state_of(dataset, folder or default_folder()) for dataset in registry().values()]


def state_of(dataset: Dataset, folder: Path) -> DatasetState:
    """Which files of `dataset` are in its folder in `folder`; reads no file completely."""
    home = Path(folder) / dataset.name
    known = _lock(home)
    missing = []
    for file in dataset.files:
        path = home / file.name
        size = known.get(file.name, {}).get("bytes")
        here = path.is_file() and size is not None and path.stat().st_size == size
        if not here or (_is_zip(file) and not _unpacked(path).is_dir()):
            missing.append(file.name)
    return DatasetState(dataset, home, tuple(missing))


def fetch(
    name: str, folder: Path | None = None, *, on_progress: DownloadProgress | None = None
) -> list[Fetched]:
    """Download, verify and unpack the data set `name` of the registry into `folder`/`name`, where
    `folder` is that of all data sets; what is already here is kept. `on_progress` is called with
    each file's progress. A file that was put into the folder by hand is verified like a download.

    Raises ArchiveError: unknown name; no network; DOI or file not found; the server fails; the disk
    is too full; the file has another hash or size than published, or was cut off; an archive
    contains unsafe members.
    """
    known = registry()
    if name not in known:
        raise ArchiveError(f"{name}: no such data set. Available are: {', '.join(known)}.")
    return fetch_dataset(known[name], folder or default_folder(), on_progress=on_progress)


def fetch_dataset(
    dataset: Dataset,
    folder: Path,
    *,
    on_progress: DownloadProgress | None = None,
    base_url: str | None = None,
) -> list[Fetched]:
    """`fetch` for a `dataset` that need not be in the registry, into a folder of its name in
    `folder`.

    `on_progress` is called while bytes arrive; `base_url` is a mirror's, instead of the DOI's
    repository. Raises ArchiveError if a file cannot be had, is not as published, or cannot be
    written.
    """
    home = Path(folder) / dataset.name
    try:
        home.mkdir(parents=True, exist_ok=True)
        source = Mirror(base_url) if base_url else Repository(dataset.doi)
        fetched = []
        for file in dataset.files:
            one = _fetch_file(file, source, home, on_progress)
            lock = _lock(home)
            hash_source = "registry" if one.hash_from == "registry" else "repository"
            lock[file.name] = {"bytes": one.size, "md5": one.md5, "hash_from": hash_source}
            write_json(home / LOCK, lock)
            fetched.append(one)
    except OSError as error:
        # a requests exception is also an OSError, and is turned into ours where it arises
        raise ArchiveError(
            f"{home}: cannot be written ({error.strerror or error}). Name a folder that you may "
            "write to, on a disk with room."
        ) from None
    return fetched


def _fetch_file(
    file: ArchiveFile, source: Mirror | Repository, home: Path, on_progress: DownloadProgress | None
) -> Fetched:
    if PurePosixPath(file.name).name != file.name:
        raise ArchiveError(f"{file.name}: a published file must have a plain name.")
    path = home / file.name
    md5, hash_from = _known_hash(file, source, home)
    # the name of the part contains the hash: a part of another version is not continued
    part = home / f".{file.name}.{md5[:8]}.part"
    resumed_from = part.stat().st_size if part.exists() else 0
    downloaded = not (path.exists() and pooch.file_hash(path, alg="md5") == md5)
    if downloaded:
        address = source.address(file)
        check_disk(home, (file.size or 0) - resumed_from)

        def download(url: str, output: str, _pooch: object) -> None:
            download_part(url, part, file, on_progress)
            part.replace(output)

        pooch.get_logger().setLevel("WARNING")
        store = pooch.create(
            path=home, base_url="", registry={file.name: f"md5:{md5}"}, urls={file.name: address}
        )
        try:
            store.fetch(file.name, downloader=download)
        except ValueError as error:
            raise ArchiveError(
                f"{path}: the download is corrupted. {error} Run this again; if it fails the same "
                "way, a proxy may be changing files."
            ) from None
    unpacked = _unpacked(path) if _is_zip(file) else None
    if unpacked is not None and (downloaded or not unpacked.is_dir()):
        unpack(path, unpacked)
    return Fetched(
        path=path,
        unpacked=unpacked,
        size=path.stat().st_size,
        md5=md5,
        hash_from=hash_from,
        downloaded=downloaded,
        resumed_from=resumed_from if downloaded else 0,
    )


def _known_hash(file: ArchiveFile, source: Mirror | Repository, home: Path) -> tuple[str, HashFrom]:
    """The hash that a file must have, and who states it."""
    if file.md5 is not None:
        return file.md5, "registry"
    stored = _lock(home).get(file.name, {}).get("md5")
    if stored is not None:
        return stored, "earlier download"
    return source.stated_md5(file), "repository"


def _is_zip(file: ArchiveFile) -> bool:
    return file.name.lower().endswith(".zip")


def _unpacked(path: Path) -> Path:
    """Folder with the contents of an archive."""
    return path.with_suffix("")


def _lock(home: Path) -> dict[str, dict[str, Any]]:
    """Contents of the lock file; empty without one."""
    path = home / LOCK
    if not path.exists():
        return {}
    stored = read_json(path)
    if not isinstance(stored, dict) or not all(isinstance(one, dict) for one in stored.values()):
        raise ArchiveError(f"{path}: not a record of downloads. Delete it and run this again.")
    return stored
