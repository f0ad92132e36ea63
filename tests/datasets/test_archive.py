"""The data command, against a web server on this machine.

What is promised: what is used is what was published, to the byte; nothing half done is ever taken
for the whole.
"""

import hashlib
import io
import shutil
import threading
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
import requests
from pooch.downloaders import FigshareRepository
from typer.testing import CliRunner

from gaitval import cli
from gaitval.errors import ArchiveError, GaitvalError
from gaitval.subjects import archive
from gaitval.subjects.archive import Dataset, fetch, fetch_dataset, missing


def zip_of(members: dict[str, bytes]) -> bytes:
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w") as stored:
        for name, content in members.items():
            stored.writestr(name, content)
    return memory.getvalue()


TRIAL = bytes(range(256)) * 12_000
ARCHIVE = zip_of({"trials/WBDS01walkT01mkr.txt": TRIAL, "readme.txt": b"synthetic\n"})
TABLE = b"Subject,Mass\n1,74.3\n"


def md5(content: bytes) -> str:
    return hashlib.md5(content).hexdigest()


@dataclass
class Server:
    """What the web server hands out, and what it was asked for."""

    files: dict[str, bytes]
    statuses: list[int] = field(default_factory=list)
    """Statuses of the next answers, before any file is handed out."""
    cuts: list[int] = field(default_factory=list)
    """Bytes after which the next answers are cut off, one an answer."""
    asked: list[str] = field(default_factory=list)


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    """A repository on this machine, where pooch finds it by any DOI."""
    state = Server({"data.zip": ARCHIVE, "table.csv": TABLE})

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            state.asked.append(self.path.lstrip("/"))
            content = state.files.get(self.path.lstrip("/"), b"")
            status = state.statuses.pop(0) if state.statuses else 200
            self.send_response(status)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            with suppress(ConnectionError):
                self.wfile.write(content[: state.cuts.pop(0)] if state.cuts else content)

        def log_message(self, *_: object) -> None:
            pass

    web = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=web.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()

    def repository(doi: str, **_: object) -> FigshareRepository:
        found = FigshareRepository(doi, "https://figshare.com/walks")
        found._api_response = [
            {
                "name": name,
                "computed_md5": md5(content),
                "download_url": f"http://127.0.0.1:{web.server_address[1]}/{name}",
            }
            for name, content in state.files.items()
        ]
        return found

    monkeypatch.setattr("pooch.core.doi_to_repository", repository)
    monkeypatch.setattr("pooch.downloaders.doi_to_repository", repository)
    monkeypatch.setattr("pooch.core.time.sleep", lambda _: None)
    # a proxy of the machine must not stand between the test and its server
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    yield state
    web.shutdown()
    web.server_close()
    thread.join()


def dataset(hashes: dict[str, str | None]) -> Dataset:
    return Dataset("walks", "Rollouts", "10.0000/walks.v1", "Nobody (2026)", "CC0", 1, hashes)


PUBLISHED = dataset({"data.zip": md5(ARCHIVE)})


