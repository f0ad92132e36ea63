"""Tables as text: whoever wrote them, and what is written."""

import csv
from types import SimpleNamespace

import jinja2
import pytest

from gaitval._internal.io.text_tables import csv_text, shown, text_table, with_unit, without_unit
from gaitval.gait.cycles import GaitCycle
from gaitval.reporting.page import _html
from gaitval.session.importing.write import cycle_table


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_notes_quotes_and_empty_lines_are_passed_over(separator):
    note = f'"# made by{separator} somebody"' if separator == ";" else "# made by somebody"
    lines = [note, separator.join(("name", "mass")), "", separator.join(("Anna", "61.5"))]
    assert text_table(lines) == (["name", "mass"], [(4, ["Anna", "61.5"])])


def test_empty_lines_before_the_header_are_passed_over():
    assert text_table(["", "# note", " ", "a,b", "1,2"]) == (["a", "b"], [(5, ["1", "2"])])
    assert text_table(["", " "]) == ([], [])


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        (["a,b", '1,"2', "3,4"], "unexpected end"),  # or the last row would be part of a cell
        (["a,b,a ", "1,2,3"], "column a is there twice"),
    ],
)
def test_what_would_lose_values_is_refused(lines, why):
    with pytest.raises(csv.Error, match=why):
        text_table(lines)


def test_columns_without_a_name_are_no_columns_that_are_there_twice():
    assert text_table(["a,,", "1,2,3"]).rows == [(2, ["1", "2", "3"])]


def test_a_comma_is_the_point_where_it_does_not_separate():
    _, rows = text_table(["name;mass;note", "Anna;61,5;left, then right", "Bob;-1,5e-3;1.5"])
    assert [cells for _, cells in rows] == [
        ["Anna", "61.5", "left, then right"],
        ["Bob", "-1.5e-3", "1.5"],
    ]


def test_a_row_that_is_empty_but_for_separators_is_there():
    assert text_table(["a,b", "1,2", ",", "3,4"]).rows[1] == (3, ["", ""])


def test_text_that_would_be_a_formula_is_written_as_text():
    assert csv_text([["a", "b"], ["=1+1", -1.5], ["-1.5", None]]) == "a,b\n'=1+1,-1.5\n-1.5,\n"


@pytest.mark.parametrize("unit", ["s", "rad", "deg", "Nm/kg", "W/kg", "1", "BW", "% BW"])
def test_the_name_of_a_column_says_its_unit_and_is_read_without_it(unit):
    named = with_unit("knee_angle_r_mean", unit)
    assert named.startswith("knee_angle_r_mean_")
    assert without_unit(named) == ("knee_angle_r_mean", unit)
    assert without_unit("knee_angle_r_mean") == ("knee_angle_r_mean", "")  # as before 0.10.0


CYCLE = GaitCycle("right", 0.0, 0.6, 1.0, 0.1, 0.5, True, True)


def test_the_name_of_a_trial_in_the_table_of_cycles_is_no_formula():
    walk = SimpleNamespace(name="=cmd().c3d", cycles={"right": [CYCLE], "left": []})
    table = cycle_table([walk])
    assert list(table["trial"]) == ["'=cmd().c3d"]
    assert {"start_s", "toe_off_s", "end_s", "kinematics_valid"} <= set(table)


HOSTILE = "x\x1b]0;title\a\x9b31m\u202e\udcfc.trc"
"""Control characters of terminals, the turn of a text's direction, half a character."""
SHOWN = "x\ufffd]0;title\ufffd\ufffd31m\ufffd\ufffd.trc"


def test_hidden_characters_of_names_reach_no_table_and_no_page():
    assert csv_text([["trial"], [HOSTILE]]) == f"trial\n{SHOWN}\n"
    walk = SimpleNamespace(name=HOSTILE, cycles={"right": [CYCLE], "left": []})
    assert list(cycle_table([walk])["trial"]) == [SHOWN]
    page = jinja2.Environment(autoescape=True).from_string("<h2>{{ trial }}</h2>\n\t")
    assert SHOWN in _html(page, {"trial": HOSTILE}, "screen")
    assert shown("a\tb\nß") == "a\tb\nß"
