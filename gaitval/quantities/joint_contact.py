"""Contact forces of hip, knee, patella and ankle over the gait cycle, body weights.

See `gaitval.kinetics.musculature`: they follow from what muscles pull with, so they are worked out
while the motion and its loads are at hand, and stored.
"""

from typing import Final

from gaitval.kinetics.musculature.gait import CONTACTS, MuscleGait
from gaitval.quantities.quantity import FigureTable, Found, Quantity


def joint_contact(muscles: MuscleGait) -> Found | None:
    """Mean contact forces over the cycles of each side, and their peaks; None without a whole
    cycle.
    """
    curves = {
        f"{name}_{side[0]}": curve
        for side, leg in muscles.legs.items()
        for name, curve in leg.contact.items()
    }
    if not curves:
        return None
    return Found(curves, {"peak": {name: float(curve.max()) for name, curve in curves.items()}})


JOINT_CONTACT: Final = Quantity(
    name="joint_contact",
    title="Joint contact force",
    axis="force",
    unit="BW",
    note="What a joint carries: the intersegmental force less what the muscles across it exert. "
    "How people share moments to muscles is the largest uncertainty: at implanted knees such "
    "models are 0.3 to 0.5 body weights off. Hips of the ten built-in people come out at 3.3 body "
    "weights where ten people with implants had 2.5; no sharing of their moments has less than "
    "2.9.",
    needs=("angles", "moments", "forces"),
    curves=dict(CONTACTS),
    of_muscles=joint_contact,
    figures={"peak": "BW"},
    tables=(
        FigureTable(
            "Largest contact force",
            "BW",
            2,
            tuple((title, "peak", name) for name, title in CONTACTS.items()),
        ),
    ),
)
