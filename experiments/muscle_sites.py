"""Compute the sites that tendons of MuJoCo run through, so that they are as long as our muscles.

    python -m experiments.muscle_sites gaitval/kinetics/musculature/sites.json

MuJoCo knows tendons along straight lines between sites, and no polynomial. For each of the 40
muscles of a leg of the published size, sites on the segments of our body are found with which the
tendon's length is `own_coordinates.own_lengths` over gait (nonlinear least squares, from the line
of action of the muscle). Where one strand is not near enough, two share the muscle (a pulley), and
then three. Minutes.
"""

import argparse
import itertools
import json
import multiprocessing
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from experiments.muscle_paths import GAIT
from gaitval.kinetics.musculature.own_coordinates import own_lengths
from gaitval.kinetics.musculature.paths import table
from gaitval.kinetics.musculature.strands import SEGMENTS, strand_lengths

GOOD = 0.5e-3
"""m, 95 % of poses: more strands are tried until it is kept."""
PIECES = {
    (True, False, False): [("pelvis", "thigh")],
    (False, True, False): [("thigh", "shank")],
    (False, False, True): [("shank", "foot")],
    (True, True, False): [("pelvis", "shank"), ("pelvis", "thigh", "shank")],
    (False, True, True): [("thigh", "foot"), ("thigh", "shank", "foot")],
}
"""Segments of the sites, by the joints that a muscle spans."""


def poses() -> np.ndarray:
    """(N, 6) rad of gaitval's coordinates over gait, and its ends."""
    unit = qmc.Sobol(6, seed=7).random(512)
    unit = np.clip(1.06 * (unit - 0.5) + 0.5, 0, 1)
    found = GAIT[:, 0] + (GAIT[:, 1] - GAIT[:, 0]) * unit
    found[:, 0] -= table().skeleton.hip_zero
    found[:, 3] -= table().skeleton.knee_zero
    return found


def strands_of(chains: list[tuple[str, ...]], x: np.ndarray) -> list[list[tuple[str, np.ndarray]]]:
    """Sites by strand, of the parameters `x` m in the order of `chains`."""
    points = iter(x[: 3 * sum(len(chain) for chain in chains)].reshape(-1, 3))
    return [[(segment, next(points)) for segment in chain] for chain in chains]


def fitted(number: int) -> dict[str, Any]:
    """The best sites of a muscle."""
    muscle = table().muscles[number]
    angles = poses()
    wanted = own_lengths(angles, np.ones(4))[0][:, number]
    joints = (
        any(i < 3 for i in muscle.coordinates), 3 in muscle.coordinates,
        any(i > 3 for i in muscle.coordinates),
    )  # fmt: skip
    train = np.arange(len(angles)) % 3 != 0
    random = np.random.default_rng(number)
    best = None
    for strands in (1, 2, 3):
        for chains in itertools.combinations_with_replacement(PIECES[joints], strands):
            count = 3 * sum(len(chain) for chain in chains)

            def length(
                x: np.ndarray, rows: np.ndarray, chains: tuple[tuple[str, ...], ...] = chains
            ) -> np.ndarray:
                of = strands_of(list(chains), x)
                return strand_lengths(angles[rows], of, np.ones(4)) / len(of) + x[-1] ** 2

            for _ in range(4 if strands == 1 else 2):
                start = np.append(random.normal(0, 0.04, count), 0.1)
                try:
                    found = least_squares(
                        lambda x, length=length: (length(x, train) - wanted[train]) / 1e-3,
                        start, loss="soft_l1", max_nfev=150, bounds=(-0.35, 0.6),
                    )  # fmt: skip
                except ValueError:
                    continue
                off = np.abs(length(found.x, ~train) - wanted[~train])
                error = float(np.quantile(off, 0.95))
                if best is None or error < 0.8 * best[0]:
                    best = error, chains, found.x
        if best is not None and best[0] < GOOD:
            break
    error, chains, x = best
    strands = [
        [{"segment": s, "at_m": [round(float(v), 6) for v in p]} for s, p in each]
        for each in strands_of(list(chains), x)
    ]
    print(f"{muscle.name:10s} {len(strands)} strands, 95 % {1e3 * error:.2f} mm", flush=True)
    return {
        "muscle": muscle.name, "strands": strands, "more_m": round(float(x[-1] ** 2), 6),
        "error_95_mm": round(1e3 * error, 3),
    }  # fmt: skip


def main() -> None:
    """Fit and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--workers", type=int, default=1)
    arguments = parser.parse_args()
    assert SEGMENTS
    with multiprocessing.Pool(arguments.workers) as pool:
        rows = pool.map(fitted, range(len(table().names)), chunksize=1)
    arguments.out.write_text(json.dumps({"muscles": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
