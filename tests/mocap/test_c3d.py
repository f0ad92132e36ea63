"""C3D files: what a laboratory's program may write is read as meant, or refused with a reason."""

import re
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
import pytest
from integer_c3d import write_integer_c3d
from scipy.signal import butter, filtfilt

from gaitval.arrays import Array
from gaitval.errors import RecordError, RecordWarning
from gaitval.mocap import c3d_contents
from gaitval.mocap.c3d import _markers, read_c3d
from gaitval.mocap.c3d_plates import _zero_samples
from gaitval.mocap.c3d_process import opened, samples_of
from gaitval.mocap.force_plates import certain_load, plate_axes
from gaitval.mocap.mot import read_storage
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Event
from gaitval.units import LENGTH

# A laboratory with y up; plates with z down, one turned by 180 degrees about the vertical.
CORNERS = np.array([[1.6, 0, 0.3], [1.6, 0, 0.9], [1.0, 0, 0.9], [1.0, 0, 0.3]])
ORIGIN = np.array([0.01, -0.02, -0.04])
KISTLER = np.array([0.2, 0.17, -0.05])
"""Half the distances between the sensors, and their depth."""
UPSIDE_DOWN = [1, 0, 3, 2]
"""Corners so numbered that the plate's z points up."""
LOAD = np.array([45.0, 720.0, -30.0])
POINT = np.array([1.42, 0.0, 0.51])
TORQUE = np.array([0.0, 6.5, 0.0])


@dataclass
class Plate:
    """A plate to write: its type, channels (T, n) as stored, and parameters in metres."""

    kind: int
    channels: Array
    corners: Array = field(default_factory=lambda: CORNERS.copy())
    origin: Array = field(default_factory=lambda: ORIGIN.copy())
    calibration: Array | None = None
    units: Sequence[str] = ("N",) * 3 + ("Nmm",) * 3


def with_float_offsets(whole: bytes, offset: float) -> bytes:
    """A file whose ANALOG:OFFSET are floats of this value, with zeros before it that are spare."""
    at = whole.index(b"OFFSET") + len("OFFSET")
    (step,) = struct.unpack_from("<H", whole, at)
    assert whole[at + 2] == 2
    begin = at + 4 + whole[at + 3]
    count = int(np.prod([*whole[at + 4 : begin]]))
    first = 512 * (whole[0] - 1)
    last = first + 512 * whole[first + 2]
    assert not any(whole[last - 2 * count : last])
    parts = (
        whole[:at], struct.pack("<HB", step + 2 * count, 4), whole[at + 3 : begin],
        struct.pack(f"<{count}f", *[offset] * count), whole[begin + 2 * count : last - 2 * count],
        whole[last:],
    )  # fmt: skip
    return b"".join(parts)


def write(
    path: Path,
    *,
    markers: Array | None = None,
    names: Sequence[str] = ("R.ASIS", "L.ASIS", "R.Heel"),
    residuals: Array | None = None,
    unit: str | None = "mm",
    rate: float = 100.0,
    per_frame: int = 4,
    plates: Sequence[Plate] = (),
    first_frame: int = 0,
    scale: float = 1e3,
    parameters: Mapping[tuple[str, str], Any] | None = None,
) -> Path:
    """Write a C3D file with ezc3d; `scale` is the file's unit of length over a metre."""
    if markers is None:
        count = len(plates[0].channels) // per_frame if plates else 8
        markers = np.tile(
            1e3 * np.array([[1.2, 0.9, 0.4], [1.2, 0.9, 0.7], [1.3, 0.1, 0.5]]), (count, 1, 1)
        )
    file = ezc3d.c3d()
    points = np.ones((4, markers.shape[1], len(markers)))
    points[:3] = markers.transpose(2, 1, 0)
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    if unit is not None:
        file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["data"]["points"] = points
    if residuals is not None:
        file["data"]["meta_points"]["residuals"] = residuals.T[None]
    if plates:
        channels = np.column_stack([plate.channels for plate in plates])
        file["parameters"]["ANALOG"]["RATE"]["value"] = [rate * per_frame]
        file["parameters"]["ANALOG"]["LABELS"]["value"] = [
            f"C{i}" for i in range(channels.shape[1])
        ]
        file["parameters"]["ANALOG"]["UNITS"]["value"] = [u for p in plates for u in p.units]
        file["data"]["analogs"] = channels.T[None]
        widest = max(plate.channels.shape[1] for plate in plates)
        listed = np.zeros((widest, len(plates)), dtype=int)
        start = 1
        for i, plate in enumerate(plates):
            listed[: plate.channels.shape[1], i] = np.arange(plate.channels.shape[1]) + start
            start += plate.channels.shape[1]
        add = file.add_parameter
        declared = file["parameters"]["FORCE_PLATFORM"]
        declared["USED"]["value"] = np.array([len(plates)])
        declared["TYPE"]["value"] = np.array([plate.kind for plate in plates])
        declared["ZERO"]["value"] = np.array([0, 0])
        declared["CHANNEL"]["value"] = listed
        add("FORCE_PLATFORM", "CORNERS", scale * np.stack([p.corners.T for p in plates], axis=2))
        add("FORCE_PLATFORM", "ORIGIN", scale * np.stack([p.origin for p in plates], axis=1))
        given = [np.eye(6) if p.calibration is None else p.calibration for p in plates]
        matrices = np.zeros((*np.max([matrix.shape for matrix in given], axis=0), len(plates)))
        for i, matrix in enumerate(given):
            matrices[: matrix.shape[0], : matrix.shape[1], i] = matrix
        add("FORCE_PLATFORM", "CAL_MATRIX", matrices)
    for (group, name), value in (parameters or {}).items():
        file.add_parameter(group, name, value)
    file["header"]["points"]["first_frame"] = first_frame
    file.write(str(path))
    return path


def axes_of(corners: Array) -> Array:
    """Axes of a plate as columns, from the definition of its corners by quadrants."""
    x = (corners[0] + corners[3] - corners[1] - corners[2]) / 2
    y = (corners[0] + corners[1] - corners[2] - corners[3]) / 2
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def wrench_in_plate(corners: Array) -> tuple[Array, Array]:
    """LOAD at POINT with TORQUE, in the plate's axes about the middle of its surface."""
    axes = axes_of(corners)
    moment = np.cross(POINT - corners.mean(axis=0), LOAD) + TORQUE
    return LOAD @ axes, moment @ axes


