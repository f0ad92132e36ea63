"""The person as a URDF for robot simulators, and the walk in its joints as a table."""

from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval._internal.io.artefacts import write_text
from gaitval.apps.export.walked import ExportedWalk
from gaitval.coordinates import ACTUATED, ROOT
from gaitval.model.urdf import write_urdf

FILES: Final = ("person.urdf", "walk.csv")
PELVIS: Final = ("pelvis_x", "pelvis_y", "pelvis_z", *(f"pelvis_q{axis}" for axis in "xyzw"))
"""Place of the base in the world, m, and how it is turned there, a unit quaternion."""


def write_urdf_folder(folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write `FILES` into `folder`; returns their paths. A row of the table is a physics step: time
    s, `PELVIS`, then by the URDF's names of joints angles, rad, and moments, Nm. Raises
    ArtefactError or ModelError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_urdf(walked.body, folder / FILES[0])
    rows, walk = walked.rows, walked.walk
    positions = walk.positions[rows]
    turned = Rotation.from_rotvec(positions[:, :3]).as_quat(canonical=True)
    columns = ("time", *PELVIS, *ACTUATED, *(f"{name}_moment" for name in ACTUATED))
    table = np.column_stack([
        walk.time[rows] - walk.time[rows.start], positions[:, 3:6], turned,
        positions[:, len(ROOT) :], walk.moments[rows],
    ])  # fmt: skip
    lines = [",".join(columns), *(",".join(f"{each:.9g}" for each in row) for row in table)]
    write_text(folder / FILES[1], "\n".join(lines) + "\n")
    return [folder / name for name in FILES]
