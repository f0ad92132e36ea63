"""Which extra has a library that is not installed."""

import pytest

from gaitval.errors import ConfigurationError
from gaitval.missing_extras import need, raise_named


@pytest.mark.parametrize(("library", "extra"), [("torch", "study"), ("weasyprint", "pages")])
def test_the_extra_is_named_that_has_the_library(library: str, extra: str) -> None:
    error = ModuleNotFoundError(f"No module named '{library}'", name=f"{library}.nn")
    with pytest.raises(ConfigurationError, match=rf"{library} .*gaitval\[{extra}\]"):
        raise_named(error)


def test_what_is_of_no_extra_is_another_fault() -> None:
    raise_named(ModuleNotFoundError("No module named 'nobody'", name="nobody"))
    raise_named(ImportError("cannot import name 'x' from 'torch'", name="torch"))


def test_what_is_there_is_no_problem() -> None:
    need("numpy", "json")
