"""Published data sets: found by their DOI, downloaded, verified and unpacked.

`registry.toml` beside this file says what is published and which hash it must have. pooch finds
the file that belongs to a DOI and verifies it; the download itself continues where it was cut off,
because the archives are hundreds of megabytes.
"""

import shutil
import stat
import tempfile
import time
import tomllib
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path, PurePosixPath
from typing import Any, Final, Literal
from urllib.parse import quote

import pooch
import requests
from pooch.downloaders import doi_to_repository

from gaitval.artefacts import read_json, write_json
from gaitval.errors import ArchiveError

Progress = Callable[[str, int, int], None]
"""Told of the name of a file, its bytes so far and its bytes in all."""

HashFrom = Literal["registry", "repository", "earlier download"]

LOCK: Final = "fetched.json"
"""Beside the files of a data set: the hash of each, and who stated it."""

WAITS: Final = (1.0, 3.0, 10.0)
"""s, before each new attempt that follows one in which nothing more arrived."""
TIMEOUT: Final = (10.0, 60.0)
"""s, for a connection and for the next bytes on it."""
CHUNK: Final = 1 << 16
"""Bytes between two calls of the progress callback; at most so many are lost by a cut."""
DISK_MARGIN: Final = 200_000_000
"""Bytes that a download leaves free on the disk."""
UNPACKED_LIMIT: Final = 20_000_000_000
"""Bytes; more inside one archive is refused. The largest known one holds about 2 GB."""
MEMBERS_LIMIT: Final = 100_000
"""Files; more inside one archive are refused. The largest known one holds about 10 000."""


@dataclass(frozen=True)
class ArchiveFile:
    """One published file.

    Attributes
    ----------
    name : as published, the name of a file without a folder.
    size : bytes; None where the registry does not know.
    md5 : hexadecimal; None where the registry does not know and the repository is asked.
    address : where it can be had when the DOI cannot be followed; only with `md5`.
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
        """Bytes of the files whose size the registry knows."""
        return sum(file.size or 0 for file in self.files)


@dataclass(frozen=True)
class Fetched:
    """One file as it is on this machine, verified.

    Attributes
    ----------
    path : the file as published.
    unpacked : folder with what a ZIP archive holds; None for another file.
    size : bytes.
    md5 : hexadecimal.
    hash_from : who stated the hash that was verified: the project's registry, the repository that
        was asked for it now, or the repository at an earlier download.
    downloaded : False where the file was already here.
    resumed_from : bytes that an interrupted download had left, 0 without one.
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
    """A data set and what of it is in `folder`.

    Attributes
    ----------
    missing : names of files that are not here, not of their size, or not unpacked. The hashes are
        verified by `fetch`, not here.
    """

    dataset: Dataset
    folder: Path
    missing: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """True when nothing is missing."""
        return not self.missing


def default_folder() -> Path:
    """The user's folder for downloaded data; each data set has a folder of its name in it."""
    return Path(pooch.os_cache("gaitval"))


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


def datasets(folder: Path | None = None) -> list[DatasetState]:
    """Every data set of the registry, and what of it is in `folder` (`default_folder()`)."""
    return [state_of(dataset, folder or default_folder()) for dataset in registry().values()]


def state_of(dataset: Dataset, folder: Path) -> DatasetState:
    """What of a data set is in the folder of its name in `folder`; reads no file whole."""
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
    name: str,
    folder: Path | None = None,
    *,
    on_progress: Progress | None = None,
    base_url: str | None = None,
) -> list[Fetched]:
    """Download, verify and unpack a data set of the registry; what is already here is kept.

    A file that was laid into the folder by hand is verified as a download would be.

    Parameters
    ----------
    name : of a data set, see `registry`.
    folder : folder of all data sets; this one goes into `folder`/`name`.
    on_progress : told of each file's progress.
    base_url : folder of a mirror to use instead of the DOI; the hashes stay those of the registry.

    Raises
    ------
    ArchiveError : unknown name; no network; DOI or file not found; the server fails; the disk is
        too full; the file has another hash or size than published, or was cut off; an archive
        holds unsafe members.
    """
    known = registry()
    if name not in known:
        raise ArchiveError(f"{name}: no such data set. There are: {', '.join(known)}.")
    return fetch_dataset(
        known[name], folder or default_folder(), on_progress=on_progress, base_url=base_url
    )


