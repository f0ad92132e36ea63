"""Download one published file: request its bytes, continue where they were cut off, verify them."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import requests

from gaitval.artefacts import growing
from gaitval.datasets.registry import ArchiveFile
from gaitval.errors import ArchiveError

DownloadProgress = Callable[[str, int, int], None]
"""Called with the name of a file, its bytes so far and its bytes in total."""

WAITS: Final = (1.0, 3.0, 10.0)
"""s, before each new attempt after one in which nothing more arrived."""
TIMEOUT: Final = (10.0, 60.0)
"""s, for a connection and for the next bytes on it."""
CHUNK: Final = 1 << 16
"""Bytes between two calls of the progress callback; an interruption loses at most this many."""


def cause_of(error: Exception) -> str:
    """The innermost cause of a network error, in short."""
    reason = getattr(error.args[0], "reason", error) if error.args else error
    return str(reason).rsplit(": ", 1)[-1] or type(error).__name__


def download_part(
    url: str, part: Path, file: ArchiveFile, on_progress: DownloadProgress | None
) -> None:
    """Complete `part` of `file` from `url`, continuing from what it contains; try again while the
    network fails. `on_progress` is called while bytes arrive.

    Only attempts that leave `part` no longer than before count as failures. So a connection that is
    cut again and again still gives a whole file if the server can continue files, and an
    ArchiveError if it cannot.
    """
    best = part.stat().st_size if part.exists() else 0
    waits = iter(WAITS)
    while True:
        try:
            if _attempt(url, part, file, on_progress):
                return
            failure = "the connection ended early"
        except requests.RequestException as error:
            failure = cause_of(error)
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


def _attempt(url: str, part: Path, file: ArchiveFile, on_progress: DownloadProgress | None) -> bool:
    """One request for what `part` still lacks; True when the file is complete.

    A server that cannot continue files answers with the whole file (status 200): then `part` starts
    again. Compression in transit would make ranges and lengths meaningless, so it is declined.
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
                f"{url}: the server's file has {total} bytes, but {file.name} as published has "
                f"{file.size}. Nothing was downloaded."
            )
        total = file.size if file.size is not None else total
        with growing(part, "change") as stream:
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
            "and deleted. A proxy may be sending a page of its own."
        )
    return total is None or have == total


def _check_status(answer: requests.Response, file: ArchiveFile) -> None:
    """Statuses that another attempt cannot cure are errors; others raise, to be tried again."""
    status = answer.status_code
    if status in (200, 206, 416):
        return
    if status in (404, 410):
        raise ArchiveError(
            f"{answer.url}: no such file (HTTP status {status}). {file.name} may have moved; "
            "report it to the maintainers of gaitval."
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
    """Byte at which the answer begins, and bytes of the whole file if the server states them."""
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
