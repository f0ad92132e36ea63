"""The person for robot simulators: the table has the walk in the joints of the URDF."""

import csv
from pathlib import Path

import numpy as np
import pytest
import yourdfpy

from gaitval.apps.export.urdf_folder import FILES, PELVIS, write_urdf_folder
from gaitval.apps.export.walked import ExportedWalk
from gaitval.coordinates import ACTUATED
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames


@pytest.fixture(scope="module")
def folder(walked: ExportedWalk, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("urdf") / "robot"
    assert [path.name for path in write_urdf_folder(found, walked)] == list(FILES)
    return found


def test_another_reader_puts_the_segments_where_the_walk_has_them(
    walked: ExportedWalk, folder: Path
) -> None:
    with (folder / "walk.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time", *PELVIS, *ACTUATED, *(f"{n}_moment" for n in ACTUATED)]
    walk, part = walked.walk, walked.rows
    assert len(rows) == len(walk.time[part])
    body = yourdfpy.URDF.load(
        str(folder / "person.urdf"), load_meshes=False, build_scene_graph=True
    )
    assert sum(each.inertial.mass for each in body.robot.links if each.inertial) == pytest.approx(
        walked.body.mass, rel=1e-3
    )
    for at in (0, 150, len(rows) - 1):
        values = {name: float(text) for name, text in rows[at].items()}
        expected = segment_frames(walked.body, walk.positions[part][at][None])[0]
        body.update_cfg({name: values[name] for name in ACTUATED})
        x, y, z, w = (values[f"pelvis_q{axis}"] for axis in "xyzw")
        assert x * x + y * y + z * z + w * w == pytest.approx(1.0)
        turned = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        place = [values[f"pelvis_{axis}"] for axis in "xyz"]
        for number, name in enumerate(SEGMENTS):
            inside = body.get_transform(name, "pelvis")
            whole = np.eye(4)
            whole[:3, :3] = turned @ inside[:3, :3]
            whole[:3, 3] = place + turned @ inside[:3, 3]
            np.testing.assert_allclose(whole, expected[number], atol=1e-6, err_msg=name)
        moments = [values[f"{name}_moment"] for name in ACTUATED]
        np.testing.assert_allclose(moments, walk.moments[part][at], rtol=1e-8, atol=1e-8)