def four_sensors(origin: Array) -> Array:
    """(6, 8) from Fx12 Fx34 Fy14 Fy23 Fz1 Fz2 Fz3 Fz4 to force and moment about the middle of the
    surface: each acts where the sensors are, half_x and half_y from it and `depth` along z."""
    half_x, half_y, depth = abs(origin[0]), abs(origin[1]), -origin[2]
    x, y, z = np.eye(3)
    parts = [
        *[((0.0, side * half_y), x) for side in (1, -1)],
        *[((side * half_x, 0.0), y) for side in (1, -1)],
        *[((a * half_x, b * half_y), z) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))],
    ]
    return np.column_stack([np.r_[axis, np.cross((*at, depth), axis)] for at, axis in parts])


def twelve_sensors(origin: Array) -> Array:
    """(6, 12) likewise, from x, y and z of the four sensors, in the order of the corners."""
    half_x, half_y, depth = abs(origin[0]), abs(origin[1]), -origin[2]
    places = [(a * half_x, b * half_y, depth) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    parts = [np.r_[axis, np.cross(at, axis)] for at in places for axis in np.eye(3)]
    return np.column_stack(parts)


def plate_of(kind: int, corners: Array = CORNERS, scale: Array | None = None) -> Plate:
    """A plate of a type that carries LOAD at POINT with TORQUE, times `scale` over time."""
    force, moment = wrench_in_plate(corners)
    course = np.ones(32) if scale is None else scale
    # The surface is above the sensors: where z points up, z of the way there is positive.
    above = np.array([1.0, 1.0, -np.sign(axes_of(corners)[1, 2])])
    kistler, origin = KISTLER * above, ORIGIN * above
    if kind == 1:
        point = (POINT - corners.mean(axis=0)) @ axes_of(corners)
        torque = TORQUE @ axes_of(corners)
        channels = np.outer(course, np.r_[force, 0, 0, 1e3 * torque[2]])
        channels[:, 3:5] = 1e3 * point[:2]
        return Plate(1, channels, corners, units=("N", "N", "N", "mm", "mm", "Nmm"))
    if kind in (3, 7):
        sensors = np.linalg.pinv(four_sensors(kistler)) @ np.r_[force, moment]
        if kind == 3:
            return Plate(3, np.outer(course, sensors), corners, kistler, units=("N",) * 8)
        matrix = np.diag(np.linspace(40.0, 110, 8)) + np.arange(64).reshape(8, 8) / 10
        volts = np.linalg.solve(matrix, sensors)
        return Plate(7, np.outer(course, volts), corners, kistler, matrix, units=("V",) * 8)
    if kind == 6:
        sensors = np.linalg.pinv(twelve_sensors(kistler)) @ np.r_[force, moment]
        matrix = np.diag(np.linspace(40.0, 150, 12)) + np.arange(144).reshape(12, 12) / 20
        volts = np.linalg.solve(matrix, sensors)
        return Plate(6, np.outer(course, volts), corners, kistler, matrix, units=("V",) * 12)
    about_sensors = moment + np.cross(origin, force)
    stored = np.r_[force, 1e3 * about_sensors]
    if kind == 2:
        return Plate(2, np.outer(course, stored), corners, origin)
    if kind == 5:
        matrix = np.random.default_rng(5).normal(0, [[300]] * 3 + [[1e5]] * 3, (6, 8))
        volts = np.linalg.pinv(matrix) @ stored
        return Plate(5, np.outer(course, volts), corners, origin, matrix, units=("V",) * 8)
    matrix = np.diag([500.0, 500, 1000, 8e5, 2.5e5, 4e5]) + np.arange(36).reshape(6, 6)
    volts = np.linalg.solve(matrix, stored)
    return Plate(4, np.outer(course, volts), corners, origin, matrix, units=("V",) * 6)


def assert_carries(plate: Any, factor: Array | float = 1.0) -> None:
    """The plate shows LOAD at POINT with TORQUE. Values are stored as 32-bit floats."""
    scale = np.broadcast_to(factor, len(plate.force))[:, None]
    np.testing.assert_allclose(plate.force, scale * LOAD, atol=1e-3)
    loaded = np.linalg.norm(plate.force, axis=1) > 50
    np.testing.assert_allclose(
        plate.centre_of_pressure[loaded], np.tile(POINT, (loaded.sum(), 1)), atol=1e-6
    )
    np.testing.assert_allclose(plate.free_moment[loaded], (scale * TORQUE)[loaded], atol=1e-4)
    about_origin = np.cross(POINT, LOAD) + TORQUE
    np.testing.assert_allclose(plate.moment, scale * about_origin, atol=2e-3)


class TestMarkers:
    @pytest.mark.parametrize(
        ("unit", "metres"),
        [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("inches", 0.0254), ("ft", 0.3048)],
    )
    def test_units_become_metres(self, tmp_path, unit, metres):
        places = np.arange(24.0).reshape(2, 4, 3) + 1
        path = write(tmp_path / "a.c3d", markers=places / metres, names=list("abcd"), unit=unit)
        recording = read_c3d(path)
        np.testing.assert_allclose(recording.markers, places, rtol=1e-6)
        assert recording.names == ("a", "b", "c", "d")
        assert recording.axes == "laboratory"

    def test_hidden_markers_are_nan(self, tmp_path):
        markers = np.full((5, 3, 3), 700.0)
        markers[2, 1] = 0.0
        residuals = np.zeros((5, 3))
        residuals[3, 0] = -1.0
        recording = read_c3d(write(tmp_path / "a.c3d", markers=markers, residuals=residuals))
        hidden = np.isnan(recording.markers).all(axis=2)
        assert sorted(zip(*np.nonzero(hidden), strict=True)) == [(2, 1), (3, 0)]
        assert np.isfinite(recording.markers[~hidden]).all()

    def test_a_coordinate_of_zero_is_no_gap(self, tmp_path):
        markers = np.full((5, 3, 3), 700.0)
        markers[:, :, 1] = 0.0
        assert np.isfinite(read_c3d(write(tmp_path / "a.c3d", markers=markers)).markers).all()

    def test_angles_and_unlabelled_points_are_left_out_and_the_prefix_taken_off(self, tmp_path):
        path = write(
            tmp_path / "a.c3d",
            markers=np.full((5, 5, 3), 700.0),
            names=["Anna:LASI", "Anna:RASI", "*12", "Anna:LKneeAngles", "Anna:LHEE"],
            parameters={("POINT", "ANGLES"): ["Anna:LKneeAngles"]},
        )
        assert read_c3d(path).names == ("LASI", "RASI", "LHEE")

    def test_axes_of_segments_are_left_out(self, tmp_path):
        path = write(
            tmp_path / "a.c3d",
            markers=np.full((5, 6, 3), 700.0),
            names=["LASI", "PELO", "PELA", "PELL", "PELP", "TOEA"],
        )
        assert read_c3d(path).names == ("LASI", "TOEA")

    def test_a_knee_is_where_its_alignment_device_puts_it(self, tmp_path):
        # Without a device, a knee among the results is a second one.
        for device, kept in (("Anna:LKAX", ("LKAX", "LKNE")), ("Anna:LTHI", ("LTHI",))):
            path = write(
                tmp_path / "a.c3d",
                markers=np.full((5, 3, 3), 700.0),
                names=[device, "Anna:LKNE", "Anna:RKNE"],
                parameters={("POINT", "MODELED_MARKERS"): ["Anna:LKNE", "Anna:RKNE"]},
            )
            assert read_c3d(path).names == kept

    @pytest.mark.parametrize(
        ("bytes_there", "name"),
        [(b"Heel\0\0\0\0", "Heel"), ("Schädel ".encode("latin-1"), "Schädel")],
        ids=["ends in NUL", "not UTF-8"],
    )
    def test_names_as_others_store_them(self, tmp_path, bytes_there, name):
        path = write(tmp_path / "a.c3d", names=["Schaedel", "R.ASIS", "L.ASIS"])
        path.write_bytes(path.read_bytes().replace(b"Schaedel", bytes_there))
        assert read_c3d(path).names == (name, "R.ASIS", "L.ASIS")

    def test_clock_starts_at_the_first_frame_that_was_kept(self, tmp_path):
        recording = read_c3d(write(tmp_path / "a.c3d", first_frame=150))
        assert recording.start == pytest.approx(1.5)
        np.testing.assert_allclose(recording.time[:2], [1.5, 1.51])

    def test_wbds_static_c3d_and_trc_agree(self, gait_data):
        folder = gait_data / "wbds" / "raw"
        first = read_recording(folder / "WBDS01static1.c3d")
        second = read_recording(folder / "WBDS01static1.trc")
        assert first.names == second.names
        np.testing.assert_allclose(first.markers, second.markers, atol=1e-7)
        assert first.plates == ()  # one is declared, without channels


class TestPlates:
    @pytest.mark.parametrize("kind", [1, 2, 3, 4, 5, 6, 7])
    @pytest.mark.parametrize(
        "order",
        [(0, 1, 2, 3), (2, 3, 0, 1), (3, 0, 1, 2), UPSIDE_DOWN],
        ids=["straight", "turned", "by 90", "z up"],
    )
    def test_a_known_force_at_a_known_point(self, tmp_path, kind, order):
        plate = plate_of(kind, CORNERS[list(order)])
        recording = read_c3d(write(tmp_path / "a.c3d", plates=[plate]))
        assert (recording.marker_rate, recording.force_rate) == (100.0, 400.0)
        np.testing.assert_allclose(recording.plates[0].corners, plate.corners, atol=1e-6)
        assert_carries(recording.plates[0])

    @pytest.mark.parametrize("kind", [2, 4])
    def test_a_child_on_a_plate_that_has_the_force_on_itself(self, tmp_path, kind):
        """Of 13 to 19 kg by the peak of stance: never 200 N."""
        course = np.r_[np.zeros(8), 0.26 * np.sin(np.linspace(0.0, np.pi, 24))]
        recording = read_c3d(write(tmp_path / "a.c3d", plates=[plate_of(kind, scale=-course)]))
        assert_carries(recording.plates[0], course)

    def test_an_offset_is_nobodys_load(self):
        """Of a plate that nobody is on, before it is zeroed."""
        size = 150.0 + np.random.default_rng(1).normal(0.0, 5.0, 1000)
        assert not certain_load(size).any()

    @pytest.mark.parametrize(("gap", "kept"), [(8, True), (9, False)])
    def test_numbers_that_are_missing_for_a_moment_are_put_between(self, tmp_path, gap, kept):
        """20 ms of 400 Hz; what misses more is left out, and both are said."""
        plate = plate_of(2, CORNERS)
        plate.channels[10 : 10 + gap] = np.nan
        with pytest.warns(RecordWarning, match="put between" if kept else "it is left out"):
            recording = read_c3d(write(tmp_path / "a.c3d", plates=[plate]))
        assert len(recording.plates) == kept
        for each in recording.plates:
            assert_carries(each)

    @pytest.mark.parametrize("idle", [np.nan, 0.0])
    def test_type_1_has_no_centre_of_pressure_without_a_load(self, tmp_path, recwarn, idle):
        course = np.r_[np.zeros(12), np.ones(20)]
        plate = plate_of(1, scale=course)
        plate.channels[:12, 3:] = idle
        assert_carries(read_c3d(write(tmp_path / "a.c3d", plates=[plate])).plates[0], course)
        assert not recwarn

    def test_type_1_whose_centre_of_pressure_was_never_computed(self, tmp_path):
        plate = plate_of(1)
        plate.channels[:, 3:5] = 0.0
        found = read_c3d(write(tmp_path / "a.c3d", plates=[plate])).plates[0]
        assert "channels 4 and 5" in found.fault
        assert "CAL_MATRIX" not in found.fault

    def test_kistlers_polynomial_moves_the_centre_of_pressure(self, tmp_path):
        """By its place x, y (mm) in the plate's axes; force and moment about the vertical stay."""
        stored = plate_of(3)
        plain = read_recording(write(tmp_path / "a.c3d", plates=[stored])).plates[0]
        polynomial = np.zeros((6, 2, 1))
        polynomial[:, 0, 0] = 2e-15, 3e-11, 1e-7, 4e-12, 5e-8, -0.04
        polynomial[:, 1, 0] = 1e-15, 2e-11, 3e-7, 1e-12, 2e-8, 0.07
        path = write(
            tmp_path / "b.c3d", plates=[stored],
            parameters={("FORCE_PLATFORM", "FPCOPPOLY"): polynomial},
        )  # fmt: skip
        moved = read_recording(path).plates[0]
        axes, centre = axes_of(stored.corners), stored.corners.mean(axis=0)
        x, y, _ = 1e3 * (POINT - centre) @ axes
        p, q = polynomial[:, 0, 0], polynomial[:, 1, 0]
        dx = (p[0] * y**4 + p[1] * y**2 + p[2]) * x**3 + (p[3] * y**4 + p[4] * y**2 + p[5]) * x
        dy = (q[0] * x**4 + q[1] * x**2 + q[2]) * y**3 + (q[3] * x**4 + q[4] * x**2 + q[5]) * y
        assert min(abs(dx), abs(dy)) > 1.0
        loaded = np.isfinite(plain.centre_of_pressure).all(axis=1)
        shift = (moved.centre_of_pressure - plain.centre_of_pressure)[loaded] @ axes
        np.testing.assert_allclose(
            1e3 * shift, np.tile([-dx, -dy, 0.0], (len(shift), 1)), atol=1e-3
        )
        np.testing.assert_array_equal(moved.force, plain.force)

    @pytest.mark.parametrize("order", [[0, 1, 2, 3], UPSIDE_DOWN], ids=["z down", "z up"])
    @pytest.mark.parametrize(("kind", "signs"), [(2, -1.0), (4, -1.0), (3, [1.0, 1.0, -1.0])])
    def test_an_origin_below_the_surface_is_reversed(self, tmp_path, order, kind, signs):
        plate = plate_of(kind, CORNERS[order])
        plate.origin = signs * plate.origin
        assert_carries(read_c3d(write(tmp_path / "a.c3d", plates=[plate])).plates[0])

    def test_a_calibration_stored_by_rows(self, tmp_path):
        plate = plate_of(4)
        assert plate.calibration is not None
        plate.calibration = plate.calibration.T
        path = write(
            tmp_path / "a.c3d",
            plates=[plate],
            parameters={("FORCE_PLATFORM", "MATRIX_STORE"): ["BYROW"]},
        )
        assert_carries(read_c3d(path).plates[0])

    @pytest.mark.parametrize("kind", [2, 4])
    def test_forces_on_the_plate_are_turned_round(self, tmp_path, kind):
        plate = plate_of(kind)
        plate.channels = -plate.channels
        assert_carries(read_c3d(write(tmp_path / "a.c3d", plates=[plate])).plates[0])

    @pytest.mark.parametrize(("unit", "factor"), [("Nmm", 1.0), ("Nm", 1e-3), ("", 1.0)])
    def test_unit_of_the_moments(self, tmp_path, unit, factor):
        plate = plate_of(2)
        plate.channels[:, 3:] *= factor
        plate.units = ("N", "N", "N", unit, unit, unit)
        assert_carries(read_c3d(write(tmp_path / "a.c3d", plates=[plate])).plates[0])

    @pytest.mark.parametrize("kind", [4, 5, 6, 7])
    def test_a_missing_calibration(self, tmp_path, kind):
        plate = plate_of(kind)
        plate.calibration = np.zeros((6, 6))
        with pytest.raises(RecordError, match=f"type {kind}, but .*CAL_MATRIX"):
            read_recording(write(tmp_path / "a.c3d", plates=[plate]))

    def test_a_plate_that_cannot_be_used_leaves_the_others(self, tmp_path):
        faulty = plate_of(4)
        faulty.calibration = np.zeros((6, 6))
        path = write(tmp_path / "a.c3d", plates=[faulty, plate_of(2)])
        one, other = read_recording(path, faulty=True).plates
        assert "CAL_MATRIX" in one.fault
        assert one.name == "1"
        assert not one.force.any()
        assert len(one.force) == len(other.force)
        assert_carries(other)
        with pytest.raises(RecordError, match="CAL_MATRIX"):
            read_recording(path)

    @pytest.mark.parametrize(
        ("force", "moment", "factor"),
        [("nt", "ntmm", (1, 1)), ("kN", "kNm", (1e-3, 1e-6)), ("Newtons", "N.m", (1, 1e-3))],
    )
    def test_other_spellings_and_sizes_of_units(self, tmp_path, force, moment, factor):
        plate = plate_of(2)
        plate.channels = plate.channels * np.repeat(factor, 3)
        plate.units = (force,) * 3 + (moment,) * 3
        assert_carries(read_c3d(write(tmp_path / "a.c3d", plates=[plate])).plates[0])

    @pytest.mark.parametrize("kind", [2, 4])
    def test_points_in_metres(self, tmp_path, kind):
        """ANALOG:UNITS are the channels' own; lengths of the plate, and moments that a calibration
        makes of volts, follow POINT:UNITS."""
        markers = np.tile([[1.2, 0.9, 0.4], [1.2, 0.9, 0.7], [1.3, 0.1, 0.5]], (8, 1, 1))
        plate = plate_of(kind)
        if plate.calibration is not None:
            plate.calibration[3:] *= 1e-3
        path = write(tmp_path / "a.c3d", plates=[plate], markers=markers, unit="meter", scale=1.0)
        assert_carries(read_c3d(path).plates[0])

    def test_no_centre_of_pressure_where_unloaded_but_the_moment_stays(self, tmp_path):
        course = np.r_[np.zeros(16), np.ones(16)]
        plate = plate_of(2, scale=course)
        offset = np.array([0.0, 0, -4.0, 300, -200, 0])  # 4 N, as of plates that are not zeroed
        plate.channels += offset
        found = read_c3d(write(tmp_path / "a.c3d", plates=[plate])).plates[0]
        assert np.isnan(found.centre_of_pressure[:16]).all()
        assert np.isfinite(found.centre_of_pressure[16:]).all()
        assert (found.free_moment[:16] == 0).all()
        assert found.moment is not None
        assert (np.linalg.norm(found.moment[:16], axis=1) > 0.3).all()

    @pytest.mark.parametrize("unloaded", [16, 0])
    def test_a_baseline_is_subtracted_as_the_file_says_but_of_a_loaded_plate(
        self, tmp_path, unloaded
    ):
        course = np.r_[np.zeros(unloaded), np.ones(32 - unloaded)]
        plate = plate_of(2, scale=course)
        if unloaded:
            plate.channels += np.array([3.0, -2, -30, 900, 400, 100])
        path = write(
            tmp_path / "a.c3d", plates=[plate], parameters={("FORCE_PLATFORM", "ZERO"): [1, 4]}
        )
        assert_carries(read_c3d(path).plates[0], course)

    @pytest.mark.parametrize("lifted", range(4))
    def test_the_surface_is_the_plane_nearest_to_all_four_corners(self, lifted):
        """By least squares, a corner that is d too high tilts a plate a long by d / (2 a)."""
        corners = np.array([[0.3, 0.2, 0], [-0.3, 0.2, 0], [-0.3, -0.2, 0], [0.3, -0.2, 0]])
        corners[lifted, 2] = 0.01
        design = np.column_stack([corners[:, :2], np.ones(4)])
        slope = np.linalg.lstsq(design, corners[:, 2], rcond=None)[0][:2]
        np.testing.assert_allclose(np.abs(slope), [0.01 / 1.2, 0.01 / 0.8])
        z = plate_axes(corners)[:, 2]
        np.testing.assert_allclose(z[:2] / z[2], -slope, atol=1e-15)

    @pytest.mark.parametrize("moved", range(4))
    def test_no_corner_turns_a_plate_more_than_another(self, moved):
        """Along its front or back edge, by the half of what the edge itself turns by."""
        corners = np.array([[0.3, 0.2, 0], [-0.3, 0.2, 0], [-0.3, -0.2, 0], [0.3, -0.2, 0]])
        corners[moved, 1] += 0.006
        axes = plate_axes(corners)
        assert abs(axes[1, 0] / axes[0, 0]) == pytest.approx(0.5 * 0.006 / 0.6)
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-15)

    def test_wbds_treadmill_as_another_laboratory_computed_it(self, gait_data):
        """The .mot was made by a third party from the same C3D, with a low-pass filter.

        Its cut-off is not stated; at 40 Hz the difference is least. Tolerances are what is left
        at heel strike then; the means are not touched by a filter. A wrong sign, lever or origin
        (15 mm) shows tenfold.
        """
        folder = gait_data / "wbds" / "raw"
        recording = read_recording(folder / "WBDS01walkT01.c3d")
        table = read_storage(folder / "WBDS01walkT01_grf.mot")
        low_pass = butter(2, 40 / 0.802 / 150)
        for number, plate in enumerate(recording.plates, start=1):
            force, point, torque = (
                np.column_stack([table.column(f"ground_{n}{a}{number}") for a in "xyz"])
                for n in ("force_v", "force_p", "torque_")
            )
            loaded = force[:, 1] > 200
            smooth = filtfilt(*low_pass, plate.force, axis=0)
            assert plate.moment is not None
            moment = filtfilt(*low_pass, plate.moment, axis=0)
            pressure = np.column_stack(
                [moment[:, 2], np.zeros(len(moment)), -moment[:, 0]]
            ) / smooth[:, [1]]  # fmt: skip
            free = moment[:, 1] - np.cross(pressure, smooth)[:, 1]
            assert np.abs((plate.force - force)[loaded].mean(axis=0)).max() < 0.05
            assert np.sqrt(((smooth - force)[loaded] ** 2).mean(axis=0)).max() < 1.0
            assert np.sqrt(((pressure - point)[loaded] ** 2).mean(axis=0)).max() < 3e-3
            assert np.sqrt(((free - torque[:, 1])[loaded] ** 2).mean()) < 0.3


