"""MOT and STO: read as meant, written as OpenSim reads them."""

from dataclasses import replace

import numpy as np
import pytest
from motion_files import FORCE, POINT, TORQUE, forces, refuse

from gaitval.errors import RecordError, RecordWarning
from gaitval.mocap.mot import read_ground_reaction, read_storage
from gaitval.mocap.mot_writing import StorageTable, write_storage


class TestStorage:
    @pytest.mark.parametrize("in_degrees", [True, False])
    def test_round_trip(self, tmp_path, in_degrees):
        rng = np.random.default_rng(1)
        table = StorageTable(
            ("hip_flexion_r", "b/c|d"), np.arange(5) / 300, rng.normal(size=(5, 2)), in_degrees, "x"
        )
        write_storage(tmp_path / "a.mot", table)
        read = read_storage(tmp_path / "a.mot")
        assert (read.columns, read.in_degrees, read.name) == (table.columns, in_degrees, "x")
        np.testing.assert_allclose(read.time, table.time, rtol=1e-11)
        np.testing.assert_allclose(read.values, table.values, rtol=1e-11)
        np.testing.assert_array_equal(read.column("b/c|d"), read.values[:, 1])

    def test_opensim_reads_what_is_written(self, tmp_path):
        opensim = pytest.importorskip("opensim")
        table = StorageTable(("a", "b"), np.arange(4) / 150, np.arange(8.0).reshape(4, 2) / 3, True)
        write_storage(tmp_path / "a.mot", table)
        peer = opensim.TimeSeriesTable(str(tmp_path / "a.mot"))
        assert peer.getColumnLabels() == table.columns
        assert peer.getTableMetaDataString("inDegrees") == "yes"
        np.testing.assert_allclose(peer.getMatrix().to_numpy(), table.values, rtol=1e-11)
        np.testing.assert_allclose(peer.getIndependentColumn(), table.time, rtol=1e-11)
        assert opensim.Storage(str(tmp_path / "a.mot")).getSize() == 4

    @pytest.mark.parametrize(
        "header",
        [
            "walk\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\nendheader\n",
            "inDegrees=yes\nDataRate=100.0\nDataType=double\nversion=3\nOpenSimVersion=4.2\nendheader\n",
            "walk\ndatacolumns 3\ndatarows 2\nrange 0 1\ninDegrees=yes\nendheader\n",
            "walk\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\n\nAngles are in degrees.\n\n"
            "endheader\n\n",
        ],
        ids=["version 1", "version 3", "SIMM", "with a comment"],
    )
    def test_versions_of_the_header(self, tmp_path, header):
        (tmp_path / "a.mot").write_text(header + "time\ta\tb\n 0.0  1 2\n 0.1\t3\t4\n")
        read = read_storage(tmp_path / "a.mot")
        assert read.in_degrees
        assert read.columns == ("a", "b")
        np.testing.assert_array_equal(read.values, [[1, 2], [3, 4]])

    @pytest.mark.parametrize(
        "header",
        [
            *(
                f"walk\nversion=1\n{line}nRows=2\nnColumns=2\nendheader\n"
                for line in (
                    "",
                    *(f"inDegrees={word}\n" for word in ("yes", "y", "YES", "no", "n")),
                )
            ),
            "walk\nnRows=2\nnColumns=2\nendheader\n",
            "walk\nversion=0\nnRows=2\nnColumns=2\nendheader\n",
            "name walk\ndatacolumns 2\ndatarows 2\nrange 0 1\nendheader\n",
            "walk\nversion=1\nnRows=2\nnColumns=2\ninDegrees\tyes\nendheader\n",
            "walk\nversion=3\nnRows=2\nnColumns=2\nendheader\n",
        ],
    )
    def test_degrees_are_what_opensim_takes_for_degrees(self, tmp_path, header):
        opensim = pytest.importorskip("opensim")
        path = tmp_path / "a.mot"
        path.write_text(header + "time\ta\n0\t1\n1\t2\n")
        assert read_storage(path).in_degrees == opensim.Storage(str(path)).isInDegrees()

    def test_words_say_the_unit_where_no_key_does(self, tmp_path):
        path = tmp_path / "a.mot"
        for unit in ("degrees", "radians"):
            path.write_text(f"walk\nAngles are in {unit}.\nendheader\ntime\ta\n0\t1\n1\t2\n")
            assert read_storage(path).in_degrees == (unit == "degrees")
        path.write_text(
            "Angles are in radians.\nAngles are in degrees.\nendheader\ntime\ta\n0\t1\n"
        )
        with pytest.raises(RecordError, match="Correct it"):
            read_storage(path)

    def test_times_may_be_in_any_column_or_in_simms_range(self, tmp_path):
        path = tmp_path / "a.mot"
        path.write_text("walk\nendheader\na\tTime\tb\n1\t0\t2\n3\t0.5\t4\n")
        read = read_storage(path)
        assert read.columns == ("a", "b")
        np.testing.assert_array_equal(read.time, [0.0, 0.5])
        np.testing.assert_array_equal(read.values, [[1, 2], [3, 4]])
        path.write_text("name walk\ndatacolumns 1\nrange 2 3\nendheader\na\n1\n2\n4\n")
        np.testing.assert_array_equal(read_storage(path).time, [2.0, 2.5, 3.0])

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("", "empty"),
            ("time\ta\n0\t1\n", "no line `endheader`"),
            ("endheader\n", "nothing follows"),
            ("endheader\ntime\ta\n", "no rows"),
            ("endheader\nt\ta\n0\t1\n", "must be named time"),
            ("endheader\ntime\ta\ta\n0\t1\t2\n", "column a appears 2 times"),
            ("endheader\ntime\ta\n0\t1\n0.1\n", "line 4 has 1 fields, but the header has 2"),
            ("endheader\ntime\ta\n0\tone\n", "'one' is not a number"),
            ("inDegrees=true\nendheader\ntime\ta\n0\t1\n", "inDegrees is 'true'"),
            ("walk\nversion=99\nendheader\ntime\ta\n0\t1\n", "99"),
            (
                "nRows=3\nendheader\ntime\ta\n0\t1\n1\n",
                "there are 2 rows, the last of them incomplete",
            ),
            ("DataType=Mat33\nendheader\ntime\ta\n0\t1,2,3\n", "DataType is Mat33"),
            ("DataType=Vec3\nendheader\ntime\ta\n0\t1,2,3,4\n", "5 fields, but the header has 4"),
        ],
    )
    def test_refusals(self, tmp_path, text, words):
        (tmp_path / "a.sto").write_text(text)
        refuse(read_storage, tmp_path / "a.sto", "a.sto", words)

    @pytest.mark.parametrize("cell", ["{},{},{}", "({},{},{})"])
    def test_vectors_are_the_columns_that_opensim_flattens_them_to(self, tmp_path, cell):
        rows = [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [0.1, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5]]
        lines = [f"{r[0]}\t{cell.format(*r[1:4])}\t{cell.format(*r[4:])}" for r in rows]
        head = "DataType=Vec3\nnColumns=3\nnRows=2\nversion=3\nendheader\ntime\tf1\tp1\n"
        (tmp_path / "a.sto").write_text(head + "\n".join(lines) + "\n")
        table = read_storage(tmp_path / "a.sto")
        assert table.columns == ("f1_1", "f1_2", "f1_3", "p1_1", "p1_2", "p1_3")
        np.testing.assert_allclose(np.c_[table.time, table.values], rows)

    @pytest.mark.parametrize(
        "gap", ["-nan(ind)", "1.#QNAN", "-1.#IND00", "NULL", "#N/A", "nan", "--", "-"]
    )
    def test_what_other_programs_write_for_no_number(self, tmp_path, gap):
        text = f"endheader\ntime\ta\tb\n0\t1\t2\n0.1\t{gap}\t3\n0.2\t4\t5\n"
        (tmp_path / "a.sto").write_text(text)
        table = read_storage(tmp_path / "a.sto")
        np.testing.assert_array_equal(table.values, [[1.0, 2.0], [np.nan, 3.0], [4.0, 5.0]])

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("nRows=4\nendheader\ntime\ta\n0\t1\n1\t2\n2\t3\n", "rows is 4, but there are 3"),
            ("nColumns=3\nendheader\ntime\ta\n0\t1\n1\t2\n", "of columns is 3, but there are 2"),
            ("nRows=1\nendheader\ntime\ta\n0\t1\n1\t2\n", "rows is 1, but there are 2"),
        ],
    )
    def test_counts_of_the_header_unlike_the_rows(self, tmp_path, text, words):
        (tmp_path / "a.sto").write_text(text)
        with pytest.warns(RecordWarning, match=words):
            assert read_storage(tmp_path / "a.sto").values.tolist() == [[1.0], [2.0]]

    def test_a_last_row_off_the_clock_is_left_out(self, tmp_path):
        """Half a millisecond late, as in opensim-jam; later is another fault."""
        rows = "".join(f"{0.0005 * i:.4f}\t{i}\n" for i in range(10))
        path = tmp_path / "a.sto"
        path.write_text(f"endheader\ntime\ta\n{rows}0.0055\t0\n")
        with pytest.warns(RecordWarning, match="the last of 11 samples"):
            assert len(read_storage(path).time) == 10
        path.write_text(f"endheader\ntime\ta\n{rows}0.0053\t0\n")
        with pytest.warns(RecordWarning, match="the last of 11 samples"):
            assert len(read_storage(path).time) == 10
        path.write_text(f"endheader\ntime\ta\n{rows}0.0255\t0\n")
        assert len(read_storage(path).time) == 11

    def test_third_party_files(self, gait_data):
        folder = gait_data / "wbds" / "raw"
        forces_of = read_storage(folder / "WBDS01walkT01_grf.mot")
        assert forces_of.values.shape == (9000, 18)
        assert not forces_of.in_degrees
        angles = read_storage(folder / "WBDS01walkT01_ik_sample.mot")
        assert angles.name == "Coordinates"
        assert angles.in_degrees
        assert angles.column("hip_flexion_r")[0] == 20.17079055
        errors = read_storage(folder / "WBDS01walkT01_ik_marker_errors.sto")
        assert errors.columns == ("total_squared_error", "marker_error_RMS", "marker_error_max")


