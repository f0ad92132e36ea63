"""Subjects: the built-in table, the round trip, and every refusal with its hint."""

import math
import re
import tomllib

import numpy as np
import pytest
from pydantic import ValidationError

from gaitval.errors import SubjectError
from gaitval.gait.record import ANGLE_NAMES, MOMENT_NAMES, REQUIRED_ANGLES, LowPass
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.plausible import unusual_build, value_problems
from gaitval.subjects.subject import Subject, make_subject
from gaitval.subjects.subject_file import BUILTIN, builtin_subjects, load_subject, parse_subject

TEXT = load_subject("S05").to_toml()


def changed(**values):
    """The tables of S05 with some keys replaced; None removes a key."""
    tables = tomllib.loads(TEXT) | values
    return {key: value for key, value in tables.items() if value is not None}


def refusal(tables):
    with pytest.raises(SubjectError) as error:
        make_subject(tables, "mine.toml")
    assert str(error.value).startswith("mine.toml: ")
    return str(error.value)


def test_the_ten_subjects():
    subjects = builtin_subjects()
    assert [subject.identifier for subject in subjects] == list(BUILTIN)
    assert [(subject.person, subject.trial) for subject in subjects] == list(BUILTIN.values())
    assert "".join(subject.sex for subject in subjects) == "MFFMFMFMFM"
    five = subjects[4]
    assert (five.mass_kg, five.height_m, five.leg_length_m) == (64.95, 1.53, 0.8)
    assert (five.walking_speed_m_s, five.stride_time_s) == (1.12, 1.05)
    assert five.paper is not None
    assert (five.paper.mass_kg, five.paper.height_m) == (153, 0.64)
    assert all(subject.licence == "CC BY 4.0" for subject in subjects)


@pytest.mark.parametrize("name", [5, "5", "05", "S05", "s5", "WBDS14", "wbds14"])
def test_names_of_a_built_in_subject(name):
    assert load_subject(name).identifier == "S05"


def test_a_subject_from_a_path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(TEXT)
    assert load_subject(path) == load_subject(str(path)) == load_subject(5)


@pytest.mark.parametrize("name", ["mine", "some/mine"])
def test_the_folder_of_a_run_is_refused_with_the_file_in_it(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).mkdir(parents=True)
    (tmp_path / name / "subject.toml").write_text(TEXT)
    with pytest.raises(SubjectError, match=f"{name}/subject.toml"):
        load_subject(name)


@pytest.mark.parametrize("name", ["11", "S00", "14", "WBDS03", "five", ""])
def test_unknown_names_list_the_valid_ones(name):
    with pytest.raises(SubjectError, match=r"S05 \(WBDS14\)"):
        load_subject(name)


def test_record_has_every_curve_of_the_convention():
    record = load_subject(5).record()
    assert set(record.angles) == set(ANGLE_NAMES)
    assert set(record.moments) == set(MOMENT_NAMES)
    assert record.ground_reaction("left", np.linspace(0, 1, 7)).shape == (7, 3)
    assert record.speed == 1.12
    assert record.stance_fraction["right"] == pytest.approx(0.608, abs=1e-3)


@pytest.mark.parametrize("subject", builtin_subjects(), ids=lambda subject: subject.identifier)
def test_toml_round_trip(subject):
    text = subject.to_toml()
    assert parse_subject(text, "again") == subject
    assert parse_subject(text, "again").to_toml() == text
    assert len(text) < 25_000 * (1 + len(subject.trials))


def test_markers_and_the_paper_s_values_may_be_absent():
    subject = make_subject(changed(markers=None, paper=None), "mine")
    assert subject.markers == {}
    assert parse_subject(subject.to_toml(), "again") == subject


@pytest.mark.parametrize("side", ["none", "right", "left"])
def test_a_prosthesis_is_kept_and_said(side):
    subject = make_subject(changed(prosthesis=side), "mine")
    assert subject.prosthesis == side
    assert parse_subject(subject.to_toml(), "again") == subject
    assert subject.title().endswith(f", prosthesis: {side}")


def test_a_file_that_says_nothing_of_a_prosthesis_is_written_as_before():
    assert load_subject("S05").prosthesis is None
    assert "prosthesis" not in TEXT + load_subject("S05").title()
    assert "prosthesis = 'both'" in refusal(changed(prosthesis="both"))