class TestEvents:
    def stored(self, folder: Path, frames: int, **values: object) -> tuple[Event, ...]:
        """Events of a file of so many `frames`, 1 a second, with `values` of EVENT by their names,
        in minutes and seconds of its times.
        """
        return read_c3d(
            write(
                folder / "a.c3d",
                rate=1.0,
                markers=np.full((frames, 3, 3), 500.0),
                parameters={("EVENT", name): value for name, value in values.items()},
            )
        ).events

    def test_spellings(self, tmp_path):
        known = [
            ("LHS", "", "left", "heel_strike"),
            ("RON", "", "right", "heel_strike"),
            ("LOFF", "", "left", "toe_off"),
            ("RTO", "", "right", "toe_off"),
            ("Foot Strike", "Left", "left", "heel_strike"),
            ("Foot Off", "Right", "right", "toe_off"),
            ("Right Heel Strike", "", "right", "heel_strike"),
            ("Left_Toe_Off", "General", "left", "toe_off"),
            ("R_IC", "", "right", "heel_strike"),
            ("HS_R", "", "right", "heel_strike"),
            ("ToeOffLeft", "", "left", "toe_off"),
            ("Foot Strike", "Gauche", "left", "heel_strike"),
            ("Foot Strike", "Droite", "right", "heel_strike"),
            ("Foot Off", "Izquierda", "left", "toe_off"),
            ("Foot Off", "Derecho", "right", "toe_off"),
            ("Foot Off", "Rechts", "right", "toe_off"),
            ("Foot Strike", "Lt.", "left", "heel_strike"),
            ("Foot Strike", "Esquerda", "left", "heel_strike"),
            ("Foot Strike", "Sinistra", "left", "heel_strike"),
        ]
        events = self.stored(
            tmp_path,
            20,
            LABELS=[label for label, *_ in known],
            CONTEXTS=[context for _, context, *_ in known],
            TIMES=np.array([[0.0] * len(known), range(len(known))]),
        )
        assert events == tuple(
            Event(float(time), side, kind) for time, (_, _, side, kind) in enumerate(known)
        )

    def test_others_are_left_out_and_minutes_counted(self, tmp_path):
        times = np.array([[1.0, 0, 0, 0], [5.5, 1, 2, 3]])
        assert self.stored(tmp_path, 100, LABELS=["LTO", "Clap", "On", "LHS"], TIMES=times) == (
            Event(3.0, "left", "heel_strike"),
            Event(65.5, "left", "toe_off"),
        )

    @pytest.mark.parametrize("context", ["", "General"])
    def test_one_that_names_no_side_is_left_out_and_said(self, tmp_path, context):
        with pytest.warns(RecordWarning, match=r"without a side \(Foot Strike\)"):
            events = self.stored(
                tmp_path,
                10,
                LABELS=["Foot Strike", "LHS"],
                CONTEXTS=[context, "Left"],
                TIMES=np.array([[0.0, 0.0], [2.0, 3.0]]),
            )
        assert events == (Event(3.0, "left", "heel_strike"),)

    def test_more_than_255_events_continue_in_second_parameters(self, tmp_path):
        """The format's arrays have at most 255 entries, so a long walk's go on in TIMES2."""
        events = self.stored(
            tmp_path,
            400,
            LABELS=["LHS"] * 255,
            LABELS2=["RTO"] * 45,
            TIMES=np.array([[0.0] * 255, range(255)]),
            TIMES2=np.array([[0.0] * 45, range(255, 300)]),
        )
        assert [event.time for event in events] == list(range(300))
        assert [event.side for event in events] == ["left"] * 255 + ["right"] * 45

    @pytest.mark.parametrize("stored", [1.53, 0.03], ids=["from frame 1", "from what is kept"])
    def test_clock_of_a_file_that_was_cut(self, tmp_path, stored):
        path = write(
            tmp_path / "a.c3d",
            first_frame=150,
            parameters={
                ("EVENT", "LABELS"): ["LHS"],
                ("EVENT", "TIMES"): np.array([[0.0], [stored]]),
            },
        )
        assert [event.time for event in read_c3d(path).events] == pytest.approx([1.53])

    def test_one_event_under_two_names_is_one_and_the_plates_contact_counts(self, gait_data):
        """WBDS01 T01 has LHS and LON, RHS and RON …; six RHS are 53 ms before any force."""
        recording = read_recording(gait_data / "wbds" / "raw" / "WBDS01walkT01.c3d")
        for side, kind, count in (
            ("left", "heel_strike", 17),
            ("left", "toe_off", 17),
            ("right", "heel_strike", 16),
            ("right", "toe_off", 17),
        ):
            times = [e.time for e in recording.events if (e.side, e.kind) == (side, kind)]
            assert len(times) == count
            assert min(np.diff(times)) > 1.0
        strikes = [e.time for e in recording.events if (e.side, e.kind) == ("right", "heel_strike")]
        assert strikes[1] == pytest.approx(3.3733, abs=1e-3)


