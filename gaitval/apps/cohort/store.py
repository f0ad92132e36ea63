"""Where the studies of a cohort are kept: a folder, or object storage through fsspec.

Each study has a folder of its name. `finished.json` in it is written last, with the fingerprint of
all that the study depends on, so a study is finished only if it is there with the same fingerprint.
In a folder, which all workers must see, a study works in place, and an interrupted one resumes. On
object storage a study works in a temporary folder of its worker, and is copied when it is done.
"""

import json
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final

import filelock
import fsspec

from gaitval import file_gate
from gaitval.apps.cohort.answers import StudyOutcome, StudySummary
from gaitval.artefacts import read_json, without_nan, write_text
from gaitval.errors import ArtefactError, ConfigurationError
from gaitval.partial_files import own_folder

FINISHED: Final = "finished.json"
SUMMARY: Final = "summary.json"
LOG: Final = "study.log"
WAIT: Final = 300.0
"""s, for a study process whose worker is lost to end; it ends at once if the machine is well."""
OF_STORE: Final = "gaitval-cohort-"
"""First letters of the temporary folder of a study whose results go to object storage."""
LEFT_OUT: Final = (".lock", ".process", ".study.lock")
"""Files of a working folder that are nobody's results."""


class Store:
    """The folders of a cohort's studies at an `address`: a path, or what fsspec knows,
    "s3://bucket/cohort". Raises ConfigurationError if there is no such kind of address, or the
    package for it is missing.
    """

    def __init__(self, address: str) -> None:
        self.address = str(address).rstrip("/")
        self._made: dict[Path, ExitStack] = {}
        try:
            self._files, self.root = fsspec.core.url_to_fs(self.address)
        except (ValueError, ImportError) as error:
            raise ConfigurationError(
                f"--store {address}: cannot be used: {error}. Give a folder, or an address whose "
                "package is installed, such as s3fs for s3://."
            ) from None
        protocols = self._files.protocol
        kinds = (protocols,) if isinstance(protocols, str) else protocols
        self.local = Path(self.root) if "file" in kinds else None

    def where(self, name: str, file: str = "") -> str:
        """Path, or address, of a study's folder or of a file in it."""
        base = str(self.local) if self.local is not None else self.address
        return "/".join(part for part in (base, name, file) if part)

    def finished(self, name: str) -> dict[str, Any] | None:
        """What is known of a finished study; None if it is not finished, or cannot be read.

        It counts only with a summary that the tables can take, or it would be run no more.
        """
        try:
            found = StudyOutcome.model_validate(self.read(name, FINISHED)).model_dump()
        except ValueError:
            return None
        whole = found["name"] == name and found["status"] == "finished"
        return found if whole and self.summary(name) is not None else None

    def summary(self, name: str) -> dict[str, Any] | None:
        """The summary of a study, of the types of `answers.StudySummary`; None if there is none."""
        try:
            return StudySummary.model_validate(self.read(name, SUMMARY)).model_dump()
        except ValueError:
            return None

    def read(self, name: str, file: str) -> Any:
        """A JSON file of a study; None if it is not there, damaged, or not this user's."""
        try:
            if self.local is not None:
                path = self.local / name / file
                return read_json(path) if _ours(path.parent) and _ours(path) else None
            text = self._files.cat_file(f"{self.root}/{name}/{file}", end=file_gate.VALUES)
            return json.loads(text)
        except (ArtefactError, OSError, RecursionError, ValueError):
            return None

    def finish(self, name: str, record: dict[str, Any]) -> None:
        """Write what is known of a finished study, whole or not at all."""
        text = json.dumps(without_nan(record), indent=1, sort_keys=True, allow_nan=False) + "\n"
        if self.local is not None:
            write_text(self.local / name / FINISHED, text)
        else:  # an object is there as a whole or not at all
            self._files.pipe_file(f"{self.root}/{name}/{FINISHED}", text.encode())

    def forget(self, name: str) -> None:
        """Let a study count as unfinished: it starts again, from other inputs."""
        path = f"{self.root}/{name}/{FINISHED}"
        if self._files.exists(path):
            self._files.rm_file(path)

    def folder(self, name: str) -> Path:
        """Folder to work in: the study's own, or a new one of this machine for object storage,
        which this user alone can read. Raises ArtefactError if the study's own is a link.
        """
        if self.local is None:
            own = ExitStack()
            made = own.enter_context(own_folder(Path(tempfile.gettempdir()), OF_STORE))
            self._made[made] = own
            return made / name
        folder = self.local / name
        if folder.is_symlink():
            raise ArtefactError(f"{folder}: is a link, which is not followed. Remove it.")
        return folder

    def keep(self, name: str, folder: Path) -> None:
        """Copy a working folder to object storage; nothing to do for a folder."""
        if self.local is not None:
            return
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.name not in LEFT_OUT:
                target = f"{self.root}/{name}/{path.relative_to(folder).as_posix()}"
                self._files.put_file(str(path), target)

    def clear(self, folder: Path) -> None:
        """Remove a working folder whose contents are on object storage."""
        if self.local is None:
            self._made.pop(folder.parent).close()

    def check(self) -> None:
        """Raise ArtefactError unless one can write there."""
        probe = f"{self.root}/.gaitval-{os.getpid()}"
        try:
            if self.local is not None:
                self.local.mkdir(parents=True, exist_ok=True)
                if os.name == "posix" and self.local.stat().st_mode & stat.S_IWOTH:
                    raise PermissionError("everybody may write to it: run chmod o-w")
            self._files.pipe_file(probe, b"")
            self._files.rm_file(probe)
        except Exception as error:  # each kind of storage has its own
            raise ArtefactError(
                f"{self.address}: cannot be written to ({type(error).__name__}: {error}). Check "
                "the address, and the key or the permissions."
            ) from None


def _ours(path: Path) -> bool:
    """Whether a file or folder is this user's own, and no link."""
    found = path.lstat()
    user = getattr(os, "getuid", lambda: found.st_uid)()
    return not stat.S_ISLNK(found.st_mode) and found.st_uid == user


@contextmanager
def alone(folder: Path, seconds: float = WAIT) -> Iterator[None]:
    """Work in `folder` alone: wait up to `seconds` for a process whose worker was lost to end.
    Raises ArtefactError if another process still works there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with filelock.FileLock(folder / ".study.lock").acquire(timeout=seconds):
            yield
    except filelock.Timeout:
        raise ArtefactError(
            f"{folder}: another process has worked in this folder for {seconds:g} s. Is the same "
            "cohort running twice? Wait for it to end, or give this one its own --out."
        ) from None