def fetch_dataset(
    dataset: Dataset,
    folder: Path,
    *,
    on_progress: Progress | None = None,
    base_url: str | None = None,
) -> list[Fetched]:
    """`fetch` for a data set that need not be in the registry."""
    home = Path(folder) / dataset.name
    try:
        home.mkdir(parents=True, exist_ok=True)
        source = _Mirror(base_url) if base_url else _Repository(dataset.doi)
        fetched = []
        for file in dataset.files:
            one = _fetch_file(file, source, home, on_progress)
            lock = _lock(home)
            said = "registry" if one.hash_from == "registry" else "repository"
            lock[file.name] = {"bytes": one.size, "md5": one.md5, "hash_from": said}
            write_json(home / LOCK, lock)
            fetched.append(one)
    except OSError as error:
        # a requests exception is an OSError as well, and is turned into ours where it arises
        raise ArchiveError(
            f"{home}: cannot be written ({error.strerror or error}). Name a folder that you may "
            "write to, on a disk with room."
        ) from None
    return fetched


# --- where a file comes from ---------------------------------------------------------------


class _Mirror:
    """A folder on a web server that holds the published files."""

    def __init__(self, base_url: str) -> None:
        self.base_url = base_url.rstrip("/")

    def address(self, file: ArchiveFile) -> str:
        return f"{self.base_url}/{quote(file.name)}"

    def stated_md5(self, file: ArchiveFile) -> str:
        raise ArchiveError(
            f"{file.name}: the registry has no hash of this file and a mirror cannot vouch for "
            "itself. Fetch it once by its DOI (without a mirror), then the mirror can be used."
        )


class _Repository:
    """The repository behind a DOI, asked once, when something of it is needed."""

    def __init__(self, doi: str) -> None:
        self.doi = doi
        self._files: dict[str, tuple[str, str]] | None = None

    def _listing(self) -> dict[str, tuple[str, str]]:
        """MD5 and address of every published file, as the repository states them."""
        if self._files is None:
            with _repository_errors(self.doi):
                repository = doi_to_repository(self.doi, timeout=TIMEOUT)
                listing = pooch.create(path=".", base_url="")
                repository.populate_registry(listing)
                self._files = {
                    name: (known.removeprefix("md5:"), repository.download_url(name))
                    for name, known in listing.registry.items()
                }
        return self._files

    def _entry(self, file: ArchiveFile) -> tuple[str, str]:
        listing = self._listing()
        if file.name not in listing:
            raise ArchiveError(
                f"{file.name}: not among the files of doi:{self.doi}, which are: "
                f"{', '.join(sorted(listing)[:8])}. Tell the maintainers of gaitval."
            )
        return listing[file.name]

    def address(self, file: ArchiveFile) -> str:
        try:
            stated, address = self._entry(file)
        except ArchiveError:
            if file.address is None:
                raise
            # the hash is known, so it does not matter by which way the bytes come
            return file.address
        if file.md5 is not None and stated.lower() != file.md5:
            raise ArchiveError(
                f"{file.name}: doi:{self.doi} now states MD5 {stated}, the registry of gaitval has "
                f"{file.md5}. The publication was changed; nothing was downloaded. Tell the "
                "maintainers of gaitval."
            )
        return address

    def stated_md5(self, file: ArchiveFile) -> str:
        return self._entry(file)[0].lower()


@contextmanager
def _repository_errors(doi: str) -> Iterator[None]:
    """Turn what may go wrong on the way from a DOI to a list of files into `ArchiveError`."""
    by_hand = (
        f"Or download the files in a browser from https://doi.org/{doi}, put them into the "
        "folder of the data set and run this again: those with a hash in gaitval's registry are "
        "verified there."
    )
    try:
        yield
    except requests.HTTPError as error:
        status = None if error.response is None else error.response.status_code
        if status == 404:
            raise ArchiveError(f"doi:{doi}: no such DOI (HTTP status 404).") from None
        raise ArchiveError(
            f"doi:{doi}: the repository answers with HTTP status {status}. Try again later. "
            + by_hand
        ) from None
    except (requests.ConnectionError, requests.Timeout) as error:
        raise ArchiveError(
            f"doi:{doi}: cannot be reached ({_cause(error)}). Check the network connection and the "
            "proxy settings. " + by_hand
        ) from None
    except (requests.RequestException, ValueError, LookupError) as error:
        raise ArchiveError(
            f"doi:{doi}: what the repository answers is not a list of files ({error}). "
            "Try again later. " + by_hand
        ) from None


