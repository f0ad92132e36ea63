"""Tables of strides and of people: what they say is read, what is wrong is named."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from made_strides import stride_rows, write_strides
from typer.testing import CliRunner

from gaitval.apps.patients.people import person_of, read_people
from gaitval.apps.patients.strides import AXES, doubts, read_strides
from gaitval.cli import app
from gaitval.errors import RecordError
from gaitval.subjects.sample import copy_sample


def test_a_stride_is_read_by_the_numbers_of_axes(strides_table):
    first, second = read_strides(strides_table)
    assert (first.group, first.subject) == ("well", "P1_off")
    assert len(first.angles) == 18
    assert 50 < first.angles["knee_angle_r"].max() < 80
    assert not any("seems" in each for each in doubts([first, second]))


def test_a_side_that_lacks_an_angle_is_refused_and_not_mirrored(tmp_path):
    rows = [row for row in stride_rows("5", "g", "P") if row[3:5] != ["L", "knee_2"]]
    with pytest.raises(RecordError, match="P: no knee_angle_l"):
        read_strides(write_strides(tmp_path / "s.csv", rows))


def half_a_stride_off(values):
    return [*values[50:-1], *values[:51]]


@pytest.mark.parametrize(
    ("which", "change", "message"),
    [
        (lambda row: True, lambda v: [x * np.pi / 180 for x in v], "the angles are in radians"),
        (lambda row: row[4] == "ankle_2", lambda v: [x * np.pi / 180 for x in v],
         "ankle_angle_l are in radians"),
        (lambda row: row[3] == "L", half_a_stride_off, "over the other side's cycle"),
        (lambda row: row[3:5] == ["R", "knee_2"], lambda v: [-x for x in v], "has the other sign"),
        (lambda row: row[3:5] == ["R", "knee_2"], lambda v: [*v[:30], -9999.0, *v[31:]],
         "a value that is missing"),
    ],
)  # fmt: skip
def test_a_persons_unit_cycle_and_gaps_are_named(tmp_path, which, change, message):
    rows = stride_rows("5", "g", "P")
    for row in rows:
        if which(row):
            row[5:] = change(row[5:])
    with pytest.raises(RecordError, match=f"P.*{message}"):
        read_strides(write_strides(tmp_path / "s.csv", rows))


@pytest.fixture(scope="module")
def controls(tmp_path_factory, gait_data):
    with (gait_data / "gps" / "strides.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if row[0] == "control"]
    return read_strides(write_strides(tmp_path_factory.mktemp("controls") / "s.csv", rows))


@pytest.mark.parametrize(
    ("angle", "sides"), [("hip_1", "RL"), ("hip_1", "L"), ("pelvis_3", "L"), ("pelvis_2", "RL")]
)
def test_a_sign_that_is_wrong_in_all_people_is_doubted(controls, angle, sides):
    """In one person it may be his gait. What the curves do not show is said."""
    (unseen,) = doubts(controls)
    assert "do not show whether the sign is right of hip_rotation" in unseen
    turned = {f"{AXES[angle]}_{side.lower()}" for side in sides}
    wrong = [
        replace(each, angles={n: -c if n in turned else c for n, c in each.angles.items()})
        for each in controls
    ]
    first, *_ = doubts(wrong)
    assert re.search(f"{AXES[angle]}_.* the other sign", first)


def test_one_patient_may_walk_with_the_feet_turned_in(tmp_path):
    """Knees that bend forwards are refused. Pounds for kilograms may be a heavy person's, too."""
    rows = stride_rows("5", "g", "P")
    for row in rows:
        if row[4] == "foot_3":
            row[5:] = [-value for value in row[5:]]
    heavy = tmp_path / "people.csv"
    heavy.write_text("Subject,Mass,Height\nP,154,1.7\n", encoding="utf-8")
    table = str(write_strides(tmp_path / "s.csv", rows))
    command = ["patients", table, "--people", str(heavy), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0
    assert "foot_progression" in done.stderr
    assert "P: 154 kg at 1.7 m" in done.stderr


def test_what_is_no_number_or_there_twice_is_named(tmp_path):
    rows = stride_rows("5", "g", "P")
    rows[0][20] = "x"
    rows.append(rows[1])
    with pytest.raises(RecordError, match=r"is missing(.|\n)*there twice"):
        read_strides(write_strides(tmp_path / "s.csv", rows))
    other = tmp_path / "other.csv"
    other.write_text("a,b\n1,2\n", encoding="utf-8")
    with pytest.raises(RecordError, match="no group"):
        read_strides(other)


def test_people_are_read_whatever_the_columns_are_called(people_table):
    people = read_people(people_table)
    one, state = person_of("P1_off", people)
    assert state == "off"
    assert one.affected == {"off": "left"}
    assert 1.4 < one.height < 2.1
    assert 0.7 < one.leg_length < 1.1
    two, state = person_of("P2", people)
    assert (two.amputation, two.affected, two.age, state) == ("right", None, None, "")


def test_somebody_without_a_row_is_known_by_name_only(people_table):
    nobody, state = person_of("X9_on", read_people(people_table))
    assert (nobody.identifier, nobody.mass, state) == ("X9", None, "on")


def test_two_rows_of_one_person_that_differ_are_refused(tmp_path):
    path = tmp_path / "people.csv"
    path.write_text("Subject,Sex\nA,F\nA,M\n", encoding="utf-8")
    with pytest.raises(RecordError, match="second time"):
        read_people(path)
    path.write_text("Name,Sex\nA,F\n", encoding="utf-8")
    with pytest.raises(RecordError, match="no column says who"):
        read_people(path)


def test_the_datas_people_are_read(gait_data):
    gps = gait_data / "gps"
    amputees = read_people(gps / "amputee_subjects.csv")
    assert len(amputees) == 18
    assert {each.amputation for each in amputees.values()} == {"right", "left"}
    parkinson = read_people(gps / "parkinson_subjects.csv")
    assert parkinson["SUB03"].affected == {"on": "left", "off": "right"}
    assert np.isclose(parkinson["SUB06"].height, 1.515)
    with (gps / "amputee_subjects.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(amputees)


def test_the_sample_has_a_healthy_one_a_stiff_knee_and_a_crouch(tmp_path):
    """As `gaitval/samples/README.md` says; and of who they are there is a row for each."""
    copy_sample(tmp_path)
    sample = read_strides(tmp_path / "strides.csv")
    assert [each.group for each in sample] == [
        *("virtual_healthy", "virtual_stiff_knee", "virtual_crouch")
    ]
    bent = {
        (each.subject, side): (
            each.angles[f"knee_angle_{side}"].min(),
            each.angles[f"knee_angle_{side}"].max(),
        )
        for each in sample
        for side in "rl"
    }
    for side in "rl":
        assert bent["V1", side][0] < 5.0
        assert 55.0 < bent["V1", side][1] < 75.0
        assert bent["V3", side][0] > 15.0
    assert bent["V2", "r"][1] > 55.0
    assert 25.0 < bent["V2", "l"][1] < 35.0
    person, _ = person_of("V2", read_people(tmp_path / "people.csv"))
    assert person.affected == {"": "left"}


def test_every_percent_is_read_where_it_stands(tmp_path):
    """0 % and 100 % are two strides' landings, so they need not be the same."""
    rows = stride_rows("5", "g", "P")
    (row,) = (each for each in rows if each[3:5] == ["L", "knee_2"])
    row[5:] = [value + 0.04 * percent for percent, value in enumerate(row[5:])]
    (person,) = read_strides(write_strides(tmp_path / "s.csv", rows))
    np.testing.assert_allclose(person.angles["knee_angle_l"], row[5:], atol=1e-9)
    assert person.angles["knee_angle_l"][100] - person.angles["knee_angle_l"][0] > 3.0
