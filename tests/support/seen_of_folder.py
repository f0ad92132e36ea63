"""Imported by Python at its start as `sitecustomize` (tests/test_current_folder.py): writes down what
is opened, listed, loaded or started of the folder FOLDER_WATCHED, a line each, into FOLDER_LOG."""

import os
import sys

_FOLDER, _LOG = os.environ.get("FOLDER_WATCHED"), os.environ.get("FOLDER_LOG")
_busy = False


def _watch(event: str, arguments: tuple) -> None:
    global _busy
    if _busy or event not in {"open", "ctypes.dlopen", "subprocess.Popen", "exec"}:
        return
    _busy = True
    try:
        if event == "exec":
            name = getattr(arguments[0], "co_filename", "")
        elif event == "subprocess.Popen":
            name = os.path.join("started", os.path.basename(os.fsdecode(arguments[0])))
            if name.partition("/")[2] in {"gcc", "cc", "ld"}:
                _write(event, name)
            return
        else:
            name = arguments[0]
        if isinstance(name, bytes | str | os.PathLike) and not str(name).startswith("<"):
            name = os.fsdecode(name)
            if event == "ctypes.dlopen" and "/" not in name:
                return  # by the system's search, which knows no current folder
            inside = os.path.relpath(os.path.abspath(name), _FOLDER)
            if not inside.startswith(".."):
                _write(event, inside)
    except (OSError, ValueError):
        pass
    finally:
        _busy = False


def _write(event: str, name: str) -> None:
    with open(_LOG, "a") as file:
        file.write(f"{event} {name}\n")


if _FOLDER and _LOG:
    sys.addaudithook(_watch)
