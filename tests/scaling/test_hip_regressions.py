"""Regressions of the hip centre: their values, and that a body is scaled by the one asked for."""

import numpy as np
import pytest

from gaitval.conventions import GENERIC
from gaitval.scaling.hip_regressions import REGRESSIONS, PelvisSize, hip_centre
from gaitval.scaling.joint_centres import locate, measure
from gaitval.subjects.subject_file import load_subject

PELVIS = PelvisSize(width=0.240, depth=0.150, leg=0.900)


@pytest.mark.parametrize(
    ("name", "millimetres"),
    [
        ("harrington", (-45.9, -86.5, -82.9)),
        ("bell", (-52.8, -86.4, -72.0)),
        ("hara", (-45.7, -85.4, -79.2)),
        ("davis", (-46.75, -78.05, -96.77)),
    ],
)
def test_the_values_are_those_of_the_paper(name, millimetres):
    assert 1e3 * hip_centre(name, PELVIS) == pytest.approx(millimetres, abs=0.05)


@pytest.mark.parametrize("name", list(GENERIC))
def test_a_person_of_the_size_of_a_model_has_its_hip(name):
    asis, rear, hip = (np.array(each) for each in GENERIC[name])
    depth = float(np.hypot(asis[0] - rear[0], asis[2] - rear[2]))
    found = hip_centre(name, PelvisSize(2 * abs(asis[1]), depth, 0.9))
    # Its distance from the right ASIS does not depend on the axes.
    spine = np.array([0.0, asis[1], 0.0])
    assert np.linalg.norm(found - spine) == pytest.approx(np.linalg.norm(hip - asis))
    assert found[1] == pytest.approx(hip[1])


def test_a_body_has_the_hips_that_are_asked_for():
    markers = load_subject("S05").markers
    places = {name: locate(markers, hip_regression=name) for name in REGRESSIONS}
    hips = {name: at["R.Hip.Centre"] for name, at in places.items()}
    assert len({tuple(np.round(at, 4)) for at in hips.values()}) == len(hips)
    assert locate(markers)["R.Hip.Centre"] == pytest.approx(hips["harrington"])
    # Gait2392's lies 2 to 4 cm behind Harrington's, and both hips do.
    behind = places["harrington"]["Mid.PSIS"] - hips["harrington"]
    apart = (hips["gait2392"] - hips["harrington"]) @ behind / np.linalg.norm(behind)
    assert 0.015 < apart < 0.045
    source = measure(markers, hip_regression="gait2392").sources["thigh"]
    assert "Gait2392" in source
    assert "thigh" not in measure(markers).sources
