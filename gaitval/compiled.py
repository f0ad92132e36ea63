"""numba for all compiled functions, with a cache that notices every change of their sources.

numba's cache checks only the function's own file: after an edit of `forces.py`, a compiled
function of `walker.py` that calls into it would still run the old code. So the cache is in a folder
named by the hash of all files with compiled functions or with constants that these read.
"""

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import event

from gaitval.cache_home import cache_home

SOURCES = (
    "compiled.py",
    *(f"contact/{file.name}" for file in sorted((Path(__file__).parent / "contact").glob("*.py"))),
    "constants.py",
    "coordinates.py",
    "inverse/inverse_dynamics.py",
    "inverse/marked_body.py",
    "inverse/marker_derivatives.py",
    "inverse/model_fit_solver.py",
    "inverse/motion_rates.py",
    "inverse/newton_euler.py",
    "inverse/pose_solver.py",
    "model/body.py",
    "lanes.py",
    "model/tree.py",
    "policy/judgement.py",
    "policy/observation.py",
    "policy/policy_update.py",
    "policy/reward.py",
    "policy/walking_group.py",
    "reference/harmonic_square.py",
    "reference/walking_laws.py",
    "simulation/dynamics.py",
    "simulation/physics_steps.py",
    "simulation/side_by_side.py",
    "simulation/tables.py",
)


def _cache_folder() -> Path:
    # All sources in one hash: numba does not record which compiled function calls which, so an edit
    # of one file must discard every function that might have inlined it.
    digest = hashlib.sha256()
    for name in SOURCES:
        digest.update((Path(__file__).parent / name).read_bytes())
    return cache_home() / "gaitval" / f"numba-{digest.hexdigest()[:16]}"


class _WhenCompiling(event.Listener):
    """Loads what says that numba compiles when it does."""

    def __init__(self, *, first: bool) -> None:
        self._first = first
        self._announcer: Any = None

    def on_start(self, event: Any) -> None:
        if self._announcer is None:
            from gaitval.compiling import Announcer

            self._announcer = Announcer(first=self._first)
        self._announcer.on_start(event)

    def on_end(self, event: Any) -> None:
        self._announcer.on_end(event)


def _kept_in() -> Path:
    settings: Any = numba.config
    return Path(settings.CACHE_DIR or _cache_folder())  # the former is NUMBA_CACHE_DIR, if set


def is_empty(folder: Path | None = None) -> bool:
    """Whether nothing was compiled before: the cache `folder`, by default that of this package as
    it is, has no files.
    """
    folder = folder or _kept_in()
    return not folder.is_dir() or not any(folder.iterdir())


@cache
def _announce(folder: Path) -> None:
    """From now on print a line when something is compiled that is not in the cache `folder`."""
    # The listener lives as long as the process.
    event.register(  # type: ignore[no-untyped-call]
        "numba:compile", _WhenCompiling(first=is_empty(folder))
    )


def _compiled(function: Any, **options: Any) -> Any:
    settings: Any = numba.config
    before = settings.CACHE_DIR
    # numba reads the folder when the decorator runs, not when the function is first called, so it
    # only needs to be set here and other packages' functions keep their own.
    settings.CACHE_DIR = str(_kept_in())
    _announce(Path(settings.CACHE_DIR))
    try:
        # No `fastmath`: it may reorder sums, and results would differ between processors and
        # between lanes and doubles.
        return numba.njit(cache=True, error_model="numpy", **options)(function)
    finally:
        settings.CACHE_DIR = before


def njit(function: Any) -> Any:
    """Compile a module's `function` with numba on its first call, or load it from the cache.
    Division by zero gives infinity or NaN, as in NumPy.

    Its file must be one of `SOURCES`. A wing's function may call what is compiled in those and in
    its own file, which numba checks itself.
    """
    return _compiled(function)


def njit_borrowing(function: Any) -> Any:
    """`njit` for a `function` that neither creates nor returns arrays (numba refuses one that
    does): it works in those it is given, which outlive the call, so numba need not count references
    to them. Counting every view and every tuple member took a third of the time of a physics step.
    """
    return _compiled(function, _nrt=False)


def njit_unlocked(function: Any) -> Any:
    """`njit` for a `function` that runs beside others in threads: it holds no lock of Python's, and
    must only write to arrays that no other thread touches.
    """
    return _compiled(function, nogil=True)
