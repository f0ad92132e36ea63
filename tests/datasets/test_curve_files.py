"""Subjects from anyone's mean curves, and what is said of curves that cannot be used."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from gaitval.coordinates import SIDES
from gaitval.datasets.curve_files import read_mean_curves
from gaitval.datasets.curve_subject import PersonDetails, add_trial, new_subject
from gaitval.datasets.curve_template import curve_template
from gaitval.datasets.gait_values import gait_values
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.errors import (
    ConfigurationError,
    RecordError,
    RecordWarning,
    ScalingError,
    SubjectError,
)

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
    with pytest.raises(RecordError, match="moment_knee_angle_r_mean_bw: the unit 'BW'"):
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
        (lambda c: c.head(100), "100 rows of data, but there must be 101"),
        (lambda c: c.drop(columns="angle_hip_rotation_l"), "missing columns: angle_hip_rotation_l"),
        (lambda c: c.drop(columns="force_up_r"), "missing columns: force_up_r"),
        (lambda c: c.rename(columns={"angle_knee_angle_r": "angle_knee_angl_r"}),
         r"angle_knee_angl_r: not the name of a curve. Is it angle_knee_angle_r\?"),
        (change("angle_knee_angle_r", np.negative), "knee_angle_r: smallest at .* Change its sign"),
        (change("angle_hip_flexion_l", np.negative), "hip_flexion_l: largest .* Change its sign"),
        (change("angle_ankle_angle_r", np.negative), "ankle_angle_r: larger after push-off"),
        (change("angle_knee_angle_l", np.radians), "looks like radians. Give --angle-unit rad"),
        (every("angle_pelvis_", np.pi / 180), "angle_pelvis_rotation_r .*looks like radians"),
        (change("moment_ankle_angle_r", np.negative), "moment_ankle_angle_r: .* Change its sign"),
        (change("moment_ankle_angle_l", lambda m: 65 * m), "looks like Nm. Divide moments by the"),
        (every("moment_", 1000), r"reaches 1\d*; this looks like Nmm/kg. Divide moments by 1000:"),
        (every("moment_", 65e3), "looks like Nmm. Divide moments by 1000 and by the body mass"),
        (every("moment_", 100 / 9.80665 / 1.53), "% of body weight times height. Multiply "),
        (every("moment_", 1000 / 65), "reaches .*; no usual unit has this .*Nmm/kg 500 to 3000"),
        (every("moment_", 1000 / 65**2), "reach 0.3. and 0.2.; .* divided by the body mass twice"),
        (change("moment_ankle_angle_l", lambda m: 0 * m), "_l: reaches only 0 Nm/kg"),
        (every("force_", 100), "force_up_r: .* looks like % of body weight. Divide forces by 100"),
        (every("force_", 40), "force_up_l: .* no usual unit"),
        (change("force_up_r", lambda f: 640 * f), "force_up_r: reaches .* looks like N. Divide"),
        (change("force_up_l", lambda f: 9.8 * f), "force_up_l: .* looks like N/kg"),
        (change("force_up_l", np.negative), "force_up_l: .* the ground pushes up"),
        (change("force_forward_r", np.negative), "force_forward_r: it does not brake first"),
        (change("force_left_l", np.negative), "force_left_l: it points away from the midline"),
        (lambda c: c.rename(columns={n: n[:-1] + {"r": "l", "l": "r"}[n[-1]] for n in c
                                     if n != "percent"}), "exchanged, in all columns"),
        (lambda c: c.assign(force_up_r=np.roll(c.force_up_l, 50)), "force_up_r: .*"),
        (change("angle_pelvis_list_l", np.negative), "impossible for one pelvis"),
        (change("angle_hip_adduction_r", lambda a: a.where(a.index != 40)), "a number in row 42"),
        (change("angle_hip_rotation_r", lambda a: a + 30.0 * (a.index == 50)), "jumps by .* betw"),
        (lambda c: c.assign(percent=np.roll(c.percent, 8)), "percent: 93 in row 2, where 0 is "),
        (lambda c: c.assign(percent=c.percent / 1000), "percent: 0.001 in row 3, where 1 is"),
        (lambda c: c.assign(percent=c.percent.where(c.index != 4)), "percent: nan in row 6"),
        (later(7), "force_up_r: .* at 3-5 %, where the foot has landed"),
        (later(-5), "force_up_r: .* in swing"),
        (change("angle_ankle_angle_r", lambda a: a + 90.0), "ankle_angle_r: .* from 90° in stand"),
        (change("angle_knee_angle_l", lambda a: 180.0 - a), "knee_angle_l: .* from 180° in stand"),
    ],
)  # fmt: skip
def test_a_wrong_sign_unit_side_or_gap_is_named(good, tmp_path, damage, message):
    path = written(tmp_path, damage(good))
    with pytest.raises(RecordError, match=message):
        gait_values(read_mean_curves([path]), str(path))


def stretched(curves, until):
    """Rows of 0 to `until` % of the cycle, stretched over all."""
    rows = np.linspace(0.0, until, 101) % 100.0
    return curves.apply(lambda c: np.interp(rows, np.arange(101), c)).assign(percent=curves.percent)


def of_side(side, kinds, function):
    return lambda curves: curves.assign(
        **{n: function(curves[n]) for n in curves if n.startswith(kinds) and n.endswith(f"_{side}")}
    )


def row_of(column, row, value):
    return lambda curves: curves.assign(
        **{column: curves[column].where(curves.index != row, value)}
    )


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (of_side("l", ("angle", "moment", "force"), lambda c: moved(c, 50)),
         "knee_angle_l: .* over the other side's cycle, half a stride off"),
        (of_side("l", "moment", lambda c: moved(c, 50)),
         "moment_ankle_angle_l: .* in swing .* over the other side's cycle, half a stride"),
        (change("angle_hip_flexion_l", lambda c: moved(c, 50)),
         "angle_hip_flexion_l is over the other side's cycle"),
        (later(39), "angle_knee_angle_r: .* begin at toe-off, not at heel strike"),
        (lambda c: c.iloc[::-1].reset_index(drop=True).assign(percent=c.percent),
         "angle_knee_angle_r: .* run backwards"),
        (lambda c: stretched(c, 61.0), "angle_knee_angle_r: .* are of stance alone"),
        (lambda c: stretched(c, 200.0), "angle_knee_angle_r: .* are two cycles"),
        (lambda c: swapped("angle_hip_flexion_r", "angle_knee_angle_r")(c),
         "angle_hip_flexion_r and angle_knee_angle_r are exchanged"),
        (lambda c: swapped("force_left_r", "force_forward_r")(c),
         "force_forward_r and force_left_r are exchanged"),
        (lambda c: swapped("force_up_r", "force_forward_r")(c),
         "force_forward_r and force_up_r are exchanged"),
        (row_of("angle_knee_angle_r", 39, -9999.0), "-9999 in row 41 stands for a value that is m"),
        (row_of("force_up_r", 69, 9999.0), "force_up_r: 9999 in row 71 stands for a value"),
        (change("angle_ankle_angle_r", np.radians), "ankle_angle_r: it spans .* unlike other col"),
        (change("angle_hip_rotation_l", np.radians), "hip_rotation_l: .* looks like radians"),
        (change("angle_knee_angle_l", lambda a: 0.0 * a + 10.0), "is 10° in all rows"),
        (every("force_", 0.0), "force_up_r: is 0 in all rows"),
        (lambda c: every("force_left", 640.0)(every("force_forward", 640.0)(c)),
         "force_forward_r: reaches .* this looks like N"),
        (change("angle_hip_flexion_r", lambda a: a - 90.0), "hip_flexion_r: -70° .* from 90°"),
        (lambda c: every("angle_pelvis_tilt", 1.0)(c).assign(
            angle_pelvis_tilt_r=c.angle_pelvis_tilt_r - 90.0), "pelvis_tilt_r: .* than the vert"),
        (lambda c: c.assign(**{n: c[n] + 180.0 for n in c if "pelvis_rotation" in n}),
         "pelvis_rotation_r: .* an axis of the laboratory"),
        (lambda c: pd.concat([c, c]), "begins again after 101 rows: several trials, people or si"),
        (lambda c: pd.concat([c, c.tail(1).assign(percent="mean")]), "line 103: 'mean' where a p"),
        (lambda c: c.head(0), "a header and no rows"),
        (lambda c: c.rename(columns={n: f"{n} (Nm/(kg m))" for n in c if n.startswith("moment")}),
         "the unit .* is not known here. Give moments in Nm/kg"),
    ],
)  # fmt: skip
def test_what_became_of_curves_is_named_and_not_only_where_they_are_odd(
    good, tmp_path, damage, message
):
    with pytest.raises(RecordError, match=message):
        read_mean_curves([written(tmp_path, damage(good))])


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (swapped("moment_hip_flexion_r", "moment_knee_angle_r"), "and moment_knee_angle_r are exc"),
        (every("moment_hip_flexion", 0.0), "moment_hip_flexion_r, .* was not measured"),
        (every("angle_hip_rotation", 0.0), "angle_hip_rotation_r, .* was not measured"),
        (lambda c: c.assign(**{n: moved(c[n], 5) for n in c if n.startswith("moment")}),
         "moment_ankle_angle_r: .* after the foot has left the ground"),
        (lambda c: c.assign(**{f"{n[:-1]}l": c[n] for n in c if re.match("angle.*_r$", n)}),
         "one side is a copy of the other"),
        (lambda c: c.assign(**{n: -c[n] for n in c if "foot_pitch" in n}),
         "angle_foot_pitch_r.* turn the foot"),
        (lambda c: c.assign(**{f"angle_hip_flexion_{s}": c[f"angle_hip_flexion_{s}"]
                               - c[f"angle_pelvis_tilt_{s}"] for s in "rl"}), "another zero"),
    ],
)  # fmt: skip
def test_what_people_may_do_is_said_and_not_refused(good, tmp_path, damage, message):
    found = read_mean_curves([written(tmp_path, damage(good))]).warnings
    assert re.search(message, "; ".join(found)), found


def test_hips_from_the_vertical_are_said_without_the_angles_of_the_feet(good, tmp_path):
    lacking = [n for n in good if any(f"angle_{each}" in n for each in SKIPPED)]
    thigh = good.drop(columns=lacking).assign(
        **{f"angle_hip_flexion_{s}": good[f"angle_hip_flexion_{s}"] - good[f"angle_pelvis_tilt_{s}"]
           for s in "rl"}
    )  # fmt: skip
    found = read_mean_curves([written(tmp_path, thigh)]).warnings
    assert any("both soles off the level" in each for each in found), found


def test_angles_that_are_late_are_said_without_forces_too(good, tmp_path):
    late = later(10)(good.drop(columns=[n for n in good if not n.startswith(("angle", "perc"))]))
    found = read_mean_curves([written(tmp_path, late)]).warnings
    assert re.search("1[0-4] % of the cycle too late", "; ".join(found))


def test_running_and_stairs_are_named(good, tmp_path):
    percent = np.arange(101)
    squeezed = np.interp(percent, [0, 36, 100], [0, 61, 100])
    running = good.apply(lambda c: np.interp(squeezed, percent, c)).assign(percent=good.percent)
    with pytest.raises(RecordError, match="this is running"):
        read_mean_curves([written(tmp_path, running)])
    knee = np.interp(percent, [0, 15, 45, 62, 85, 100], [65, 50, 8, 30, 95, 65])
    hip = np.interp(percent, [0, 15, 55, 85, 100], [62, 50, 8, 70, 62])
    climbing = good.assign(
        **{f"angle_knee_angle_{s}": knee for s in "rl"},
        **{f"angle_hip_flexion_{s}": hip for s in "rl"},
    )
    assert any(
        "stairs" in each for each in read_mean_curves([written(tmp_path, climbing)]).warnings
    )


UNITS = {"angle": " (rad)", "moment": " [Nmm/kg]", "force": " (%BW)"}
FACTORS = {"angle": np.pi / 180, "moment": 1000.0, "force": 100.0}


def in_other_units(curves):
    return curves.assign(
        **{n: curves[n] * FACTORS[n.split("_")[0]] for n in curves if n != "percent"}
    )


def with_units(curves):
    names = {n: n + UNITS[n.split("_")[0]] for n in curves if n != "percent"}
    return in_other_units(curves).rename(columns=names)


def with_row_of_units(curves):
    units = {n: UNITS.get(n.split("_")[0], " (%)").strip(" ()[]") for n in curves}
    return pd.concat([pd.DataFrame([units]), in_other_units(curves)])


def of_rows(count):
    def resampled(curves):
        rows = np.linspace(0.0, 100.0, count)
        return curves.apply(lambda c: pd.Series(np.interp(rows, np.arange(101), c)))

    return resampled


@pytest.mark.parametrize(
    ("change", "within"),
    [
        (with_units, 1e-6),
        (with_row_of_units, 1e-6),
        (lambda c: c.rename(columns=lambda n: f" {n.title()} "), 1e-9),
        (lambda c: c.rename(columns=lambda n: re.sub("_r$", "_right", re.sub("_l$", "_left", n))),
         1e-9),
        (lambda c: c.assign(percent=c.percent / 100), 1e-9),
        (of_rows(201), 1e-6),
        (of_rows(51), 0.4),
    ],
    ids=["units", "row of units", "capitals", "right and left", "0 to 1", "201 rows", "51 rows"],
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


SKIPPED = ("knee_adduction", "knee_rotation", "ankle_rotation", "foot_")


def both(name, columns):
    return columns.assign(**{each: -columns[each] for each in (f"{name}_r", f"{name}_l")})


@pytest.mark.parametrize("subject", builtin_subjects(), ids=lambda each: each.identifier)
@pytest.mark.parametrize("whole", [True, False], ids=["whole", "without optional curves"])
def test_the_signs_of_sound_curves_are_not_doubted(subject, whole, tmp_path):
    curves = table(subject)
    if not whole:
        curves = curves[[name for name in curves if not any(each in name for each in SKIPPED)]]
    warnings = read_mean_curves([written(tmp_path, curves)]).warnings
    # What the curves do not show is said, and is no doubt.
    assert [each for each in warnings if "do not show whether the sign" not in each] == []


@pytest.mark.slow
@pytest.mark.parametrize("subject", builtin_subjects(), ids=lambda each: each.identifier)
@pytest.mark.parametrize(
    "name",
    ["hip_adduction", "hip_rotation", "subtalar_angle",
     "pelvis_tilt", "pelvis_list", "pelvis_rotation"],
)  # fmt: skip
@pytest.mark.parametrize("whole", [True, False], ids=["whole", "without optional curves"])
def test_a_reversed_angle_is_never_taken_without_a_word(subject, name, whole, tmp_path):
    curves = both(f"angle_{name}", table(subject))
    if not whole:
        curves = curves[[each for each in curves if not any(one in each for one in SKIPPED)]]
    warnings = read_mean_curves([written(tmp_path, curves)]).warnings
    about = [each for each in warnings if f"angle_{name}" in each]
    assert about
    assert "positive" in about[0]


@pytest.mark.parametrize("name", ["hip_flexion", "hip_adduction", "knee_angle"])
def test_a_reversed_moment_is_refused_by_the_lever_of_the_ground_reaction(good, name, tmp_path):
    path = written(tmp_path, both(f"moment_{name}", good))
    with pytest.raises(RecordError, match=f"moment_{name}_r.*[Cc]hange"):
        read_mean_curves([path])


@pytest.mark.parametrize("name", ["knee_adduction", "hip_rotation", "subtalar_angle"])
def test_a_reversed_moment_across_the_midline_is_said(good, name, tmp_path):
    warnings = read_mean_curves([written(tmp_path, both(f"moment_{name}", good))]).warnings
    assert any(f"moment_{name}_r" in each for each in warnings)


def test_an_angle_of_the_wrong_sign_does_not_accuse_moments(good, tmp_path):
    (warning,) = read_mean_curves([written(tmp_path, both("angle_hip_adduction", good))]).warnings
    assert "angle_hip_adduction_r and angle_hip_adduction_l" in warning


@pytest.mark.parametrize("name", ["hip_flexion_l", "ankle_angle_r"])
def test_an_angle_with_another_zero_than_on_the_other_side_is_said(good, name, tmp_path):
    odd = good.assign(**{f"angle_{name}": good[f"angle_{name}"] + 12.0})
    warnings = read_mean_curves([written(tmp_path, odd)]).warnings
    assert any(f"angle_{name}" in each and "offset" in each for each in warnings)
    assert not read_mean_curves([written(tmp_path, good)]).warnings


def test_doubts_of_signs_reach_the_user(good, tmp_path):
    path, message = written(tmp_path, both("angle_pelvis_list", good)), []
    new_subject([path], tmp_path / "a.toml", PERSON, **TRIAL, notify=message.append)
    assert any(each.startswith("Warning: angle_pelvis_list_r") for each in message)
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
    with pytest.raises(RecordError, match=r"is in .* too\. Give each curve once"):
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
    with pytest.raises(ScalingError, match="looks like centimetres"):
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
    with pytest.raises(RecordError, match=r"give one ang\.txt and at most one knt\.txt"):
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
    with pytest.raises(RecordError, match="percent: nan in row 42"):
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
    ("name", "text", "message"),
    [
        ("a.toml", "[x]\ny = 1, 2\nz = [1, 2, 3]\n", "a .toml file is no table of mean curves"),
        ("a.csv", "a,b\n1,2\n1,2,3\n", "line 3 has 3 values, but the header has 2"),
        ("a.csv", "\udcff\udcab", "not UTF-8 text"),
    ],
)
def test_a_file_that_is_no_table_is_refused_in_plain_words(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(RecordError, match=message) as refused:
        read_mean_curves([path])
    assert "Parser" not in str(refused.value)
