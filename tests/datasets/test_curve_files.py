"""Subjects from anyone's mean curves, and what is said of curves that cannot be used."""

import re
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from gaitval.coordinates import SIDES
from gaitval.errors import (
    ConfigurationError,
    RecordError,
    RecordWarning,
    ScalingError,
    SubjectError,
)
from gaitval.subjects.curve_files import read_mean_curves
from gaitval.subjects.curve_subject import PersonDetails, add_trial, new_subject
from gaitval.subjects.curve_template import curve_template
from gaitval.subjects.gait_values import gait_values
from gaitval.subjects.subject_file import builtin_subjects, load_subject

PHASE = np.linspace(0.0, 1.0, 101)
PERSON = PersonDetails(64.95, 1.53, 0.8, "F", 31, ("thigh=0.35",), "mine", "CC BY 4.0")
TRIAL = {
    "name": "T05",
    "speed": 1.12,
    "stride_time": 1.05,
    "stance": None,
    "angle_unit": "deg",
}


def table(subject) -> pd.DataFrame:
    """The measured curves of a subject as a laboratory would export them."""
    record = subject.measured()
    columns = {f"angle_{n}": np.degrees(c(PHASE)) for n, c in record.angles.items()}
    columns |= {f"moment_{n}": c(PHASE) for n, c in record.moments.items()}
    for side in SIDES:
        force = record.ground_reaction(side, PHASE % 1.0)
        for axis, name in enumerate(("forward", "left", "up")):
            columns[f"force_{name}_{side[0]}"] = force[:, axis]
    return pd.DataFrame({"percent": 100 * PHASE, **columns})


@pytest.fixture(scope="module")
def good() -> pd.DataFrame:
    return table(load_subject("S05"))


SEPARATORS = {"semicolon": ";", "tab": "\t"}


def written(folder: Path, curves: pd.DataFrame, name: str = "curves.csv") -> Path:
    path = folder / name
    separator = next((c for word, c in SEPARATORS.items() if word in name), ",")
    decimal = "," if "comma" in name else "."
    encoding = "utf-16" if "unicode" in name else "utf-8"
    curves.to_csv(path, index=False, sep=separator, decimal=decimal, encoding=encoding)
    return path


@pytest.mark.parametrize("subject", builtin_subjects(), ids=lambda s: s.identifier)
def test_the_curves_of_every_built_in_person_are_read_as_they_were(subject, tmp_path):
    found = gait_values(read_mean_curves([written(tmp_path, table(subject))]), "here")
    assert found["left_phase"] == pytest.approx(subject.left_phase, abs=1e-3)
    assert found["mean_vertical_force"] == pytest.approx(subject.mean_vertical_force, abs=2e-3)
    assert found["stance_fraction"].left == pytest.approx(subject.stance_fraction.left, abs=5e-3)
    for name, curve in found["gait"].angles.items():
        expected = subject.gait.angles[name].periodic()(PHASE)
        np.testing.assert_allclose(curve.periodic()(PHASE), expected, atol=0.006)


@pytest.mark.parametrize(
    "name",
    ["curves.csv", "semicolon.csv", "tab.csv", "semicolon-comma.csv", "tab-comma-unicode.csv"],
)
def test_every_kind_of_csv_gives_the_same_curves(good, tmp_path, name):
    found = read_mean_curves([written(tmp_path, good, name)])
    np.testing.assert_allclose(np.degrees(found.angles["knee_angle_l"]), good.angle_knee_angle_l)
    np.testing.assert_allclose(found.forces["right"][:, 2], good.force_up_r)


def test_two_files_and_radians_and_means_and_other_columns(good, tmp_path):
    angles = good.filter(regex="^angle_").apply(np.radians)
    angles.columns = [f"{name}_mean" for name in angles.columns]
    angles["angle_knee_angle_r_band90"] = angles["angle_knee_angle_r_sd"] = 0.1
    angles["angle_knee_angle_r_sd"] = 0.1
    rest = good.drop(columns=[name for name in good if name.startswith("angle_")])
    found = read_mean_curves(
        [written(tmp_path, angles, "a.csv"), written(tmp_path, rest, "b.csv")], angle_unit="rad"
    )
    np.testing.assert_allclose(np.degrees(found.angles["knee_angle_l"]), good.angle_knee_angle_l)


