"""Children whom evidence.seconds draws, against the growth reference of the WHO."""

import numpy as np
import pytest

from evidence import seconds
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import load_subject

# de Onis et al. 2007, Bull World Health Organ 85:660: percentiles 3, 50, 97 of stature, cm, and of
# body mass index, kg/m², at 10 years.
PUBLISHED = {
    "F": ((126.6, 138.6, 150.7), (13.5, 16.6, 22.1)),
    "M": ((125.8, 137.8, 149.8), (13.9, 16.4, 20.9)),
}


class Fixed:
    """A generator of the child of 10 years with given standard scores."""

    def __init__(self, *scores: float) -> None:
        self.scores = list(scores)

    def integers(self, _: int) -> int:
        return 2

    def standard_normal(self) -> float:
        return self.scores.pop(0)


def child(sex: str, *scores: float) -> Subject:
    person = load_subject("S05").model_copy(update={"sex": sex}).by_stature()
    return seconds._child(person, Fixed(*scores))


@pytest.mark.parametrize("sex", ["F", "M"])
@pytest.mark.parametrize(("column", "score"), [(0, -1.881), (1, 0.0), (2, 1.881)])
def test_children_are_as_the_published_percentiles(sex, column, score):
    stature, index = PUBLISHED[sex]
    of_height, of_mass = child(sex, score, 0.0), child(sex, 0.0, score)
    assert 100.0 * of_height.height_m == pytest.approx(stature[column], abs=0.1)
    found = of_mass.mass_kg / of_mass.height_m**2
    assert found == pytest.approx(index[column], abs=0.15)


def test_a_child_walks_at_the_dimensionless_speed_and_stride_of_the_other():
    person, small = load_subject("S05").by_stature(), child("M", 0.0, 0.0)
    ratio = np.sqrt(small.leg_length_m / person.leg_length_m)
    assert small.walking_speed_m_s == pytest.approx(person.walking_speed_m_s * ratio)
    assert small.stride_time_s == pytest.approx(person.stride_time_s * ratio)
    assert ratio < 1.0
