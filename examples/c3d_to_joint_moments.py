"""From a C3D file to joint moments: inverse kinematics, inverse dynamics, a picture.

    python examples/c3d_to_joint_moments.py TRIAL [SUBJECT] [FOLDER]

TRIAL is one of SUBJECT, such as WBDS01walkT01.c3d of built-in subject 1, whose axes it has. FOLDER
gets motion.npz, moments.npz, moments.csv and moments.png.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import gaitval as gv


def main(trial: str, name: str = "1", folder: str = "moments") -> None:
    """Read, scale, fit the body to the markers, find the moments, draw."""
    recording = gv.read_recording(trial, axes="forward=+x up=+y")
    body = gv.scale(gv.load_subject(name))  # its standing trial says where the markers sit
    motion = gv.inverse_kinematics(recording, body)
    moments = gv.inverse_dynamics(motion, recording, body)
    print(motion)
    print(moments)

    motion.save(Path(folder) / "motion.npz")
    moments.save(Path(folder) / "moments.npz")
    table = moments.to_frame()
    table.to_csv(Path(folder) / "moments.csv", index=False)
    figure = Figure(figsize=(8, 3), layout="constrained")
    axes = figure.add_subplot(xlabel="time (s)", ylabel="knee_angle moment (Nm/kg)")
    for side, curve in table[table.quantity == "knee_angle moment"].groupby("side"):
        axes.plot(curve.time, curve.value, label=side)
    axes.legend()
    figure.savefig(Path(folder) / "moments.png", dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 1 else sys.exit(__doc__)
