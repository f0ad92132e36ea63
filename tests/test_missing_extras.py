"""Which extra has a library that is not installed."""

import tomllib
from pathlib import Path

import pytest

from gaitval._internal.text.missing_extras import EXTRAS, need, raise_named
from gaitval.errors import ConfigurationError


@pytest.mark.parametrize(
    ("library", "extra"),
    [("torch", "study"), ("tensorboard", "study"), ("distributed", "cohort")],
)
def test_the_extra_is_named_that_has_the_library(library: str, extra: str) -> None:
    error = ModuleNotFoundError(f"No module named '{library}'", name=f"{library}.nn")
    with pytest.raises(ConfigurationError, match=rf"{library} .*gaitval\[{extra}\]"):
        raise_named(error)


def test_what_is_of_no_extra_is_another_fault() -> None:
    raise_named(ModuleNotFoundError("No module named 'nobody'", name="nobody"))
    raise_named(ImportError("cannot import name 'x' from 'torch'", name="torch"))


def test_what_may_be_named_are_the_extras_of_who_uses_gaitval() -> None:
    text = (Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    extras = tomllib.loads(text)["project"]["optional-dependencies"]
    assert set(extras["all"][0][len("gaitval[") : -1].split(",")) == set(EXTRAS)
    for place, extra in enumerate(EXTRAS):
        wanted = "".join(line for line in extras[extra] if line.startswith("gaitval["))
        assert not any(later in wanted for later in EXTRAS[place:]), extra


def test_what_is_there_is_no_problem() -> None:
    need("numpy", "json")