class TestGroundReaction:
    @pytest.mark.parametrize(
        ("form", "torque_form", "name"),
        [
            ("ground_force_{}1", "ground_torque_{}1", "1"),
            ("ground_force_r_{}", "ground_torque_r_{}", "r"),
            ("ground_force_{}_2", "ground_torque_{}_2", "2"),
            ("1_ground_force_{}", "1_ground_torque_{}", "1"),
            ("ground_force_{}", "ground_torque_{}", "1"),
            ("ground_force_calcn_l_{}", "ground_moment_calcn_l_m{}", "calcn_l"),
            ("FP1_{}", "FP1_m{}", "fp1"),
        ],
    )
    def test_names_of_columns(self, tmp_path, form, torque_form, name):
        path = forces(tmp_path / "a.mot", form=form, torque_form=torque_form)
        rate, start, (plate,) = read_ground_reaction(path)
        assert (rate, start, plate.name) == (1000.0, 0.0, name)
        np.testing.assert_allclose(plate.force[-1], FORCE)
        np.testing.assert_allclose(plate.centre_of_pressure[-1], POINT)
        np.testing.assert_allclose(plate.free_moment[-1], TORQUE)

    @pytest.mark.parametrize(
        ("form", "name"),
        [("FP1_{}{}", "fp1"), ("{}{}1", "1"), ("{}{}_1", "1"), ("Left {}{}", "left")],
    )
    @pytest.mark.parametrize("moment", ["M", "T"])
    def test_letters_of_plates_programs(self, tmp_path, form, name, moment):
        """In any order of columns."""
        table = read_storage(forces(tmp_path / "a.mot", form="FP1_{}", torque_form="FP1_m{}"))
        if " " in form:  # a blank parts the columns of a .mot
            form = form.replace(" ", ".")
        letters = {"v": "F", "p": "COP", "m": moment}
        columns = tuple(form.format(letters[c[-2]], c[-1]) for c in table.columns)
        other = replace(table, columns=columns[::-1], values=table.values[:, ::-1])
        write_storage(tmp_path / "b.mot", other)
        _, _, (plate,) = read_ground_reaction(tmp_path / "b.mot")
        assert plate.name == name
        np.testing.assert_allclose(plate.force[-1], FORCE)
        np.testing.assert_allclose(plate.centre_of_pressure[-1], POINT)
        np.testing.assert_allclose(plate.free_moment[-1], TORQUE)

    def test_other_columns_are_no_plate(self, tmp_path):
        """A muscle's force and the velocity of a point, and a clock that begins later."""
        for form in ("ground_force_{}", "FP1_{}"):
            torque_form = "ground_torque_{}" if "ground" in form else "FP1_m{}"
            table = read_storage(forces(tmp_path / "a.mot", form=form, torque_form=torque_form))
            more = replace(
                table,
                columns=("soleus_force_x", "com_vx", *table.columns),
                time=table.time + 0.5,
                values=np.hstack([table.values[:, :2], table.values]),
            )
            if form == "FP1_{}":
                more = replace(more, columns=more.columns[1:], values=more.values[:, 1:])
            write_storage(tmp_path / "b.mot", more)
            _, start, (plate,) = read_ground_reaction(tmp_path / "b.mot")
            assert start == pytest.approx(0.5)
            np.testing.assert_allclose(plate.force[-1], FORCE)

    def test_a_plate_without_a_name_beside_one_that_is_called_1(self, tmp_path):
        """As in a stair trial of AddBiomechanics: ground_force_vx and 1_ground_force_vx."""
        first = read_storage(
            forces(tmp_path / "a.mot", form="ground_force_{}", torque_form="ground_torque_{}")
        )
        second = read_storage(
            forces(tmp_path / "b.mot", form="1_ground_force_{}", torque_form="1_ground_torque_{}")
        )
        for one, other in ((first, second), (second, first)):
            both = replace(
                one,
                columns=one.columns + other.columns,
                values=np.hstack([one.values, other.values]),
            )
            write_storage(tmp_path / "c.mot", both)
            _, _, plates = read_ground_reaction(tmp_path / "c.mot")
            assert sorted(plate.name for plate in plates) == ["1", "2"]

    @pytest.mark.parametrize("twist", [10.0, -3.0])
    def test_a_torque_without_a_force_is_a_devices_and_no_plate(self, tmp_path, twist):
        plate = read_storage(forces(tmp_path / "a.mot"))
        names = [f"exo_r_force_{kind}{axis}" for kind in "vp" for axis in "xyz"]
        names += [f"exo_r_torque_{axis}" for axis in "xyz"]
        of_device = np.zeros((len(plate.time), 9))
        of_device[:, 6] = twist * np.sin(np.linspace(0.0, np.pi, len(plate.time)))
        write_storage(
            tmp_path / "b.mot",
            replace(
                plate,
                columns=(*plate.columns, *names),
                values=np.hstack([plate.values, of_device]),
            ),
        )
        with pytest.warns(
            RecordWarning, match=rf"exo_r \(up to {abs(twist):g} Nm\).*device's record.*exo_hip_r"
        ):
            _, _, plates = read_ground_reaction(tmp_path / "b.mot")
        assert [each.name for each in plates] == ["1"]

    def test_columns_that_are_not_used_are_named(self, tmp_path):
        plate = read_storage(forces(tmp_path / "a.mot"))
        more = replace(
            plate,
            columns=(*plate.columns, "emg_soleus"),
            values=np.pad(plate.values, ((0, 0), (0, 1))),
        )
        write_storage(tmp_path / "b.mot", more)
        with pytest.warns(RecordWarning, match="not used: emg_soleus"):
            read_ground_reaction(tmp_path / "b.mot")

    @pytest.mark.parametrize("factor", [1.0, 1000.0], ids=["m", "mm"])
    @pytest.mark.filterwarnings("ignore::gaitval.errors.RecordWarning")
    def test_names_of_opensims_reader_of_c3d(self, tmp_path, factor):
        table = read_storage(forces(tmp_path / "a.mot"))
        values = table.values * np.repeat([1.0, factor, factor], 3)
        names = tuple(f"{kind}1_{axis}" for kind in "fpm" for axis in (1, 2, 3))
        write_storage(tmp_path / "b.mot", replace(table, columns=names, values=values))
        _, _, (known,) = read_ground_reaction(tmp_path / "a.mot")
        _, _, (plate,) = read_ground_reaction(tmp_path / "b.mot")
        np.testing.assert_allclose(plate.force, known.force)
        np.testing.assert_allclose(plate.centre_of_pressure, known.centre_of_pressure)
        np.testing.assert_allclose(plate.free_moment, known.free_moment)

    def test_no_centre_of_pressure_where_unloaded(self, tmp_path):
        _, _, (plate,) = read_ground_reaction(forces(tmp_path / "a.mot"))
        assert np.isnan(plate.centre_of_pressure[:50]).all()
        assert np.isfinite(plate.centre_of_pressure[50:]).all()
        assert plate.moment is None
        assert np.isnan(plate.corners).all()

    def test_no_forces_in_the_file(self, tmp_path):
        write_storage(tmp_path / "a.mot", StorageTable(("hip",), np.arange(3.0), np.ones((3, 1))))
        refuse(read_ground_reaction, tmp_path / "a.mot", "no ground reaction forces", "hip")

    @pytest.mark.parametrize(("lost", "words"), [(4, "point"), (8, "torque"), (1, "force")])
    def test_incomplete_plate(self, tmp_path, lost, words):
        table = read_storage(forces(tmp_path / "a.mot"))
        columns = table.columns[:lost] + table.columns[lost + 1 :]
        write_storage(
            tmp_path / "a.mot",
            replace(table, columns=columns, values=np.delete(table.values, lost, axis=1)),
        )
        refuse(read_ground_reaction, tmp_path / "a.mot", "lacks the " + words)

    @pytest.mark.parametrize("column", [1, 3])
    def test_gaps(self, tmp_path, column):
        table = read_storage(forces(tmp_path / "a.mot"))
        table.values[100, column] = np.nan
        write_storage(tmp_path / "a.mot", table)
        _, _, (plate,) = read_ground_reaction(tmp_path / "a.mot")
        assert "missing" in plate.fault
        assert "without gaps" in plate.fault
        assert not plate.force.any()


