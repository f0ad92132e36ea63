"""Three numbers of the joints' metabolic model, from another laboratory's people.

    python -m experiments.joint_metabolics Bovi2011.csv Bovi2011_parameters.csv

The files are the supplement of Bovi et al. (2011), Gait Posture 33:6: mean curves of joint power
and moment, and parameters of gait, of twenty adults and twenty young people at five speeds. Their
rate is taken to be what published equations expect at the speed (`expected_rates`, the mean of
both, where both hold). Found by least squares that are not negative, and again with each condition
left out, which is what the model is off by at people whom it does not know. Seconds.
"""

import argparse
import csv
from pathlib import Path
from typing import Final

import numpy as np
from scipy.optimize import nnls

from gaitval.arrays import Array
from gaitval.musculature.metabolics import REST
from gaitval.quantities.metabolic_rate import expected_rates

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
            expected = expected_rates(speed)
            if len(expected) < 2:  # beyond what one of the equations is of
                continue
            at = f"{speed_name} {group}"
            moment = sum(np.nanmean(np.abs(means["joint_moments", each, at])) for each in MOMENTS)
            positive, negative = (
                sum(np.nanmean(np.clip(means["joint_power", each, at], *to)) for each in POWERS)
                for to in ((0.0, None), (None, 0.0))
            )
            names.append(f"{at}, {speed:.2f} m/s")
            seen.append([2.0 * moment, 2.0 * positive, 2.0 * negative])
            wanted.append(float(np.mean(list(expected.values()))) - REST)
    return names, np.array(seen), np.array(wanted)


def main() -> None:
    """Print the numbers, and what is left."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("curves", type=Path)
    parser.add_argument("parameters", type=Path)
    given = parser.parse_args()
    names, seen, wanted = conditions(given.curves, given.parameters)
    found, left = nnls(seen, wanted)
    print(
        f"heat {found[0]:.3f} W/Nm, work {found[1]:.3f}, returned {found[2] / found[1]:.3f}; "
        f"RMS {left / np.sqrt(len(wanted)):.3f}"
    )
    heat, work = nnls(seen[:, :2], wanted)[0]
    alone = seen[:, :2] @ [heat, work] - wanted
    print(f"nothing returned: heat {heat:.3f}, work {work:.3f}; RMS {_rms(alone):.3f}")
    out = []
    for i, name in enumerate(names):
        others = np.arange(len(names)) != i
        out.append(float(seen[i] @ nnls(seen[others], wanted[others])[0] - wanted[i]))
        print(f"{name}: expected {wanted[i] + REST:.2f}, left out {out[-1]:+.2f} W/kg")
    print(f"left out: RMS {_rms(np.array(out)):.3f} W/kg")


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
