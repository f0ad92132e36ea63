"""The data command, against a web server on this machine.

What is promised: what is used is what was published, to the byte; a download that was cut off goes
on where it stopped; nothing half done is ever taken for the whole.
"""

import errno
import hashlib
import io
import json
import shutil
import stat
import threading
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace

import pytest
import requests
from pooch.downloaders import FigshareRepository

from gaitval.datasets import archive, download, unpacking
from gaitval.datasets import repository as repository_module
from gaitval.datasets.archive import datasets, fetch, fetch_dataset
from gaitval.datasets.download import CHUNK
from gaitval.datasets.registry import ArchiveFile, Dataset, registry
from gaitval.errors import ArchiveError, GaitvalError


def zip_of(members: dict[str, bytes]) -> bytes:
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w") as stored:
        for name, content in members.items():
            stored.writestr(name, content)
    return memory.getvalue()


# Stored, not deflated, and larger than one chunk of the download: so that a cut falls inside.
TRIAL = bytes(range(256)) * 12_000
ARCHIVE = zip_of({"trials/WBDS01walkT01mkr.txt": TRIAL, "readme.txt": b"synthetic\n"})
TABLE = b"Subject,Mass\n1,74.3\n"


def md5(content: bytes) -> str:
    return hashlib.md5(content).hexdigest()


@dataclass
class Server:
    """What the web server hands out, and what it was asked for."""

    files: dict[str, bytes]
    address: str = ""
    continues: bool = True
    """Answers Range requests with 206."""
    cuts: list[int] = field(default_factory=list)
    """Bytes after which the next answers are cut off, one an answer."""
    statuses: list[int] = field(default_factory=list)
    """Statuses of the next answers, before any file is handed out."""
    ranges: list[str | None] = field(default_factory=list)
    wrong_range: bool = False


@pytest.fixture
def server() -> Iterator[Server]:
    state = Server({"data.zip": ARCHIVE, "table.csv": TABLE})

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            self.close_connection = True
            state.ranges.append(self.headers["Range"])
            content = state.files.get(self.path.lstrip("/"))
            status = 404 if content is None else 200
            if state.statuses:
                content, status = b"", state.statuses.pop(0)
            content = content or b""
            begin, total = 0, len(content)
            if status == 200 and self.headers["Range"] and state.continues:
                begin = int(self.headers["Range"].removeprefix("bytes=").rstrip("-"))
                status = 206 if begin < total else 416
            self.send_response(status)
            if status == 206:
                message = begin + 1 if state.wrong_range else begin
                self.send_header("Content-Range", f"bytes {message}-{total - 1}/{total}")
            body = b"" if status == 416 else content[begin:]
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            # the client hangs up on an answer that it refuses
            with suppress(ConnectionError):
                self.wfile.write(body[: state.cuts.pop(0)] if body and state.cuts else body)

        def log_message(self, *_: object) -> None:
            pass

    web = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=web.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    state.address = f"http://127.0.0.1:{web.server_address[1]}"
    yield state
    web.shutdown()
    web.server_close()
    thread.join()


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(download, "WAITS", (0.0, 0.0))
    # a proxy of the machine must not stand between the test and its server
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")


def dataset(*files: ArchiveFile) -> Dataset:
    return Dataset("walks", "Rollouts", "10.0000/walks.v1", "Nobody (2026)", "CC0", files)


PUBLISHED = ArchiveFile("data.zip", len(ARCHIVE), md5(ARCHIVE))