def test_a_file_of_theia_names_the_poses_that_it_has_instead_of_markers():
    """What ezc3d finds in one: frames without points, and a group for the matrices."""
    contents = c3d_contents.Contents(
        parameters={"ROTATION": {"LABELS": {"value": ["pelvis_4X4", "l_thigh_4X4"]}}},
        first_frame=0,
        points=np.zeros((100, 0, 3)),
        residuals=np.zeros((100, 0)),
        analogs=np.zeros((0, 0)),
    )
    with pytest.raises(RecordError, match=r"ROTATION: pelvis_4X4, l_thigh_4X4\), as Theia3D"):
        _markers(Path("walk.c3d"), contents)


class TestRefusals:
    def refuse(self, path: Path, *words: str) -> str:
        with pytest.raises(RecordError) as caught:
            read_recording(path)
        message = str(caught.value)
        assert str(path) in message
        for word in words:
            assert word in message
        return message

    def test_missing_and_empty(self, tmp_path):
        self.refuse(tmp_path / "a.c3d", "no such file")
        (tmp_path / "a.c3d").write_bytes(b"")
        self.refuse(tmp_path / "a.c3d", "empty")

    def test_a_folder(self, tmp_path):
        (tmp_path / "a.c3d").mkdir()
        self.refuse(tmp_path / "a.c3d", "is a folder")

    def test_not_a_c3d_file(self, tmp_path):
        (tmp_path / "a.c3d").write_text("Time,X,Y\n" * 200)
        self.refuse(tmp_path / "a.c3d", "not a C3D file", "0x50")

    @pytest.mark.parametrize("offset", [0, 3, 0.5])
    def test_offsets_stored_as_floats(self, tmp_path, offset):
        """As Visual3D has written them; ezc3d asks for integers, as the format does."""
        path = write(tmp_path / "a.c3d", plates=[plate_of(2)])
        whole = path.read_bytes()
        path.write_bytes(with_float_offsets(whole, offset))
        with pytest.raises(ValueError, match="OFFSET"):
            ezc3d.c3d(str(path))
        if offset == 0.5:
            self.refuse(path, "OFFSET parameter is not an INT")
            return
        (tmp_path / "b.c3d").write_bytes(whole)
        ours, theirs = (c3d_contents.read_contents(tmp_path / f"{name}.c3d") for name in "ab")
        np.testing.assert_array_equal(ours.points, theirs.points)
        assert set(ours.get("ANALOG", "OFFSET")) == {offset}
        scale = np.array(ours.get("ANALOG", "SCALE")) * ours.get("ANALOG", "GEN_SCALE")[0]
        np.testing.assert_allclose(ours.analogs, theirs.analogs - offset * scale, rtol=1e-5)

    def test_the_byte_order_of_sgi(self, tmp_path):
        path = write(tmp_path / "a.c3d")
        stored = bytearray(path.read_bytes())
        stored[512 * (stored[0] - 1) + 3] = 86
        path.write_bytes(stored)
        self.refuse(path, "MIPS", "save it for Intel")

    def test_truncated_anywhere(self, tmp_path):
        whole = write(tmp_path / "whole.c3d", plates=[plate_of(2)]).read_bytes()
        data = 8 * (4 * 3 + 4 * 6) * 4  # frames x (markers + samples) x 4 bytes
        path = tmp_path / "a.c3d"
        for size in (*range(1, len(whole) - data, 97), len(whole) - data, len(whole) - 600):
            path.write_bytes(whole[:size])
            self.refuse(path, "truncated" if size > 1 else "")

    @pytest.mark.parametrize(
        ("script", "words"),
        [
            ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "crash"),
            ("import time; time.sleep(60)", "did not finish within 1 s"),
            ("import sys; print('c3d: no such group', file=sys.stderr); sys.exit(1)", "no such gr"),
            ("import sys; sys.exit(3)", "crash"),
        ],
    )
    def test_whatever_happens_to_the_reading_process(self, tmp_path, monkeypatch, script, words):
        path = write(tmp_path / "a.c3d")
        (tmp_path / "process.py").write_text(script)
        monkeypatch.setattr(c3d_contents, "PROCESS", tmp_path / "process.py")
        monkeypatch.setattr(c3d_contents, "SECONDS", 1.0)
        monkeypatch.setattr(c3d_contents, "BUSY", 1.0)
        self.refuse(path, words, "damaged", "Copy it again")

    @pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit of computing time")
    def test_a_file_that_never_ends_to_be_read_has_a_limit_of_computing_time(
        self, tmp_path, monkeypatch
    ):
        """By the clock it is ten times as long, for machines that are busy."""
        path = write(tmp_path / "a.c3d")
        folder = str(c3d_contents.PROCESS.parent)
        (tmp_path / "process.py").write_text(
            f"import sys; sys.path.insert(0, {folder!r})\nfrom c3d_process import limit_time\n"
            "limit_time(float(sys.argv[2]))\nwhile True: pass"
        )
        monkeypatch.setattr(c3d_contents, "PROCESS", tmp_path / "process.py")
        monkeypatch.setattr(c3d_contents, "SECONDS", 1.0)
        monkeypatch.setattr(c3d_contents, "BUSY", 100.0)
        self.refuse(path, "did not finish within 1 s of computing", "damaged")

    def test_the_process_loads_nothing_of_gaitval_that_takes_time(self):
        """It starts for every file."""
        code = (
            "import runpy, sys\nsys.argv = ['x', 'none.c3d', '1']\n"
            f"runpy.run_path({str(c3d_contents.PROCESS)!r})\n"
            "print(sorted(name for name in sys.modules if name.startswith('gaitval')))"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        internal = ("", ".io", ".io.current_folder", ".io.partial_files")
        assert done.stdout.strip() == str(["gaitval", *(f"gaitval._internal{x}" for x in internal)])

    @pytest.mark.parametrize("without", ["module", "limit"])
    def test_a_system_without_a_limit_of_memory_reads_the_same(
        self, tmp_path, monkeypatch, without
    ):
        """Windows has no module `resource`; macOS has it and refuses the limit."""
        write(tmp_path / "t.c3d", plates=[plate_of(2)])
        usual = read_c3d(tmp_path / "t.c3d")
        refusing = "def setrlimit(*_): raise ValueError('current limit exceeds maximum limit')"
        stand_in = {
            "module": "sys.modules['resource'] = None",
            "limit": f"import resource\n{refusing}\nresource.setrlimit = setrlimit",
        }
        (tmp_path / "process.py").write_text(
            f"import runpy, sys\n{stand_in[without]}\n"
            f"runpy.run_path({str(c3d_contents.PROCESS)!r}, run_name='__main__')\n"
        )
        monkeypatch.setattr(c3d_contents, "PROCESS", tmp_path / "process.py")
        elsewhere = read_c3d(tmp_path / "t.c3d")
        np.testing.assert_array_equal(elsewhere.markers, usual.markers)
        np.testing.assert_array_equal(elsewhere.plates[0].force, usual.plates[0].force)

    def test_damaged_bytes_never_end_in_anything_else(self, tmp_path, monkeypatch):
        """Single bytes of the parameters changed; ezc3d 1.7.2 crashes or hangs with some."""
        monkeypatch.setattr(c3d_contents, "SECONDS", 1.5)
        whole = write(tmp_path / "whole.c3d", plates=[plate_of(4)]).read_bytes()
        rng = np.random.default_rng(0)
        refused = 0
        for place in rng.choice(2500, size=12, replace=False):
            damaged = bytearray(whole)
            damaged[place] = rng.integers(256)
            (tmp_path / "a.c3d").write_bytes(damaged)
            try:
                read_recording(tmp_path / "a.c3d")
            except RecordError:
                refused += 1
        assert refused > 0  # else nothing was damaged that matters

    def test_unit_of_length(self, tmp_path):
        self.refuse(
            write(tmp_path / "a.c3d", unit="furlong"), "POINT:UNITS", "'furlong'", "millimetres"
        )

    @pytest.mark.parametrize("scale", [5e-5, 20.0, 0.07])
    def test_no_unit_of_length_and_no_size_of_a_person(self, tmp_path, scale):
        """0.04 and 16,000, which are no size in any unit; and 56, in inches or of a child in cm."""
        markers = scale * np.tile(
            [[1200.0, 900, 400], [1200, 900, 700], [1300, 100, 500]], (8, 1, 1)
        )
        path = write(tmp_path / "a.c3d", unit="", markers=markers)
        self.refuse(path, "POINT:UNITS is missing", "spread over", "metres")

    def test_wrong_unit(self, tmp_path):
        self.refuse(write(tmp_path / "a.c3d", unit="m"), "spread", "millimetres that are called m")

    def test_no_marker_is_ever_seen(self, tmp_path):
        path = write(tmp_path / "a.c3d", markers=np.zeros((8, 3, 3)))
        self.refuse(path, "none of the 3 markers", "8 frames")

    def test_a_name_twice(self, tmp_path):
        """Which is right is unknown, so neither has the name."""
        path = write(tmp_path / "a.c3d", names=["R.ASIS", "L.ASIS", "R.ASIS"])
        with pytest.warns(RecordWarning, match="more than one marker has the name R.ASIS"):
            assert read_recording(path).names == ("R.ASIS#1", "L.ASIS", "R.ASIS#2")

    def test_no_markers(self, tmp_path):
        self.refuse(write(tmp_path / "a.c3d", names=["*1", "*2", "*3"]), "labelled marker")

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            ({"kind": 8}, ("force plate 1", "type 8", "1 to 7")),
            ({"corners": np.zeros((4, 3))}, ("force plate 1", "CORNERS")),
            ({"units": ("V",) * 6, "channels": 1e-5}, ("is in V", "no calibration")),
            ({"units": ("N",) * 3 + ("Nm",) * 3}, ("wrong unit", "ANALOG:UNITS")),
            ({"units": ("N",) * 3 + ("kNm",) * 3}, ("wrong unit", "ANALOG:UNITS")),
        ],
        ids=["type", "no place", "volts", "Nm", "kNm"],
    )
    def test_what_is_said_of_a_plate_cannot_be(self, tmp_path, change, words):
        plate = plate_of(2)
        factor = change.get("channels", 1.0)
        plate = replace(plate, **change | {"channels": factor * plate.channels})
        self.refuse(write(tmp_path / "a.c3d", plates=[plate]), *words)

    def test_plate_with_channels_that_are_not_there(self, tmp_path):
        path = write(
            tmp_path / "a.c3d",
            plates=[plate_of(2)],
            parameters={("FORCE_PLATFORM", "CHANNEL"): np.arange(5.0, 11)[:, None]},
        )
        self.refuse(path, "FORCE_PLATFORM:CHANNEL", "[5, 6, 7, 8, 9, 10]")

    def test_no_rate(self, tmp_path):
        path = write(tmp_path / "a.c3d")
        blob = path.read_bytes()
        at = re.search(rb"RATE..\x04\x00", blob, flags=re.DOTALL)
        assert at is not None
        blob = blob[: at.end()] + b"\0\0\0\0" + blob[at.end() + 4 :]
        path.write_bytes(blob[:20] + b"\0\0\0\0" + blob[24:])  # the header has it again
        self.refuse(path, "POINT:RATE is 0")