def files_in(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


WHOLE = {"walks/data.zip", "walks/data/trials/WBDS01walkT01mkr.txt", "walks/data/readme.txt"}


def test_whole_file_is_verified_and_unpacked(server: Server, tmp_path: Path) -> None:
    (file,) = fetch_dataset(PUBLISHED, tmp_path)
    assert file.read_bytes() == ARCHIVE
    assert (tmp_path / "walks/data/trials/WBDS01walkT01mkr.txt").read_bytes() == TRIAL
    assert files_in(tmp_path) == WHOLE


def test_the_command_shows_progress_and_says_what_is_here(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archive, "registry", lambda: {"walks": PUBLISHED})

    def gaitval(*arguments: str) -> str:
        result = CliRunner().invoke(cli.app, ["data", *arguments, "--folder", str(tmp_path)])
        assert result.exit_code == 0
        return result.output

    assert "missing: data.zip" in gaitval("list")
    assert f"{tmp_path / 'walks/data.zip'}: here" in gaitval("fetch", "walks")
    assert files_in(tmp_path) == WHOLE
    assert "complete" in gaitval("list")


def test_second_fetch_asks_the_server_nothing(server: Server, tmp_path: Path) -> None:
    fetch_dataset(PUBLISHED, tmp_path)
    server.asked.clear()
    fetch_dataset(PUBLISHED, tmp_path)
    assert server.asked == []


def test_file_laid_in_by_hand_is_verified_and_kept(server: Server, tmp_path: Path) -> None:
    home = tmp_path / "walks"
    home.mkdir()
    (home / "data.zip").write_bytes(ARCHIVE)
    fetch_dataset(PUBLISHED, tmp_path)
    assert server.asked == []
    assert (home / "data/readme.txt").exists()


def test_damaged_local_file_is_fetched_again(server: Server, tmp_path: Path) -> None:
    path = tmp_path / "walks/data.zip"
    fetch_dataset(PUBLISHED, tmp_path)
    path.write_bytes(ARCHIVE[:-1] + b"?")
    fetch_dataset(PUBLISHED, tmp_path)
    assert path.read_bytes() == ARCHIVE


def test_cut_connections_and_a_busy_server_are_tried_again(server: Server, tmp_path: Path) -> None:
    server.statuses = [503, 200, 429]
    server.cuts = [0, len(ARCHIVE) // 2, 0]
    (file,) = fetch_dataset(PUBLISHED, tmp_path)
    assert file.read_bytes() == ARCHIVE
    assert len(server.asked) == 1 + archive.ATTEMPTS_MORE


@pytest.mark.parametrize("damaged", [ARCHIVE[:-1000], ARCHIVE[:100] + b"?" + ARCHIVE[101:]])
def test_another_file_than_published_is_refused_and_deleted(
    server: Server, tmp_path: Path, damaged: bytes
) -> None:
    server.files["data.zip"] = damaged
    with pytest.raises(ArchiveError, match=f"{md5(ARCHIVE)}.*{md5(damaged)}"):
        fetch_dataset(PUBLISHED, tmp_path)
    assert files_in(tmp_path) == set()


@pytest.mark.parametrize("status", [404, 403, 500])
def test_a_server_that_refuses_is_told(server: Server, tmp_path: Path, status: int) -> None:
    server.statuses = [status] * 9
    with pytest.raises(ArchiveError, match=rf"{status}.*in a browser from https://doi\.org/10"):
        fetch_dataset(PUBLISHED, tmp_path)
    assert files_in(tmp_path) == set()


def test_a_hash_that_is_not_known_is_the_repositorys(server: Server, tmp_path: Path) -> None:
    unknown = dataset({"table.csv": None})
    (file,) = fetch_dataset(unknown, tmp_path)
    assert file.read_bytes() == TABLE
    file.write_bytes(b"Subject,Mass\n1,163.8\n")
    fetch_dataset(unknown, tmp_path)
    assert file.read_bytes() == TABLE


def test_file_that_the_doi_does_not_have(server: Server, tmp_path: Path) -> None:
    for md5_ in (None, "0" * 32):
        with pytest.raises(ArchiveError, match=r"other\.csv"):
            fetch_dataset(dataset({"other.csv": md5_}), tmp_path)


@pytest.mark.parametrize(
    "failure",
    [
        requests.ConnectionError("no route"),
        IndexError("list index out of range"),
        ValueError("Invalid data repository"),
    ],
)
def test_doi_that_leads_nowhere(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: Exception
) -> None:
    def repository(doi: str, **_: object) -> None:
        raise failure

    monkeypatch.setattr("pooch.downloaders.doi_to_repository", repository)
    with pytest.raises(ArchiveError, match=rf"10\.0000/walks.*{failure}"):
        fetch_dataset(PUBLISHED, tmp_path)


@pytest.mark.parametrize("name", ["../outside.txt", "trials/../../outside.txt", "/outside.txt"])
def test_unsafe_archive_is_refused(server: Server, tmp_path: Path, name: str) -> None:
    content = zip_of({"readme.txt": b"x", name: b"x"})
    server.files["data.zip"] = content
    with pytest.raises(ArchiveError, match="Nothing was unpacked"):
        fetch_dataset(dataset({"data.zip": md5(content)}), tmp_path / "a/b")
    assert files_in(tmp_path) == {"a/b/walks/data.zip"}


def test_archive_that_is_cut_off_while_unpacking_is_not_taken_for_the_whole(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut(self: zipfile.ZipFile, folder: Path) -> None:
        self.extract("readme.txt", folder)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(zipfile.ZipFile, "extractall", cut)
        with pytest.raises(KeyboardInterrupt):
            fetch_dataset(PUBLISHED, tmp_path)
    assert missing(PUBLISHED, tmp_path) == ["data.zip"]
    fetch_dataset(PUBLISHED, tmp_path)
    assert files_in(tmp_path) == WHOLE


def test_folder_that_cannot_be_written(server: Server, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ArchiveError, match="cannot be written"):
        fetch_dataset(PUBLISHED, tmp_path / "file")


def test_missing_follows_what_is_there(server: Server, tmp_path: Path) -> None:
    assert missing(PUBLISHED, tmp_path) == ["data.zip"]
    fetch_dataset(PUBLISHED, tmp_path)
    assert not missing(PUBLISHED, tmp_path)
    shutil.rmtree(tmp_path / "walks/data")
    assert missing(PUBLISHED, tmp_path) == ["data.zip"]


def test_unknown_name_lists_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(GaitvalError, match=r"wbs: no such data set. Available are: wbds"):
        fetch("wbs", tmp_path)
