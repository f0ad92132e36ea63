"""What the current folder does not decide.

numba and matplotlib read a file of settings there when they are imported. An archive of recordings
may hold such a file, hidden, and it could name the folder that compiled code is taken from. And
WeasyPrint asks the linker where its libraries are (`ctypes.util`), where the system's list does not
have them; a linker script in the current folder could answer with one that is there. And glfw,
which MuJoCo brings, asks another Python for the versions of its libraries. When gaitval,
or what it imports, is what imports these libraries, they see nothing of it. A program that imports
them before gaitval, for itself, is left alone.
"""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import FrameType, ModuleType
from typing import Any, Final


@contextmanager
def unseen(name: str) -> Iterator[None]:
    """While the block runs, the file `name` of the current folder is not there for who asks by this
    relative name. Unlike a change of the current folder, this does not concern other threads.
    """
    before: Any = os.path.exists

    def exists(path: Any) -> bool:
        return path != name and bool(before(path))

    os.path.exists = exists
    try:
        yield
    finally:
        os.path.exists = before


@contextmanager
def without_linker() -> Iterator[None]:
    """While the block runs, libraries are looked up in the system's list alone."""
    from ctypes import util

    wanted = [name for name in ("_findLib_gcc", "_findLib_ld") if hasattr(util, name)]
    before = {name: getattr(util, name) for name in wanted}
    for name in wanted:
        setattr(util, name, lambda _: None)
    try:
        yield
    finally:
        for name, function in before.items():
            setattr(util, name, function)


@contextmanager
def safe_processes() -> Iterator[None]:
    """While the block runs, a Python that is started takes no modules from the current folder."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        del os.environ["PYTHONSAFEPATH"]
        if before is not None:
            os.environ["PYTHONSAFEPATH"] = before


IMPORTED: Final[dict[str, Callable[[], AbstractContextManager[None]]]] = {
    "glfw": safe_processes,
    "matplotlib": partial(unseen, "matplotlibrc"),
    "numba": partial(unseen, ".numba_config.yaml"),
    "weasyprint": without_linker,
}
"""In what each library is imported."""


class _Finder(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname not in IMPORTED or not _for_gaitval(sys._getframe()):
            return None
        others = (each for each in sys.meta_path if each is not self)
        found = (each.find_spec(fullname, path, target) for each in others)
        spec = next((each for each in found if each is not None), None)
        if spec is not None and spec.loader is not None:
            loader: Any = spec.loader
            execute = loader.exec_module

            def exec_module(module: ModuleType) -> None:
                with IMPORTED[fullname]():
                    execute(module)

            loader.exec_module = exec_module
        return spec


def _for_gaitval(frame: FrameType | None) -> bool:
    """Whether a module of gaitval is on the way to `frame`, other than this one."""
    while frame is not None:
        name = str(frame.f_globals.get("__name__"))
        if name.partition(".")[0].partition("_")[0] == "gaitval" and name != __name__:
            return True
        frame = frame.f_back
    return False


def ignore() -> None:
    """Hide these files from what gaitval imports from now on."""
    if not any(isinstance(each, _Finder) for each in sys.meta_path):
        sys.meta_path.insert(0, _Finder())