def test_the_unit_in_the_name_of_a_column_counts(good, tmp_path):
    """The table of an import is read again as it is."""
    named = {
        name: f"{name}_mean_{dict(angle='rad', moment='nm_kg', force='bw')[name.split('_')[0]]}"
        for name in good
        if name != "percent"
    }
    angles = [name for name in good if name.startswith("angle_")]
    table = good.assign(**good[angles].apply(np.radians)).rename(columns=named)
    table["angle_knee_angle_r_sd_rad"] = table["angle_knee_angle_r_band90_rad"] = 0.1
    for unit in ("deg", "rad"):
        found = read_mean_curves([written(tmp_path, table)], angle_unit=unit)
        np.testing.assert_allclose(
            np.degrees(found.angles["knee_angle_l"]), good.angle_knee_angle_l
        )
        np.testing.assert_allclose(found.forces["right"][:, 2], good.force_up_r)
    wrong = table.rename(columns={"moment_knee_angle_r_mean_nm_kg": "moment_knee_angle_r_mean_bw"})
    with pytest.raises(RecordError, match="moment_knee_angle_r_mean_bw: 'BW' is no known unit"):
        read_mean_curves([written(tmp_path, wrong)])


def change(name, function):
    def apply(curves):
        return curves.assign(**{name: function(curves[name])})

    return apply


def every(kind, factor):
    return lambda curves: curves.assign(
        **{name: factor * curves[name] for name in curves if name.startswith(kind)}
    )


def test_weak_ankles_are_a_walkers(good, tmp_path):
    """A slow patient has 0.6 Nm/kg, and hardly any on the side of a weak calf."""
    weak = good.assign(
        **{name: 0.45 * good[name] for name in good if name.startswith("moment_")}
    ).assign(moment_ankle_angle_l=0.1 * good.moment_ankle_angle_l)
    assert read_mean_curves([written(tmp_path, weak)]).moments


def swapped(one, other):
    return lambda curves: curves.rename(columns={one: other, other: one})


def moved(curve, percent):
    """The curve of a cycle, that much later."""
    once = np.roll(np.asarray(curve)[:-1], percent)
    return np.append(once, once[0])


def later(percent):
    return lambda curves: curves.apply(lambda curve: moved(curve, percent)).assign(
        percent=curves.percent
    )


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda c: c.head(100), "its 100 rows are no gait cycle"),
        (lambda c: c.head(0), "no column of a curve"),
        (lambda c: pd.concat([c, c]), "its 202 rows are no gait cycle"),
        (lambda c: pd.concat([c, c.tail(1).assign(percent="mean")]), "its 102 rows are no"),
        (lambda c: c.assign(percent=np.roll(c.percent, 8)), "its 101 rows are no gait cycle"),
        (lambda c: c.assign(percent=c.percent / 1000), "its 101 rows are no gait cycle"),
        (lambda c: c.drop(columns="angle_hip_rotation_l"), "missing columns: angle_hip_rotation_l"),
        (lambda c: c.drop(columns="force_up_r"), "missing columns: force_up_r"),
        (lambda c: c.rename(columns={"angle_knee_angle_r": "angle_knee_angl_r"}),
         "angle_knee_angl_r: not the name of a curve"),
        (lambda c: c.rename(columns={n: f"{n} (Nm/(kg m))" for n in c if n.startswith("moment")}),
         "no known unit of a moment by mass .Nm/kg, Nmm/kg"),
        (change("angle_hip_adduction_r", lambda a: a.where(a.index != 40)), "a number in row 42"),
        (change("angle_knee_angle_r", lambda a: a.where(a.index != 39, -9999.0)),
         "not a number in row 41"),
        (change("angle_knee_angle_l", lambda a: 0.0 * a + 10.0), "the same in all rows"),
        (every("force_", 0.0), "force_up_r: the same in all rows"),
    ],
)  # fmt: skip
def test_a_table_that_is_none_is_refused(good, tmp_path, damage, message):
    with pytest.raises(RecordError, match=message):
        read_mean_curves([written(tmp_path, damage(good))])


