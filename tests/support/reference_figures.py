"""Figures of the references of S05, by which a change of a number anywhere in them is seen.

python tests/support/reference_figures.py      # writes them again, after a change that is meant
"""

import json
from pathlib import Path

import numpy as np

from gaitval.configuration import ContactSettings
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.dynamic_fit import INFERENCE, fitted, solve
from gaitval.walk.reference.motion import ReferenceMotion, build_reference

FILE = Path(__file__).with_suffix(".json")
ARRAYS = (
    *("positions", "velocities", "moments", "ground_reaction", "centre_of_mass"),
    *("end_effectors", "offsets", "hip_centre"),
)


def figures(reference: ReferenceMotion) -> dict[str, list[float]]:
    """Root mean squares of each column, over the cycle."""
    found = {}
    for name in ARRAYS:
        values = np.asarray(getattr(reference, name))
        values = values if name in ("offsets", "hip_centre") else np.sqrt((values**2).mean(axis=0))
        found[name] = [float(f"{value:.6g}") for value in np.ravel(values)]
    return found


def of_s05() -> tuple:
    """Record and model of S05, and its reference before the fit."""
    subject = load_subject("S05")
    record, model = subject.record(), scale_subject(subject).model
    return record, model, build_reference(record, model)


def inference_figures(record, model, reference) -> dict[str, list[float]]:
    """Of the fit as the identification makes it."""
    found = solve(reference, record, model, ContactSettings(), INFERENCE)
    return {
        "common": found.common.tolist(),
        "deviation": np.sqrt(np.diag(found.covariance)).tolist(),
        "cost": [found.cost],
        "change": np.sqrt((found.change**2).mean(axis=1)).tolist(),
    }


def same(found: dict[str, list[float]], name: str) -> None:
    """Asserts that figures are the stored ones, but for what machines make of the last digits."""
    stored = json.loads(FILE.read_text(encoding="utf-8"))[name]
    assert found.keys() == stored.keys()
    for each, values in found.items():
        scale = np.abs(stored[each]).max()
        np.testing.assert_allclose(values, stored[each], rtol=1e-3, atol=1e-4 * scale, err_msg=each)


if __name__ == "__main__":
    record, model, built = of_s05()
    values = {
        "built": figures(built),
        "fitted": figures(fitted(built, record, model, ContactSettings())),
        "inference": inference_figures(record, model, built),
    }
    FILE.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")