@pytest.mark.parametrize("beside", [0.4, 0.03])
def test_a_torque_about_the_plates_origin_gives_the_free_moment(tmp_path, beside):
    """As the plates of Camargo et al. 2021 are exported; the foot may land near the middle, m."""
    path = forces(tmp_path / "a.mot")
    table = read_storage(path)
    values, random = table.values.copy(), np.random.default_rng(1)
    values[50:, :3] *= 1.0 + 0.3 * random.standard_normal((150, 3))
    values[50:, 3:6] += np.cumsum(0.002 * random.standard_normal((150, 3)) * [1, 0, 1], axis=0)
    about = np.array([POINT[0] - beside, 0.0, POINT[2]])
    free = np.array([0.0, 5.0, 0.0])
    moved = values.copy()
    moved[50:, 6:] = free + np.cross(values[50:, 3:6] - about, values[50:, :3])
    write_storage(path, StorageTable(table.columns, table.time, moved))
    with pytest.warns(RecordWarning, match="the free moment is computed from it"):
        _, _, (plate,) = read_ground_reaction(path)
    np.testing.assert_allclose(plate.free_moment[50:], np.tile(free, (150, 1)), atol=1e-6)
    np.testing.assert_allclose(plate.centre_of_pressure[50:], values[50:, 3:6])