def stretched(curves, until):
    """Rows of 0 to `until` % of the cycle, stretched over all."""
    rows = np.linspace(0.0, until, 101) % 100.0
    return curves.apply(lambda c: np.interp(rows, np.arange(101), c)).assign(percent=curves.percent)


def running(curves):
    percent = np.arange(101)
    squeezed = np.interp(percent, [0, 36, 100], [0, 61, 100])
    run = curves.apply(lambda c: np.interp(squeezed, percent, c))
    return run.assign(percent=curves.percent)


def of_side(side, kinds, function):
    return lambda curves: curves.assign(
        **{n: function(curves[n]) for n in curves if n.startswith(kinds) and n.endswith(f"_{side}")}
    )


def both(name, columns):
    return columns.assign(**{each: -columns[each] for each in (f"{name}_r", f"{name}_l")})


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (change("angle_knee_angle_r", np.negative), "Change the sign of angle_knee_angle_r: flex"),
        (change("angle_hip_flexion_l", np.negative), "Change the sign of angle_hip_flexion_l"),
        (change("moment_ankle_angle_r", np.negative), "the sign of moment_ankle_angle_r: moments"),
        (partial(both, "moment_hip_adduction"), "sign of moment_hip_adduction_r and"),
        (every("moment_", -1.0), "the sign of the moments: .* are internal"),
        (change("force_forward_r", np.negative), "Change the sign of force_forward_r"),
        (change("force_left_l", np.negative), "Change the sign of force_left_l"),
        (every("angle_", np.pi / 180), "the angles are in radians .* Give --angle-unit rad"),
        (change("angle_ankle_angle_r", np.radians), "ankle_angle_r is in radians .* in one unit"),
        (every("moment_", 1000), "the moments are in Nmm/kg .* Multiply them by 0.001"),
        (every("moment_", 65), "the moments are in Nm .* Divide by the body mass"),
        (every("moment_", 65e3), "the moments are in Nmm .* Divide by 1000 and by the body"),
        (every("moment_", 100 / 9.80665 / 1.53), "in % of body weight times height .* Multiply"),
        (every("force_", 100), "the forces are in % of body weight .* Multiply them by 0.01"),
        (every("force_", 40), "no walker's curves: not even if the forces are in % of body weight"),
        (change("force_up_l", lambda f: 9.8 * f), "force_up_l is in N/kg"),
        (lambda c: c.rename(columns={n: n[:-1] + {"r": "l", "l": "r"}[n[-1]] for n in c
                                     if n != "percent"}),
         "right and left are exchanged in all curves"),
        (of_side("l", ("angle", "moment", "force"), lambda c: moved(c, 50)),
         "all curves of the left side are over the other side's cycle, half a stride off"),
        (of_side("l", "moment", lambda c: moved(c, 50)), "the moments of the left side are over"),
        (later(7), "all curves are about 8 % of the cycle too late"),
        (lambda c: c.assign(**{n: moved(c[n], 7) for n in c if n.startswith("moment")}),
         "the moments are about 8 % of the cycle too late"),
        (later(39), "all curves are about 40 % of the cycle too late"),
        (lambda c: c.iloc[::-1].reset_index(drop=True).assign(percent=c.percent), "run backwards"),
        (lambda c: stretched(c, 61.0), "no walker's curves"),
        (lambda c: stretched(c, 200.0), "no walker's curves"),
        (lambda c: running(c), "no walker's curves"),
        (swapped("angle_hip_flexion_r", "angle_knee_angle_r"), "hip_flexion_r are exchanged"),
        (swapped("force_up_r", "force_forward_r"), "force_up_r and force_forward_r are exchanged"),
        (change("angle_ankle_angle_r", lambda a: a + 90.0), "from 90° in standing"),
        (change("angle_knee_angle_l", lambda a: 180.0 - a), "from 180° in standing"),
    ],
)  # fmt: skip
def test_curves_of_no_walker_are_refused_with_what_explains_them(good, tmp_path, damage, message):
    with pytest.raises(RecordError, match=message):
        read_mean_curves([written(tmp_path, damage(good))])


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (partial(both, "angle_hip_adduction"), "Change the sign of angle_hip_adduction_r and .*_l"),
        (partial(both, "angle_pelvis_list"), "Change the sign of angle_pelvis_list_r and"),
        (partial(both, "angle_foot_pitch"), "angle_foot_pitch_r and angle_foot_pitch_l have the"),
        (lambda c: c.assign(**{n: c[n] + 180.0 for n in c if "pelvis_rotation" in n}),
         "angle_pelvis_rotation_l are measured from 180°"),
        (change("angle_hip_flexion_l", lambda a: a + 20.0), "angle_hip_flexion_l has another zero"),
        (every("moment_hip_flexion", 0.0), "moment_hip_flexion_r, .* was not measured"),
        (lambda c: c.assign(**{f"{n[:-1]}l": c[n] for n in c if re.match("angle.*_r$", n)}),
         "one side is a copy of the other"),
    ],
)  # fmt: skip
def test_what_people_may_do_is_said_and_not_refused(good, tmp_path, damage, message):
    found = read_mean_curves([written(tmp_path, damage(good))]).warnings
    assert re.search(message, "; ".join(found)), found


