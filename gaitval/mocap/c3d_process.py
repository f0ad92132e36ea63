"""Read a C3D file with ezc3d and write its contents as npz to stdout; see `gaitval.mocap.c3d`.

A script, run with a file and a computing time, s, in a separate process. Of gaitval it imports
nothing but `partial_files`, which needs the standard library alone.
"""

import contextlib
import io
import json
import math
import os
import struct
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

from gaitval._internal.io.partial_files import own_folder


def values(stored: Any) -> list[Any]:
    """Values of a parameter in the file's order; texts without trailing blanks and NUL. `stored` is
    an array of any shape, or a list, as ezc3d gives it; the first index is fastest in the file.
    """
    found: list[Any] = np.asarray(stored).ravel(order="F").tolist()
    return [plain(value) if isinstance(value, str) else value for value in found]


def plain(text: str) -> str:
    """A `text` of ezc3d without blanks and NUL at its ends; bytes not of UTF-8 are Latin-1."""
    stripped = text.strip("\0 ")
    try:
        stripped.encode("utf-8")
    except UnicodeEncodeError:
        return stripped.encode("utf-8", "surrogateescape").decode("latin-1")
    return stripped


def limit_memory(size: int) -> None:
    """Limit this process to the memory that a file of a `size` in bytes needs, if the system can:
    Windows has no such limit, and macOS refuses it.
    """
    try:
        import resource
    except ImportError:
        return
    # ezc3d's objects take many times the bytes of a point in the file: 1.3 GB for 86 MB.
    memory = 2 * 2**30 + 50 * size
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))


def limit_time(seconds: float) -> None:
    """End this process when it has computed for so many `seconds`, not by the clock and rounded up,
    if the system can.
    """
    try:
        import resource
    except ImportError:
        return
    whole = math.ceil(seconds)
    with contextlib.suppress(OSError, ValueError):
        # The system sends SIGXCPU at the first limit, which the parent process recognises, and
        # kills the process at the second.
        resource.setrlimit(resource.RLIMIT_CPU, (whole, whole + 1))


def entries(data: bytes) -> Iterator[tuple[int, bytes, int, int]]:
    """The parameters and groups of a file, whose `data` these are: number of the group, negative
    where it is one; name in capitals; place of the step to the next; place behind the entry. Raises
    IndexError or struct.error if the file ends in its parameters.
    """
    at, step = (data[0] - 1) * 512 + 4, 1
    while step and data[at]:
        length, group = struct.unpack_from("2b", data, at)
        pointer = at + 2 + abs(length)
        (step,) = struct.unpack_from("<H", data, pointer)
        yield group, data[at + 2 : pointer].upper(), pointer, pointer + step
        at = pointer + step


def with_whole_offsets(data: bytes) -> bytes | None:
    """The whole `data` of a file whose ANALOG:OFFSET is stored as floats, as some programs write it
    although the format wants integers, with the same numbers as integers; None for any other file.
    Raises as `entries`.
    """
    first = (data[0] - 1) * 512
    last = first + 512 * data[first + 2]
    if data[first + 3] != 84:  # of another processor, whose floats are others
        return None
    for group, name, pointer, _ in entries(data):
        if group > 0 and name == b"OFFSET" and data[pointer + 2] == 4:
            (step,) = struct.unpack_from("<H", data, pointer)
            begin = pointer + 4 + data[pointer + 3]
            count = math.prod(data[pointer + 4 : begin])
            numbers = struct.unpack_from(f"<{count}f", data, begin)
            if any(each != round(each) or abs(each) > 32767 for each in numbers):
                return None
            parts = (
                data[:pointer],
                struct.pack("<HB", step - 2 * count if step else 0, 2),
                data[pointer + 3 : begin],
                struct.pack(f"<{count}h", *map(round, numbers)),
                data[begin + 4 * count : last],
                bytes(2 * count),  # the data begin where they did
                data[last:],
            )
            return b"".join(parts)
    return None


