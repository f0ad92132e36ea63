"""A small trial as files: markers as TRC, a force plate as MOT."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc_writing import write_trc

FORCE, POINT, TORQUE = (30.0, 700.0, -20.0), (0.5, 0.0, 0.3), (0.0, 4.0, 0.0)


def recording(frames: int = 20, rate: float = 100.0, start: float = 0.0) -> Recording:
    """Three markers about a metre apart that move a little."""
    course = np.linspace(0, 0.1, frames)[:, None, None]
    places = np.array([[0.4, 0.9, 0.2], [0.4, 0.9, 0.5], [0.6, 0.1, 0.3]])
    return Recording("test", "laboratory", ("a", "b.c", "d 1"), places + course, rate, start)


def trc(path: Path, *, units: str = "mm", changes: dict[int, str] | None = None) -> Path:
    """A TRC file of `recording()`; `changes` replaces lines by their number."""
    write_trc(path, recording())
    lines = path.read_text().splitlines()
    lines[2] = lines[2].replace("mm", units)
    for number, line in (changes or {}).items():
        lines[number - 1] = line
    path.write_text("\n".join(lines) + "\n")
    return path


def forces(
    path: Path,
    *,
    rate: float = 1000.0,
    samples: int = 200,
    start: float = 0.0,
    point: tuple[float, ...] = POINT,
    sign: float = 1.0,
    form: str = "ground_force_{}1",
    torque_form: str = "ground_torque_{}1",
    axes: str = "xyz",
) -> Path:
    """A MOT file of one plate that carries FORCE at POINT, and nothing in the first 50 samples."""
    values = np.tile(np.r_[FORCE, point, TORQUE], (samples, 1))
    values[:, [0, 1, 2, 6, 7, 8]] *= sign
    values[:50, [0, 1, 2, 6, 7, 8]] = 0.0
    values[:50, 3:6] = 346.0  # as in OpenSim's own example: nonsense while unloaded
    columns = [form.format(kind + axis) for kind in "vp" for axis in axes]
    columns += [torque_form.format(axis) for axis in axes]
    time = start + np.arange(samples) / rate
    write_storage(path, StorageTable(tuple(columns), time, values))
    return path


def refuse(read: object, path: Path, *words: str, **options: object) -> str:
    assert callable(read)
    with pytest.raises(RecordError) as caught:
        read(path, **options)
    message = str(caught.value)
    for word in words:
        assert word in message, message
    return message
