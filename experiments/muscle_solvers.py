"""How fast and how equal solvers are at sharing moments to muscles.

    pip install daqp quadprog clarabel osqp
    python -m experiments.muscle_solvers

100 frames of 40 muscles and 6 rows, as `gaitval.musculature.sharing` has them. Nothing is shipped.
"""

import time
from collections.abc import Callable

import clarabel
import daqp
import numpy as np
import osqp
import quadprog
from scipy import sparse

from gaitval.arrays import Array
from gaitval.musculature.sharing import LOWEST, solve

FRAMES, ROWS, MUSCLES = 100, 6, 40


def problem() -> tuple[Array, Array]:
    """Arms times forces (frames, rows, muscles) Nm, and moments (frames, rows) that can be made."""
    random = np.random.default_rng(0)
    shape = FRAMES, ROWS, MUSCLES
    arms = 40 * random.normal(size=shape) * (random.random(shape) < 0.4)
    return arms, np.einsum("nri,ni->nr", arms, random.random((FRAMES, MUSCLES)) ** 3)


def by_quadprog(arms: Array, moment: Array) -> Array:
    """Activations of a frame; reserves are unknowns of their own, here and below."""
    count = MUSCLES + ROWS
    bounds = np.vstack([np.eye(MUSCLES), np.zeros((ROWS, MUSCLES))])
    sides = np.hstack([np.vstack([arms.T, np.eye(ROWS)]), bounds, -bounds])
    right = np.r_[moment, np.full(MUSCLES, LOWEST), -np.ones(MUSCLES)]
    return quadprog.solve_qp(2 * np.eye(count), np.zeros(count), sides, right, meq=ROWS)[0]


def by_daqp(arms: Array, moment: Array) -> Array:
    """As `by_quadprog`."""
    count, free = MUSCLES + ROWS, np.full(ROWS, 1e30)
    equal = np.r_[np.zeros(count), np.full(ROWS, 5)].astype(np.int32)
    upper, lower = np.r_[np.ones(MUSCLES), free], np.r_[np.full(MUSCLES, LOWEST), -free]
    rows = np.ascontiguousarray(np.hstack([arms, np.eye(ROWS)]))
    found = daqp.solve(
        2 * np.eye(count), np.zeros(count), rows, np.r_[upper, moment], np.r_[lower, moment], equal
    )
    return found[0]


def by_clarabel(arms: Array, moment: Array) -> Array:
    """As `by_quadprog`."""
    count, bounds = MUSCLES + ROWS, np.hstack([np.eye(MUSCLES), np.zeros((MUSCLES, ROWS))])
    rows = sparse.csc_matrix(np.vstack([np.hstack([arms, np.eye(ROWS)]), bounds, -bounds]))
    right = np.r_[moment, np.ones(MUSCLES), np.full(MUSCLES, -LOWEST)]
    cones = [clarabel.ZeroConeT(ROWS), clarabel.NonnegativeConeT(2 * MUSCLES)]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cost = sparse.diags([2.0] * count).tocsc()
    solver = clarabel.DefaultSolver(cost, np.zeros(count), rows, right, cones, settings)
    return np.array(solver.solve().x)


def by_osqp(arms: Array, moment: Array) -> Array:
    """As `by_quadprog`."""
    count, bounds = MUSCLES + ROWS, np.hstack([np.eye(MUSCLES), np.zeros((MUSCLES, ROWS))])
    rows = sparse.csc_matrix(np.vstack([np.hstack([arms, np.eye(ROWS)]), bounds]))
    lower = np.r_[moment, np.full(MUSCLES, LOWEST)]
    upper = np.r_[moment, np.ones(MUSCLES)]
    solver = osqp.OSQP()
    cost = sparse.diags([2.0] * count).tocsc()
    precise = {"eps_abs": 1e-6, "eps_rel": 1e-6, "max_iter": 20000}
    solver.setup(cost, np.zeros(count), rows, lower, upper, verbose=False, **precise)
    return solver.solve().x


def main() -> None:
    """Time and compare."""
    arms, moments = problem()
    solve(arms, moments, 2.0, np.ones(MUSCLES))  # compile
    start = time.perf_counter()
    ours = solve(arms, moments, 2.0, np.ones(MUSCLES)).activations
    print(f"gaitval {1e3 * (time.perf_counter() - start):.0f} ms")
    others: dict[str, Callable[[Array, Array], Array]] = {
        "quadprog": by_quadprog,
        "daqp": by_daqp,
        "clarabel": by_clarabel,
        "osqp": by_osqp,
    }
    for name, other in others.items():
        start = time.perf_counter()
        found = [other(*frame)[:MUSCLES] for frame in zip(arms, moments, strict=True)]
        took = 1e3 * (time.perf_counter() - start)
        print(f"{name} {took:.0f} ms, activations differ by {np.abs(found - ours).max():.1e}")


if __name__ == "__main__":
    main()
