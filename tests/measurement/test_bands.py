"""Bands hold the truth of the sample, name their sources, and grow with a fault that was found."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gaitval.configuration import ProcessingSettings
from gaitval.consistency import Verdict
from gaitval.coordinates import RANGES
from gaitval.mocap.recording import FootForces
from gaitval.scaling.hip_regressions import REGRESSIONS
from gaitval.session.importing.importing import work_out
from gaitval.session.importing.write import _curve_table
from gaitval.session.measurement.bands import CHOICE, _summed, bands, half_holding
from gaitval.session.measurement.estimate import FoundFault
from gaitval.session.measurement.kinds import Fault
from gaitval.session.measurement.measured import bands_text, unshown
from gaitval.session.measurement.otherwise import with_fault
from gaitval.session.subject import subject_of
from gaitval.subjects.subject_file import load_subject


@pytest.fixture(scope="module")
def found(sample_request):
    return work_out(sample_request, ProcessingSettings())


def test_each_curve_has_a_band_and_its_sources(found):
    made = found.measurement.bands
    names = {f"angle_{name}" for name in found.angles} | {f"moment_{n}" for n in found.moments}
    assert names <= set(made.half)
    for name in names:
        assert (made.half[name] > 0.0).all()
        assert sum(share for _, share in made.shares[name]) + 0.5 > 0.9
        assert max(share for _, share in made.shares[name]) <= 1.0
    # its centre is the middle of the epicondyles, and not pulled at by the lateral one besides
    assert "landmark Knee" in {source for source, _ in made.shares["angle_knee_angle_r"]}
    assert 0.0 < made.remedy[1] <= 1.0
    assert 0.005 < made.lengths["thigh_right"] < 0.03  # m


def test_bands_are_said_in_the_words_of_the_page(found):
    message = bands_text(found.measurement.bands)
    assert "hip flexion angle ± " in message
    assert "knee moment ± " in message
    assert "_" not in message
    wide = replace(found.measurement.bands, half={"angle_knee_angle_r": np.full(101, 0.5)})
    (flag,) = unshown(wide)
    assert "hardly show right knee ± 29°:" in flag.message


@pytest.mark.slow
def test_the_band_of_a_moment_holds_the_curve_by_each_hip_centre(found):
    """That of an angle does not: there the choice is a convention."""
    made = found.measurement.bands
    assert set(made.by_hip) == set(REGRESSIONS) - {found.request.joint_centres}
    for each in made.by_hip.values():
        for side in "rl":
            name = f"moment_hip_flexion_{side}"
            assert (np.abs(each[name]) <= made.half[name]).all()
    largest = max(np.abs(each["moment_hip_flexion_r"]).max() for each in made.by_hip.values())
    assert largest > 0.1  # Nm/kg; Gait2392's hips are 2 to 4 cm away
    assert CHOICE in dict(made.shares["moment_hip_flexion_r"])
    assert CHOICE not in dict(made.shares["angle_hip_flexion_r"])


@pytest.mark.parametrize("away", [0.0, 0.3, 1.0, 5.0])
def test_a_band_about_one_curve_holds_nine_tenths_of_what_is_normal_about_another(away):
    """Of 0 away 1.645 standard deviations, of 5 one tail alone: 5 and 1.28."""
    half = float(half_holding(np.array(away), np.array(1.0)))
    drawn = away + np.random.default_rng(1).standard_normal(200_000)
    assert np.mean(np.abs(drawn) <= half) == pytest.approx(0.9, abs=0.003)
    assert float(half_holding(np.array(2.0 * away), np.array(2.0))) == pytest.approx(2.0 * half)
    assert float(half_holding(np.array(away), np.array(0.0))) == pytest.approx(away)


def test_an_angle_that_is_not_shown_is_no_further_off_than_its_range_is_wide():
    """Of the bands of Plug-in Gait's two markers on a foot, ± 118° was one; the joint has 69°."""
    made = _summed({"landmark MT2": {"angle_subtalar_angle_l": np.full(101, 4.0)}}, {}, 3.0)
    low, high = RANGES["subtalar_angle_l"]
    np.testing.assert_allclose(made.half["angle_subtalar_angle_l"], high - low)
    (flag,) = unshown(made)
    assert "hardly show left subtalar ± 69°:" in flag.message


def test_bands_are_in_the_table_of_curves(found):
    table = _curve_table(found, {})
    assert isinstance(table, pd.DataFrame)
    half = np.degrees(table["angle_knee_angle_r_band90_rad"])
    assert 1.0 < half.median() < 6.0
    assert "moment_ankle_angle_l_band90_nm_kg" in table


def test_the_subject_keeps_the_width_of_each_band(found, tmp_path):
    subject = subject_of(found)
    half = found.measurement.bands.half["angle_knee_angle_r"]
    assert subject.uncertainty["angle_knee_angle_r"] == pytest.approx(np.median(half))
    assert set(subject.uncertainty) > {"moment_hip_flexion_l", "force_up_r", "length_thigh_right"}
    subject.save(tmp_path / "mine.toml")
    again = load_subject(str(tmp_path / "mine.toml")).uncertainty
    assert again == pytest.approx(subject.uncertainty, rel=1e-5)


@pytest.mark.slow
def test_a_delay_that_was_found_widens_the_moments(found):
    seen = found.measurement.seen
    delay = Fault("delay", "", 0.04)
    late = FoundFault(delay, np.array([0.03]), np.array([0.003]), Verdict(()), matters=True)
    wide = bands(found, replace(seen, found=(late,)))
    name = "moment_hip_flexion_r"
    more = wide.half[name] ** 2 - found.measurement.bands.half[name] ** 2
    assert np.sqrt(more.mean()) > 0.15  # Nm/kg, of 30 ms
    angle = "angle_knee_angle_r"
    np.testing.assert_allclose(wide.half[angle], found.measurement.bands.half[angle], rtol=1e-6)


@pytest.mark.parametrize("delay", [0.004, -0.013])
def test_late_forces_lose_nothing_where_a_foot_lands_and_leaves(delay):
    """A stance of 0.6 s at 75 Hz that moves on: what it pushes with, and where, is as before."""
    time = np.arange(90) / 75.0
    on = (time > 0.3) & (time < 0.9)
    force, point = np.zeros((90, 2, 3)), np.full((90, 2, 3), np.nan)
    force[on, 0, 2] = 300.0  # N, as much as a heel strikes with
    point[on, 0] = 0.0
    point[on, 0, 0] = time[on]
    loads = FootForces(75.0, 0.0, force, point, np.zeros((90, 2, 3)), np.ones((90, 2), bool))
    late = with_fault(loads, "delay", delay)
    acting = np.isfinite(late.centre_of_pressure[:, 0, 0])
    assert late.force[acting, 0, 2].sum() == pytest.approx(force[..., 2].sum())
    away = late.centre_of_pressure[acting, 0, 0] - (time[acting] - delay)
    assert np.abs(away).max() < 1.0 / 75.0


@pytest.mark.slow
def test_errors_of_landmarks_go_with_the_stature(found):
    smaller = found.request.model_copy(update={"height": 0.9 * found.request.height})
    made = bands(replace(found, request=smaller), found.measurement.seen)
    # Where ankles are goes with the shank, not with what is said of the stature.
    for name in ("thigh_right", "thigh_left"):
        usual = found.measurement.bands.lengths[name]
        assert made.lengths[name] == pytest.approx(0.9 * usual, rel=0.02)
