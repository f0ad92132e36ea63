"""The unit of other people's numbers: by the word of a header, and by their size."""

import math

import pytest

from gaitval import units
from gaitval.errors import RecordError
from gaitval.units import confused, stated_factor, unit_of


@pytest.mark.parametrize(
    ("quantity", "words", "factor"),
    [
        (units.LENGTH, "mm Millimeters millimetre", 1e-3),
        (units.LENGTH, "cm Centimeters", 1e-2),
        (units.LENGTH, "m metres Meter mete", 1.0),
        (units.LENGTH, "in Inches", 0.0254),
        (units.LENGTH, "ft feet foot", 0.3048),
        (units.FORCE, "N newtons nt", 1.0),
        (units.FORCE, "kN", 1e3),
        (units.MOMENT, "Nm N.m N·m NewtonMeters", 1.0),
        (units.MOMENT, "Nmm N.mm N*mm N-mm ntmm", 1e-3),
        (units.MOMENT, "Ncm", 1e-2),
        (units.MOMENT, "kNm", 1e3),
        (units.TIME, "s seconds sec", 1.0),
        (units.TIME, "ms milliseconds", 1e-3),
        (units.ANGLE, "rad radians", 1.0),
        (units.ANGLE, "deg Degrees °", math.pi / 180.0),
        (units.MOMENT_PER_MASS, "Nm/kg Nm·kg⁻¹ Nmkg-1 (Nm/kg)", 1.0),
        (units.MOMENT_PER_MASS, "Nmm/kg", 1e-3),
        (units.FORCE_PER_WEIGHT, "BW xBW N/N bodyweights", 1.0),
        (units.FORCE_PER_WEIGHT, "%BW %BodyWeight", 1e-2),
        (units.FORCE_PER_WEIGHT, "N/kg", 1.0 / 9.80665),
        (units.WALKING_SPEED, "m/s", 1.0),
        (units.WALKING_SPEED, "km/h", 1.0 / 3.6),
    ],
)
def test_a_word_of_a_header_is_known_in_every_spelling(quantity, words, factor):
    for word in words.split():
        assert stated_factor("file", quantity, word) == pytest.approx(factor, rel=1e-9)


@pytest.mark.parametrize(
    ("word", "match"), [("furlong", "'furlong' is no known unit of a length"), ("", "no unit")]
)
def test_a_word_that_is_unknown_or_missing_is_refused(word, match):
    with pytest.raises(RecordError, match=f"line 3: {match}"):
        stated_factor("line 3", units.LENGTH, word)


@pytest.mark.parametrize(
    ("quantity", "size", "candidates"),
    [
        (units.SPREAD, 1.65, "metres"),
        (units.SPREAD, 165.0, "centimetres"),
        (units.SPREAD, 1650.0, "millimetres"),
        (units.SPREAD, 65.0, "centimetres|inches"),
        (units.STATURE, 1.53, "metres"),
        (units.STATURE, 153.0, "centimetres"),
        (units.STATURE, 5.02, "feet"),
        (units.STATURE, 60.24, "inches"),
        (units.BODY_MASS, 64.95, "kilograms|pounds"),
        (units.BODY_MASS, 637.0, "newtons"),
        (units.BODY_MASS, 64950.0, "grams"),
        (units.AGE, 372.0, "months"),
        (units.WALKING_SPEED, 1.12, "m/s|km/h"),
        (units.WALKING_SPEED, 4.03, "km/h"),
        (units.WALKING_SPEED, 112.0, "cm/s|mm/s"),
        (units.STRIDE_TIME, 1050.0, "milliseconds"),
        (units.LEFT_PHASE, 49.9, "per cent"),
        (units.STANCE, 0.62, "of the whole"),
        (units.JOINT_SWING, 60.0, "degrees"),
        (units.JOINT_SWING, 1.05, "radians"),
        (units.ANKLE_MOMENT, 1.5, "Nm/kg"),
        (units.ANKLE_MOMENT, 1500.0, "Nmm/kg"),
        (units.ANKLE_MOMENT, 100.0, "Nm"),
        (units.ANKLE_MOMENT, 1e5, "Nmm"),
        (units.ANKLE_MOMENT, 9.0, "% of body weight times height"),
        (units.VERTICAL_FORCE, 1.1, "body weights"),
        (units.VERTICAL_FORCE, 110.0, "% of body weight"),
        (units.VERTICAL_FORCE, 640.0, "N"),
        (units.VERTICAL_FORCE, 10.5, "N/kg"),
        (units.MEAN_FORCE, 9.42, "N/kg"),
        (units.STATURE, 1e7, ""),
    ],
)
def test_the_size_of_numbers_shows_their_unit_the_likeliest_first(quantity, size, candidates):
    found = unit_of(quantity, size=size)
    names = [unit.name for unit in found.candidates]
    assert names == [name for name in candidates.split("|") if name]
    assert found.unit == (found.candidates[0] if len(names) == 1 else None)


def test_a_stated_unit_that_the_numbers_contradict_is_not_taken():
    found = unit_of(units.STATURE, "m", size=153.0)
    assert found.unit is None
    assert found.sentence == "this looks like centimetres (1.53 metres)"
    assert unit_of(units.STATURE, "cm", size=153.0).unit.factor == 1e-2
    of_two = unit_of(units.WALKING_SPEED, "m/s", size=112.0)
    assert of_two.sentence == "this looks like cm/s (1.12 m/s) or mm/s (0.112 m/s)"
    by_mass = unit_of(units.ANKLE_MOMENT, "Nm/kg", size=100.0)
    assert by_mass.sentence == "this looks like Nm (divide by the body mass in kg)"
    assert "0.8 to 2.3 metres of a stature" in unit_of(units.STATURE, "m", size=1e7).sentence


@pytest.mark.parametrize(
    ("size", "words"),
    [
        (1650.0, "millimetres that are called metres"),
        (1.65e-3, "metres that are called millimetres"),
        (165.0, "centimetres that are called metres"),
        (16.5, "millimetres that are called centimetres"),
        (0.16, "centimetres that are called millimetres"),
        (0.04, "inches that are called millimetres"),
        (1.65, ""),
        (1e9, ""),
    ],
)
def test_units_that_were_taken_for_each_other_are_named(size, words):
    assert confused(units.SPREAD, size) == words
