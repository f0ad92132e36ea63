"""The gate for files from outside: each is looked at before anything is read of it.

What is no regular file (a pipe would be waited for, a device might never end) or larger than its
kind can be is refused. Every reader of gaitval comes through here; `tests/test_readers.py` finds
one that does not. A reader in another language that wants a path gets it from `passed`.
"""

import codecs
import csv
import io
import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitval._internal.io.text_tables import text_table
from gaitval.errors import GaitvalError

if TYPE_CHECKING:
    import pandas as pd

Refusal = type[GaitvalError]


@dataclass(frozen=True)
class LargestSizes:
    """Most bytes or values that are read."""

    written: int = 8_000_000
    """Bytes of the largest file that a person writes: a table of 25,000 studies has half of it."""
    values: int = 32_000_000
    """Bytes of the largest JSON; `metrics.json` has less than 1,000,000."""
    table: int = 400_000_000
    """Bytes of the largest table of numbers as text: 20 minutes of 60 markers at 200 Hz."""
    binary: int = 4_000_000_000
    """Bytes of the largest file that another library reads, such as C3D."""
    unpacked: int = 1_000_000_000
    """Bytes of all arrays of a file, or of what a workbook unpacks to: they are held in memory."""


SIZES: Final = LargestSizes()


def passed(path: Path, refusal: Refusal, *, largest: int, fix: str = "Check the path") -> Path:
    """`path`, if it is a file that may be read and has at most `largest` bytes. Raises a
    GaitvalError of type `refusal` if it is missing (`fix` is then the last sentence of the message,
    without a stop), no regular file, may not be read, or too large.
    """
    opened(path, refusal, largest=largest, fix=fix).close()
    return Path(path)


def read_bytes(path: Path, refusal: Refusal, *, largest: int, fix: str = "Check the path") -> bytes:
    """The content of a file; `path`, `refusal`, `largest` (bytes) and `fix` are those of `passed`,
    as which it raises.
    """
    with opened(path, refusal, largest=largest, fix=fix) as file:
        try:
            content = file.read(largest + 1)
        except OSError as error:
            raise refusal(f"{path}: cannot be read ({error.strerror}). Give another.") from None
    if len(content) > largest:  # it says that it has none, as those below /proc do, or still grows
        raise _too_large(path, refusal, largest)
    return content


def read_text(
    path: Path,
    refusal: Refusal,
    *,
    largest: int,
    fix: str = "Check the path",
    encodings: Sequence[str] = ("utf-8-sig",),  # -sig: Windows may begin a file with a mark
) -> str:
    """The text of a file in the first of `encodings` that fits, or in UTF-16 if its mark says so;
    `path`, `refusal`, `largest` and `fix` are those of `passed`, as which it raises.

    A text that is not ASCII takes up to four times its bytes, so it may have a quarter of
    `largest`. Raises UnicodeDecodeError if it is not text in any of `encodings`.
    """
    content = read_bytes(path, refusal, largest=largest, fix=fix)
    if len(content) > largest // 4 and not content.isascii():
        raise _too_large(path, refusal, largest // 4)
    if content[:4] == b"PK\x03\x04":
        raise refusal(
            f"{path}: a workbook of a spreadsheet, or a ZIP file, by its content. Save the table "
            "as CSV."
        )
    if content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        encodings = ("utf-16",)
    for encoding in encodings[:-1]:
        try:
            return _plain_lines(content.decode(encoding))
        except UnicodeDecodeError:
            continue
    return _plain_lines(content.decode(encodings[-1]))


def _plain_lines(text: str) -> str:
    """With the ends of lines of this system, whichever wrote it."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def csv_rows(
    path: Path, refusal: Refusal, *, largest: int = SIZES.table
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Line and cells, by their columns, of each row of a CSV file, as `text_table` reads them: None
    where a row ends early, and by the name None a list of what is beyond the columns. `path`,
    `refusal` and `largest` are those of `passed`, as which it raises, also for what is not CSV in
    UTF-8.
    """
    try:
        text = read_text(path, refusal, largest=largest)
        names, rows = text_table(io.StringIO(text).readlines())
    except UnicodeDecodeError:
        raise refusal(f"{path}: not UTF-8 text. Save the table as UTF-8.") from None
    except csv.Error as error:
        raise refusal(f"{path}: cannot be read as CSV ({error}). Write it again.") from None
    for line, cells in rows:
        row: dict[Any, Any] = dict(zip_longest(names, cells[: len(names)]))
        if len(cells) > len(names):
            row[None] = cells[len(names) :]
        yield line, row


def csv_frame(path: Path, refusal: Refusal, **options: Any) -> "pd.DataFrame":
    """A CSV table `path` that gaitval wrote; `options` are those of `pandas.read_csv`. Raises as
    `passed` with `refusal`, also for what is not a CSV table.
    """
    import pandas as pd

    try:
        text = read_text(path, refusal, largest=SIZES.table)
        table: pd.DataFrame = pd.read_csv(io.StringIO(text), **options)
        return table
    except ValueError as error:  # pandas' own errors and UnicodeDecodeError are ones
        raise refusal(
            f"{path}: cannot be read as CSV ({error}). Delete it and run its stage again."
        ) from None


def opened(
    path: Path, refusal: Refusal, *, largest: int, fix: str = "Check the path"
) -> io.BufferedReader:
    """The open file; `path`, `refusal`, `largest` (bytes) and `fix` are those of `passed`, as which
    it raises.

    That it is a file is asked before it is opened, for that alone moves a tape, and after, for it
    may have been exchanged.
    """
    try:
        _look(path, refusal, largest, os.stat(path))
        # without O_NONBLOCK the opening of a pipe waits for who writes to it
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        file = os.fdopen(os.open(path, flags), "rb")
    except FileNotFoundError:
        raise refusal(f"{path}: no such file. {fix}.") from None
    except OSError as error:
        raise refusal(
            f"{path}: cannot be opened ({error.strerror}). Change its permissions, or give another."
        ) from None
    except ValueError:  # a zero or half a character in the name
        raise refusal(f"{str(path)!r}: no name of a file. {fix}.") from None
    try:
        _look(path, refusal, largest, os.fstat(file.fileno()))
    except GaitvalError:
        file.close()
        raise
    return file


def _look(path: Path, refusal: Refusal, largest: int, found: os.stat_result) -> None:
    if not stat.S_ISREG(found.st_mode):
        what = "a folder" if stat.S_ISDIR(found.st_mode) else "a pipe or a device"
        raise refusal(f"{path}: is {what}, but a file is read here. Give the file itself.")
    if found.st_size > largest:
        raise _too_large(path, refusal, largest)


def _too_large(path: Path, refusal: Refusal, largest: int) -> GaitvalError:
    return refusal(
        f"{path}: has more than {largest:,} bytes, which no file of this kind needs. Give another."
    )


def check_unpacked(sizes: Iterable[int], path: Path, refusal: Refusal) -> None:
    """Refuse a packed file `path` whose members, of `sizes` in bytes, are too large together:
    raises a GaitvalError of type `refusal`.
    """
    if sum(sizes) > SIZES.unpacked:
        raise refusal(
            f"{path}: unpacks to more than {SIZES.unpacked:,} bytes, which no file of this kind "
            "needs. "
            "Give another."
        )