@pytest.mark.parametrize(
    "values",
    [
        {"age_years": 2, "mass_kg": 12, "height_m": 0.86, "leg_length_m": 0.36},
        {"age_years": 7, "mass_kg": 14.5, "height_m": 1.15, "leg_length_m": 0.56},
        {"left_phase": 0.2, "stance_fraction": {"right": 0.42, "left": 0.88}},
        {"walking_speed_m_s": 0.12, "stride_time_s": 3.2},
        {"aid": "crutches", "mean_vertical_force": 0.55},
    ],
)
def test_nobody_is_refused_for_who_they_are(values):
    subject = make_subject(changed(**values), "mine")
    assert parse_subject(subject.to_toml(), "again") == subject
    message = f", aid: {subject.aid}" if subject.aid else ""
    assert subject.title().endswith(f"({subject.source}){message}")


def test_only_an_aid_explains_a_missing_weight():
    message = refusal(changed(mean_vertical_force=0.55, mass_kg=60.0))
    assert "mean_vertical_force = 0.55" in message
    assert "mean_vertical_force = 1.3" in refusal(changed(mean_vertical_force=1.3, aid="rail"))
    assert "aid = 'dog'" in refusal(changed(aid="dog"))


@pytest.mark.parametrize(
    ("values", "hints"),
    [
        ({"mass_kg": 1.53, "height_m": 64.95}, ["mass_kg = 1.53: outside", "height_m = 64.95"]),
        ({"mass_kg": 153, "height_m": 0.64}, ["height_m = 0.64: outside the plausible 0.8-2.3"]),
        ({"height_m": 153}, ["height_m = 153: this looks like centimetres", "height_m = 1.53"]),
        ({"mass_kg": 165, "height_m": 1.42}, ["the body mass index is 81.8", "their units"]),
        ({"height_m": 5.02}, ["height_m = 5.02: this looks like feet", "1.530"]),
        ({"height_m": 60.24}, ["height_m = 60.24: this looks like inches", "1.53"]),
        ({"height_m": 1530}, ["height_m = 1530: this looks like millimetres", "1.53"]),
        ({"mass_kg": 637}, ["mass_kg = 637: this looks like newtons", "mass_kg = 64.9"]),
        ({"mass_kg": 20}, ["body mass index is 8.5", "outside 10-80"]),
        ({"mass_kg": -64.95}, ["mass_kg = -64.95: outside the plausible 10-200"]),
        ({"mass_kg": 0, "height_m": 0}, ["mass_kg = 0: outside", "height_m = 0: outside"]),
        ({"leg_length_m": 80}, ["leg_length_m = 80: this looks like centimetres"]),
        ({"leg_length_m": 1.2}, ["0.78 of height_m = 1.53, outside 0.38-0.6"]),
        ({"age_years": 372}, ["age_years = 372: this looks like months", "age_years = 31"]),
        ({"age_years": 1.5}, ["age_years = 1.5: outside the plausible 2-105 years"]),
        ({"walking_speed_m_s": 4.03}, ["this looks like km/h"]),
        (
            {"walking_speed_m_s": 112.0},
            ["this looks like cm/s; give m/s: walking_speed_m_s = 1.12"],
        ),
        ({"stride_time_s": 0.52}, ["this looks like the time of a step. A stride is two"]),
        ({"stride_time_s": 1050}, ["this looks like milliseconds"]),
        ({"left_phase": 49.9}, ["this looks like per cent"]),
        ({"left_phase": 0.0}, ["left_phase = 0: outside"]),
        ({"mean_vertical_force": 9.42}, ["this looks like N/kg"]),
        ({"stance_fraction": {"right": 60.8, "left": 0.61}}, ["stance_fraction.right = 60.8"]),
        ({"mass_kg": math.nan}, ["mass_kg = nan: Input should be a finite number"]),
        ({"mass_kg": "64.95"}, ["mass_kg = '64.95': Input should be a valid number"]),
        ({"sex": "female"}, ["sex = 'female': Input should be 'F' or 'M'"]),
        ({"identifier": "../S05"}, ["identifier = '../S05'"]),
        ({"leg_length_m": None, "leg_lenght_m": 0.8}, ["1 problem\n", "did you mean leg_length_m"]),
        ({"colour": "blue"}, ["colour: unknown key. Remove it"]),
        ({"gait": None}, ["gait: missing"]),
        ({"left_phase_from_force": 49.8}, ["left_phase_from_force = 49.8"]),
        ({"plates": {"scale_sd": 5.0}}, ["plates.scale_sd = 5"]),
        ({"plates": {"shift_left_sd": 3.6}}, ["plates.shift_left_sd = 3.6"]),
        ({"person": "Ann\x00a"}, ["person: ", "letter 4 is '\\x00'"]),
        ({"laboratory": "Lab\x7f"}, ["laboratory: ", "letter 4 is '\\x7f'"]),
        ({"licence": "CC\ud800"}, ["licence: ", "'\\ud800'"]),
        ({"source": "T05\u202e50T"}, ["source: ", "'\\u202e'"]),
    ],
)
def test_refused_with_a_hint(values, hints):
    message = refusal(changed(**values))
    for hint in hints:
        assert hint in message


