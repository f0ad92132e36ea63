"""What is normal at a speed and an age."""

from pathlib import Path

import numpy as np
import pytest

from experiments import norms as made
from gaitval.datasets.subject_file import load_subject
from gaitval.metrics.healthy_bands import healthy_bands
from gaitval.metrics.norms import norms, norms_at


def test_the_shipped_file_is_what_the_data_give(gait_data: Path) -> None:
    assert made.norms_file(gait_data) == made.FILE.read_text("utf-8")


def test_a_line_is_found_again_with_its_scatter() -> None:
    random = np.random.default_rng(0)
    speed, age = random.uniform(0.2, 0.6, 400), random.uniform(20, 80, 400)
    truth = 30.0 + 20.0 * (speed - made.SPEED) - 0.1 * (age - made.AGE)
    mean, slope, square, year, sd = made.fitted(truth + random.normal(0, 2.0, 400), speed, age)
    assert mean == pytest.approx(30.0, abs=0.5)
    assert slope == pytest.approx(20.0, abs=3.0)
    assert square == 0.0
    assert year == pytest.approx(-0.1, abs=0.02)
    assert sd == pytest.approx(2.0, abs=0.2)


def test_who_walks_faster_takes_more_and_longer_steps() -> None:
    slow, fast = (norms_at(speed, 0.9, 30.0) for speed in (0.8, 1.4))
    for name in ("parameter/cadence", "parameter/step_length"):
        assert fast[name].mean > slow[name].mean
    assert fast["parameter/stance_fraction"].mean < slow["parameter/stance_fraction"].mean
    for each in (slow, fast):
        speed = each["parameter/cadence"].mean / 60.0 * each["parameter/step_length"].mean
        assert speed == pytest.approx({True: 0.8, False: 1.4}[each is slow], rel=0.05)


def test_beyond_the_speeds_of_the_people_the_nearest_is_taken_and_said() -> None:
    far, further = (norms_at(speed, 0.9, 30.0)["angles/knee_angle"] for speed in (2.5, 3.0))
    assert far.beyond
    assert np.array_equal(far.mean, further.mean)
    assert not norms_at(1.2, 0.9, 30.0)["angles/knee_angle"].beyond


def test_built_in_people_are_within_three_sd_of_the_norm_most_of_the_time() -> None:
    inside = []
    for name in ("S01", "S05", "S09"):
        subject = load_subject(name)
        record = subject.record()
        for curve in ("hip_flexion", "knee_angle", "ankle_angle"):
            mean, sd, *_ = norms(subject)[f"angles/{curve}"]
            angle = np.degrees(record.angles[f"{curve}_r"](np.linspace(0.0, 1.0, 101)))
            inside.append(np.mean(np.abs(angle - mean) < 3.0 * sd))
    assert np.mean(inside) > 0.8


def test_children_have_the_curves_of_children_and_no_parameters() -> None:
    found = norms_at(1.0, 0.6, 9.0)
    mean, sd = healthy_bands()["angles"]["knee_angle"]
    assert np.array_equal(found["angles/knee_angle"].mean, mean)
    assert np.array_equal(found["angles/knee_angle"].sd, sd)
    assert not any(name.startswith("parameter/") for name in found)
