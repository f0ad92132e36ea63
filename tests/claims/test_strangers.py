"""Children whom claims.walking draws, against the growth reference of the WHO."""

import numpy as np
import pytest

from claims import Claim, Given, walking
from gaitval._internal.io.artefacts import read_json
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import load_subject

# Body mass index, kg/m², at -2, -1, 0, 1 and 2 standard scores, as the WHO prints it (de Onis et
# al. 2007, Bull World Health Organ 85:660, its tables of standard scores).
PUBLISHED = {
    ("M", 6): (13.0, 14.1, 15.3, 16.8, 18.5),
    ("M", 10): (13.7, 14.9, 16.4, 18.5, 21.4),
    ("M", 12): (14.5, 15.8, 17.5, 19.9, 23.6),
    ("M", 14): (15.5, 17.0, 19.0, 21.8, 25.9),
    ("M", 16): (16.5, 18.2, 20.5, 23.5, 27.9),
    ("F", 6): (12.7, 13.9, 15.3, 17.0, 19.2),
}


class Fixed:
    """A generator of a child of an age with given standard scores, of stature and mass."""

    def __init__(self, years: int, *scores: float) -> None:
        self.years, self.scores = years, list(scores)

    def integers(self, _: int) -> int:
        return [each[0] for each in walking.GROWTH["M"]].index(self.years)

    def standard_normal(self) -> float:
        return self.scores.pop(0)


def child(sex: str, years: int, *scores: float) -> Subject:
    person = load_subject("S05").model_copy(update={"sex": sex}).by_stature()
    return walking._child(person, Fixed(years, *scores))


@pytest.mark.parametrize(("sex", "years"), PUBLISHED)
def test_children_are_as_heavy_as_the_published_ones(sex, years):
    drawn = [child(sex, years, tall, score) for tall in (-1, 1) for score in (-2, -1, 0, 1, 2)]
    found = [each.mass_kg / each.height_m**2 for each in drawn]
    assert found == pytest.approx(2 * PUBLISHED[sex, years], abs=0.06)  # printed to 0.1
    assert {each.age_years for each in drawn} == {years}


def test_a_tall_child_is_as_much_above_the_median_as_a_short_one_below():
    short, middle, tall = (child("F", 8, score, 0).height_m for score in (-2, 0, 2))
    assert tall - middle == pytest.approx(middle - short)
    assert 1.1 < short < middle < tall < 1.4


def test_a_child_walks_at_the_dimensionless_speed_and_stride_of_the_other():
    person, small = load_subject("S05").by_stature(), child("M", 10, 0.0, 0.0)
    ratio = np.sqrt(small.leg_length_m / person.leg_length_m)
    assert small.walking_speed_m_s == pytest.approx(person.walking_speed_m_s * ratio)
    assert small.stride_time_s == pytest.approx(person.stride_time_s * ratio)
    assert small.leg_length_m < person.leg_length_m


@pytest.fixture
def population(tmp_path, monkeypatch):
    """The measurement on a table of two people, and who has walked."""
    walked = []
    folder = tmp_path / "anthropometry"
    folder.mkdir()
    sizes = {"F": "1630,650,840", "M": "1760,855,910"}
    for sex, name in walking.TABLES.items():
        header = "SubjectId,stature,weightkg,trochanterionheight"
        (folder / name).write_text(f"{header}\n{sex},{sizes[sex]}\n", encoding="latin-1")

    def fell(person: Subject, speed: float) -> int:
        walked.append((person, speed))
        return 3 if len(walked) == 1 else 0

    monkeypatch.setattr(walking, "_fell", fell)
    monkeypatch.setattr(walking, "SEED", 1)
    given = Given(data=tmp_path, public=tmp_path, work=tmp_path)

    def measured(count: int) -> Claim:
        monkeypatch.setattr(walking, "COUNT", count)
        return walking.strangers(given)

    return measured, walked


def test_a_stranger_who_has_walked_does_not_walk_again(population, tmp_path):
    strangers, walked = population
    first = strangers(4)
    assert (first.value, first.n) == (75.0, 4)
    assert (strangers(10).value, len(walked)) == (90.0, 10)
    (store,) = tmp_path.glob("strangers-*.json")
    kept = read_json(store)
    store.unlink()
    assert strangers(10).value == 100.0  # nobody falls any more
    assert [{**each, "fell": 0} for each in kept] == read_json(store)


def test_one_stranger_in_five_is_a_child_at_a_speed_of_its_size(population):
    strangers, walked = population
    strangers(20)
    children = [number for number, (person, _) in enumerate(walked) if person.laboratory == "WHO"]
    assert children == [4, 9, 14, 19]
    for person, speed in walked:
        scale = np.sqrt(person.leg_length_m / 0.875) if person.laboratory == "WHO" else 1.0
        assert walking.SLOWEST * scale <= speed <= walking.FASTEST * scale


def test_a_stranger_is_a_row_of_the_table_with_the_stride_of_its_leg(population):
    strangers, walked = population
    strangers(4)
    legs = {"F": 0.84, "M": 0.91}
    for person, _ in walked:
        assert person.leg_length_m == legs[person.sex]
        froude = person.walking_speed_m_s / np.sqrt(9.81 * person.leg_length_m)
        whose = [load_subject(each) for each in walking.PEOPLE]
        known = [each.walking_speed_m_s / np.sqrt(9.81 * each.leg_length_m) for each in whose]
        assert np.min(np.abs(np.array(known) - froude)) < 1e-9


def test_moments_of_a_child_are_those_of_legs_as_short(population):
    """A child of half an adult's leg has half the moments, Nm/kg, and equal forces."""
    strangers, walked = population
    strangers(20)
    for person, _ in walked:
        own = person.measured()
        froude = person.walking_speed_m_s / np.sqrt(9.81 * person.leg_length_m)
        like = min(
            map(load_subject, walking.PEOPLE),
            key=lambda one: abs(one.walking_speed_m_s / np.sqrt(9.81 * one.leg_length_m) - froude),
        )
        theirs, phase = like.measured(), np.linspace(0.0, 1.0, 11)
        size = person.leg_length_m / like.leg_length_m
        for name, moment in theirs.moments.items():
            np.testing.assert_allclose(own.moments[name](phase), size * moment(phase), atol=1e-12)
        up = [record.ground_reaction("right", phase)[:, 2] for record in (own, theirs)]
        np.testing.assert_array_equal(*up)
