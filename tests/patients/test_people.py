"""Tables of people, as laboratories head them."""

import pytest

from gaitval_patients.people import read_people


def table(tmp_path, header, *rows):
    path = tmp_path / "people.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return read_people(path)


@pytest.mark.parametrize("age", ["Age", "Age(yrs)", "Age (yrs)", "age (years)", "Age y"])
def test_the_age_is_read_however_its_header_has_the_unit(tmp_path, age):
    (person,) = table(tmp_path, f"Subject Code,{age},Mass(kg)", "A,72,80").values()
    assert (person.age, person.mass) == (72.0, 80.0)


def test_the_age_of_an_amputation_is_not_the_persons(tmp_path):
    header = "Subject Code,Age(yrs),Age of Amputation (yrs)"
    assert table(tmp_path, header, "A,72,5")["A"].age == 72.0


def test_the_ages_of_the_published_amputees_are_read(gait_data):
    people = read_people(gait_data / "gps" / "amputee_subjects.csv")
    assert len(people) == 18
    assert all(18.0 <= person.age <= 90.0 for person in people.values())


@pytest.mark.parametrize("level", ["Transtibial", "below knee", "TT", "trans-tibial, left"])
def test_an_amputation_below_the_knee_is_no_above_knee_prosthesis(tmp_path, level):
    header = "Subject,Amputation side,Amputation level"
    person = table(tmp_path, header, f'A,Left,"{level}"')["A"]
    assert person.amputation is None
    assert person.below_knee == "left"
    assert person.affected == {"": "left"}


@pytest.mark.parametrize("level", ["Transfemoral", "above knee", "", "knee disarticulation"])
def test_other_levels_are(tmp_path, level):
    header = "Subject,Amputation side,Amputation level"
    person = table(tmp_path, header, f"A,Left,{level}")["A"]
    assert (person.amputation, person.below_knee) == ("left", None)
