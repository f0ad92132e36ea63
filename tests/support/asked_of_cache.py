"""Started with Python as `sitecustomize`: notes every compiled function that a process asks numba's
cache for, with the types it is asked for, in the file that CACHE_LOG names. What is asked for and
not there would be compiled."""

import os
from typing import Any

from numba.core.caching import Cache

_load = Cache.load_overload


def _noted(cache: Any, signature: Any, context: Any) -> Any:
    name = cache._name.partition(" at ")[0]
    with open(os.environ["CACHE_LOG"], "a", encoding="utf-8") as log:
        log.write(f"{name}: {signature}\n")
    return _load(cache, signature, context)


if "CACHE_LOG" in os.environ:
    Cache.load_overload = _noted
