"""How the moments of the joints are shared out to muscles: a convex problem in each frame.

    minimise  Σᵢ wᵢ aᵢᵖ - Σᵢ fᵢ aᵢ + ½ Σⱼ ρⱼ (bⱼ - Σᵢ Aⱼᵢ aᵢ)²   with  lowest ≤ aᵢ ≤ 1

f is 0 but where a recorded activation is to be kept near (λ (a - e)² is λ a² - 2 λ e a). With
activation dynamics, limits of a frame follow from the activation of the one before.

Rows j are the moments that muscles have to make, with so large a weight ρ that what is left, the
reserve, is nearly nothing; or a contact force, with a small one, if the criterion wants it low.

The dual problem has one unknown a row, seven at most, and is smooth and convex; Newton's method
(`dual_newton`) solves a frame in some ten steps. Four solvers were tried on 100 frames of 40
muscles and 6 rows: quadprog and daqp give the same activations to 1e-15, clarabel and osqp to 1e-5.
Newton's method took 1 ms, daqp 50, quadprog 180, clarabel 560, osqp 850; none takes a³ but
clarabel, which needs cones for it, and each would be a further dependency.
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.kinetics.musculature.dual_newton import share_frames


@dataclass(frozen=True)
class SharingSettings:
    """Bounds of activations."""

    lowest: float = 0.0
    """Least activation. OpenSim's 0.01 of all muscles about the knee presses it with a third of a
    body weight, at rest, too."""
    lowest_of_roots: float = 1e-3
    """Of exponents above 2: at 0 an activation rises infinitely fast with what it is worth, and one
    frame of a thousand would not be solved."""
    precision: float = 1e-9


SHARING: Final = SharingSettings()


@dataclass(frozen=True)
class Criterion:
    """What muscles are assumed to keep small.

    Attributes
    ----------
    name : of this criterion.
    exponent : p of aᵢᵖ, 2 or more.
    by_volume : whether a muscle counts by its volume.
    weights : factor on muscles by name; others count once.
    knee, hip : weights of the squares of the knee's axial contact force and of the hip's contact
        force, in body weights.
    source : who uses it.
    """

    name: str
    exponent: float = 2.0
    by_volume: bool = False
    weights: dict[str, float] = field(default_factory=dict)
    knee: float = 0.0
    hip: float = 0.0
    source: str = ""


_GASTROCNEMIUS = dict.fromkeys(("gasmed", "gaslat"), 7.0)
_HAMSTRINGS = dict.fromkeys(("bflh", "semimem", "semiten"), 3.0)

CRITERIA: Final[dict[str, Criterion]] = {
    each.name: each
    for each in (
        Criterion("squares", source="Crowninshield 1978; OpenSim's static optimisation"),
        Criterion("cubes", exponent=3.0, source="Crowninshield and Brand 1981"),
        Criterion("volume", by_volume=True, source="Happee 1994; Rajagopal et al. 2016"),
        Criterion(
            "spared knee",
            weights=_GASTROCNEMIUS | _HAMSTRINGS,
            source="after Uhlrich et al. 2022, Sci Rep 12:9842; weights not checked against print",
        ),
        Criterion(
            "contact",
            knee=0.1,
            hip=0.1,
            source="squares, with the forces of hip and knee; near to what implanted knees carry",
        ),
        Criterion(
            "contact by volume",
            by_volume=True,
            knee=0.1,
            hip=0.1,
            source="volume, with the forces of hip and knee; nearest to the EMG of five people",
        ),
    )
}
"""Criteria by name.

What was chosen on whom. That contact forces belong in a criterion at all was first tried on the man
with the instrumented knee; others found it on hips (FreeBody's cost: stress squared and hip force,
doi 10.3389/fbioe.2022.995279). Their weight, 0.1, is of ten healthy walkers, none of whom has an
implant (`muscle_criteria` at 60ee3cba): of 0, 0.01, 0.03, 0.1, 0.3 and 1, their mean
activations are nearest to Perry's EMG of 27 muscles with it.

That muscles count by volume, five people with EMG of their own chose, with neither an implant nor a
place among the ten (`emg_criteria` at 60ee3cba). Their mean correlation is 0.67 with `contact
by volume`, 0.64 with `contact`, more in each of the five, and 0.64 with `squares`. EMG alone would
ask for no weight of contact forces at all (`volume`: 0.68); but the hips of those three who were
imported would then be 4.0 body weights, counted as those of ten people with implants were, 2.47,
where with `contact by volume` they are 3.6, and knees would be far off what any implant measured.
So the weight stayed. The figures of the man with the instrumented knee by both criteria were known
when this was decided, and spoke against it: 0.34 body weights off (RMS), 0.32 with `contact`."""


@dataclass(frozen=True)
class Shares:
    """Solution of N problems.

    Attributes
    ----------
    activations : (N, m).
    left : (N, r), b less Σ A a: the reserves of moment rows.
    multipliers : (N, r), to start a similar problem from.
    solved : (N,) whether the equations hold; elsewhere the values are the best found.
    """

    activations: Array
    left: Array
    multipliers: Array
    solved: Flags


def solve(
    rows: Array,
    wanted: Array,
    stiffness: Array,
    weights: Array,
    *,
    exponent: float = 2.0,
    lowest: float = SHARING.lowest,
    favour: Array | None = None,
    limits: tuple[float, float] = (1.0, 1.0),
    start: Array | None = None,
) -> Shares:
    """Share N frames: `rows` A (N, r, m), `wanted` b (N, r), `stiffness` ρ (r,) or (N, r),
    `weights` w (m,) or (N, m), `favour` f (N, m). `limits` are the largest share of itself that an
    activation loses from frame to frame, and of what is left to 1 that it gains. `start` (N, r) are
    multipliers to begin at.

    Raises ValueError for shapes that do not fit, exponents below 2 and values that are not finite.
    """
    rows, wanted = np.asarray(rows, float), np.asarray(wanted, float)
    count, r, m = rows.shape
    if wanted.shape != (count, r):
        raise ValueError(f"wanted must have shape ({count}, {r}), but it has {wanted.shape}")
    if exponent < 2.0:
        raise ValueError(f"exponent must be 2 or more, but is {exponent}")
    if not (np.isfinite(rows).all() and np.isfinite(wanted).all()):
        raise ValueError("rows and wanted must be finite")
    softness = np.array(np.broadcast_to(1.0 / np.asarray(stiffness, float), (count, r)))
    weights = np.array(np.broadcast_to(np.asarray(weights, float), (count, m)))
    multipliers = np.zeros((count, r)) if start is None else np.array(start, float)
    activations, solved = np.empty((count, m)), np.empty(count, dtype=bool)
    if exponent > 2.0:
        lowest = max(lowest, SHARING.lowest_of_roots)
    rows, wanted = np.ascontiguousarray(rows), np.ascontiguousarray(wanted)
    favoured = np.zeros((count, m)) if favour is None else np.array(favour, float)
    share_frames(
        rows, wanted, softness, weights, exponent, lowest, favoured, *limits, SHARING.precision,
        multipliers, activations, solved,
    )  # fmt: skip
    left = wanted - np.einsum("nri,ni->nr", rows, activations)
    return Shares(activations, left, multipliers, solved)
