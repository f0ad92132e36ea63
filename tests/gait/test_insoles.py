"""Insoles: mean curves of a walk come back from its file, and what is no walk of it is refused."""

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.gait.insoles import read_insoles

MASS, STRIDE, RATE = 70.0, 1.12, 100.0
WEIGHT = MASS * 9.80665
NAMES = ("force_right", "force_left")


def carried(phase: np.ndarray) -> np.ndarray:
    """Body weights on a foot at phases of its cycle: two peaks in 0.62 of it."""
    on = phase < 0.62
    u = np.where(on, phase / 0.62, 0.0)
    return np.where(on, 1.25 * np.sin(np.pi * u) ** 0.8 - 0.35 * np.sin(np.pi * u) ** 4, 0.0)


def walk(gain: float = 1.0, seconds: float = 9.0) -> tuple[np.ndarray, np.ndarray]:
    """Times, and N on both feet (T, 2), with the weight as the mean of their sum."""
    time = np.arange(int(seconds * RATE)) / RATE
    phases = np.stack([time / STRIDE + 0.7, time / STRIDE + 0.2], axis=1) % 1.0
    even = carried(np.arange(1000) / 1000)
    return time + 31.0, gain * WEIGHT * carried(phases) / (2.0 * even.mean())


def write(path, time, forces, names=NAMES, separator=","):
    rows = [separator.join(["left_foot_lost", names[1], "Time", names[0]])]
    rows += [
        separator.join(f"{x:.6g}" for x in (1.0, left, t, right))
        for t, (right, left) in zip(time, forces, strict=True)
    ]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def read(path, **changes):
    asked = {"mass": MASS, "stride_time": STRIDE, "error": 0.05, "columns": NAMES}
    return read_insoles(path, **(asked | changes))


@pytest.mark.parametrize(("gain", "separator"), [(1.0, ","), (0.93, ";"), (1.1, "\t")])
def test_each_foot_s_mean_over_its_own_cycle(tmp_path, gain, separator):
    found = read(write(tmp_path / "walk.csv", *walk(gain), separator=separator))
    assert found.gain == pytest.approx(gain, abs=0.005)
    assert found.stride_time == pytest.approx(STRIDE, abs=0.005)
    assert found.strides == (7, 7)
    phase = np.arange(100) / 100
    even = carried(np.arange(1000) / 1000)
    expected = carried(phase) / (2.0 * even.mean())
    for foot in found.vertical:
        # the stride begins where the foot is loaded, up to a hundredth of it after it lands
        assert np.abs(foot - expected)[2:60].max() < 0.06
    assert found.vertical.mean(axis=1).sum() == pytest.approx(1.0)


def test_units_in_names_and_numbers_for_gaps_are_understood(tmp_path):
    time, forces = walk()
    forces[300:310, 0] = -9999.0
    path = write(tmp_path / "walk.csv", time, forces, names=("Force_Right (N)", "Force_Left [N]"))
    assert read(path).strides == (6, 7)


def test_a_copy_of_one_foot_is_refused(tmp_path):
    time, forces = walk()
    with pytest.raises(RecordError, match="one is a copy of the other"):
        read(write(tmp_path / "walk.csv", time, np.stack([forces[:, 0]] * 2, axis=1)))


def test_the_right_foot_is_the_first_column_that_is_named(tmp_path):
    time, forces = walk()
    forces[:, 0] *= 0.9
    path = write(tmp_path / "walk.csv", time, forces, ("a", "b"))
    one, other = read(path, columns=("a", "b")), read(path, columns=("b", "a"))
    assert one.vertical[0].max() < 0.95 * one.vertical[1].max()
    np.testing.assert_array_equal(one.vertical, other.vertical[::-1])


def test_a_stride_with_a_gap_does_not_count(tmp_path):
    time, forces = walk()
    forces[300:303] = np.nan
    found = read(write(tmp_path / "walk.csv", time, forces))
    assert found.strides == (6, 6)
    assert np.isfinite(found.vertical).all()


