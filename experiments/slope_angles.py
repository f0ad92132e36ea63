"""How joint angles change with the slope of the ground: the table of
`gaitval.subjects.prediction.slopes`.

    python -m experiments.slope_angles FOLDER gaitval/subjects/prediction/slope_angles.csv

FOLDER has the coefficients `Psi_globalThighAngles`, `Psi_kneeAngles`, `Psi_ankleAngles` of
github.com/twhsu-stanley/Robotic_prosthetics_state_estimation (commit c543633, folder Psi; its
script for fitting basis models says the form): a Fourier series of ten harmonics in the phase,
times quadratic Bernstein polynomials of stride length over leg length and of the slope in degrees,
fitted to every stride of ten people who walked at three speeds and nine slopes from -10 to 10
degrees (Embry et al. 2018, IEEE DataPort, doi 10.21227/gk32-e868) and of ten others at five slopes
(Reznick et al. 2021, Sci Data 8:282). Both data sets are CC BY 4.0. The repository names no
licence, so its coefficients and code stay there: what is shipped are mean angles of those people.
Seconds.
"""

import argparse
import pickle
from math import comb
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io.artefacts import write_text
from gaitval._internal.io.text_tables import csv_text

FILES: Final = {"thigh": "globalThighAngles", "knee": "kneeAngles", "ankle": "ankleAngles"}
SIGN: Final = {"thigh": 1.0, "knee": -1.0, "ankle": -1.0}
"""To flexion and dorsiflexion positive."""
HARMONICS: Final = 10
STRIDE: Final = 1.4
"""Stride length over leg length: the middle of what the people walked."""
SLOPES: Final = (-10.0, 10.0)
"""Degrees."""
POINTS: Final = 50


class _Arrays(pickle.Unpickler):
    """Nothing but arrays of numbers."""

    def find_class(self, module: str, name: str) -> Any:
        if module.startswith("numpy") and name in ("_reconstruct", "ndarray", "dtype"):
            return super().find_class(module.replace("numpy.core", "numpy._core"), name)
        raise pickle.UnpicklingError(f"{module}.{name}: not part of an array")


def _bernstein(x: float) -> np.ndarray:
    return np.array([comb(2, i) * x**i * (1.0 - x) ** (2 - i) for i in range(3)])


def curve(coefficients: np.ndarray, stride: float, slope: float, phase: np.ndarray) -> np.ndarray:
    """Degrees over the gait cycle, at a stride length over leg length and a slope in degrees."""
    k = 2.0 * np.pi * np.outer(phase, np.arange(1, HARMONICS + 1))
    series = np.hstack([np.ones((len(phase), 1)), np.cos(k), np.sin(k)])
    table = coefficients.reshape(series.shape[1], 3, 3)
    return np.asarray(
        np.einsum("pf,fls,l,s->p", series, table, _bernstein(stride), _bernstein(slope))
    )


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("table", type=Path)
    given = parser.parse_args()
    phase = np.arange(POINTS) / POINTS
    columns = {"percent": 100.0 * phase}
    for name, file in FILES.items():
        with (given.folder / f"Psi_{file}").open("rb") as opened:
            found = np.asarray(_Arrays(opened).load())
        level = curve(found, STRIDE, 0.0, phase)
        for slope in SLOPES:
            there = curve(found, STRIDE, slope, phase)
            columns[f"{name}_{slope:+g}"] = SIGN[name] * (there - level)
    rows = (
        [f"{row[0]:g}", *(f"{value:.1f}" for value in row[1:])]
        for row in zip(*columns.values(), strict=True)
    )
    write_text(given.table, csv_text([columns, *rows]))


if __name__ == "__main__":
    main()
