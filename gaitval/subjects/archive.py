"""Published data sets: found by their DOI, downloaded, verified and unpacked by pooch.

`registry.toml` beside this file says what is published and which hash it must have.
"""

import shutil
import tempfile
import tomllib
import zipfile
from dataclasses import dataclass
from importlib import resources
from pathlib import Path, PurePosixPath
from typing import Final

import pooch
import requests

from gaitval.errors import ArchiveError

ATTEMPTS_MORE: Final = 3
"""After a download that failed, or whose hash is another one."""
TIMEOUT: Final = 60.0
"""s, for a connection and for the next bytes on it."""


@dataclass(frozen=True)
class Dataset:
    """One version of a published data set; `doi` names that version.

    `hashes` has the MD5 of each file, hexadecimal; None for one whose hash the repository is asked
    for. `size` is of all files, in bytes.
    """

    name: str
    title: str
    doi: str
    citation: str
    licence: str
    size: int
    hashes: dict[str, str | None]


def registry() -> dict[str, Dataset]:
    """Data sets that can be fetched, by name."""
    text = resources.files("gaitval.subjects").joinpath("registry.toml").read_text("utf-8")
    return {
        name: Dataset(
            name=name,
            size=sum(file.get("bytes", 0) for file in files),
            hashes={file["name"]: file.get("md5") for file in files},
            **about,
        )
        for name, about in tomllib.loads(text).items()
        for files in [about.pop("files")]
    }


def default_folder() -> Path:
    """The user's folder for downloaded data; in it each data set has a folder of its name."""
    return Path(pooch.os_cache("gaitval"))


def missing(dataset: Dataset, folder: Path) -> list[str]:
    """Files of `dataset` that are not in its folder in `folder`, or not unpacked."""
    home = Path(folder) / dataset.name
    return [
        name
        for name in dataset.hashes
        if not ((home / name).is_file() and _contents(home / name).exists())
    ]


def fetch(name: str, folder: Path | None = None) -> list[Path]:
    """Download, verify and unpack the data set `name` of the registry into `folder`/`name`, where
    `folder` is that of all data sets; what is already here is kept. A file that was put
    into the folder by hand is verified like a download.

    Returns the files. Raises ArchiveError: unknown name; the DOI or a file cannot be reached; a
    file has another hash than published; an archive has members outside its folder; the folder
    cannot be written.
    """
    known = registry()
    if name not in known:
        raise ArchiveError(f"{name}: no such data set. Available are: {', '.join(known)}.")
    return fetch_dataset(known[name], folder or default_folder())


def fetch_dataset(dataset: Dataset, folder: Path) -> list[Path]:
    """`fetch` for a `dataset` that need not be in the registry."""
    home = Path(folder) / dataset.name
    by_hand = (
        f"Check the network connection and run this again; or download the files in a browser from "
        f"https://doi.org/{dataset.doi} into {home} and run this again, which verifies them."
    )
    pooch.get_logger().setLevel("WARNING")
    try:
        home.mkdir(parents=True, exist_ok=True)
        return [_fetch_file(dataset, name, home) for name in dataset.hashes]
    except requests.RequestException as error:
        raise ArchiveError(f"doi:{dataset.doi}: cannot be had ({error}). {by_hand}") from None
    except OSError as error:
        raise ArchiveError(
            f"{home}: cannot be written ({error.strerror or error}). Name a folder that you may "
            "write to, on a disk with room."
        ) from None
    except (ValueError, LookupError, zipfile.BadZipFile) as error:  # most are of pooch
        raise ArchiveError(f"doi:{dataset.doi}: not as published: {error} {by_hand}") from None


def _fetch_file(dataset: Dataset, name: str, home: Path) -> Path:
    store = pooch.create(home, f"doi:{dataset.doi}/", retry_if_failed=ATTEMPTS_MORE)
    if (md5 := dataset.hashes[name]) is None:
        store.load_registry_from_doi()
    else:
        store.registry[name] = f"md5:{md5}"
    download = pooch.DOIDownloader(timeout=TIMEOUT)
    unpack = _unpack if _contents(home / name) != home / name else None
    store.fetch(name, processor=unpack, downloader=download)
    return home / name


def _contents(path: Path) -> Path:
    """The folder into which an archive is unpacked; another file itself."""
    return path.with_suffix("") if path.suffix == ".zip" else path


def _unpack(archive: str, action: str, _: pooch.Pooch) -> None:
    """Unpack a ZIP archive beside it, whole or not at all, unless that was done before."""
    folder = _contents(Path(archive))
    if action == "fetch" and folder.is_dir():
        return
    with (
        zipfile.ZipFile(archive) as stored,
        tempfile.TemporaryDirectory(dir=folder.parent) as temporary,
    ):
        for name in stored.namelist():  # zipfile itself would write it in another place
            if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts:
                raise ArchiveError(
                    f"{archive}: member {name!r} would be written outside its folder. Nothing was "
                    "unpacked."
                )
        stored.extractall(Path(temporary) / "new")
        shutil.rmtree(folder, ignore_errors=True)
        Path(temporary, "new").replace(folder)
