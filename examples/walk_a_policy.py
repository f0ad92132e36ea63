"""Walk a stored policy and plot its knee and ankle against the measured gait.

    python examples/walk_a_policy.py [SUBJECT] [FOLDER]

FOLDER gets walk.npz, curves.csv and walk.png.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import gaitval as gv


def main(name: str = "5", folder: str = "walk") -> None:
    """Walk, compare, draw."""
    out = Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    policy = gv.load_policy(name)
    walk = gv.rollout(policy, cycles=6)
    walk.save(out / "walk.npz")
    comparison = gv.compare(walk, policy.subject)
    print(walk.title())
    print(comparison)

    curves = comparison.to_frame()
    curves.to_csv(out / "curves.csv", index=False)
    figure = Figure(figsize=(8, 3), layout="constrained")
    for axes, quantity in zip(figure.subplots(1, 2), ("knee_angle", "ankle_angle"), strict=True):
        shown = curves[(curves.quantity == quantity) & (curves.side == "right")]
        for source, curve in shown.groupby("source"):
            axes.plot(curve.percent, curve.value, label=source)
        axes.set(xlabel="gait cycle (%)", ylabel=f"{quantity} (deg)")
    axes.legend()
    figure.savefig(out / "walk.png", dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:])
