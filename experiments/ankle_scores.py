"""Shipped: writes `gaitval/subjects/prediction/ankles.json`, what right ankles of 33 people do.

    python -m experiments.ankle_scores ../shared/data          # the file
    python -m experiments.ankle_scores ../shared/data --check  # fails if it is another

Reads `wbds_ankle/` (Fukuchi et al. 2018), treadmill trials alone. Moments are corrected for the
right plate as those of the built-in people are (`gait.plate_correction`), with their mean scale and
shift, and with the vertical force that they have at the trial's speed: a built-in person's own has
a tenth in it, which is less than 0.0005 Nm/kg of anybody's moment. Curves are then scores of
`COMPONENTS` principal components, every person as heavy as another.
"""

import csv
from json import dumps
from pathlib import Path

import numpy as np

import gaitval.subjects.prediction
from experiments.shipped import parser_of, ship
from gaitval.arrays import Array
from gaitval.constants import GRAVITY, STANDARD_GRAVITY
from gaitval.gait.dimensionless import speed_unit
from gaitval.gait.plate_correction import LOADED, SHIFT_SIGNS
from gaitval.subjects.prediction.ankles import STORE, UNIT
from gaitval.subjects.prediction.population import expected, gaits_of
from gaitval.subjects.subject_file import builtin_subjects

FILE = Path(gaitval.subjects.prediction.__file__).parent / STORE
COMPONENTS = {"angle": 12, "moment": 8}
"""With 4, 6, 8 and 12 of the angle, moments of people who are left out are 0.0885, 0.087, 0.085 and
0.083 Nm/kg off; with 6 or 8 of the moment they are the same."""
SOURCE = (
    "Right ankles of 33 people, computed by experiments/ankle_scores.py from: Fukuchi CA, Fukuchi "
    "RK, Duarte M (2018) A public dataset of overground and treadmill walking kinematics and "
    "kinetics in healthy individuals. PeerJ 6:e4640, https://doi.org/10.7717/peerj.4640. Licence "
    "of the data and of this file: CC BY 4.0, https://creativecommons.org/licenses/by/4.0/. Its "
    "authors do not endorse this project."
)
UNKNOWN = "--"
_SAMPLES = 100


def _speeds(folder: Path) -> dict[tuple[str, str], tuple[float, float]]:
    """Dimensionless speed and leg length (m) of each treadmill trial."""
    found = {}
    with (folder / "WBDSinfo.csv").open(encoding="latin1", newline="") as file:
        for row in csv.DictReader(file):
            trial = row["FileName"].removesuffix(".c3d").partition("walk")[2]
            belt = row["GaitSpeed(m/s)"]
            if trial.startswith("T") and belt != UNKNOWN:
                leg = float(row["LegLength"])
                speed = float(belt) / speed_unit(leg)
                found[f"S{int(row['Subject']):02d}", trial] = (speed, leg)
    return found


def _curves(folder: Path) -> dict[tuple[str, str], dict[str, Array]]:
    """`ankle_angle_deg` and `ankle_moment_nm_kg` (100,) of each treadmill trial."""
    found: dict[tuple[str, str], dict[str, Array]] = {}
    with (folder / "ankle.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["trial"].startswith("T"):
                curve = np.array([float(row[f"p{each}"]) for each in range(_SAMPLES)])
                found.setdefault((row["subject"], row["trial"]), {})[row["quantity"]] = curve
    return found


def corrected(moment: Array, speed: float) -> Array:
    """A right ankle's `moment` (100,) Nm/kg, dorsiflexion positive, at a dimensionless `speed`,
    without the fault of the plate.
    """
    subjects = builtin_subjects()
    plates = [each.plates for each in subjects if each.plates is not None]
    scale = float(np.mean([each.scale for each in plates]))
    shift = float(np.mean([each.shift_right for each in plates]))
    forces = expected([gaits_of(each) for each in subjects], speed).forces
    vertical = forces[..., 2].mean(axis=0)  # of corrected records
    loaded = 1.0 + (scale - 1.0) * np.clip(vertical / LOADED, 0.0, 1.0)
    lever = SHIFT_SIGNS["ankle_angle"] * shift * vertical * STANDARD_GRAVITY
    return np.asarray(moment * loaded - lever)


def _components(curves: Array, weight: Array, count: int) -> tuple[Array, Array]:
    """Mean (100,) and `count` principal components of `curves` (n, 100) with a `weight` (n,)."""
    mean = np.average(curves, axis=0, weights=weight)
    _, _, shapes = np.linalg.svd((curves - mean) * np.sqrt(weight)[:, None], full_matrices=False)
    kept = shapes[:count]
    largest = np.take_along_axis(kept, np.argmax(np.abs(kept), axis=1)[:, None], axis=1)
    return mean, kept * np.sign(largest)  # the sign of a component is nobody's


def ankle_scores(data: Path) -> str:
    """The file."""
    folder = data / "wbds_ankle"
    speeds, curves = _speeds(folder), _curves(folder)
    names = [name for name in sorted(curves) if name in speeds]
    by_speed = {name: speeds[name][0] for name in names}
    angle = np.array([np.radians(curves[name]["ankle_angle_deg"]) for name in names])
    moment = np.array(
        [
            corrected(-curves[name]["ankle_moment_nm_kg"], by_speed[name])
            / (GRAVITY * speeds[name][1])
            for name in names
        ]
    )
    weight = np.array([1.0 / sum(one == each for one, _ in names) for each, _ in names])
    stored: dict[str, object] = {"source": SOURCE}
    scores = []
    for kind, values in (("angle", angle), ("moment", moment)):
        mean, shapes = _components(values, weight, COMPONENTS[kind])
        stored[kind] = {"mean": _whole(mean), "shapes": [_whole(each) for each in shapes]}
        scores.append((values - mean) @ shapes.T)
    people: dict[str, list[list[int]]] = {}
    for i, (name, trial) in enumerate(names):
        row = np.concatenate([[by_speed[name, trial]], scores[0][i], scores[1][i]])
        people.setdefault(f"WBDS{name[1:]}", []).append(_whole(row))
    return dumps(stored | {"people": people}, separators=(",", ":")).replace("],", "],\n") + "\n"


def _whole(values: Array) -> list[int]:
    found: list[int] = np.rint(values / UNIT).astype(int).tolist()
    return found


def main() -> None:
    """Command line; see the module's docstring."""
    ship({FILE: ankle_scores}, parser_of(__doc__).parse_args(), "ankle_scores")


if __name__ == "__main__":
    main()
