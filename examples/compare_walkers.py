"""Compare two stored walkers: let both walk, and draw the joint moments of one leg.

    python examples/compare_walkers.py [SUBJECT] [OTHER] [FOLDER]

FOLDER gets comparison.npz, comparison.csv and comparison.png.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import gaitval as gv


def main(name: str = "5", other: str = "1", folder: str = "walkers") -> None:
    """Walk twice, compare, draw."""
    first, second = (gv.rollout(gv.load_policy(each)) for each in (name, other))
    comparison = gv.compare(first, second)
    print(comparison)  # how far apart two people are: RMSE of each mean curve

    comparison.save(Path(folder) / "comparison.npz")
    curves = comparison.to_frame()
    curves.to_csv(Path(folder) / "comparison.csv", index=False)
    figure = Figure(figsize=(9, 3), layout="constrained")
    joints = ("hip_flexion", "knee_angle", "ankle_angle")
    for axes, joint in zip(figure.subplots(1, 3), joints, strict=True):
        shown = curves[(curves.quantity == f"{joint} moment") & (curves.side == "right")]
        for source, curve in shown.groupby("source"):
            axes.plot(curve.percent, curve.value, label=source)
        axes.set(xlabel="gait cycle (%)", ylabel=f"{joint} moment (Nm/kg)")
    axes.legend()
    figure.savefig(Path(folder) / "comparison.png", dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:])
