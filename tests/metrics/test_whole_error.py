"""Errors before and after a correction, recomputed from the curves of a stored file."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.constants import GRAVITY
from gaitval.metrics.results import read_metrics
from gaitval.metrics.whole_error import AS_MEASURED, OWN_HIPS

ROOT = Path(__file__).parents[2]


def rms(difference):
    return float(np.sqrt(np.mean(np.square(difference))))


@pytest.fixture(scope="module")
def walked():
    stored = read_metrics(ROOT / "reports" / "S05" / "baseline")
    return stored, stored.walk.curves, stored.record


def by_target(metrics, measure):
    return {row.target: row.value for row in metrics.measures if row.measure == measure}


@pytest.mark.parametrize("kind", ["moments", "forces"])
def test_the_error_as_measured_is_from_the_curve_before_the_plates_were_moved(walked, kind):
    metrics, curves, record = walked
    found = by_target(metrics, AS_MEASURED[kind])
    assert set(found) == set(curves.of(kind))
    for name, error in found.items():
        before = np.array(getattr(record.as_measured, kind)[name])
        assert error == pytest.approx(rms(np.array(curves.of(kind)[name].mean) - before), abs=2e-4)


def test_the_error_about_own_hips_has_the_lever_of_the_vertical_force(walked):
    """Both sides, both planes: a hip further forward needs more flexion, one further outward more
    abduction."""
    metrics, curves, record = walked
    found = by_target(metrics, OWN_HIPS)
    for side, letter in (("right", "r"), ("left", "l")):
        hip = metrics.walk.hip_centres.of(side)
        vertical = GRAVITY * np.array(curves.forces[f"vertical_{letter}"].mean) / 100.0
        for name, lever in (("hip_flexion", hip.forward), ("hip_adduction", -hip.outward)):
            own = np.array(curves.moments[f"{name}_{letter}"].mean) - lever * vertical
            error = rms(own - np.array(record.curves.moments[f"{name}_{letter}"]))
            assert found[f"{name}_{letter}"] == pytest.approx(error, abs=2e-4)


def test_the_summary_is_the_mean_of_both_sides(walked):
    metrics, _, record = walked
    for row in metrics.summary.errors:
        sides = [f"{row.curve}_{letter}" for letter in "rl"]
        errors = [metrics.walk.errors.of(row.kind)[side].rmse for side in sides]
        assert row.corrected == pytest.approx(np.mean(errors), rel=1e-4)
        if row.kind == "angles":
            assert (row.as_measured, row.correction) == (row.corrected, 0.0)
            continue
        before = by_target(metrics, AS_MEASURED[row.kind])
        assert row.as_measured == pytest.approx(np.mean([before[s] for s in sides]), rel=1e-4)
        changed = [
            rms(np.array(record.curves.of(row.kind)[s])
                - np.array(getattr(record.as_measured, row.kind)[s]))
            for s in sides
        ]  # fmt: skip
        assert row.correction == pytest.approx(np.mean(changed), rel=1e-3)
        best = [metrics.lights.of(row.kind)[side].guess_error for side in sides]
        assert row.prediction == pytest.approx(np.mean(best), rel=1e-4)
