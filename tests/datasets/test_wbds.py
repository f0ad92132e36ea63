"""The dataset's files: units, codings, seams and what is refused."""

import re

import numpy as np
import pytest

from experiments import ten_subjects
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.record import ANGLE_NAMES, MOMENT_NAMES
from gaitval.subjects.curve_columns import read_columns
from gaitval.subjects.curve_files import read_mean_curves
from gaitval.subjects.subject_file import BUILTIN, builtin_subjects
from gaitval.subjects.wbds import COLUMNS, MOMENT_SEAM

NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")
HEADERS = {
    kind: ["Time", *(name for name in COLUMNS if ("Angle" in name) is (kind == "ang"))]
    for kind in ("ang", "knt")
}


def synthetic(kind):
    """A file's columns: curves of the right size and timing, in the dataset's units."""
    percent = np.arange(101.0)
    columns = {name: np.zeros(101) for name in HEADERS[kind]}
    columns["Time"] = percent
    for side in "RL":
        if kind == "ang":
            columns[f"{side}KneeAngleZ"] = 60 * np.exp(-(((percent - 72) / 10) ** 2))
            columns[f"{side}HipAngleZ"] = 12 + 20 * np.cos(2 * np.pi * (percent + 5) / 100)
            columns[f"{side}PelvisAngleX"] = 5 * np.sin(2 * np.pi * percent / 100)
        else:
            stance = percent < 62
            columns[f"{side}AnkleMomentZ"] = 1.5 * np.exp(-(((percent - 50) / 8) ** 2))
            columns[f"{side}GRFY"] = np.where(
                stance, 10 * np.abs(np.sin(np.pi * percent / 62)) ** 0.5, 0.0
            )
            columns[f"{side}GRFX"] = np.where(stance, -np.sin(2 * np.pi * percent / 62), 0.0)
            columns[f"{side}GRFZ"] = np.where(stance, 0.5, 0.0)
    return columns


def write(folder, kind, columns):
    path = folder / f"WBDS99walkT05{kind}.txt"
    rows = np.stack(list(columns.values()), axis=1)
    lines = ["\t".join(columns), *("\t".join(f"{x:.6g}" for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def curves_of(path):
    return read_columns(path, "deg").curves


def test_angles_have_the_project_s_names(tmp_path):
    columns = synthetic("ang")
    columns["RFootAngleY"] = np.full(101, 7.0)
    angles = curves_of(write(tmp_path, "ang", columns))
    assert sorted(angles) == sorted(f"angle_{name}" for name in ANGLE_NAMES)
    assert angles["angle_knee_angle_l"].max() == pytest.approx(60)
    # Toes out in the dataset, towards the midline in the project.
    assert angles["angle_foot_progression_r"][0] == pytest.approx(-7)


def test_moments_change_sign_where_the_coordinate_does(tmp_path):
    columns = synthetic("knt")
    columns["RHipMomentX"] += 0.9
    columns["LHipMomentZ"] -= 0.8
    columns["LKneeMomentZ"] += 0.4
    found = read_columns(write(tmp_path, "knt", columns), "deg")
    assert found.seam == (97, 98, 99)
    assert {f"moment_{name}" for name in MOMENT_NAMES} < set(found.curves)
    assert found.curves["moment_ankle_angle_r"].min() == pytest.approx(-1.5)
    assert found.curves["moment_hip_adduction_r"][0] == pytest.approx(-0.9)
    assert found.curves["moment_hip_flexion_l"][0] == pytest.approx(-0.8)
    assert found.curves["moment_knee_angle_l"][0] == pytest.approx(-0.4)


def test_forces_become_body_weights_in_world_axes(tmp_path):
    forces = curves_of(write(tmp_path, "knt", synthetic("knt")))
    assert forces["force_up_r"].max() == pytest.approx(10 / 9.80665)
    assert forces["force_forward_r"][20] < 0  # brakes
    # Medial is to the left on the right foot and to the right on the left foot.
    assert forces["force_left_r"][20] == pytest.approx(0.5 / 9.80665)
    assert forces["force_left_l"][20] == pytest.approx(-0.5 / 9.80665)


def test_both_codings_of_swing_read_the_same(tmp_path):
    zero = synthetic("knt")
    nan = {
        name: np.where(np.arange(101) >= 62, np.nan, column) if "GRF" in name else column
        for name, column in zero.items()
    }
    expected = curves_of(write(tmp_path, "knt", zero))
    seen = curves_of(write(tmp_path, "knt", nan))
    for name in expected:
        np.testing.assert_array_equal(seen[name], expected[name])


def rename(columns):
    return {("RKneeFlexionZ" if k == "RKneeAngleZ" else k): v for k, v in columns.items()}


def drop(columns):
    return {k: v for k, v in columns.items() if k != "LHipAngleZ"}


def gap(name, row):
    def apply(columns):
        return columns | {name: np.where(np.arange(101) == row, np.nan, columns[name])}

    return apply


@pytest.mark.parametrize(
    ("kind", "damage", "message"),
    [
        ("ang", rename, "missing columns: angle_knee_angle_r"),
        ("ang", drop, "missing columns: angle_hip_flexion_l"),
        ("ang", gap("LAnkleAngleX", 30), r"angle_subtalar_angle_l: not a number in row 32"),
        ("knt", gap("RHipMomentX", 10), r"moment_hip_adduction_r: not a number in row 12"),
        ("knt", gap("LGRFY", 20), r"force_up_l: not a number in row 22"),
    ],
)
def test_refused(tmp_path, kind, damage, message):
    paths = [write(tmp_path, each, synthetic(each)) for each in ("ang", "knt")]
    write(tmp_path, kind, damage(synthetic(kind)))
    with pytest.raises(RecordError, match=message) as error:
        read_mean_curves(paths)
    assert str(tmp_path) in str(error.value)


def test_refused_when_truncated(tmp_path):
    path = write(tmp_path, "ang", synthetic("ang"))
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:50]))
    with pytest.raises(RecordError, match="its 49 rows are no gait cycle"):
        read_mean_curves([path])