def _cause(error: Exception) -> str:
    """The innermost reason of a network error, in short."""
    reason = getattr(error.args[0], "reason", error) if error.args else error
    return str(reason).rsplit(": ", 1)[-1] or type(error).__name__


# --- one file ------------------------------------------------------------------------------


def _fetch_file(
    file: ArchiveFile, source: _Mirror | _Repository, home: Path, on_progress: Progress | None
) -> Fetched:
    if PurePosixPath(file.name).name != file.name:
        raise ArchiveError(f"{file.name}: a published file must have a plain name.")
    path = home / file.name
    md5, hash_from = _known_hash(file, source, home)
    # the part carries the hash: one left by another version of the file is not continued
    part = home / f".{file.name}.{md5[:8]}.part"
    resumed_from = part.stat().st_size if part.exists() else 0
    downloaded = not (path.exists() and pooch.file_hash(path, alg="md5") == md5)
    if downloaded:
        address = source.address(file)
        _check_disk(home, (file.size or 0) - resumed_from)

        def download(url: str, output: str, _pooch: object) -> None:
            _download(url, part, file, on_progress)
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
                "way, a proxy may change files on the way."
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


def _known_hash(
    file: ArchiveFile, source: _Mirror | _Repository, home: Path
) -> tuple[str, HashFrom]:
    """The hash that a file must have, and who states it."""
    if file.md5 is not None:
        return file.md5, "registry"
    stored = _lock(home).get(file.name, {}).get("md5")
    if stored is not None:
        return stored, "earlier download"
    return source.stated_md5(file), "repository"


def _download(url: str, part: Path, file: ArchiveFile, on_progress: Progress | None) -> None:
    """Bring `part` to the whole file, continuing what it holds; try again while the net fails.

    An attempt counts as failed in vain when `part` is no longer than it ever was; so a connection
    that is cut again and again still ends with a whole file if the server continues files, and
    ends with an error if it does not.
    """
    best = part.stat().st_size if part.exists() else 0
    waits = iter(WAITS)
    while True:
        try:
            if _attempt(url, part, file, on_progress):
                return
            failure = "the connection ended early"
        except requests.RequestException as error:
            failure = _cause(error)
        reached = part.stat().st_size if part.exists() else 0
        if reached > best:
            best, waits = reached, iter(WAITS)
            continue
        wait = next(waits, None)
        if wait is None:
            of = "" if file.size is None else f" of {file.size}"
            raise ArchiveError(
                f"{url}: {failure}, after {len(WAITS) + 1} attempts; {reached}{of} bytes arrived "
                "and are kept. Check the network connection and run this again to continue."
            )
        time.sleep(wait)


def _attempt(url: str, part: Path, file: ArchiveFile, on_progress: Progress | None) -> bool:
    """One request for what `part` still lacks; True when the file is whole.

    A server that does not continue files answers with the whole file (status 200): then `part`
    starts anew. Compression on the way would make ranges and lengths meaningless, so it is
    declined.
    """
    have = part.stat().st_size if part.exists() else 0
    if file.size is not None and have == file.size:
        return True
    headers = {"Accept-Encoding": "identity"}
    if have:
        headers["Range"] = f"bytes={have}-"
    with requests.get(url, headers=headers, stream=True, timeout=TIMEOUT) as answer:
        _check_status(answer, file)
        if answer.status_code == requests.codes.requested_range_not_satisfiable:
            # only a part that is too long, or a changed file, has no such range
            part.unlink()
            return False
        begin, total = _range(answer, have)
        if file.size is not None and total is not None and total != file.size:
            raise ArchiveError(
                f"{url}: the server's file has {total} bytes, {file.name} as published has "
                f"{file.size}. Nothing was downloaded."
            )
        total = file.size if file.size is not None else total
        with part.open("r+b" if begin else "wb") as stream:
            stream.truncate(begin)
            stream.seek(begin)
            for chunk in answer.iter_content(CHUNK):
                stream.write(chunk)
                done = stream.tell()
                if total is not None and done > total:
                    break
                if on_progress is not None:
                    on_progress(file.name, done, total or done)
    have = part.stat().st_size
    if total is not None and have > total:
        part.unlink()
        raise ArchiveError(
            f"{url}: more than the {total} bytes of {file.name} arrived; the download was stopped "
            "and deleted. A proxy may send a page of its own."
        )
    return total is None or have == total


