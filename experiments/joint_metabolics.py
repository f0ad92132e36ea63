"""Two numbers of the joints' metabolic model, from another laboratory's people.

    python -m experiments.joint_metabolics Bovi2011.csv Bovi2011_parameters.csv

The files are the supplement of Bovi et al. (2011), Gait Posture 33:6: mean curves of joint power
and moment, and parameters of gait, of twenty adults and twenty young people at five speeds. Their
rate is taken to be what is expected at the speed (`expected_rate`). The
efficiencies are published. Found by least squares, and again with each condition left out, which is
what the model is off by at people whom it does not know. Seconds.
"""

import argparse
import csv
from pathlib import Path
from typing import Final

import numpy as np
from scipy.optimize import nnls

from gaitval.arrays import Array
from gaitval.kinetics.musculature.metabolics import METABOLISM
from gaitval.metrics.comparison import rms
from gaitval.quantities.metabolic_rate import EFFICIENCY, expected_rate

CONCENTRIC, ECCENTRIC = EFFICIENCY.values()

TASKS: Final = {"Very Slow": "XS", "Slow": "S", "Free": "Natural", "Medium": "M", "Fast": "L"}
GROUPS: Final = {"Y": "young_mean", "A": "adult_mean"}
MOMENTS: Final = ("Hip Ext/Flexion", "Knee Ext/Flexion", "Ankle Dorsi/Plantarflexion")
POWERS: Final = ("Hip", "Knee", "Ankle")


def conditions(curves: Path, parameters: Path) -> tuple[list[str], Array, Array]:
    """Names, (N, 3) mean size of the moments Nm/kg, positive and negative power W/kg (the latter as
    it is) of both legs, and (N,) net rate W/kg that is expected.
    """
    means: dict[tuple[str, str, str], Array] = {}
    with curves.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["statistic"] == "mean":
                values = np.array([float(row[f"p{i}"] or "nan") for i in range(100)])
                means[row["kind"], row["curve"], row["group_and_speed"]] = values
    with parameters.open(newline="") as file:
        table = {(row["parameter"], row["task"]): row for row in csv.DictReader(file)}
    names, seen, wanted = [], [], []
    for group, column in GROUPS.items():
        for speed_name, task in TASKS.items():
            stride = float(table["Stride length [m]", task][column])
            speed = stride / float(table["Stride time [s]", task][column])
            at = f"{speed_name} {group}"
            moment = sum(np.nanmean(np.abs(means["joint_moments", each, at])) for each in MOMENTS)
            positive, negative = (
                sum(np.nanmean(np.clip(means["joint_power", each, at], *to)) for each in POWERS)
                for to in ((0.0, None), (None, 0.0))
            )
            names.append(f"{at}, {speed:.2f} m/s")
            seen.append([2.0 * moment, 2.0 * positive, 2.0 * negative])
            wanted.append(expected_rate(speed) - METABOLISM.rest)
    return names, np.array(seen), np.array(wanted)


def found_numbers(seen: Array, wanted: Array) -> Array:
    """(2,) heat, W/Nm, and the share of negative power that returns, of `conditions`."""
    size, positive, negative = seen.T[0], seen.T[1], -seen.T[2]
    unpaid = wanted - positive / CONCENTRIC - negative / ECCENTRIC
    saved = -negative * (1.0 / CONCENTRIC + 1.0 / ECCENTRIC)
    return np.asarray(nnls(np.stack([size, saved], axis=1), unpaid)[0])


def predicted(seen: Array, numbers: Array) -> Array:
    """(N,) net rate W/kg of `conditions` by two `numbers`."""
    size, positive, negative = seen.T[0], seen.T[1], -seen.T[2]
    back = numbers[1] * negative
    return np.asarray(
        numbers[0] * size + (positive - back) / CONCENTRIC + (negative - back) / ECCENTRIC
    )


def main() -> None:
    """Print the numbers, and what is left."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("curves", type=Path)
    parser.add_argument("parameters", type=Path)
    given = parser.parse_args()
    names, seen, wanted = conditions(given.curves, given.parameters)
    numbers = found_numbers(seen, wanted)
    left = predicted(seen, numbers) - wanted
    print(f"heat {numbers[0]:.3f} W/Nm, returned {numbers[1]:.3f}; RMS {rms(left):.3f} W/kg")
    out = []
    for i, name in enumerate(names):
        others = np.arange(len(names)) != i
        known = found_numbers(seen[others], wanted[others])
        out.append(float(predicted(seen[i : i + 1], known)[0] - wanted[i]))
        print(
            f"{name}: expected {wanted[i] + METABOLISM.rest:.2f} W/kg, off {left[i]:+.2f}, "
            f"left out {out[-1]:+.2f}"
        )
    print(f"left out: RMS {rms(np.array(out)):.3f} W/kg, median {np.median(np.abs(out)):.3f}")


if __name__ == "__main__":
    main()
