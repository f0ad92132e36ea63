"""What is normal at a speed and an age."""

from pathlib import Path

import numpy as np
import pytest

from experiments import norms as made
from gaitval.metrics.norms import healthy_bands, norms, norms_at
from gaitval.metrics.unrecorded import STEP_WIDTH
from gaitval.subjects.subject_file import load_subject


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


def shipped() -> dict[str, np.ndarray]:
    """Rows of norms.csv by curve: mean, slopes by speed, its square and age, SD, people, speeds."""
    lines = [line for line in made.FILE.read_text("utf-8").splitlines() if not line.startswith("#")]
    found: dict[str, list[list[float]]] = {}
    for line in lines[1:]:
        name, _, *values = line.split(",")
        found.setdefault(name, []).append([float(each) for each in values])
    return {name: np.array(rows) for name, rows in found.items()}


@pytest.mark.parametrize("leg", [0.8, 0.95])
@pytest.mark.parametrize(("speed", "age"), [(0.4, 40.0), (0.46, 65.0), (0.35, 22.0)])
def test_each_norm_is_its_polynomial_in_dimensionless_speed_and_age(
    leg: float, speed: float, age: float
) -> None:
    """Without dimension: speed over the root of g times leg, cadence times the root of leg over g,
    lengths over leg; forces in % of body weight."""
    root = np.sqrt(9.81 * leg)
    found = norms_at(speed * root, leg, age)
    units = {"parameter/cadence": 60.0 * np.sqrt(9.81 / leg), "parameter/step_length": leg,
             "parameter/walking_speed": root}  # fmt: skip
    for name, rows in shipped().items():
        mean, slope, square, year, sd, people, *_ = rows.T
        unit = units.get(name, 100.0 if name.startswith("forces/") else 1.0)
        away = speed - 0.4
        expected = unit * (mean + slope * away + square * away**2 + year * (age - 40.0))
        np.testing.assert_allclose(found[name].mean, np.squeeze(expected), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found[name].sd, np.squeeze(unit * sd), rtol=1e-12)
        assert (found[name].people, found[name].beyond) == (int(people[0]), False)


def test_a_stride_is_two_steps_and_the_width_is_a_share_of_the_leg() -> None:
    found = norms_at(1.2, 0.9, 40.0)
    cadence, stride = found["parameter/cadence"], found["parameter/stride_time"]
    assert stride.mean == pytest.approx(2.0 * 60.0 / cadence.mean)
    assert stride.sd / stride.mean == pytest.approx(cadence.sd / cadence.mean)
    assert stride.people == cadence.people
    wide, narrow = (norms_at(1.2, leg, 40.0)["parameter/step_width"] for leg in (1.0, 0.5))
    assert wide.mean == pytest.approx(2.0 * narrow.mean) == STEP_WIDTH[0]
    assert wide.sd == pytest.approx(2.0 * narrow.sd) == STEP_WIDTH[1]


def test_an_adult_of_unknown_age_is_forty() -> None:
    unknown, forty, older = (norms_at(1.2, 0.9, age) for age in (None, 40.0, 60.0))
    for name, norm in unknown.items():
        np.testing.assert_array_equal(norm.mean, forty[name].mean)
    assert not np.array_equal(older["angles/knee_angle"].mean, forty["angles/knee_angle"].mean)


def test_the_fastest_and_the_slowest_are_not_beyond() -> None:
    rows = shipped()["angles/knee_angle"]
    slowest, fastest = rows[0, 6], rows[0, 7]
    root = np.sqrt(9.81 * 0.9)
    for speed, beyond in ((slowest + 1e-9, False), (fastest - 1e-9, False), (slowest - 1e-6, True),
                          (fastest + 1e-6, True)):  # fmt: skip
        assert norms_at(speed * root, 0.9, 40.0)["angles/knee_angle"].beyond == beyond