@pytest.mark.parametrize("shown", [0.0, np.nan, 0.25])
def test_a_centre_of_pressure_that_a_program_leaves_out_is_the_nearest(tmp_path, shown):
    """Below its own threshold, more than what counts as loaded, it writes what an unloaded plate
    shows; a torque may be missing there too.
    """
    path = forces(tmp_path / "a.mot")
    table = read_storage(path)
    values = table.values.copy()
    values[:50, 3:6] = shown
    values[50:60, :3] *= 45.0 / 700.0
    values[50:60, 3:6] = shown
    values[55, 6:] = np.nan
    write_storage(path, StorageTable(table.columns, table.time, values))
    with pytest.warns(RecordWarning, match=r"10 samples under up to 45 N have no centre"):
        _, _, (plate,) = read_ground_reaction(path)
    assert not plate.fault
    np.testing.assert_allclose(plate.centre_of_pressure[50:], np.tile(POINT, (150, 1)))
    np.testing.assert_allclose(plate.free_moment[50:, 1], np.where(np.arange(50, 200) == 55, 0, 4))
    values[50:60, :3] *= 3.0
    write_storage(path, StorageTable(table.columns, table.time, values))
    _, _, (plate,) = read_ground_reaction(path)
    assert ("missing in 10 samples, the first of them 51" in plate.fault) == np.isnan(shown)


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (0.01, 0.0, 0.0)])
def test_a_foot_at_the_origin_is_there(tmp_path, recwarn, point):
    """The same numbers as of an unloaded plate, among others that are near."""
    path = forces(tmp_path / "a.mot", point=point)
    table = read_storage(path)
    values = table.values.copy()
    values[:50, 3:6] = values[100:110, 3:6] = 0.0
    write_storage(path, StorageTable(table.columns, table.time, values))
    _, _, (plate,) = read_ground_reaction(path)
    assert not plate.fault
    assert not recwarn.list
    np.testing.assert_array_equal(plate.centre_of_pressure[50:], values[50:, 3:6])


def test_a_level_torque_about_no_point_is_said_and_kept(tmp_path):
    """Filtered or noisy; a recording is not refused for it."""
    path = forces(tmp_path / "a.mot")
    table = read_storage(path)
    values = table.values.copy()
    noise = np.random.default_rng(3).standard_normal((len(values) - 50, 2))
    values[50:, [6, 8]] += 0.02 * 700.0 * noise
    write_storage(path, StorageTable(table.columns, table.time, values))
    with pytest.warns(RecordWarning, match="no foot exerts its torque of 0.0"):
        _, _, (plate,) = read_ground_reaction(path)
    assert not plate.fault
    np.testing.assert_allclose(plate.free_moment[50:], values[50:, 6:9], atol=1e-6)
