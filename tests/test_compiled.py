"""The cache of compiled functions sees every source that goes into them."""

from pathlib import Path

import gaitval
from gaitval.compiled import SOURCES

PACKAGE = Path(gaitval.__file__).parent


def test_every_file_with_compiled_functions_names_the_cache():
    compiled = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if "\n@njit" in path.read_text(encoding="utf-8")
    }
    assert compiled
    assert compiled <= set(SOURCES)


def test_all_sources_exist():
    assert all((PACKAGE / name).is_file() for name in SOURCES)