def test_moments_without_forces_and_a_lacking_subtalar_angle_are_said(good, tmp_path):
    """As in every public table of norms."""
    lacking = [n for n in good if n.startswith("force_") or "subtalar" in n]
    found = read_mean_curves([written(tmp_path, good.drop(columns=lacking))])
    assert not found.moments
    assert "moment_knee_angle_r" in found.left_out
    assert "moments are not used" in found.in_words()
    assert "subtalar_angle_r and subtalar_angle_l are not in it" in found.in_words()
    others = [s.measured().angles["subtalar_angle_r"].mean for s in builtin_subjects()]
    others += [s.measured().angles["subtalar_angle_l"].mean for s in builtin_subjects()]
    assert found.angles["subtalar_angle_l"][:-1].mean() == pytest.approx(np.mean(others), abs=1e-6)


UNITS = {"angle": " (rad)", "moment": " [Nmm/kg]", "force": " (%BW)"}
FACTORS = {"angle": np.pi / 180, "moment": 1000.0, "force": 100.0}


def in_other_units(curves):
    return curves.assign(
        **{n: curves[n] * FACTORS[n.split("_")[0]] for n in curves if n != "percent"}
    )


def with_units(curves):
    names = {n: n + UNITS[n.split("_")[0]] for n in curves if n != "percent"}
    return in_other_units(curves).rename(columns=names)


def of_rows(count):
    def resampled(curves):
        rows = np.linspace(0.0, 100.0, count)
        return curves.apply(lambda c: pd.Series(np.interp(rows, np.arange(101), c)))

    return resampled


@pytest.mark.parametrize(
    ("change", "within"),
    [
        (with_units, 1e-6),
        (lambda c: c.rename(columns=lambda n: f" {n.title()} "), 1e-9),
        (lambda c: c.rename(columns=lambda n: re.sub("_r$", "_right", re.sub("_l$", "_left", n))),
         1e-9),
        (lambda c: c.assign(percent=c.percent / 100), 1e-9),
        (of_rows(201), 1e-6),
        (of_rows(51), 0.4),
    ],
    ids=["units", "capitals", "right and left", "0 to 1", "201 rows", "51 rows"],
)  # fmt: skip
def test_tables_as_others_write_them_have_the_same_curves(good, tmp_path, change, within):
    found = read_mean_curves([written(tmp_path, change(good))])
    knee = np.degrees(found.angles["knee_angle_l"])
    np.testing.assert_allclose(knee, good.angle_knee_angle_l, atol=within)
    np.testing.assert_allclose(found.moments["ankle_angle_r"], good.moment_ankle_angle_r, atol=0.05)
    np.testing.assert_allclose(found.forces["left"][:, 2], good.force_up_l, atol=0.05)


def test_a_workbook_that_is_called_csv_is_told(tmp_path):
    (tmp_path / "means.csv").write_bytes(b"PK\x03\x04" + bytes(range(256)))
    with pytest.raises(RecordError, match="a workbook of a spreadsheet"):
        read_mean_curves([tmp_path / "means.csv"])


def test_a_first_line_for_excel_is_passed_over(good, tmp_path):
    path = written(tmp_path, good, "semicolon.csv")
    path.write_text("sep=;\n" + path.read_text())
    assert read_mean_curves([path]).angles