def with_analog_rate(data: bytes) -> bytes | None:
    """The whole `data` of a file of BTS without ANALOG:RATE with that of its header, without which
    ezc3d takes the channels of each frame for markers; None for any other file. Raises as
    `entries`.
    """
    first = (data[0] - 1) * 512
    last = first + 512 * data[first + 2]
    (values,) = struct.unpack_from("<H", data, 4)
    samples, frames = struct.unpack_from("<Hf", data, 18)
    found = list(entries(data))
    group = next((-group for group, name, *_ in found if group < 0 and name == b"ANALOG"), 0)
    known = any((group, b"RATE") == each[:2] for each in found)
    if known or not (group and values) or data[first + 3] != 84:
        return None
    entry = struct.pack("<bb4sHbBfB", 4, group, b"RATE", 9, 4, 0, samples * frames, 0)
    # A last step of 0 ends the list too, and then it does not say where its entry ends.
    pointer, end = found[-1][2:]
    if end == pointer or any(data[end : end + len(entry) + 2]) or end + len(entry) + 2 > last:
        return None
    return data[:end] + entry + data[end + len(entry) :]


def opened(path: Path) -> Any:
    """What ezc3d finds in the file `path`, with whole offsets and an analog rate where they can be
    had. Raises what ezc3d does.
    """
    file, failed = None, None
    try:
        file = ezc3d.c3d(str(path))
        if file["parameters"]["ANALOG"]["RATE"]["value"][0]:
            return file
    except Exception as error:
        failed = error
    corrected = with_analog_rate if failed is None else with_whole_offsets
    data = None
    with contextlib.suppress(IndexError, struct.error, ValueError, OverflowError):
        data = corrected(path.read_bytes())
    if data is None:
        if failed is not None:
            raise failed
        return file
    with own_folder(Path(tempfile.gettempdir()), "gaitval-c3d-") as folder:
        copy = folder / "copy.c3d"
        copy.write_bytes(data)
        return ezc3d.c3d(str(copy))


def samples_of(file: Any) -> "np.ndarray[Any, np.dtype[np.float64]]":
    """Analog samples (T, C) of ezc3d's `file`, which reads offsets and UNSIGNED counts wrongly."""
    samples, group = np.ascontiguousarray(file["data"]["analogs"][0].T), file["parameters"]
    names = ("SCALE", "OFFSET", "GEN_SCALE", "FORMAT")
    found = [group.get("ANALOG", {}).get(name, {}).get("value", ()) for name in names]
    if not len(found[0]) == len(found[1]) == samples.shape[1] or not len(found[2]):
        return samples
    gain, offset = np.multiply(found[0], found[2][0]), np.array(found[1], dtype=float)
    unsigned = str([*found[3], ""][0]).upper().startswith("UNSIGNED")
    if unsigned and group["POINT"]["SCALE"]["value"][0] > 0:
        counts = np.rint(samples / gain + np.abs(offset))
        return np.asarray((counts % 65536 - offset % 65536) * gain)
    return np.asarray(samples + (np.abs(offset) - offset) * gain)


def main() -> None:
    """Exit code 0 with the contents on stdout, or 1 with one line `c3d: why` on stderr."""
    path = Path(sys.argv[1])
    # Anything that ezc3d prints must not mix with the contents.
    contents = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    limit_memory(path.stat().st_size)
    limit_time(float(sys.argv[2]))
    try:
        file = opened(path)
        described = {
            "parameters": {
                group: {
                    name: {"value": values(entry["value"]), "shape": np.shape(entry["value"])}
                    for name, entry in entries.items()
                    if name != "__METADATA__"
                }
                for group, entries in file["parameters"].items()
            },
            "first_frame": int(file["header"]["points"]["first_frame"]),
            "last_frame": int(file["header"]["points"]["last_frame"]),
        }
        # ezc3d has (x y z 1, point, frame); saved are (frame, point, x y z).
        points, residuals = file["data"]["points"], file["data"]["meta_points"]["residuals"]
        output = io.BytesIO()
        np.savez(
            output,
            described=np.array(json.dumps(described)),
            points=np.ascontiguousarray(points[:3].transpose(2, 1, 0)),
            residuals=np.ascontiguousarray(residuals[0].T),
            analogs=samples_of(file),
        )
    except Exception as error:  # whatever a damaged file causes, the parent process reports it
        text = str(error).splitlines()
        print("c3d:", text[0] if text else type(error).__name__, file=sys.stderr)
        sys.exit(1)
    with contents:
        contents.write(output.getvalue())


if __name__ == "__main__":
    main()
