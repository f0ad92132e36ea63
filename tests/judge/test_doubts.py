"""Motions, moments and forces that keep every limit, and that nobody walked."""

import re
from dataclasses import replace

import numpy as np
import pytest

from gaitval.apps.judge.doubts import check_times
from gaitval.apps.judge.judge import judge
from gaitval.apps.judge.request import JudgeRequest
from gaitval.errors import RecordError
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable, write_storage

ROOT = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
STRIDE = 1.05
"""s, of the walk of `judged_files`, about."""


@pytest.fixture
def changed(judged_files, tmp_path):
    """The request for all files, with the columns of one of them changed by `change(names,
    values)`, which gives the new values, or names and values.
    """

    def of(changes, *, alone=False):
        files = {"ik": "ik.mot", "id": "id.sto", "grf": "grf.mot"}
        for kind, change in changes.items():
            table = read_storage(judged_files / files[kind])
            names, time = list(table.columns), table.time
            new = change(names, time.copy(), table.values.copy())
            names, time, values = new if isinstance(new, tuple) else (names, time, new)
            path = tmp_path / files[kind]
            write_storage(path, StorageTable(tuple(names), time, values, table.in_degrees))
        paths = {
            kind: tmp_path / name if kind in changes else judged_files / name
            for kind, name in files.items()
        }
        if alone:
            paths = {"ik": paths["ik"]}
        return JudgeRequest(model=judged_files / "model.osim", **paths)

    return of


def times(*wanted, factor):
    def change(names, _, values):
        columns = [i for i, name in enumerate(names) if name in wanted]
        assert columns
        values[:, columns] *= factor
        return values

    return change


def sides_exchanged(names, time, values):
    other = {"_r": "_l", "_l": "_r"}
    return [n[:-2] + other.get(n[-2:], n[-2:]) for n in names], time, values


def moments_exchanged(names, time, values):
    swapped = [n.replace("_r_", "_#_").replace("_l_", "_r_").replace("_#_", "_l_") for n in names]
    return swapped, time, values


def rolled(rows, *suffixes):
    def change(names, _, values):
        columns = [i for i, name in enumerate(names) if name.endswith(suffixes)]
        values[:, columns] = np.roll(values[:, columns], rows, axis=0)
        return values

    return change


def copied(names, _, values):
    for i, name in enumerate(names):
        if name.endswith("_l"):
            values[:, i] = values[:, names.index(f"{name[:-2]}_r")]
    return values


HALF = round(100 * STRIDE / 2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ik": times("knee_angle_l", factor=np.pi / 180)}, "left sole is .* another sign, unit"),
        ({"ik": times("ankle_angle_r", "ankle_angle_l", factor=-1.0)},
         "ankle_angle_r and angle_ankle_angle_l have the other sign"),
        ({"ik": times("pelvis_tilt", factor=-1.0)}, "left sole is -?[0-9]+° off the level"),
        ({"ik": sides_exchanged}, "beside the feet: right and left are exchanged"),
        ({"ik": lambda names, time, values: values - 0.055 * np.array(
            [name == "pelvis_ty" for name in names])}, "off the floor"),
        ({"ik": rolled(HALF, "_l")}, "no complete gait cycle .* half a stride off, a copy"),
        ({"ik": copied}, "no complete gait cycle .* half a stride off, a copy"),
        ({"grf": lambda names, time, values: times(
            *(n for n in names if n.endswith("_vx")), factor=-1.0)(names, time, values)},
         "forward and back they point away"),
        ({"id": moments_exchanged}, "moments are over the other side's cycle, half a str"),
        ({"id": times("knee_angle_r_moment", factor=0.0)}, "of knee_angle_r .* not judged"),
        ({"id": lambda names, time, values: 0.0 * values}, "of .* not judged"),
        ({"id": times("knee_angle_r_moment", factor=np.nan)}, "of knee_angle_r .* not judged"),
        ({"id": lambda names, time, values: (
            [n.replace("pelvis", "hips") for n in names], time, values)},
         "residuals could not be judged"),
        ({"id": lambda names, time, values: (
            [n.replace("_l_moment", "_l_torque") for n in names], time, values)},
         "hip_flexion_l, .* not judged"),
        ({"ik": lambda names, time, values: (
            [n.replace("knee_angle_r", "knee_r") for n in names], time, values)},
         "lacks knee_angle_r"),
    ],
)  # fmt: skip
def test_what_no_walk_is_like_is_named_and_is_no_pass(changed, changes, message):
    found = judge(changed(changes))
    assert re.search(message, " ".join(found.undecided)), (found.undecided, found.findings)


def test_forces_of_the_other_step_are_said_before_axes_are_blamed(changed):
    with pytest.raises(RecordError, match="100 % of the forces act beside the feet"):
        judge(changed({"grf": rolled(HALF, "x", "y", "z")}))


def test_the_sound_walk_is_not_doubted(changed):
    assert judge(changed({})).undecided == []
    assert judge(changed({}, alone=True)).undecided == []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ik": lambda names, time, values: (names, 1000.0 * time, values)}, "milliseconds"),
        ({"ik": lambda names, time, values: (names, time / time[-1] / 2, values)}, "another trial"),
        ({"ik": lambda names, time, values: (names, time[::-1], values[::-1])}, "goes back"),
        ({"ik": lambda names, time, values: np.where(
            np.arange(len(time))[:, None] == 50, 9999.0, values)}, "stands for a value"),
        ({"ik": times(*ROOT, factor=1e3)}, "looks like millimetres"),
        ({"ik": times(*ROOT, factor=1e2)}, "looks like centimetres"),
        ({"id": lambda names, time, values: values / 64.95}, "looks like Nm/kg "),
        ({"id": lambda names, time, values: 1e3 * values}, "looks like Nmm "),
    ],
)  # fmt: skip
def test_numbers_that_cannot_be_are_refused(changed, changes, message):
    with pytest.raises(RecordError, match=message):
        judge(changed(changes))


def test_a_belt_in_kilometres_an_hour_is_said(everything):
    found = judge(replace(everything, belt=4.1))
    assert any("was given as the speed of the belt" in each for each in found.findings)


def test_results_without_the_motion_are_not_judged(everything):
    found = judge(replace(everything, ik=None))
    assert any("nothing is judged without --ik" in each for each in found.undecided)


@pytest.mark.parametrize(("rows", "said"), [(0, "no rows"), (1, "one row"), (2, "two rows")])
def test_a_pose_or_two_are_no_motion(rows, said):
    """As SCONE's initial state, a motion of one row."""
    with pytest.raises(RecordError, match=f"state.sto: {said}, but a walk needs a whole cycle"):
        check_times(np.arange(rows) * 0.01, "state.sto")
