"""Plates of type 4 as AMTI's and Bertec's calibration sheets describe them, in C3D files."""

from pathlib import Path
from typing import NamedTuple

import ezc3d
import numpy as np
import pytest

from gaitval.mocap.c3d import read_c3d

LOAD = np.array([-38.0, 55.0, 640.0])
POINT = np.array([0.31, 0.72, 0.0])
TORQUE = np.array([0.0, 0.0, -4.2])
"""On the person, in a laboratory with z up."""
CORNERS = np.array([[0.0, 0.4, 0], [0.0, 1.0, 0], [0.6, 1.0, 0], [0.6, 0.4, 0.0]])
"""x along the walkway: the plate's own x is the laboratory's -y, its y the laboratory's -x."""


class Plate(NamedTuple):
    """What a calibration sheet says: (6, 6) N and Nm per volt, and the way from the sensors' origin
    to the middle of the surface, m."""

    matrix: np.ndarray
    origin: np.ndarray


CROSSTALK = np.random.default_rng(4).normal(0.0, 0.01, (6, 6))
AMTI = Plate(
    np.diag([154.8, 154.6, 605.3, 61.9, 61.7, 31.6]) @ (np.eye(6) + CROSSTALK),
    np.array([-0.0008, 0.0004, -0.0382]),
)
"""Full of crosstalk; the origin lies beside the middle, 38 mm below the surface."""
BERTEC = Plate(np.diag([500.0, 500.0, 1000.0, 800.0, 250.0, 400.0]), np.array([0.0, 0.0, -0.159]))
"""Diagonal; the origin is that of the transducers, and the surface has a cover."""


def in_plate(vector: np.ndarray) -> np.ndarray:
    x, y = CORNERS[0] - CORNERS[1], CORNERS[0] - CORNERS[3]
    axes = np.stack([x / np.linalg.norm(x), y / np.linalg.norm(y)])
    return np.append(axes, [np.cross(*axes)], axis=0) @ vector


def write(path: Path, plate: Plate, *, sign: float, unit: str, by_row: bool) -> Path:
    """Volts that the load makes. The matrix of the file gives N, and N times the unit of length."""
    scale = {"mm": 1e3, "m": 1.0}[unit]
    force = sign * in_plate(LOAD)
    middle = in_plate(np.cross(POINT - CORNERS.mean(axis=0), LOAD) + TORQUE)
    about_sensors = sign * middle + np.cross(plate.origin, force)
    matrix = np.diag([1.0] * 3 + [scale] * 3) @ plate.matrix
    volts = np.linalg.solve(matrix, np.r_[force, scale * about_sensors])
    course = np.r_[np.zeros(20), np.linspace(0.5, 1.0, 60)]
    file = ezc3d.c3d()
    frames = len(course) // 4
    points = np.ones((4, 3, frames))
    places = np.array([[0.3, 0.7, 0.9], [0.3, 0.9, 1.0], [0.35, 0.7, 0.1]])
    points[:3] = scale * places.T[:, :, None]
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["A", "B", "C"]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["data"]["points"] = points
    file["parameters"]["ANALOG"]["RATE"]["value"] = [400.0]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"]
    file["parameters"]["ANALOG"]["UNITS"]["value"] = ["V"] * 6
    file["data"]["analogs"] = np.outer(course, volts).T[None]
    declared = file["parameters"]["FORCE_PLATFORM"]
    declared["USED"]["value"] = np.array([1])
    declared["TYPE"]["value"] = np.array([4])
    declared["ZERO"]["value"] = np.array([1, 4])
    declared["CHANNEL"]["value"] = np.arange(1, 7)[:, None]
    file.add_parameter("FORCE_PLATFORM", "CORNERS", scale * CORNERS.T[..., None])
    file.add_parameter("FORCE_PLATFORM", "ORIGIN", scale * plate.origin[:, None])
    stored = matrix.T if by_row else matrix
    file.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", stored[..., None])
    if by_row:
        file.add_parameter("FORCE_PLATFORM", "MATRIX_STORE", ["ByRow"])
    file.write(str(path))
    return path


@pytest.mark.parametrize("by_row", [False, True], ids=["by column", "by row"])
@pytest.mark.parametrize("unit", ["mm", "m"])
@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["on the person", "on the plate"])
@pytest.mark.parametrize("plate", [AMTI, BERTEC], ids=["AMTI", "Bertec"])
def test_type_4_of_both_makers(tmp_path: Path, plate: Plate, sign, unit, by_row) -> None:
    path = write(tmp_path / "a.c3d", plate, sign=sign, unit=unit, by_row=by_row)
    (found,) = read_c3d(path).plates
    np.testing.assert_allclose(found.force[-1], LOAD, rtol=1e-5)
    np.testing.assert_allclose(found.force[40] / found.force[-1], found.force[40, 2] / LOAD[2],
                               rtol=1e-4)  # fmt: skip
    np.testing.assert_allclose(found.centre_of_pressure[-1], POINT, atol=1e-6)
    np.testing.assert_allclose(found.free_moment[-1], TORQUE, atol=1e-4)
    assert np.isnan(found.centre_of_pressure[:20]).all()