def test_a_text_over_several_lines_is_one_line():
    subject = make_subject(changed(citation="Ann, Bo,\n  Cy (2020)\tGait"), "mine")
    assert subject.citation == "Ann, Bo, Cy (2020) Gait"
    assert parse_subject(subject.to_toml(), "again") == subject


def test_every_problem_is_listed():
    message = refusal(
        changed(height_m=153, sex="x", leg_length_m=None, wieght=3, walking_speed_m_s=4.03)
    )
    assert "5 problems" in message
    for part in ("height_m = 153", "sex = 'x'", "leg_length_m: missing", "wieght", "km/h"):
        assert part in message


def edited(change):
    tables = tomllib.loads(TEXT)
    change(tables)
    return tables


def scaled(curve, factor):
    curve["mean"] *= factor
    for part in ("cosine", "sine"):
        curve[part] = [factor * x for x in curve[part]]


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        (lambda t: t["markers"].update({"R.ASSI": [0, 0, 0]}), "R.ASSI.*did you mean R.ASIS"),
        (lambda t: t["markers"].update({"R.ASIS": [0, 0]}), r"markers.R.ASIS.2: missing"),
        (lambda t: scaled(t["gait"]["angles"]["knee_angle_r"], 57.3), "Check the unit"),
        (lambda t: scaled(t["gait"]["moments"]["ankle_angle_l"], 65), "Check the unit"),
        (lambda t: t["gait"]["angles"].pop("knee_angle_r"), "gait.angles: missing: knee_angle_r"),
        (lambda t: t["gait"]["moments"].pop("knee_angle_r"), "gait.moments: missing: knee_angle_r"),
        (
            lambda t: t["gait"]["angles"]["knee_angle_r"]["sine"].pop(),
            r"gait.angles.knee_angle_r: \d+ cosine but \d+ sine coefficients",
        ),
        (
            lambda t: t["gait"]["angles"].update(
                {"knee_angel_r": t["gait"]["angles"].pop("knee_angle_r")}
            ),
            "knee_angel_r: unknown key, did you mean knee_angle_r",
        ),
    ],
)
def test_markers_and_curves_are_refused_with_a_hint(change, hint):
    assert re.search(hint, refusal(edited(change)))


def test_construction_in_python_is_checked_too():
    with pytest.raises(ValidationError, match=r"height_m = 0\.64: outside"):
        Subject.model_validate(changed(mass_kg=153, height_m=0.64))


def test_files_that_are_not_there_or_not_toml(tmp_path):
    with pytest.raises(SubjectError, match="no such file"):
        load_subject(tmp_path / "nobody.toml")
    with pytest.raises(SubjectError, match="is a folder"):
        load_subject(tmp_path)
    path = tmp_path / "mine.toml"
    path.write_text(TEXT[:-100])
    with pytest.raises(SubjectError, match=r"not valid TOML: .*line \d+|end of document"):
        load_subject(path)
    path.write_bytes(b"\xff\xab")
    with pytest.raises(SubjectError, match="not UTF-8"):
        load_subject(path)