# With the dataset itself ---------------------------------------------------------------------


@pytest.mark.parametrize("identifier", BUILTIN)
def test_shipped_subjects_are_the_dataset_s(gait_data, identifier):
    """But for what another linear algebra library may round otherwise in the last digit."""
    shipped = (ten_subjects.FILES / f"{identifier}.toml").read_text(encoding="utf-8")
    made = ten_subjects.file_of(identifier, gait_data / "wbds")
    assert NUMBER.sub("", made) == NUMBER.sub("", shipped)
    numbers = [[float(each) for each in NUMBER.findall(text)] for text in (made, shipped)]
    np.testing.assert_allclose(*numbers, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("subject", builtin_subjects(), ids=lambda subject: subject.identifier)
def test_curves_reproduce_the_recorded_rows(gait_data, subject):
    """0.3°, 0.02 Nm/kg and 1 % of body weight, plus the rounding of the shipped figures."""
    person, trial = BUILTIN[subject.identifier]
    stem = gait_data / "wbds" / "processed" / f"{person}walk{trial}"
    record, phase = subject.measured(), np.arange(101) / 100
    angles, kinetics = (
        curves_of(stem.with_name(f"{stem.name}{kind}.txt")) for kind in ("ang", "knt")
    )
    for name, rows in angles.items():
        assert np.abs(np.degrees(record.angles[name[6:]](phase)) - rows).max() < 0.301, name
    trusted = np.delete(np.arange(101), MOMENT_SEAM)
    for name in record.moments:
        difference = record.moments[name](phase[trusted]) - kinetics[f"moment_{name}"][trusted]
        assert np.abs(difference).max() < 0.0201, name
    for side in SIDES:
        stance = np.arange(int(100 * subject.stance_fraction.model_dump()[side]) + 1)
        rows = [kinetics[f"force_{axis}_{side[0]}"] for axis in ("forward", "left", "up")]
        difference = record.ground_reaction(side, phase[stance]) - np.transpose(rows)[stance]
        assert np.abs(difference).max() < 0.0101


@pytest.mark.parametrize("subject", builtin_subjects(), ids=lambda subject: subject.identifier)
def test_curves_stay_calm_between_the_rows_and_across_the_seam(subject):
    """Nothing overshoots between samples or where the moments' rows are left out."""
    record, fine = subject.measured(), np.linspace(0, 1, 2001)
    for name, curve in record.moments.items():
        rows = curve(np.delete(np.arange(101), MOMENT_SEAM) / 100)
        assert curve(fine).max() < rows.max() + 0.06, name
        assert curve(fine).min() > rows.min() - 0.06, name
    for side in SIDES:
        assert np.abs(record.ground_reaction(side, fine)).max() < 1.5


def test_two_estimates_of_the_left_phase_agree():
    """Within 0.3 % of the cycle, 3 ms."""
    for subject in builtin_subjects():
        assert subject.left_phase == pytest.approx(subject.left_phase_from_force, abs=0.003)


@pytest.mark.parametrize("subject", builtin_subjects(), ids=lambda subject: subject.identifier)
def test_one_pelvis(subject):
    """List and rotation of the left cycle are the right one's, later and with the other sign."""
    angles, phase = subject.record().angles, np.linspace(0, 1, 50)
    for name, sign in (("pelvis_tilt", 1), ("pelvis_list", -1), ("pelvis_rotation", -1)):
        right = angles[f"{name}_r"](phase)
        left = sign * angles[f"{name}_l"](phase - subject.left_phase)
        assert np.degrees(np.abs(right - left).max()) < 0.8, name


def test_static_markers_are_metres_with_left_to_the_left(gait_data):
    markers = ten_subjects.about_person(gait_data / "wbds", "WBDS14", "T05")["markers"]
    assert len(markers) == 28
    assert markers["R.ASIS"] == pytest.approx((0.773, -1.356, 0.824), abs=1e-3)


def test_pelvis_of_another_sign_is_refused(gait_data, tmp_path):
    source = gait_data / "wbds"
    for file in source.glob("*.csv"):
        (tmp_path / file.name).symlink_to(file)
    (tmp_path / "processed").mkdir()
    for kind in ("ang", "knt"):
        name = f"processed/WBDS14walkT05{kind}.txt"
        (tmp_path / name).write_text((source / name).read_text())
    path = tmp_path / "processed" / "WBDS14walkT05ang.txt"
    header, *rows = [line.split("\t") for line in path.read_text().splitlines()]
    column = header.index("LPelvisAngleX")
    for row in rows:
        row[column] = str(-float(row[column]))
    path.write_text("\n".join("\t".join(row) for row in [header, *rows]))
    with pytest.raises(RecordError, match="pelvis curves of right and left differ"):
        ten_subjects.subject_of(tmp_path, "S05", "T05")


def test_stride_times_are_those_of_the_cadence(gait_data):
    """Two steps a stride; checks that the table's columns mean what we read."""
    rows = ten_subjects.rows_of(gait_data / "wbds" / "stride_times.csv")
    for row in rows:
        stride_time = 120 / float(row["cadence_steps_min"])
        assert float(row["stride_time_s"]) == pytest.approx(stride_time, rel=1e-3)
