"""The curves of a reference, and its own error."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.gait.cycle_curves import FORCES, JOINT_MOMENTS, recorded_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.epsilon import ANGLES
from gaitval.metrics.reference_curves import floor_of, reference_curves
from gaitval.subjects.subject_file import load_subject


def test_the_references_curves_have_the_records_names_signs_and_sides(task):
    """A reference that was fitted to a record is near it on both sides."""
    record = load_subject("S05").record()
    found = reference_curves(task.reference, task.model.mass, record.left_phase)
    truth = recorded_curves(record)
    for kind, largest in (("angles", np.deg2rad(3.0)), ("moments", 0.13), ("forces", 0.02)):
        for name, curve in getattr(found, kind).items():
            # The inversion of the foot is held least: `ConventionAccuracy.subtalar`.
            # Hip rotation gives way to a foot that stands (`RecordAccuracy.rotation`).
            loose = name.startswith(("subtalar", "hip_rotation"))
            bound = np.deg2rad(5.0) if loose else largest
            assert rms(curve - getattr(truth, kind)[name]) < bound, name
    assert found.forces["medial_l"][20:40].mean() > 0.0
    assert found.forces["medial_r"][20:40].mean() > 0.0


def test_the_floor_is_the_error_of_the_reference_itself(task):
    """About a sixth of the record; none for a record that is what the reference does."""
    floor = floor_of(task)
    assert 0.05 < floor < 0.5
    curves = reference_curves(task.reference, task.model.mass, task.record.left_phase)
    parts = []
    for kind, names in (("angles", ANGLES), ("moments", JOINT_MOMENTS), ("forces", FORCES)):
        recorded = getattr(recorded_curves(task.record), kind)
        keys = [f"{name}_{side}" for name in names for side in "rl"]
        off = np.array([getattr(curves, kind)[key] - recorded[key] for key in keys])
        size = np.array([recorded[key] for key in keys])
        parts.append(np.linalg.norm(off, axis=0).mean() / np.sqrt(np.mean(np.sum(size**2, axis=0))))
    assert floor == pytest.approx(sum(parts))


def test_the_cycle_closes_between_its_last_sample_and_its_first(task):
    """Half-way between them a curve is the mean of both, on either side."""
    reference = task.reference
    count = len(reference.phase)
    between = 1.0 - 0.5 / count
    ramp = np.linspace(-1.0, 2.0, count)[:, None]
    made = replace(
        reference,
        phase=np.arange(count) / count,
        positions=np.broadcast_to(ramp, reference.positions.shape).copy(),
    )
    # a phase of the left foot that puts its heel strike half-way
    found = reference_curves(made, task.model.mass, between)
    assert found.angles["knee_angle_l"][0] == pytest.approx(0.5)
    assert found.angles["knee_angle_r"][0] == pytest.approx(-1.0)