def test_what_a_laboratory_does_not_measure_may_be_left_out(tmp_path):
    gait = tomllib.loads(TEXT)["gait"]
    for name in set(gait["angles"]) - set(REQUIRED_ANGLES):
        del gait["angles"][name]
    subject = make_subject(changed(gait=gait, age_years=None), "mine.toml")
    file = tmp_path / "mine.toml"
    file.write_text(subject.to_toml())
    assert load_subject(file) == subject
    assert set(subject.record().angles) == set(REQUIRED_ANGLES)
    del gait["angles"]["knee_angle_l"]
    assert "missing: knee_angle_l" in refusal(changed(gait=gait))


def test_the_filter_of_the_record_is_kept(tmp_path):
    assert load_subject(5).record().low_pass is None
    filters = {"moments_hz": 8.0, "forces_hz": 20.0}
    file = tmp_path / "mine.toml"
    file.write_text(make_subject(changed(low_pass=filters), "mine.toml").to_toml())
    assert load_subject(file).record().low_pass == LowPass(8.0, 20.0)
    assert "moments_hz" in refusal(changed(low_pass=filters | {"moments_hz": 0.0}))


def test_lengths_by_tape_measure_scale_a_subject_without_markers(tmp_path):
    taped = changed(markers=None, tape={"thigh": 0.40, "shank": 0.37})
    file = tmp_path / "taped.toml"
    file.write_text(make_subject(taped, "taped.toml").to_toml())
    body = scale_subject(load_subject(file))
    assert body.model["shank_r"].joint_position[2] == pytest.approx(-0.40)
    assert body.model["foot_l"].joint_position[2] == pytest.approx(-0.37)
    rows = {row.segment: row.source for row in body.table}
    assert rows["thigh"].startswith("tape")
    assert rows["foot"].startswith("stature")
    assert "did you mean shank?" in refusal(changed(markers=None, tape={"shnk": 0.37}))


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ((130.0, 1.60, 40.0), ["body mass index of 51"]),
        ((15.5, 0.95, None), ["no age was given"]),
        ((22.0, 1.10, 72.0), ["72 years old", "age"]),  # months
        ((15.5, 0.95, 4.0), []),
        ((64.0, 1.53, 6.0), ["6 years old", "0.983 to 1.28 m"]),
        ((45.0, 1.53, 10.0), []),
        ((75.0, 1.50, 10.0), []),  # 33 kg/m²
        ((70.0, 1.30, 8.0), ["index of 41", "mass, stature and age"]),
        ((70.0, 1.30, 14.0), []),
        ((30.0, 1.20, 15.0), ["15 years old", "1.3 to 2.3 m"]),
        ((90.0, 1.95, 15.0), []),
        ((27.0, 1.42, 30.0), ["30 years old", "index of 13"]),
        ((27.0, 1.42, None), ["no age was given"]),
        ((27.0, 1.42, 11.0), []),
        ((45.0, 1.70, 30.0), []),
        ((75.0, 1.75, None), []),
    ],
)
def test_unusual_bodies_are_taken_with_a_word(
    body: tuple[float, float, float | None], words: list[str]
) -> None:
    """Nobody is refused for who they are."""
    assert value_problems(dict(zip(("mass_kg", "height_m"), body, strict=False))) == []
    message = " ".join(str(each) for each in unusual_build(*body))
    assert all(each in message for each in words)
    assert bool(message) == bool(words)


def test_a_trial_is_not_there_a_second_time_under_another_name():
    """It would be known where it is held out."""
    person = load_subject("S05")
    copied = person.trials[0].model_copy(update={"name": "T03b"})
    tables = person.model_dump() | {"trials": [*person.trials, copied]}
    with pytest.raises(ValidationError, match=r"T03b has the same curves as T03\. .*leave it out"):
        Subject.model_validate(tables)
    own = person.as_trial().model_copy(update={"name": "again"})
    with pytest.raises(ValidationError, match="again has the same curves as T05"):
        Subject.model_validate(person.model_dump() | {"trials": [own]})


def test_what_is_changed_in_a_subject_stays_there():
    """A loop over "what if this marker were off" must not change the built-in person."""
    one = load_subject("S05")
    before = load_subject("S05").to_toml()
    one.markers["R.Knee"] = (9.0, 9.0, 9.0)
    one.gait.angles.clear()
    assert load_subject("S05").to_toml() == before