@pytest.mark.parametrize(
    ("declared", "samples"),
    [([1, 4], (0, 20)), ([3, 3], (10, 15)), ([1, 10], (0, 50)), ([1, 11], (0, 0)),
     ([0, 0], (0, 0)), ([0, 4], (0, 0)), ([5, 4], (0, 0)), ([3], (0, 0)), ([], (0, 0))],
)  # fmt: skip
def test_frames_that_the_file_declares_unloaded_are_counted_from_one(
    declared: list[int], samples: tuple[int, int]
) -> None:
    """Five samples a frame, 50 in all; the last frame is included."""

    class Contents:
        def get(self, group: str, name: str) -> list[int]:
            assert (group, name) == ("FORCE_PLATFORM", "ZERO")
            return declared

    assert _zero_samples(Contents(), 5, 50) == samples  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("form", "offset"),
    [
        *(("SIGNED", 0), ("SIGNED", 100), ("SIGNED", -100)),
        *(("UNSIGNED", 32768), ("UNSIGNED", 0), ("UNSIGNED", 2048), ("UNSIGNED", 40000)),
    ],
)
def test_counts_and_offsets_are_read_with_their_signs(
    tmp_path: Path, form: str, offset: int
) -> None:
    """ezc3d takes unsigned counts for signed: zero became a whole range, and a sound plate an
    occupied one; and it takes offsets without their sign."""
    most = 32767 if form == "SIGNED" else 65535
    counts = np.array([[0, 1, 12], [2048, 32767, most], [most, most - 1, 100]])
    write_integer_c3d(tmp_path / "a.c3d", counts, offset, 0.25, form)
    np.testing.assert_allclose(
        samples_of(opened(tmp_path / "a.c3d")), 0.25 * (counts - float(offset))
    )