def test_where_a_gap_in_stance_ends_no_foot_lands(tmp_path):
    time, forces = walk()
    landing = next(i for i in range(200, 400) if forces[i - 1, 0] == 0.0 < forces[i, 0])
    forces[landing + 2 : landing + 10, 0] = np.nan
    found = read(write(tmp_path / "walk.csv", time, forces))
    assert found.strides == (5, 7)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_table_that_a_spreadsheet_saved(tmp_path, separator):
    plain = write(tmp_path / "walk.csv", *walk())
    note, header, *rows = f'"# insoles, left; right"\n{plain.read_text()}'.splitlines()
    header = separator.join(f'"{name}"' for name in header.split(","))
    saved = [row.replace(",", separator).replace(".", ",") for row in rows]
    path = tmp_path / "saved.csv"
    path.write_text("\n".join([note, header, *saved, 3 * separator]) + "\n", encoding="utf-8")
    np.testing.assert_array_equal(read(path).vertical, read(plain).vertical)


def test_the_tables_of_opensim(tmp_path):
    time, forces = walk()
    rows = [f"{t:.4f}\t{r:.4f}\t{le:.4f}" for t, (r, le) in zip(time, forces, strict=True)]
    header = ["walk", "version=1", f"nRows={len(rows)}", "nColumns=3", "inDegrees=no", "endheader"]
    path = tmp_path / "walk.mot"
    path.write_text("\n".join([*header, "time\t" + "\t".join(NAMES), *rows]) + "\n")
    as_table = read(write(tmp_path / "walk.csv", time, forces))
    np.testing.assert_allclose(read(path).vertical, as_table.vertical, atol=1e-3)


def other_unit(time, forces):
    return time, forces / WEIGHT


def not_zeroed(time, forces):
    return time, forces + np.array([40.0, 0.0])


def standing(time, forces):
    return time, np.tile([WEIGHT / 2, WEIGHT / 2], (len(time), 1))


def milliseconds(time, forces):
    return 1000.0 * time, forces


def short(time, forces):
    return time[:300], forces[:300]


def slow_rate(time, forces):
    return time[::4], forces[::4]


def one_broken(time, forces):
    return time, forces * [1.0, 0.75] * 0.85


@pytest.mark.parametrize(
    ("spoilt", "changes", "words"),
    [
        (other_unit, {}, ["force_right", "in N", "9.81"]),
        (not_zeroed, {}, ["force_right", "6 %", "zero"]),
        (standing, {}, ["force_right", "walks"]),
        (milliseconds, {}, ["seconds"]),
        (short, {}, ["2 whole strides", "3 are needed", "longer"]),
        (slow_rate, {}, ["25 samples", "40", "own rate"]),
        (one_broken, {}, ["0.74 of the weight", "70 kg", "calibrate"]),
        (lambda *each: each, {"stride_time": 1.4}, ["1.12 s", "1.40 s", "another walk"]),
        (lambda *each: each, {"columns": ("Fz_R", "Fz_L")}, ["'Fz_R'", "force_left", "columns"]),
        (lambda *each: each, {"columns": ("force_left",) * 2}, ["both feet", "--insole-columns"]),
    ],
)
def test_what_is_wrong_is_said_with_the_file_and_the_remedy(tmp_path, spoilt, changes, words):
    path = write(tmp_path / "walk.csv", *spoilt(*walk()))
    with pytest.raises(RecordError) as error:
        read(path, **changes)
    for word in [str(path), *words]:
        assert word in str(error.value)


def test_a_table_without_times_is_refused(tmp_path):
    path = tmp_path / "walk.csv"
    path.write_text("force_right,force_left\n1,2\n", encoding="utf-8")
    with pytest.raises(RecordError, match=r"(?s)walk\.csv.*time.*force_right"):
        read(path)


def test_a_foot_lands_between_two_samples(tmp_path):
    """A force that rises by 3.2 body weights a second, every 112.5 samples. A stride begins where
    it passes 0.05, and a hundredth of the stride later it is 0.036 larger.
    """
    stride = 1.125
    time = np.arange(900) / RATE
    lands = np.stack([(time + 0.4) % stride, (time + 0.9) % stride], axis=1)
    forces = WEIGHT * np.minimum(3.2 * lands, np.maximum(8.0 * (0.7 - lands), 0.0))
    found = read(write(tmp_path / "walk.csv", time, forces), stride_time=stride)
    assert found.stride_time == pytest.approx(1.125, abs=1e-5)
    part = np.arange(1, 40)
    for foot in found.vertical:
        np.testing.assert_allclose(found.gain * foot[part], 0.05 + 0.036 * part, atol=1e-4)
