"""Write a trial of biomechZoo (a MATLAB file, `.zoo`) as the C3D file that it was made from.

    python -m claims.recordings.zoo_to_c3d walk.zoo walk.c3d

biomechZoo's public sample study (https://github.com/PhilD001/biomechZoo-help) keeps its trials in
this form: markers, the results of Plug-in Gait, analog channels and force plates of type 2, and the
person. Checked against the one C3D file that is there too: markers, channels and plates are equal.
"""

import argparse
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
from scipy.io import loadmat


def zoo_to_c3d(source: Path, target: Path) -> None:
    """Read a `.zoo` file of a lower-limb trial and write it as C3D, with units mm, N and Nmm."""
    data = loadmat(source, squeeze_me=True, struct_as_record=False)["data"]
    system = data.zoosystem
    markers = {
        name: line
        for name in _names(system.Video.Channels)
        if (line := _line(data, name)) is not None and line.ndim == 2 and line.shape[1] == 3
    }
    frames = len(next(iter(markers.values())))
    ratio = round(float(system.Analog.Freq) / float(system.Video.Freq))
    channels = {
        name: _as_long(line, frames * ratio)
        for name in _names(system.Analog.Channels)
        if (line := _line(data, name)) is not None
    }
    points = np.ones((4, len(markers), frames))
    for i, line in enumerate(markers.values()):
        points[:3, i] = np.where((line == 0.0).all(axis=1)[:, None], np.nan, line).T
    file = ezc3d.c3d()
    file["data"]["points"] = points
    file["data"]["analogs"] = np.array(list(channels.values()))[None]
    parameters = file["parameters"]
    parameters["POINT"]["RATE"]["value"] = [float(system.Video.Freq)]
    parameters["POINT"]["LABELS"]["value"] = list(markers)
    parameters["POINT"]["UNITS"]["value"] = ["mm"]
    parameters["ANALOG"]["RATE"]["value"] = [float(system.Analog.Freq)]
    parameters["ANALOG"]["LABELS"]["value"] = list(channels)
    _add_plates(file, system.Analog.FPlates, list(channels))
    for name in system.Anthro._fieldnames:
        value = getattr(system.Anthro, name)
        if np.isscalar(value) and not name.startswith(("percent", "dollar")):
            file.add_parameter("PROCESSING", name, [float(value)])
    file.write(str(target))


def _add_plates(file: Any, plates: Any, channels: list[str]) -> None:
    count = int(plates.NUMUSED)
    of_plates = [channels.index(name) + 1 for name in _names(plates.LABELS)[: 6 * count]]
    for name, value in (
        ("USED", [count]),
        ("TYPE", [2] * count),
        ("ZERO", [1, 0]),
        ("CORNERS", np.asarray(plates.CORNERS, float)),
        ("ORIGIN", np.asarray(plates.LOCALORIGIN, float)),
        ("CHANNEL", np.array(of_plates, float).reshape(count, 6).T),
    ):
        file.add_parameter("FORCE_PLATFORM", name, value)


def _names(channels: Any) -> list[str]:
    return [str(name).strip() for name in np.atleast_1d(channels)]


def _line(data: Any, name: str) -> Any:
    """Samples of a channel; None if the file lists it but has none."""
    return np.asarray(getattr(data, name).line, float) if name in data._fieldnames else None


def _as_long(line: Any, samples: int) -> Any:
    """The channel cut to the markers' time, or filled up with zeros."""
    return np.pad(line[:samples], (0, max(0, samples - len(line))))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("zoo", type=Path)
    parser.add_argument("c3d", type=Path, help="is written")
    given = parser.parse_args()
    zoo_to_c3d(given.zoo, given.c3d)
