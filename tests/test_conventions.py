"""Conventions of angles: offsets, and figures that are counted by them."""

import numpy as np
import pytest

from gaitval.configuration import load_configuration
from gaitval.conventions import CONVENTIONS, GENERIC, OWN, beside, convention_of
from gaitval.errors import ConfigurationError
from gaitval.metrics.norms import Norm
from gaitval.reporting.grids import DrawnCurve, Panel, in_convention


def test_the_zero_of_opensim_s_models_is_where_their_markers_have_the_spines():
    """Four hips of synthetic walkers on Rajagopal's markers: +5.7, +5.9, +5.5, +5.4 degrees."""
    assert np.degrees(convention_of("rajagopal2016").pelvis) == pytest.approx(5.87, abs=0.01)
    # 10 mm in 180 mm
    assert np.tan(convention_of("gait2392").pelvis) == pytest.approx(10 / 180)
    for name, generic in GENERIC.items():
        assert convention_of(name).pelvis == generic.level


@pytest.mark.parametrize(
    ("angle", "share"),
    [("hip_flexion_r", -1), ("pelvis_tilt_l", -1), ("pelvis_tilt", -1), ("knee_angle_r", 0),
     ("hip_adduction_l", 0)],
)  # fmt: skip
def test_a_pelvis_that_is_turned_changes_tilt_and_flexion_alone(angle, share):
    convention = convention_of("rajagopal2016")
    assert convention.offset(angle) == pytest.approx(share * convention.pelvis)
    assert convention_of(OWN).offset(angle) == 0.0


def test_a_number_is_a_convention_and_another_word_is_refused():
    assert np.degrees(convention_of("2.7").pelvis) == pytest.approx(2.7)
    for wrong in ("isv", "400", "nan"):
        with pytest.raises(ConfigurationError, match=f"{wrong}.*rajagopal2016.*degrees"):
            convention_of(wrong)
    with pytest.raises(ConfigurationError, match=r"convention.*isv"):
        load_configuration(settings=["report.convention=isv"])


def test_others_are_said_by_what_they_are_more():
    more = dict(beside(convention_of("gait2392")))
    assert more[CONVENTIONS["isb"].title] == pytest.approx(3.18, abs=0.01)
    assert more[CONVENTIONS["rajagopal2016"].title] == pytest.approx(-2.69, abs=0.01)
    assert CONVENTIONS["gait2392"].title not in more


def test_a_figure_is_counted_by_the_convention_the_healthy_and_strides_too():
    curve = DrawnCurve("right", np.full(101, 30.0), np.ones(101), np.full((2, 101), 31.0))
    norm = Norm(np.full(101, 28.0), np.ones(101), 40)
    rows = [[Panel(name, (curve,), norm) for name in ("angles/hip_flexion", "angles/knee_angle",
                                                      "moments/hip_flexion")]]  # fmt: skip
    ((hip, knee, moment),) = in_convention(rows, "5")
    assert hip.curves[0].mean == pytest.approx(25.0)
    assert hip.curves[0].strides == pytest.approx(26.0)
    assert hip.norm.mean == pytest.approx(23.0)
    assert hip.curves[0].sd == pytest.approx(1.0)
    assert (knee, moment) == tuple(rows[0][1:])