@pytest.mark.parametrize("subject", builtin_subjects(), ids=lambda each: each.identifier)
def test_sound_curves_are_not_doubted(subject, tmp_path):
    warnings = read_mean_curves([written(tmp_path, table(subject))]).warnings
    # What the curves do not show is said, and is no doubt.
    assert [each for each in warnings if "do not show whether the sign" not in each] == []


def test_doubts_reach_the_user(good, tmp_path):
    path, message = written(tmp_path, both("angle_pelvis_list", good)), []
    new_subject([path], tmp_path / "a.toml", PERSON, **TRIAL, notify=message.append)
    assert any("Warning: it seems that angle_pelvis_list_r" in each for each in message)
    with pytest.warns(RecordWarning, match="angle_pelvis_list_r"):
        new_subject([path], tmp_path / "b.toml", PERSON, **TRIAL)


@pytest.mark.parametrize("strike", [0.32, 0.38, 0.45, 0.62, 0.7])
def test_unequal_steps_are_as_unequal_as_the_pelvis_shows(good, tmp_path, strike):
    """After a stroke a step may last twice the other (Patterson et al. 2008)."""
    percent = round(100 * (0.5 - strike))
    ours = {name: moved(good[name], percent) for name in good if re.search("pelvis.*_l$", name)}
    found = gait_values(read_mean_curves([written(tmp_path, good.assign(**ours))]), "here")
    assert found["left_phase"] == pytest.approx(strike, abs=0.01)


def test_a_left_foot_that_strikes_nowhere_is_refused(good, tmp_path):
    still = good.assign(**{name: 0.1 * good[name] for name in good if "pelvis" in name})
    ours = {name: moved(still[name], 40) for name in still if re.search("pelvis.*_l$", name)}
    with pytest.raises(RecordError, match="do not show when the left foot strikes"):
        gait_values(read_mean_curves([written(tmp_path, still.assign(**ours))]), "here")


def test_files_that_are_no_curves(tmp_path, good):
    with pytest.raises(RecordError, match="no such file"):
        read_mean_curves([tmp_path / "none.csv"])
    other = written(tmp_path, pd.DataFrame({"knee": [1, 2], "hip": [3, 4]}))
    with pytest.raises(RecordError, match=r"its columns are knee, hip\. Name them by kind"):
        read_mean_curves([other])
    twice = written(tmp_path, good, "a.csv"), written(tmp_path, good, "b.csv")
    with pytest.raises(RecordError, match=r"is there twice\. Give each curve once"):
        read_mean_curves(twice)


def test_a_new_subject_walks_without_kinetics_if_it_has_none(good, tmp_path):
    path = written(tmp_path, good.filter(regex="^angle_"))
    with pytest.raises(RecordError, match="Give --stance"):
        new_subject([path], tmp_path / "mine.toml", PERSON, **TRIAL)
    found = load_subject(
        new_subject([path], tmp_path / "mine.toml", PERSON, **TRIAL | {"stance": 0.61})
    )
    assert not found.has_kinetics
    assert found.tape == {"thigh": 0.35}
    assert (found.identifier, found.trial) == ("mine", "T05")
    with pytest.raises(ConfigurationError, match=r"exists\. Give another name"):
        new_subject([path], tmp_path / "mine.toml", PERSON, **TRIAL | {"stance": 0.61})


def test_a_further_trial_is_added_once_and_not_twice(good, tmp_path):
    first = new_subject([written(tmp_path, good)], tmp_path / "mine.toml", PERSON, **TRIAL)
    slow = written(tmp_path, table(load_subject("S05").on_trial("T03")), "slow.csv")
    message = TRIAL | {"speed": 0.78, "stride_time": 1.25, "name": "slow"}
    add_trial([slow], first, **message)
    found = load_subject(first)
    assert [trial.name for trial in found.trials] == ["slow"]
    assert found.on_trial("slow").record().speed == 0.78
    with pytest.raises(SubjectError, match="there is a trial slow already"):
        add_trial([slow], first, **message)
    with pytest.raises(SubjectError, match="the same curves as trial slow"):
        add_trial([slow], first, **message | {"name": "again"})
    assert load_subject(first) == found


