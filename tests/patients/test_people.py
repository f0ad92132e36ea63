"""Tables of people, as laboratories head them."""

import pytest

from gaitval.apps.patients.people import read_people
from gaitval.errors import RecordError


def table(tmp_path, header, *rows):
    path = tmp_path / "people.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return read_people(path)


@pytest.mark.parametrize("age", ["Age", "Age(yrs)", "Age (yrs)", "age (years)", "Age y"])
def test_the_age_is_read_however_its_header_has_the_unit(tmp_path, age):
    (person,) = table(tmp_path, f"Subject Code,{age},Mass(kg)", "A,72,80").values()
    assert (person.age, person.mass) == (72.0, 80.0)


def test_a_table_of_a_spreadsheet_with_decimal_commas_is_read(tmp_path):
    (person,) = table(tmp_path, "\ufeffID;Sex;Height (m);Mass (kg)", "A;F;1,53;64,95").values()
    assert (person.sex, person.height, person.mass) == ("F", 1.53, 64.95)


def test_the_age_of_an_amputation_is_not_the_persons(tmp_path):
    header = "Subject Code,Age(yrs),Age of Amputation (yrs)"
    assert table(tmp_path, header, "A,72,5")["A"].age == 72.0


@pytest.mark.parametrize(
    "level",
    ["Transtibial", "below knee", "TT", "trans-tibial, left", "TTA", "BKA", "Trans tibial", "B/K"],
)
def test_an_amputation_below_the_knee_is_no_above_knee_prosthesis(tmp_path, level):
    header = "Subject,Amputation side,Amputation level"
    person = table(tmp_path, header, f'A,Left,"{level}"')["A"]
    assert (person.amputation, person.affected) == (None, {"": "left"})


@pytest.mark.parametrize(
    "level", ["Transfemoral", "above knee", "", "knee disarticulation", "TFA", "AKA"]
)
def test_other_levels_are(tmp_path, level):
    header = "Subject,Amputation side,Amputation level"
    person = table(tmp_path, header, f"A,Left,{level}")["A"]
    assert person.amputation == "left"


def people(tmp_path, name, *rows):
    path = tmp_path / f"{name}.csv"
    path.write_text("\n".join(("Subject,Sex,Age,Mass", *rows)), encoding="utf-8")
    return read_people(path)


@pytest.mark.parametrize(
    ("sex", "age", "expected"),
    [
        ("Woman", "9 years", ("F", 9.0)),
        ("girl", "9 y", ("F", 9.0)),
        ("W", "9.5 yrs.", ("F", 9.5)),
        ("MAN", "40", ("M", 40.0)),
        ("boy", "?", ("M", None)),
        ("n/a", "", (None, None)),
    ],
)
def test_sex_and_age_are_read_as_people_write_them(tmp_path, sex, age, expected):
    (person,) = people(tmp_path, "p", f"A,{sex},{age},60 kg").values()
    assert (person.sex, person.age) == expected
    assert person.mass == 60.0


@pytest.mark.parametrize(
    ("row", "seen"),
    [
        ("A,2,40,60", "Sex is '2'"),
        ("A,F,40-50,60", "Age is '40-50'"),
        ("A,F,40,9 stone", "Mass is '9 stone'"),
    ],
)
def test_a_cell_that_is_not_understood_is_named(tmp_path, row, seen):
    with pytest.raises(RecordError, match=rf"p\.csv, line 2: {seen}.* leave the cell empty"):
        people(tmp_path, "p", row)


@pytest.mark.parametrize("side", ["Bilateral", "both sides", "Right and left", "R/L", "L + R"])
def test_an_amputation_on_both_sides_is_not_read_as_none(tmp_path, side):
    table = tmp_path / "p.csv"
    table.write_text(f"Subject,Amputation side\nA,{side}\n", encoding="utf-8")
    with pytest.raises(RecordError, match="a prosthesis is on one side"):
        read_people(table)


@pytest.mark.parametrize(
    ("side", "expected"),
    [
        *(("Right", "right"), ("L", "left"), ("Lt.", "left"), ("links", "left")),
        *(("the left leg", "left"), ("none", None), ("no", None)),
    ],
)
def test_an_amputation_has_a_side_or_is_none(tmp_path, side, expected):
    table = tmp_path / "p.csv"
    table.write_text(f"Subject,Amputation side\nA,{side}\n", encoding="utf-8")
    assert read_people(table)["A"].amputation == expected


@pytest.mark.parametrize(
    ("header", "name"),
    [
        *(
            ("Walking speed (m/s)", "speed"),
            ("Gait velocity (m/s)", "speed"),
            ("Velocity", "speed"),
        ),
        *(("Body mass (kg)", "mass"), ("Body weight (kg)", "mass"), ("Body height (m)", "height")),
    ],
)
def test_what_was_measured_is_known_by_the_words_of_its_header(tmp_path, header, name):
    path = tmp_path / "people.csv"
    value = 60.0 if name == "mass" else 1.5
    path.write_text(f"Subject,{header}\nP,{value}\n")
    assert getattr(read_people(path)["P"], name) == value


@pytest.mark.parametrize(
    ("row", "seen"),
    [
        ("A,yes,", "Amputation side is 'yes'"),
        ("A,1,Transfemoral", "Amputation side is '1'"),
        ("A,Left,transradial", "'transradial' is no level of a leg's amputation"),
    ],
)
def test_an_amputation_that_is_not_understood_is_not_left_out(tmp_path, row, seen):
    with pytest.raises(RecordError, match=rf"people\.csv, line 2: {seen}"):
        table(tmp_path, "Subject,Amputation side,Level", row)


def test_a_level_may_stand_beside_the_side(tmp_path):
    assert table(tmp_path, "Subject,Amputation side", "A,Left (BK)")["A"].amputation is None
    assert table(tmp_path, "Subject,Side of amputation", "A,Right")["A"].amputation == "right"
    # A level of something else beside an affected side is no amputation.
    arthritis = table(tmp_path, "Subject,Affected side,Level", "A,Left,hip")["A"]
    assert (arthritis.amputation, arthritis.affected) == (None, {"": "left"})


@pytest.mark.parametrize("cells", ["A,0.86,", "A,,0.86"])
@pytest.mark.parametrize(
    "names", ["Right leg length,Left leg length", "Leg length (right) [m],Leg length (L)"]
)
def test_one_leg_that_was_measured_is_the_length_of_both(tmp_path, cells, names):
    """It was read as none, and both legs were estimated from the stature."""
    person = table(tmp_path, f"Subject,{names}", cells)["A"]
    assert (person.leg_length, person.legs) == (0.86, None)


@pytest.mark.parametrize(
    ("header", "cell", "quantity", "value"),
    [
        ("Weight (lbs)", "150", "mass", 68.0388555),
        ("Weight (lb)", "60 kg", "mass", 60.0),
        ("Mass [kg]", "80", "mass", 80.0),
        ("Weight in kg", "80", "mass", 80.0),
        ("Height (in)", "66", "height", 1.6764),
        ("Height [cm]", "170", "height", 1.7),
        ("height_mm", "1700", "height", 1.7),
        ("Age (months)", "36", "age", 3.0),
        ("Age (years),Age (months)", "3,4", "age", 3.0),
        ("Speed (km/h)", "3.6", "speed", 1.0),
        ("Speed (cm/s)", "80", "speed", 0.8),
    ],
)
def test_a_unit_of_a_header_is_read(tmp_path, header, cell, quantity, value):
    person = table(tmp_path, f"Subject,{header}", f"A,{cell}")["A"]
    assert getattr(person, quantity) == pytest.approx(value)
