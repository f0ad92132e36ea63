"""numba's cache of a compiled function, of which nothing is read that this user did not write.

numba's files are pickles: to read one runs what it says. So each file begins with a keyed hash
(BLAKE2b, RFC 7693) of its name, numba's version and all the rest, and one without the right hash is
not unpickled, but compiled and written anew. The key is in the cache's own folder, in a file that
only this user can read. The time at which this file was made on this disk (ctime, which nobody can
set) goes into the hash: a folder that came out of an archive brings a key, but not its time.
"""

import hmac
import os
import pickle
import secrets
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any, Final

import filelock
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    _CacheLocator,
    _SourceFileBackedLocatorMixin,
)

KEY: Final = "key"


@dataclass(frozen=True)
class CacheSettings:
    """Of the files of compiled code."""

    size: int = 32
    """Bytes of a key, and of a hash."""
    longest: float = 120.0
    """s, for another process that is compiling the same; then this one compiles it, too."""
    wait: float = 1.0
    """s, for another process that is just making the key."""


CACHE: Final = CacheSettings()


@cache
def key_in(folder: Path) -> bytes:
    """The key of the cache `folder`, which is this user's own; made if there is none of this user's
    that nobody else can read.
    """
    path, until = folder / KEY, time.monotonic() + CACHE.wait
    while time.monotonic() < until:
        with suppress(FileExistsError):
            if not os.path.lexists(path):
                _make(path)
        if (found := _read(path)) is not None:
            return found
        time.sleep(0.01)
    with suppress(OSError):
        path.unlink()
        _make(path)
    return _read(path) or secrets.token_bytes(CACHE.size)  # of this process alone: nothing is kept


def _read(path: Path) -> bytes | None:
    """The key and its time; None if it is none, or not finished."""
    try:
        with open(path, "rb", opener=_without_links) as file:
            about, content = os.fstat(file.fileno()), file.read(CACHE.size + 1)
    except OSError:
        return None
    private = os.name != "posix" or (about.st_uid == os.getuid() and not about.st_mode & 0o077)
    # A second name: another process is just making it, or somebody holds it open to be seen.
    if not private or about.st_nlink != 1 or len(content) != CACHE.size:
        return None
    return blake2b(content + str(about.st_ctime_ns).encode(), digest_size=CACHE.size).digest()


def _without_links(path: str, flags: int) -> int:
    # O_NONBLOCK: a named pipe has no end.
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))


def _make(path: Path) -> None:
    """Make a key, all at once. Raises FileExistsError if there is one."""
    made = path.with_name(f"{KEY}.{secrets.token_hex(8)}")
    descriptor = os.open(made, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "wb") as file:
        file.write(secrets.token_bytes(CACHE.size))
    try:
        # Not by renaming: of two processes, the first makes it. While it has two names, and so not
        # yet its last time, nobody takes it.
        os.link(made, path)
    finally:
        made.unlink()


_PACKAGE: Final = Path(__file__).parents[2]


class _Locator(_SourceFileBackedLocatorMixin, _CacheLocator):
    """Where a function's files are: in a folder that is given, whatever numba's settings say.

    A function of this package is known by its file within it, for the folder is that of all its
    sources (`compiled.SOURCES`): another installation or checkout of the same has nothing to
    compile. Any other is known by the path of its file. What was compiled of other contents of
    the function's own file counts for neither.
    """

    def __init__(self, function: Any, file: str, folder: Path) -> None:
        self._py_file = file
        self._lineno = function.__code__.co_firstlineno
        self._ours = Path(file).is_relative_to(_PACKAGE)
        if self._ours:
            part = "_".join(Path(file).parent.relative_to(_PACKAGE.parent).parts)
        else:
            part = self.get_suitable_cache_subpath(file)  # type: ignore[no-untyped-call]
        self._folder = folder / part

    def get_source_stamp(self) -> Any:
        # numba's may have the time of the file, which differs from checkout to checkout
        return blake2b(Path(self._py_file).read_bytes(), digest_size=CACHE.size).hexdigest()

    def get_cache_path(self) -> str:
        return str(self._folder)

    def ensure_cache_path(self) -> None:
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)


class _Implementation(CompileResultCacheImpl):
    """numba's, without its search for a place, which may import what its settings name."""

    def __init__(self, function: Any, folder: Path) -> None:
        file = function.__code__.co_filename
        self._lineno = function.__code__.co_firstlineno
        self._locator = _Locator(function, file, folder)
        self._filename_base = self.get_filename_base(  # type: ignore[no-untyped-call]
            f"{Path(file).stem}.{function.__qualname__}", getattr(sys, "abiflags", "")
        )


class _Files(IndexDataCacheFile):
    """The files of a function: an index of what it was compiled for, and each such result."""

    def __init__(self, *about: Any, key: bytes) -> None:
        super().__init__(*about)  # type: ignore[no-untyped-call]
        self._key = key

    def _seal(self, path: str, content: bytes | memoryview) -> bytes:
        sealed = blake2b(key=self._key, digest_size=CACHE.size)
        for part in (os.path.basename(path), self._version):
            sealed.update(f"{part}\0".encode())
        sealed.update(content)
        return sealed.digest()

    def _opened(self, path: str) -> Any:
        """What a file holds; None if it is not there, or not of this user and this numba."""
        try:
            content = memoryview(Path(path).read_bytes())
        except OSError:
            return None
        if not hmac.compare_digest(self._seal(path, content[CACHE.size :]), content[: CACHE.size]):
            return None
        return pickle.loads(content[CACHE.size :])

    def _keep(self, path: str, value: Any) -> None:
        content = self._dump(value)  # type: ignore[no-untyped-call]
        with self._open_for_write(path) as file:
            file.write(self._seal(path, content))
            file.write(content)

    def _load_index(self) -> Any:
        found = self._opened(self._index_path)
        if found is None or found[0] != self._source_stamp:
            return {}
        return found[1]

    def _save_index(self, overloads: Any) -> None:
        self._keep(self._index_path, (self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return self._opened(self._data_path(name))  # type: ignore[no-untyped-call]

    def _save_data(self, name: str, data: Any) -> None:
        self._keep(self._data_path(name), data)  # type: ignore[no-untyped-call]


class SealedCache(FunctionCache):
    """numba's cache of a Python `function` in `folder`, with the `key` of `key_in`. Of several
    processes that need it at once, one compiles it, and the others wait for that.
    """

    def __init__(self, function: Any, folder: Path, key: bytes) -> None:
        self._name = repr(function)
        self._py_func = function
        self._impl = _Implementation(function, folder)
        self._cache_path = self._impl.locator.get_cache_path()
        self._cache_file = _Files(
            self._cache_path,
            self._impl.filename_base,
            self._impl.locator.get_source_stamp(),
            key=key,
        )
        self._process: int | None = None
        self.enable()  # type: ignore[no-untyped-call]

    def _of_process(self) -> filelock.BaseFileLock:
        """The lock of this process: one does not outlive a fork."""
        if self._process != os.getpid():
            path = Path(self._cache_path) / f"{self._impl.filename_base}.lock"
            self._process = os.getpid()
            self._lock: filelock.BaseFileLock = filelock.FileLock(path, timeout=CACHE.longest)
        return self._lock

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled for a signature; if None, this process is to compile it."""
        found = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        if found is None:
            with suppress(OSError, filelock.Timeout):
                self._impl.locator.ensure_cache_path()
                self._of_process().acquire()
            found = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            if found is not None:
                self._of_process().release()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled."""
        super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        self._of_process().release()
