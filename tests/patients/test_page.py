"""The page of a patient says what it shows, of whom, and what was assumed."""

import html
import re

import numpy as np
import pytest
from seen_figures import bands, figure_of, forward, lines

from gaitval.apps.patients import page
from gaitval.apps.patients.cohort import found_patients
from gaitval.apps.patients.results import result_of
from gaitval.reporting.figures import BAND_COLOUR, COLOURS


@pytest.fixture
def patient(strides_table, tmp_path):
    """P2 with this row of a table of people."""

    def made(row, header="ID,Sex,Age,Height (m),Mass (kg)", speed="1.1"):
        people = tmp_path / "rows.csv"
        people.write_text(f"{header}\nP2,{row}\n", encoding="utf-8")
        (found,) = found_patients(strides_table, [people], [f"P2={speed}"], only=["P2"])
        return found

    return made


@pytest.fixture
def text(tmp_path):
    """The words of a patient's page, without tags."""

    def made(patient):
        written = (page.write_pages([patient], None, tmp_path) / "P2" / "patient.html").read_text(
            "utf-8"
        )
        body = written[written.index("<header") :]
        plain = re.sub(r"<(svg|style|script).*?</\1>|<[^>]+>", " ", body, flags=re.S)
        return re.sub(r"\s+", " ", html.unescape(plain))

    return made


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("F,40,1.65,60", "woman, 40 years; a row of rows.csv"),
        ("M,9,1.35,30", "boy, 9 years"),
        ("M,17.6,1.75,70", "boy, 17.6 years"),
        (",9,1.35,30", "sex not known, 9 years"),
        ("M,,1.65,60", "man, age not known"),
    ],
)
def test_the_page_says_who_it_is_and_what_is_not_known(patient, text, row, message):
    assert message in text(patient(row))


def test_what_was_assumed_of_somebody_without_sex_and_age_cannot_be_said(patient, text):
    shown = text(patient(",,1.65,60"))
    assert "the body is a male's" in shown
    assert "healthy people of this speed at 40 years" in shown
    known = text(patient("F,40,1.65,60"))
    assert "the body is a male's" not in known
    assert "at 40 years" not in known


def test_a_child_is_shown_beside_children_at_their_free_speed(patient, text):
    child, adult = text(patient("M,9,1.35,30", speed="0.5")), text(patient("M,40,1.75,70"))
    assert "Grey: healthy children at their free speed" in child
    assert "differs from them for its speed alone" in child
    assert "Grey: healthy people of this speed and age, mean ± 2 SD" in adult
    assert "child" not in adult


def test_norms_of_other_speeds_are_called_so_or_left_out(patient, text):
    slow, usual = patient("F,40,1.65,60", speed="0.4"), patient("F,40,1.65,60")
    assert "healthy people of the nearest speed and age" in text(slow)
    for who, there in ((slow, False), (usual, True)):
        values = {row.name: row.norm for row in result_of(who, None).values}
        assert (values["stance_right"] is not None) is there


def test_each_angle_is_drawn_over_its_cycle_with_the_norm_of_two_sd():
    step = np.arange(101.0)
    names = page.PROFILE_ANGLES
    angles = {
        f"{name}_{side}": step + 10 * n + 100 * s
        for n, name in enumerate(names)
        for s, side in enumerate("rl")
    }
    norm = {name: (step + n, 1.0 + step / 100) for n, name in enumerate(names)}
    figure = figure_of(lambda: page.draw_angles(angles, norm))
    for axes, name in zip(figure.axes, names, strict=True):
        assert forward(axes)
        assert axes.get_title() == f"{page.TITLES[name]}, °"
        for side, colour in COLOURS.items():
            (line,) = lines(axes, colour)
            np.testing.assert_array_equal(line.T, [step, angles[f"{name}_{side[0]}"]])
        (band,) = bands(axes, BAND_COLOUR)
        mean, sd = norm[name]
        np.testing.assert_allclose(band.T, [step, mean - 2 * sd, mean + 2 * sd])
