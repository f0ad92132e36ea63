"""What the files know of a person, and what the user says."""

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from gaitval.errors import RecordError, SubjectError
from gaitval.mocap.c3d_person import read_person
from gaitval.session.importing.person import person_of_session
from gaitval.session.request import ImportOptions

PLUG_IN_GAIT = {
    "Bodymass": 32.1, "Height": 1450.0, "RKneeWidth": 84.0, "LKneeWidth": 83.0,
    "RAnkleWidth": 62.0, "LAnkleWidth": 61.0, "RLegLength": 740.0, "LLegLength": 742.0,
    "RElbowWidth": 67.0,
}  # fmt: skip


def c3d(path: Path, values: dict[str, float]) -> Path:
    """A file with one marker and these measurements of a person."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["LASI"]
    file["data"]["points"] = np.ones((4, 1, 3))
    for name, value in values.items():
        file.add_parameter("PROCESSING", name, [value])
    file.add_parameter("SUBJECTS", "NAMES", ["HC002D"])
    file.add_parameter("MANUFACTURER", "SOFTWARE", ["Vicon Nexus"])
    file.write(str(path))
    return path


def found(files, *, mass=None, height=None, sex="F", message=None, static=None, **widths):
    def notify(step, text):
        assert step == "person"
        if message is not None:
            message.append(text)

    given = {f"{joint}_width": width for joint, width in widths.items()}
    options = ImportOptions(
        trials=files or [Path("none.trc")],
        static=static,
        mass=mass,
        height=height,
        sex=sex,
        **given,
    )
    return person_of_session(options, notify)


def test_a_file_of_plug_in_gait_knows_the_person(tmp_path):
    facts = read_person(c3d(tmp_path / "a.c3d", PLUG_IN_GAIT))
    assert facts.mass_kg == pytest.approx(32.1)
    assert facts.height_m == pytest.approx(1.45)
    assert facts.knee_width_m == pytest.approx((0.084, 0.083))
    assert facts.ankle_width_m == pytest.approx((0.062, 0.061))
    assert facts.elbow_width_m[1] is None
    assert (facts.name, facts.system) == ("HC002D", "Vicon Nexus")


QUALISYS = {
    "NAMES": "2761", "SEX": "F", "AGE": "10", "A_BodyMass_kg": "35", "A_Height_mm": "1430",
    "A_InterAsisDistance_mm": "210", "A_Right_LegLength_mm": "710", "A_Left_LegLength_mm": "730",
    "A_Right_KneeWidth_mm": "95", "A_Left_KneeWidth_mm": "96", "A_Right_AnkleWidth_mm": "_",
}  # fmt: skip


def test_qualisys_and_luxembourg_know_the_person_too(tmp_path):
    for number, of_group in enumerate((QUALISYS, {})):
        path = c3d(tmp_path / f"{number}.c3d", {})
        file = ezc3d.c3d(str(path))
        for name, value in of_group.items():
            file.add_parameter("SUBJECTS", name, [value])
        if not of_group:
            file.add_parameter("SUBJECT", "LABELS", ["age", "gender", "weight", "height"])
            file.add_parameter("SUBJECT", "VALUES", [10.0, 1.0, 35.0, 1.43])
        file.write(str(path))
        facts = read_person(path)
        assert facts.mass_kg == pytest.approx(35.0)
        assert facts.height_m == pytest.approx(1.43)
        assert facts.age_years == pytest.approx(10.0)
        if of_group:
            assert facts.knee_width_m == pytest.approx((0.095, 0.096))
            assert facts.ankle_width_m == (None, None)
            assert found([path]).age == pytest.approx(10.0)


def test_an_age_that_cannot_be_is_refused_before_any_work():
    options = ImportOptions(trials=[Path("none.trc")], mass=60, height=1.7, sex="F", age=1.0)
    with pytest.raises(SubjectError, match="--age 1: outside the plausible 2-105 years"):
        person_of_session(options, lambda *_: None)


def test_cortex_writes_its_name_in_small_letters(tmp_path):
    path = c3d(tmp_path / "a.c3d", {})
    file = ezc3d.c3d(str(path))
    del file["parameters"]["MANUFACTURER"]["SOFTWARE"]
    file.add_parameter("MANUFACTURER", "Software", ["Cortex"])
    file.write(str(path))
    assert read_person(path).system == "Cortex"


@pytest.mark.parametrize("value", [0.0, -5.0, 1e9])
def test_what_was_not_measured_is_not_known(tmp_path, value):
    facts = read_person(c3d(tmp_path / "a.c3d", dict.fromkeys(PLUG_IN_GAIT, value)))
    assert facts.mass_kg is None
    assert facts.height_m is None
    assert facts.knee_width_m == (None, None)


def test_the_file_stands_in_for_what_is_not_said(tmp_path):
    messages: list[str] = []
    person = found([c3d(tmp_path / "a.c3d", PLUG_IN_GAIT)], message=messages)
    assert person.mass == pytest.approx(32.1)
    assert person.height == pytest.approx(1.45)
    assert person.knee_width == pytest.approx((0.084, 0.083))
    assert person.elbow_width is None  # one side only
    assert any("--mass 32.1 kg: from" in text for text in messages)
    assert messages[0].endswith("a.c3d: HC002D, made by Vicon Nexus")


def test_the_user_wins_and_is_told_of_a_contradiction(tmp_path):
    messages: list[str] = []
    path = c3d(tmp_path / "a.c3d", PLUG_IN_GAIT)
    person = found([path], mass=33.5, height=1.451, knee=0.1, message=messages)
    assert (person.mass, person.height, person.knee_width) == (33.5, 1.451, 0.1)
    assert any("says 32.1 kg; --mass 33.5 is used" in text for text in messages)
    assert any("says 0.084,0.083 m; --knee-width 0.1 is used" in text for text in messages)
    assert not any("--height" in text for text in messages)  # they agree to a millimetre


def test_what_nobody_says_is_asked_for(tmp_path):
    path = c3d(tmp_path / "a.c3d", {"Bodymass": 70.0})
    with pytest.raises(SubjectError, match=r"no --height \(m\), and no file of the session"):
        found([path])
    (tmp_path / "a.trc").touch()
    with pytest.raises(SubjectError, match=r"--mass \(kg\) and no --height \(m\)"):
        found([tmp_path / "a.trc"])


def test_a_file_that_is_not_there_is_no_question_about_the_person():
    with pytest.raises(RecordError, match=r"none\.trc: no such file"):
        found([])


@pytest.mark.parametrize(
    ("values", "match"),
    [
        ({"mass": 700.0}, "--mass 700"),
        ({"height": 172.5}, "centimetres"),
        ({"sex": "male"}, "--sex male: give F or M"),
    ],
)
def test_what_cannot_be_is_refused_before_a_file_is_read(tmp_path, values, match):
    damaged = tmp_path / "a.c3d"
    damaged.write_bytes(b"not C3D")
    with pytest.raises(SubjectError, match=match):
        found([damaged], **values)


@pytest.mark.parametrize(
    ("name", "system", "expected"),
    [
        ("HC002D", "Vicon Nexus", ("HC002D", "a.c3d")),
        ("IORlower_ISB", "Cortex", ("", "")),  # the name of its marker set
        ("New Patient", "Vicon Nexus", ("", "")),
    ],
)
def test_a_name_that_everybody_in_a_laboratory_has_names_nobody(tmp_path, name, system, expected):
    path = c3d(tmp_path / "a.c3d", PLUG_IN_GAIT)
    file = ezc3d.c3d(str(path))
    file.add_parameter("SUBJECTS", "NAMES", [name])
    file.add_parameter("MANUFACTURER", "SOFTWARE", [system])
    file.write(str(path))
    assert found([path]).recorded_name == expected


def test_a_damaged_file_beside_a_sound_one_is_no_reason_to_stop(tmp_path):
    """What is wrong with it is said when its trial is read, and the others are used."""
    sound, damaged = c3d(tmp_path / "a.c3d", PLUG_IN_GAIT), tmp_path / "b.c3d"
    damaged.write_bytes(sound.read_bytes()[:700])
    assert found([sound, damaged]).mass == read_person(sound).mass_kg
    with pytest.raises(RecordError, match=r"b\.c3d"):
        found([damaged])