def files_in(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_whole_file_is_verified_and_unpacked(server: Server, tmp_path: Path) -> None:
    messages: list[tuple[str, int, int]] = []
    (one,) = fetch_dataset(
        dataset(PUBLISHED),
        tmp_path,
        base_url=server.address,
        on_progress=lambda *step: messages.append(step),
    )
    assert one.path.read_bytes() == ARCHIVE
    assert one.unpacked == tmp_path / "walks/data"
    assert (one.unpacked / "trials/WBDS01walkT01mkr.txt").read_bytes() == TRIAL
    assert (one.downloaded, one.hash_from, one.resumed_from) == (True, "registry", 0)
    done = [step[1] for step in messages]
    assert len(done) > 1
    assert done == sorted(done)
    assert messages[-1] == ("data.zip", len(ARCHIVE), len(ARCHIVE))
    assert files_in(tmp_path) == {
        "walks/data.zip",
        "walks/fetched.json",
        "walks/data/trials/WBDS01walkT01mkr.txt",
        "walks/data/readme.txt",
    }


def test_second_fetch_asks_the_server_nothing(server: Server, tmp_path: Path) -> None:
    fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    server.ranges.clear()
    (one,) = fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert not one.downloaded
    assert server.ranges == []


def test_file_laid_in_by_hand_is_verified_and_kept(server: Server, tmp_path: Path) -> None:
    home = tmp_path / "walks"
    home.mkdir()
    (home / "data.zip").write_bytes(ARCHIVE)
    (one,) = fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert not one.downloaded
    assert server.ranges == []
    assert (home / "data/readme.txt").exists()


def test_damaged_local_file_is_fetched_again(server: Server, tmp_path: Path) -> None:
    fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    path = tmp_path / "walks/data.zip"
    path.write_bytes(ARCHIVE[:-1] + b"?")
    (one,) = fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert one.downloaded
    assert path.read_bytes() == ARCHIVE


def test_connection_cut_in_the_middle_is_continued(server: Server, tmp_path: Path) -> None:
    server.cuts = [24 * CHUNK, 15 * CHUNK]
    (one,) = fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert one.path.read_bytes() == ARCHIVE
    assert server.ranges[0] is None
    # each goes on at the bytes that had arrived, not from the start
    assert server.ranges[1:] == [f"bytes={24 * CHUNK}-", f"bytes={39 * CHUNK}-"]


def test_next_run_continues_an_interrupted_one(server: Server, tmp_path: Path) -> None:
    server.cuts = [24 * CHUNK, 0, 0, 0]
    with pytest.raises(ArchiveError, match=rf"{24 * CHUNK} of \d+ bytes arrived and are kept"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert not (tmp_path / "walks/data.zip").exists()
    server.ranges.clear()
    (one,) = fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert one.resumed_from == 24 * CHUNK
    assert server.ranges == [f"bytes={24 * CHUNK}-"]
    assert one.path.read_bytes() == ARCHIVE


def test_part_that_was_whole_needs_no_server(server: Server, tmp_path: Path) -> None:
    home = tmp_path / "walks"
    home.mkdir()
    (home / f".data.zip.{md5(ARCHIVE)[:8]}.part").write_bytes(ARCHIVE)
    (one,) = fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert server.ranges == []
    assert one.path.read_bytes() == ARCHIVE


def test_server_that_does_not_continue_starts_anew(server: Server, tmp_path: Path) -> None:
    server.continues = False
    server.cuts = [24 * CHUNK]
    (one,) = fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert server.ranges == [None, f"bytes={24 * CHUNK}-"]
    assert one.path.read_bytes() == ARCHIVE


def test_always_cut_without_continuing_ends(server: Server, tmp_path: Path) -> None:
    server.continues = False
    server.cuts = [24 * CHUNK] * 20
    with pytest.raises(ArchiveError, match="after 3 attempts"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert len(server.ranges) == 4


def test_truncated_on_the_server_is_refused(server: Server, tmp_path: Path) -> None:
    server.files["data.zip"] = ARCHIVE[:-1000]
    with pytest.raises(ArchiveError, match=rf"{len(ARCHIVE) - 1000} bytes.*{len(ARCHIVE)}"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert files_in(tmp_path) == set()


def test_truncated_without_a_known_size_fails_its_hash(server: Server, tmp_path: Path) -> None:
    server.files["data.zip"] = ARCHIVE[:-1000]
    file = ArchiveFile("data.zip", None, md5(ARCHIVE))
    with pytest.raises(ArchiveError, match="corrupted"):
        fetch_dataset(dataset(file), tmp_path, base_url=server.address)
    assert files_in(tmp_path) == set()


def test_corrupted_download_is_told_and_deleted(server: Server, tmp_path: Path) -> None:
    damaged = ARCHIVE[:100] + b"?" + ARCHIVE[101:]
    server.files["data.zip"] = damaged
    with pytest.raises(ArchiveError) as caught:
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert md5(ARCHIVE) in str(caught.value)
    assert md5(damaged) in str(caught.value)
    assert files_in(tmp_path) == set()


def test_part_of_another_file_is_not_trusted(server: Server, tmp_path: Path) -> None:
    home = tmp_path / "walks"
    home.mkdir()
    (home / f".data.zip.{md5(ARCHIVE)[:8]}.part").write_bytes(b"?" * 1000)
    with pytest.raises(ArchiveError, match="corrupted"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert (home / "data.zip").read_bytes() == ARCHIVE


def test_part_longer_than_the_file_starts_anew(server: Server, tmp_path: Path) -> None:
    home = tmp_path / "walks"
    home.mkdir()
    (home / f".data.zip.{md5(ARCHIVE)[:8]}.part").write_bytes(ARCHIVE + b"more")
    fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert (home / "data.zip").read_bytes() == ARCHIVE


def test_continued_at_another_byte_is_refused(server: Server, tmp_path: Path) -> None:
    server.cuts = [24 * CHUNK]
    server.wrong_range = True
    with pytest.raises(ArchiveError, match=f"Content-Range 'bytes {24 * CHUNK + 1}-"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)


@pytest.mark.parametrize(
    ("statuses", "message"),
    [
        ([404], "no such file"),
        ([202], "in a browser"),
        ([403], "in a browser"),
        ([500] * 3, "HTTP status 500, after 3 attempts"),
    ],
)
def test_statuses(server: Server, tmp_path: Path, statuses: list[int], message: str) -> None:
    server.statuses = statuses
    with pytest.raises(ArchiveError, match=message):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert server.statuses == []
    assert files_in(tmp_path) == set()


def test_server_that_recovers_is_waited_for(server: Server, tmp_path: Path) -> None:
    server.statuses = [503, 429]
    (one,) = fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert one.path.read_bytes() == ARCHIVE


def test_no_network(tmp_path: Path) -> None:
    # nothing listens on port 1
    with pytest.raises(ArchiveError, match=r"refused.*Check the network connection"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url="http://127.0.0.1:1")


# --- by DOI ------------------------------------------------------------------------------


def figshare(server: Server, monkeypatch: pytest.MonkeyPatch, stated: dict[str, str]) -> None:
    """The DOI leads to pooch's own figshare reader, its answer from the network replaced."""

    def repository(doi: str, **_: object) -> FigshareRepository:
        found = FigshareRepository(doi, "https://figshare.com/walks")
        found._api_response = [
            {"name": name, "computed_md5": known, "download_url": f"{server.address}/{name}"}
            for name, known in stated.items()
        ]
        return found

    monkeypatch.setattr(repository_module, "doi_to_repository", repository)


UNKNOWN = ArchiveFile("table.csv")


def test_hash_that_the_repository_states_is_kept_for_later(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figshare(server, monkeypatch, {"table.csv": md5(TABLE), "data.zip": md5(ARCHIVE)})
    both = fetch_dataset(dataset(UNKNOWN, PUBLISHED), tmp_path)
    assert [one.hash_from for one in both] == ["repository", "registry"]
    lock = json.loads((tmp_path / "walks/fetched.json").read_text())
    assert lock["table.csv"] == {
        "bytes": len(TABLE),
        "md5": md5(TABLE),
        "hash_from": "repository",
    }
    # the repository changes its mind: the earlier hash stands, and its file is refused
    server.files["table.csv"] = b"Subject,Mass\n1,163.8\n"
    figshare(server, monkeypatch, {"table.csv": md5(server.files["table.csv"])})
    (tmp_path / "walks/table.csv").unlink()
    with pytest.raises(ArchiveError, match=md5(TABLE)):
        fetch_dataset(dataset(UNKNOWN), tmp_path)
    server.files["table.csv"] = TABLE
    (one,) = fetch_dataset(dataset(UNKNOWN), tmp_path)
    assert one.hash_from == "earlier download"


def test_repository_that_states_another_hash_than_the_registry(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figshare(server, monkeypatch, {"data.zip": "0" * 32})
    with pytest.raises(ArchiveError, match=rf"0{{32}}.*{md5(ARCHIVE)}.*nothing was downloaded"):
        fetch_dataset(dataset(PUBLISHED), tmp_path)
    assert server.ranges == []


def test_mirror_cannot_vouch_for_itself(server: Server, tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match="has no hash"):
        fetch_dataset(dataset(UNKNOWN), tmp_path, base_url=server.address)


def answer(status: int) -> requests.Response:
    response = requests.Response()
    response.status_code = status
    return response


@pytest.mark.parametrize(
    ("failure", "message"),
    [
        (requests.ConnectionError("no route"), r"cannot be reached \(no route\)"),
        (requests.HTTPError(response=answer(404)), "no such DOI"),
        (requests.HTTPError(response=answer(403)), "HTTP status 403.*in a browser"),
        (IndexError("list index out of range"), "not a list of files"),
        (ValueError("Invalid data repository"), "not a list of files"),
    ],
)
def test_doi_that_leads_nowhere(
    server: Server,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    failure: Exception,
    message: str,
) -> None:
    def repository(doi: str, **_: object) -> None:
        raise failure

    monkeypatch.setattr(repository_module, "doi_to_repository", repository)
    with pytest.raises(ArchiveError, match=message):
        fetch_dataset(dataset(PUBLISHED), tmp_path)
    # the hash is known: with another address the DOI is not needed
    elsewhere = ArchiveFile("data.zip", len(ARCHIVE), md5(ARCHIVE), f"{server.address}/data.zip")
    (one,) = fetch_dataset(dataset(elsewhere), tmp_path)
    assert one.path.read_bytes() == ARCHIVE


def test_file_that_the_doi_does_not_have(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figshare(server, monkeypatch, {"other.zip": md5(ARCHIVE)})
    with pytest.raises(ArchiveError, match=r"not among the files.*other\.zip"):
        fetch_dataset(dataset(PUBLISHED), tmp_path)


# --- archives and disk -------------------------------------------------------------------


def link() -> bytes:
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w") as stored:
        member = zipfile.ZipInfo("trials")
        member.external_attr = (stat.S_IFLNK | 0o777) << 16
        stored.writestr(member, "/etc")
    return memory.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        zip_of({"../outside.txt": b"x"}),
        zip_of({"trials/../../outside.txt": b"x"}),
        zip_of({"..\\outside.txt": b"x"}),
        zip_of({"/outside.txt": b"x"}),
        zip_of({"C:\\outside.txt": b"x"}),
        link(),
    ],
    ids=["parent", "nested", "backslash", "absolute", "drive", "link"],
)
def test_unsafe_archive_is_refused(server: Server, tmp_path: Path, content: bytes) -> None:
    server.files["data.zip"] = content
    file = ArchiveFile("data.zip", len(content), md5(content))
    folder = tmp_path / "a/b"
    with pytest.raises(ArchiveError, match="nothing was unpacked"):
        fetch_dataset(dataset(file), folder, base_url=server.address)
    assert files_in(tmp_path) == {"a/b/walks/data.zip"}


def test_archive_that_is_too_large_unpacked(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unpacking, "UNPACKED_LIMIT", len(TRIAL))
    with pytest.raises(ArchiveError, match="Nothing was unpacked"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert not (tmp_path / "walks/data").exists()


def test_damaged_archive_leaves_what_was_unpacked_before(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.zip", tmp_path / "bad.zip"
    good.write_bytes(ARCHIVE)
    unpacking.unpack(good, tmp_path / "data")
    middle = len(TRIAL) // 2
    bad.write_bytes(ARCHIVE[:middle] + b"?" + ARCHIVE[middle + 1 :])
    with pytest.raises(ArchiveError, match="CRC"):
        unpacking.unpack(bad, tmp_path / "data")
    bad.write_bytes(b"<html>not found</html>")
    with pytest.raises(ArchiveError, match="not a zip file"):
        unpacking.unpack(bad, tmp_path / "data")
    assert files_in(tmp_path / "data") == {"trials/WBDS01walkT01mkr.txt", "readme.txt"}
    assert {path.name for path in tmp_path.iterdir()} == {"good.zip", "bad.zip", "data"}


def test_full_disk_is_told_before_the_download(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = SimpleNamespace(free=10**6)
    monkeypatch.setattr(unpacking.shutil, "disk_usage", lambda _: usage)
    with pytest.raises(ArchiveError, match=r"0\.00 GB are free.*0\.20 GB are needed"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    assert server.ranges == []


def test_folder_that_cannot_be_written(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_room(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(archive, "download_part", no_room)
    with pytest.raises(ArchiveError, match="No space left"):
        fetch_dataset(dataset(PUBLISHED), tmp_path, base_url=server.address)
    (tmp_path / "file").write_text("")
    with pytest.raises(ArchiveError, match="cannot be written"):
        fetch_dataset(dataset(PUBLISHED), tmp_path / "file", base_url=server.address)


# --- the registry ------------------------------------------------------------------------


def test_state_follows_what_is_there(server: Server, tmp_path: Path) -> None:
    published = dataset(PUBLISHED)

    def state() -> archive.DatasetState:
        return archive.state_of(published, tmp_path)

    assert state().missing == ("data.zip",)
    fetch_dataset(published, tmp_path, base_url=server.address)
    assert state().complete
    assert state().folder == tmp_path / "walks"
    shutil.rmtree(tmp_path / "walks/data")
    assert state().missing == ("data.zip",)
    fetch_dataset(published, tmp_path, base_url=server.address)
    assert state().complete
    with (tmp_path / "walks/data.zip").open("r+b") as stream:
        stream.truncate(10)
    assert not state().complete


def test_wbds_is_the_version_of_the_paper(tmp_path: Path) -> None:
    (state,) = datasets(tmp_path)
    assert state.dataset.name == "wbds"
    # the version is part of the DOI: without it the archives of another release would come
    assert state.dataset.doi == "10.6084/m9.figshare.5722711.v5"
    assert "6:e4640" in state.dataset.citation
    assert state.dataset.licence == "CC BY 4.0"
    assert state.missing == tuple(file.name for file in state.dataset.files)
    assert state.folder == tmp_path / "wbds"


def test_registry_has_whole_entries() -> None:
    for entry in registry().values():
        for file in entry.files:
            assert file.md5 is None or len(bytes.fromhex(file.md5)) == 16
            # an address that does not come from the DOI needs a hash of our own
            assert file.address is None or (file.md5 is not None and file.size is not None)


def test_unknown_name_lists_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(GaitvalError, match=r"wbs: no such data set. Available are: wbds"):
        fetch("wbs", tmp_path)
