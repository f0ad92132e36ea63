"""numba for all compiled functions, with a cache that notices every change of their sources.

numba's cache checks only the function's own file: after an edit of `forces.py`, a compiled
function of `walker.py` that calls into it would still run the old code. So the cache is in a folder
named by the hash of all files with compiled functions or with constants that these read.
"""

import hashlib
import multiprocessing
import os
import sys
from functools import cache
from pathlib import Path
from typing import Any, Final

import numba
from numba.core import event

from gaitval._internal.numba.cache_home import own_cache, own_folder
from gaitval._internal.numba.compiled_cache import SealedCache, key_in

PACKAGE: Final = Path(__file__).parents[2]
SOURCES = (
    "apps/devices/hinge_step.py",
    "_internal/numba/compiled.py",
    "_internal/numba/compiled_cache.py",
    *(f"walk/contact/{file.name}" for file in sorted((PACKAGE / "walk" / "contact").glob("*.py"))),
    "constants.py",
    "coordinates.py",
    "kinetics/inverse/change_splines.py",
    "kinetics/inverse/inverse_dynamics.py",
    "kinetics/inverse/marked_body.py",
    "kinetics/inverse/marker_derivatives.py",
    "kinetics/inverse/model_fit_solver.py",
    "kinetics/inverse/motion_rates.py",
    "kinetics/inverse/newton_euler.py",
    "kinetics/inverse/pose_solver.py",
    "kinetics/inverse/residual_derivatives.py",
    "model/body.py",
    "model/ground.py",
    "_internal/numba/lanes.py",
    "metrics/torques.py",
    "model/tree.py",
    "kinetics/musculature/dual_newton.py",
    "policy/judgement.py",
    "policy/observation.py",
    "policy/policy_update.py",
    "policy/reward.py",
    "policy/walking_group.py",
    "walk/reference/harmonic_square.py",
    "walk/reference/walking_laws.py",
    "walk/simulation/dynamics.py",
    "walk/simulation/physics_steps.py",
    "walk/simulation/side_by_side.py",
    "walk/simulation/tables.py",
)


# numba reads a file of settings in the current folder, now and whenever it compiles. When gaitval
# imports it, it does not see that file (`current_folder`); what it has seen before is dropped here.
_settings: Any = numba.core.config
_settings._config_fname = ""
_settings.reload_config()


@cache
def _sources() -> str:
    """A hash of all sources, for numba does not record which compiled function calls which: an edit
    of one file must discard every function that might have inlined it. And of numba's version, so
    that installations with another one do not overwrite each other's.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for name in SOURCES:
        digest.update((PACKAGE / name).read_bytes())
    return digest.hexdigest()[:16]


@cache
def _own_folder(_surroundings: tuple[str | None, ...]) -> Path:
    # numba's own settings do not count: a file in the current folder could have made them.
    given = Path(os.environ.get("NUMBA_CACHE_DIR", ""))
    return own_folder(given) if given.is_absolute() else own_cache()


def _cache_folder() -> Path:
    """The folder of what is compiled of these sources. Raises ConfigurationError if it is in one
    that others can write to.
    """
    environment = tuple(map(os.environ.get, ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME")))
    return _own_folder(environment) / f"numba-{_sources()}"


class _Announcer(event.Listener):
    """Prints a line, once, when something is compiled."""

    def __init__(self) -> None:
        self._said = False

    def on_start(self, event: Any) -> None:
        # a worker process would repeat what its parent has printed already
        if not self._said and multiprocessing.parent_process() is None:
            self._said = True
            how = "for the first time, once, about a minute"
            print(f"gaitval: compiling {how} ...", file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass


@cache
def _announce(folder: Path) -> None:
    """From now on print a line when something is compiled, if the cache `folder` has nothing."""
    if not folder.is_dir() or not any(folder.iterdir()):
        # The listener lives as long as the process.
        event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]


def _compiled(function: Any, **options: Any) -> Any:
    folder = _cache_folder()
    _announce(folder)
    # No `fastmath`: it may reorder sums, and results would differ between processors and between
    # lanes and doubles.
    found: Any = numba.njit(error_model="numpy", **options)(function)
    if found is not function:  # NUMBA_DISABLE_JIT
        found._cache = SealedCache(function, folder, key_in(folder.parent))
    return found


def njit(function: Any) -> Any:
    """Compile a module's `function` with numba on its first call, or load it from the cache.
    Division by zero gives infinity or NaN, as in NumPy.

    Its file must be one of `SOURCES`: of others, numba checks no more than the function's own.
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