def test_the_headers_rate_counts_where_the_parameters_have_none(tmp_path):
    """BTS writes no ANALOG:RATE: ezc3d took the channels of a frame for points of the next."""
    counts = np.arange(60).reshape(20, 3)
    write_integer_c3d(tmp_path / "a.c3d", counts, 0, 1.0, "SIGNED")
    whole = (tmp_path / "a.c3d").read_bytes()
    assert whole.count(b"\4\2RATE") == 1
    (tmp_path / "b.c3d").write_bytes(whole.replace(b"\4\2RATE", b"\4\2NONE"))
    file = opened(tmp_path / "b.c3d")
    assert file["parameters"]["ANALOG"]["RATE"]["value"] == [100.0]
    np.testing.assert_allclose(samples_of(file), counts)


@pytest.mark.parametrize("kind", [1, 2])
def test_a_moment_that_a_file_calls_newtons_is_newtons_times_its_unit_of_length(tmp_path, kind):
    """BTS writes N for all channels; without a unit the format has N times POINT:UNITS, here mm."""
    plate = replace(plate_of(kind), units=("N",) * 6)
    (read,) = read_c3d(write(tmp_path / "a.c3d", plates=[plate])).plates
    assert_carries(read)


@pytest.mark.parametrize(("before", "after"), [(500.0, 1000.0), (500.0, 0.0), (100.0, 50.0)])
def test_a_rate_that_contradicts_the_header_is_named(tmp_path, before, after):
    """The parameters decide how ezc3d cuts the data into frames: they would be read askew."""
    content = (resources.files("gaitval") / "samples" / "walking.c3d").read_bytes()
    # name, offset to the next parameter, type, dimensions, value
    place = next(
        found.end() + 4
        for found in re.finditer(rb"RATE", content)
        if content[found.end() + 4 : found.end() + 8] == struct.pack("<f", before)
    )
    path = tmp_path / "walk.c3d"
    path.write_bytes(content[:place] + struct.pack("<f", after) + content[place + 4 :])
    with pytest.raises(RecordError, match=r"POINT:RATE .* ANALOG:RATE .* header, which says 5 sam"):
        read_c3d(path)


