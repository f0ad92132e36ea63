"""`njit` for all compiled functions, with a cache that sees every change of their sources.

numba's cache looks at the file of a function alone: after an edit of `contact.py` a compiled
function of `walker.py` that calls into it would go on with the old code. So the cache lies in a
folder named by the hash of all files with compiled functions or constants that these read.
"""

import hashlib
import os
from pathlib import Path
from typing import Any

import numba

SOURCES = (
    "compiled.py",
    "coordinates.py",
    "kinematics/body_fit.py",
    "kinematics/consistency.py",
    "kinematics/dynamic_fit.py",
    "kinematics/inverse_dynamics.py",
    "kinematics/inverse_kinematics.py",
    "kinematics/tree.py",
    "policy/environment.py",
    "scaling/model.py",
    "simulation/contact.py",
    "simulation/dynamics.py",
    "simulation/walker.py",
)


def _cache_folder() -> Path:
    digest = hashlib.sha256()
    for name in SOURCES:
        digest.update((Path(__file__).parent / name).read_bytes())
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "gaitval" / f"numba-{digest.hexdigest()[:16]}"


def njit(function: Any) -> Any:
    """Compile a function with numba on its first call, or load it from the cache."""
    settings: Any = numba.config
    before = settings.CACHE_DIR  # NUMBA_CACHE_DIR of the user, if set
    settings.CACHE_DIR = before or str(_cache_folder())
    try:
        return numba.njit(cache=True)(function)
    finally:
        settings.CACHE_DIR = before
