"""How tightly fits hold hip rotation and free moment: what nine people choose for the tenth.

    python -m experiments.foot_accuracies FOLDER          # folders of studies, by subject; 20 min

Every record is fitted to its study's body with each pair of accuracies. A pair's score is the mean
over people of the sum of the squares of what is off, each over what people do and the limits of the
walks allow: angles, moments and three forces from the record, hip rotation, and creep of the loaded
foot. Printed are the means, and for each person what the nine others choose.
"""

import argparse
from itertools import product
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.configuration import ContactSettings
from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS
from gaitval.metrics.identified_body import identified_model
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.reference_curves import reference_curves
from gaitval.metrics.torques import CREEP_PERCENTILE, LOADED, slip_of
from gaitval.metrics.typed import sided
from gaitval.model.urdf import read_urdf
from gaitval.reference.dynamic_fit import consistent_reference
from gaitval.reference.motion import ReferenceMotion

ROTATIONS: Final = (1.0, 1.5, 2.0)
"""Degrees."""
FREE_MOMENTS: Final = (0.001, 0.0015, 0.002, 0.003)
"""BW m for each body weight."""
ALLOWED: Final = {
    "sagittal angles": 1.2,
    "moments": 0.032,
    "vertical force": 1.5,
    "fore-aft force": 0.7,
    "medial force": 0.6,
    "hip rotation": 5.0,
    "creep": 4.0,
}
"""Degrees, Nm/kg, % BW, cm/s."""


def off(folder: Path, accuracy: RecordAccuracy) -> dict[str, float]:
    """What the fit of a study in a `folder` is off with this `accuracy`, by `ALLOWED`; of both
    sides the root mean square for hip rotation and creep.
    """
    record = load_subject(str(folder / "subject.toml")).record()
    model = identified_model(read_urdf(folder / "model.urdf"), folder / "identification.json")
    near = ReferenceMotion.load(folder / "identified.npz")
    fit = consistent_reference(record, model, ContactSettings(), accuracy, near)
    truth = by_kind(recorded_curves(record))
    found = by_kind(reference_curves(fit, model.mass, record.left_phase))

    def error(kind: str, name: str) -> float:
        return rms(found[kind][name] - truth[kind][name])

    groups = {
        group: float(np.mean([error(kind, name) for name in sided(names)]))
        for group, (kind, names) in GROUPS.items()
        if group in ALLOWED
    }
    slip = 100.0 * slip_of(model, fit.positions, fit.velocities)
    loaded = fit.ground_reaction[:, :, 2] > LOADED
    creep = [np.percentile(slip[loaded[:, i], i], CREEP_PERCENTILE) for i in range(len(SIDES))]
    turned = [error("angles", f"hip_rotation_{side[0]}") for side in SIDES]
    two = {"hip rotation": turned, "creep": creep}
    return groups | {name: float(np.sqrt(np.mean(np.square(each)))) for name, each in two.items()}


def main() -> None:
    """Print the means of each pair, and who chooses which."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    pairs = list(product(ROTATIONS, FREE_MOMENTS))
    scores = np.zeros((len(BUILTIN), len(pairs)))
    for row, name in enumerate(BUILTIN):
        for column, (rotation, free_moment) in enumerate(pairs):
            accuracy = RecordAccuracy()._replace(
                rotation=float(np.deg2rad(rotation)), free_moment=free_moment
            )
            found = off(folder / name, accuracy)
            scores[row, column] = sum((found[key] / most) ** 2 for key, most in ALLOWED.items())
            figures = ", ".join(f"{key} {value:.3g}" for key, value in found.items())
            print(f"{name} {rotation} {free_moment}: {figures}", flush=True)
    for pair, score in zip(pairs, scores.mean(axis=0), strict=True):
        print(f"{pair}: {score:.3f}")
    for row, name in enumerate(BUILTIN):
        others = np.delete(scores, row, axis=0).mean(axis=0)
        print(f"without {name}: {pairs[int(others.argmin())]}")


if __name__ == "__main__":
    main()