@pytest.mark.parametrize("last", [70000 - 65536, 0])
def test_more_frames_than_a_header_counts_are_not_left_out(tmp_path, last):
    """Its 16 bits wrap: of 70,000 frames 4,464 were read, or one, without a word."""
    write_integer_c3d(tmp_path / "a.c3d", np.ones((70000, 1), int), 0, 1.0, "SIGNED")
    content = bytearray((tmp_path / "a.c3d").read_bytes())
    content[8:10] = struct.pack("<H", last)
    (tmp_path / "a.c3d").write_bytes(content)
    with pytest.raises(RecordError, match=r"about 69939 frames, .* in parts of at most 65535 fr"):
        read_c3d(tmp_path / "a.c3d")


@pytest.mark.parametrize(("unit", "scale"), [("mm", 1.0), ("cm", 0.13), ("m", 1e-3)])
def test_a_missing_unit_of_length_is_told_by_the_size_of_a_person(tmp_path, unit, scale):
    """800 mm; 104 cm, which in inches would be a giant; 0.8 m."""
    markers = scale * np.tile([[1200.0, 900, 400], [1200, 900, 700], [1300, 100, 500]], (8, 1, 1))
    path = write(tmp_path / "a.c3d", unit="", markers=markers)
    name = LENGTH.named(unit).name
    with pytest.warns(RecordWarning, match=f"UNITS is missing.* in {name}, which is taken"):
        found = read_recording(path)
    assert found.markers.max() == pytest.approx(markers.max() * LENGTH.named(unit).factor, rel=1e-5)
