"""Two people of whom a stride a side is known."""

from pathlib import Path

import pytest
from made_strides import stride_rows, write_strides

from gaitval.subjects.subject_file import load_subject


@pytest.fixture(scope="session")
def strides_table(tmp_path_factory) -> Path:
    """S05 as P1 without a change, and S02 as P2 with a stiff left knee."""
    path = tmp_path_factory.mktemp("strides") / "strides.csv"
    stiff = {"knee_angle_l": 8.0}
    rows = stride_rows("5", "well", "P1_off") + stride_rows("2", "ill", "P2", **stiff)
    return write_strides(path, rows)


@pytest.fixture(scope="session")
def people_table(tmp_path_factory) -> Path:
    """Their people, in the words of two laboratories."""
    path = tmp_path_factory.mktemp("people") / "people.csv"
    one, two = load_subject("5"), load_subject("2")
    path.write_text(
        "ID,Gender,Age,Height (cm),Weight (kg),Leg length (cm),OFF - UPDRS-III asymmetry,"
        "Amputation side\n"
        f"P1,{one.sex},{one.age_years},{100 * one.height_m},{one.mass_kg},"
        f"{100 * one.leg_length_m},Left,\n"
        f"P2,{two.sex},-,{100 * two.height_m},{two.mass_kg},,Undetermined,Right\n",
        encoding="utf-8",
    )
    return path