def _check_status(answer: requests.Response, file: ArchiveFile) -> None:
    """Statuses that another attempt will not mend are errors; others raise to be tried again."""
    status = answer.status_code
    if status in (200, 206, 416):
        return
    if status in (404, 410):
        raise ArchiveError(
            f"{answer.url}: no such file (HTTP status {status}). {file.name} may have moved; tell "
            "the maintainers of gaitval."
        )
    if status == 429 or status >= 500:
        raise requests.HTTPError(f"the server answers with HTTP status {status}", response=answer)
    # 202 with an empty body is how some repositories ask for a browser
    raise ArchiveError(
        f"{answer.url}: the server does not hand out the file (HTTP status {status}). Download "
        f"{file.name} in a browser, put it into the folder of the data set and run this again: it "
        "is verified there."
    )


def _range(answer: requests.Response, have: int) -> tuple[int, int | None]:
    """Byte at which the answer begins, and bytes of the whole file where the server tells them."""
    if answer.status_code != 206:
        length = answer.headers.get("Content-Length")
        return 0, int(length) if length and length.isdigit() else None
    stated = answer.headers.get("Content-Range", "")
    try:
        unit, span = stated.split(" ", 1)
        place, total = span.split("/", 1)
        begin = int(place.split("-", 1)[0])
        if unit != "bytes" or begin != have:
            raise ValueError
        return begin, None if total == "*" else int(total)
    except ValueError:
        raise ArchiveError(
            f"{answer.url}: asked to continue at byte {have}, the server answers with "
            f"Content-Range {stated!r}. Delete the .part file and run this again."
        ) from None


# --- disk and archives ---------------------------------------------------------------------


def _check_disk(folder: Path, needed: int) -> None:
    free = shutil.disk_usage(folder).free
    if free < needed + DISK_MARGIN:
        raise ArchiveError(
            f"{folder}: {free / 1e9:.2f} GB are free on this disk and "
            f"{(needed + DISK_MARGIN) / 1e9:.2f} GB are needed. Make room or name another folder."
        )


def _is_zip(file: ArchiveFile) -> bool:
    return file.name.lower().endswith(".zip")


def _unpacked(path: Path) -> Path:
    """Folder of what an archive holds."""
    return path.with_suffix("")


def unpack(archive: Path, folder: Path) -> None:
    """Unpack a ZIP archive into `folder`, whole or not at all; an old `folder` is replaced.

    Raises
    ------
    ArchiveError : not a ZIP archive, or a damaged one; a member lies outside the folder (absolute
        path or ".."), or is a link; more than `UNPACKED_LIMIT` bytes or `MEMBERS_LIMIT` members.
    """
    try:
        with zipfile.ZipFile(archive) as stored:
            members = stored.infolist()
            _check_members(archive, members)
            _check_disk(archive.parent, sum(member.file_size for member in members))
            with tempfile.TemporaryDirectory(
                dir=archive.parent, prefix=f".{folder.name}."
            ) as temporary:
                stored.extractall(Path(temporary) / "new")
                if folder.exists():
                    folder.replace(Path(temporary) / "old")
                (Path(temporary) / "new").replace(folder)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise ArchiveError(
            f"{archive}: not readable as a ZIP archive ({error}). Delete it and fetch it again."
        ) from None


def _check_members(archive: Path, members: list[zipfile.ZipInfo]) -> None:
    size = sum(member.file_size for member in members)
    if len(members) > MEMBERS_LIMIT or size > UNPACKED_LIMIT:
        raise ArchiveError(
            f"{archive}: holds {len(members)} members of {size} bytes; at most {MEMBERS_LIMIT} "
            f"members of {UNPACKED_LIMIT} bytes are unpacked. Nothing was unpacked."
        )
    for member in members:
        # zipfile itself would turn an unsafe name into another one without a word
        name = member.filename.replace("\\", "/")
        path = PurePosixPath(name)
        outside = path.is_absolute() or ".." in path.parts or ":" in name.split("/", 1)[0]
        if outside or stat.S_ISLNK(member.external_attr >> 16):
            raise ArchiveError(
                f"{archive}: member {member.filename!r} would be written outside its folder or is "
                "a link. This is not the published archive; nothing was unpacked."
            )


def _lock(home: Path) -> dict[str, dict[str, Any]]:
    """Contents of the lock file; empty without one."""
    path = home / LOCK
    if not path.exists():
        return {}
    stored = read_json(path)
    if not isinstance(stored, dict) or not all(isinstance(one, dict) for one in stored.values()):
        raise ArchiveError(f"{path}: not a record of downloads. Delete it and run this again.")
    return stored
