"""Write the table in docs/learning.md of how far the fit to Newton's laws is from each record.

It shows the deviations of the fitted reference from the record, RMS over the cycle. No walker with
this body and contact could improve on all of them at once.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from evidence.marked_table import with_table
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.model.rotations import pelvis_angles
from gaitval.reference.dynamic_fit import consistent_reference
from gaitval.reference.motion import side_phase
from gaitval.scaling.scaling import scale_subject

PAGE = Path(__file__).parents[2] / "docs" / "learning.md"
SAGITTAL = ("hip_flexion", "knee_angle", "ankle_angle")


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def row(name: str) -> str:
    """One line of the table: right / left."""
    subject = load_subject(name)
    model, record = scale_subject(subject).model, subject.record()
    reference = consistent_reference(record, model)
    pelvis = pelvis_angles(Rotation.from_rotvec(reference.positions[:, :3]).as_matrix())
    angles, rotations, turns, moments, forces = [], [], [], [], []
    for i, side in enumerate(SIDES):
        own = side_phase(record, side, reference.phase)

        def angle(key: str) -> float:
            value = reference.positions[:, COORDINATES.index(key)]
            return float(np.rad2deg(_rms(value - record.angles[key](own))))  # noqa: B023

        angles.append(max(angle(f"{joint}_{side[0]}") for joint in SAGITTAL))
        rotations.append(angle(f"hip_rotation_{side[0]}"))
        sign = 1.0 if side == "right" else -1.0
        turn = sign * pelvis[:, 2] - record.angles[f"pelvis_rotation_{side[0]}"](own)
        turns.append(float(np.rad2deg(_rms(turn))))
        errors = [
            _rms(
                reference.moments[:, ACTUATED.index(f"{joint}_{side[0]}")] / model.mass
                - record.moments[f"{joint}_{side[0]}"](own)
            )
            for joint in SAGITTAL
        ]
        moments.append(" ".join(f"{error:.3f}" for error in errors))
        force = reference.ground_reaction[:, i] - record.ground_reaction(side, np.mod(own, 1.0))
        forces.append(100 * _rms(force[:, 2]))

    def sides(values: list[float]) -> str:
        return f"{values[0]:.1f} / {values[1]:.1f}"

    cells = [name, sides(angles), sides(rotations), sides(turns), " / ".join(moments)]
    return "| " + " | ".join([*cells, sides(forces)]) + " |"


def main() -> None:
    """Write the table."""
    lines = [
        "| subject | largest of hip, knee, ankle, ° | hip rotation, ° | pelvis rotation, ° | "
        "moments of hip, knee, ankle, Nm/kg | vertical force, % BW |",
        "|---|---|---|---|---|---|",
        *(row(name) for name in BUILTIN),
    ]
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "fit", "\n".join(lines)), encoding="utf-8")


if __name__ == "__main__":
    main()