def test_lengths_by_tape_in_centimetres_write_no_subject(good, tmp_path):
    person = PERSON._replace(tape=("thigh=35",))
    with pytest.raises(ScalingError, match="thigh = 35 m"):
        new_subject([written(tmp_path, good)], tmp_path / "own.toml", person, **TRIAL)
    assert not (tmp_path / "own.toml").exists()


def test_a_new_subject_needs_to_know_the_person(good, tmp_path):
    nobody = PERSON._replace(mass=None, sex=None)
    with pytest.raises(ConfigurationError, match="needs --mass, --sex too"):
        new_subject([written(tmp_path, good)], tmp_path / "mine.toml", nobody, **TRIAL)
    with pytest.raises(ConfigurationError, match=r"--tape thig=0\.4: not of the form"):
        new_subject(
            [written(tmp_path, good)], tmp_path / "m.toml", PERSON._replace(tape=["thig=0.4"]),
            **TRIAL,
        )  # fmt: skip


def test_the_files_of_wbds_are_read_as_they_are(gait_data, tmp_path):
    folder = gait_data / "wbds" / "processed"
    files = [folder / f"WBDS14walkT05{kind}.txt" for kind in ("ang", "knt")]
    found = load_subject(new_subject(files, tmp_path / "mine.toml", PERSON, **TRIAL))
    shipped = load_subject("S05")
    np.testing.assert_allclose(
        found.measured().moments["knee_angle_r"](PHASE),
        shipped.measured().moments["knee_angle_r"](PHASE),
        atol=1e-4,
    )
    with pytest.raises(RecordError, match=r"missing columns: .*angle_pelvis_tilt_r"):
        read_mean_curves([files[1]])


def test_the_template_may_come_back_from_a_spreadsheet(good, tmp_path):
    """With semicolons, decimal commas, quotes about notes that have a semicolon, an empty row."""
    lines = []
    for line in curve_template(load_subject("S05")).splitlines():
        if line.startswith("#"):
            lines.append(f'"{line}"' if ";" in line else line)
        else:
            lines.append(line.replace(",", ";").replace(".", ","))
    assert any(line.startswith('"#') for line in lines)
    path = tmp_path / "template.csv"
    empty = ";" * lines[-1].count(";")
    path.write_text("\r\n".join([*lines, empty]), encoding="utf-8-sig")
    plain = tmp_path / "plain.csv"
    plain.write_text(curve_template(load_subject("S05")))
    found, expected = (read_mean_curves([each]) for each in (path, plain))
    assert expected.left_out == ("percent",)
    assert len(expected.angles) == 30
    for name in expected.angles:
        np.testing.assert_array_equal(found.angles[name], expected.angles[name])
        np.testing.assert_allclose(np.degrees(found.angles[name]), good[f"angle_{name}"], atol=0.06)
    np.testing.assert_array_equal(found.forces["left"], expected.forces["left"])


def test_a_row_that_is_empty_is_a_gap_and_not_passed_over(good, tmp_path):
    path = written(tmp_path, good)
    lines = path.read_text().splitlines()
    lines[41] = "," * lines[41].count(",")
    path.write_text("\n".join(lines))
    with pytest.raises(RecordError, match="no gait cycle"):
        read_mean_curves([path])


def test_what_was_read_is_said(good, tmp_path):
    messages = []
    more = good.assign(note=1.0, angle_knee_angle_r_sd=2.0)
    files = [written(tmp_path, more)]
    new_subject(files, tmp_path / "mine.toml", PERSON, **TRIAL | {"notify": messages.append})
    sentence, who = messages
    assert 'Assumed: person "mine", the name of the subject; laboratory "own"' in who
    assert "right and left, 30 angles, 18 moments (Nm/kg), 6 forces (body weights)" in sentence
    assert "left out: percent, note, angle_knee_angle_r_sd; angles in degrees" in sentence
    kinematic = good[[name for name in good if not name.startswith(("moment", "force"))]]
    assert (
        "no moments, no forces"
        in read_mean_curves([written(tmp_path, kinematic, "angles.csv")]).in_words()
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[x]\ny = 1, 2\nz = [1, 2, 3]\n", "no column of a curve"),
        ("\udcff\udcab", "not UTF-8 text"),
    ],
)
def test_a_file_that_is_no_table_is_refused_in_plain_words(tmp_path, text, message):
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(RecordError, match=message):
        read_mean_curves([path])
