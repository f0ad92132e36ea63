"""Imported by Python at its start as `sitecustomize` (tests/test_current_folder.py): writes down
what is opened, run or loaded of the folder FOLDER_WATCHED, which compilers are started, and with
which other machines it talks, a line each, into FOLDER_LOG."""

import os
import sys

_FOLDER, _LOG = os.environ.get("FOLDER_WATCHED"), os.environ.get("FOLDER_LOG")
_busy = False


def _watch(event: str, arguments: tuple) -> None:
    global _busy
    if event in {"socket.getaddrinfo", "socket.connect"} and not _busy:
        where = arguments[0] if event == "socket.getaddrinfo" else arguments[1]
        host = where[0] if isinstance(where, tuple) else where
        inet = event == "socket.getaddrinfo" or isinstance(where, tuple)
        if inet and host not in {"127.0.0.1", "localhost", "::1", None}:
            _write(event, str(host))
        return
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
            # else it is a name in a folder that is open, as `shutil.rmtree` has them
            if not inside.startswith("..") and os.path.lexists(name):
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
