"""What people sent: every small input of `cases` beside the raw data ends as it should."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitval import cli
from gaitval.mocap.mot import read_storage

PERSON = "--mass 64.95 --height 1.53 --sex F"
C3D = "import --static standing.c3d --trial walking.c3d"
TRC = "import --static standing.trc --trial walking.trc --forces grf.mot"
BELTED = f"{PERSON} --belt 1.1473"
CURVES = f"curves means.csv --speed 1.12 --stride-time 1.05 --leg-length 0.8 {PERSON}"

CASES = {
    "curves_sign_of_hip_adduction": (CURVES, 0, ("angle_hip_adduction_r", "Change the sign")),
    "curves_sign_of_hip_adduction_moment": (
        CURVES, 2, ("moment_hip_adduction_r", "moment_hip_adduction_l", "Change the sign"),
    ),
    "import_corners_other_way_round": (
        f"{C3D} {PERSON}", 2, ("under the other one", "corners", "other way round"),
    ),
    "import_decimal_commas": (
        "import --static standing.trc --trial walking.trc --forces walking.mot "
        + BELTED,
        0, ("trial walking",),
    ),
    "import_exoskeleton_torques": (
        f"{TRC} {PERSON}", 0,
        ("exo_r", "exo_l", "10 Nm", "person and device together", "2 force plates"),
    ),
    "import_forces_end_earlier": (f"{TRC} --trial-time 0:3.1 {PERSON}", 0, ("3.1 s at 100 Hz",)),
    "import_fpcoppoly": (f"{C3D} {PERSON}", 0, ("2 force plates",)),
    "import_gap_as_9999": (f"{TRC} {PERSON}", 0, ("RFCC", "gap", "rebuilt from")),
    "import_heels_taken_off_for_the_walk": (
        f"{C3D} {BELTED}", 0, ("RFCC: the walk has no marker there", "LFCC: the walk"),
    ),
    "import_marker_in_one_standing_frame": (
        f"{C3D} {BELTED}", 0, ("RFMT1: only 1 of the 12 frames of the standing trial",),
    ),
    "import_marker_fell_off": (f"{C3D} {PERSON}", 0, ("RFCC: from 2.01 s on", "left out")),
    "import_other_axes_without_ankles": (
        "import --static standing_y_up.trc --trial walking_z_up.c3d --marker-set cluster.toml "
        f"{PERSON}",
        2, ("other axes than the standing trial",),
    ),
    "import_same_trial_twice": (f"{C3D} --trial walking.c3d {PERSON}", 2, ("same recording",)),
    "import_stature_mistyped": (
        f"{C3D} --mass 64.95 --height 1.35 --sex F --belt 1.1473", 0,
        ("the stature that was given is 10 ± 3 % too small for this body",),
    ),
    "import_turning_parts": (
        f"import --static standing.trc --trial circuit.trc --kinematics-only {PERSON}",
        2, ("--trial-time",),
    ),
    "import_unused_forces_in_exports": (f"{C3D} {PERSON}", 0, ("plate 2", "not used")),
    "judge_coupled_coordinate_in_degrees": ("judge model.osim --ik ik.mot", 0, ("0 failed",)),
    "judge_degrees_called_radians": (
        "judge ../judge_radians_called_degrees/model.osim --ik ik.mot", 2,
        ("inDegrees=yes", "radians"),
    ),
    "judge_degrees_said_in_words": (
        "judge model.osim --ik ik.mot --id id.sto --grf grf.mot", 0, ("69 kept, 2 failed",),
    ),
    "judge_motion_of_one_row": ("judge model.osim --ik ik.mot", 2, ("ik.mot", "one row")),
    "judge_radians_called_degrees": (
        "judge model.osim --ik ik.mot --id id.sto --grf grf.mot", 2, ("inDegrees=no", "radians"),
    ),
    "curves_without_subtalar": (f"{CURVES} --stance 0.62", 0, ("subtalar",)),
    "judge_angles_wrapped_by_a_turn": (
        "judge model.osim --ik ik.mot --mass 64.95 --height 1.53 --belt 1.1473", 0, ("turn",),
    ),
    "judge_noise_called_a_sign": (
        "judge model.osim --ik ik.mot --id id.sto --mass 64.95 --height 1.53 --belt 1.1473",
        1, ("not low-passed",),
    ),
}  # fmt: skip
"""Command, exit code, and what must be said."""
NEVER = {
    "import_stature_mistyped": ("--correct",),
    "import_exoskeleton_torques": ("4 force plates",),
    "import_marker_fell_off": ("--correct place", "RFLE and LFLE"),
    "import_gap_as_9999": ("954 %", "not steady"),
    "import_corners_other_way_round": ("--plate", "of another trial"),
    "import_other_axes_without_ankles": ("running", "mislabelled"),
}
"""What led people astray."""


@pytest.fixture
def cases(gait_data) -> Path:
    folder = gait_data.parent / "cases"
    if not folder.is_dir():
        pytest.skip(f"no cases at {folder}, beside the raw data")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_case_that_somebody_sent_ends_as_it_should(name, cases, tmp_path, monkeypatch):
    monkeypatch.chdir(cases / name)
    command, code, words = CASES[name]
    out = tmp_path / ("out.toml" if name.startswith("curves") else "out")
    result = CliRunner().invoke(cli.app, [*command.split(), "--out", str(out)])
    message = " ".join(result.output.split())
    assert result.exit_code == code, message
    for word in words:
        assert word in message
    for word in NEVER.get(name, ()):
        assert word not in message
    if name == "import_unused_forces_in_exports":
        forces = read_storage(out / "recording/trial1_grf.mot")
        moments = read_storage(out / "recording/trial1_id.sto")
        assert np.abs(forces.column("ground_force_l_vy")).max() < 1.0
        left = moments.column("hip_adduction_l_moment")
        assert np.isnan(left).any()
        # In swing the leg's own weight and inertia are left.
        assert np.nanmax(np.abs(left)) < 0.4 * 64.95
        assert np.isfinite(moments.column("hip_adduction_r_moment")).all()


def test_every_case_is_tried(cases):
    assert {each.name for each in cases.iterdir() if each.is_dir()} == {*CASES}
