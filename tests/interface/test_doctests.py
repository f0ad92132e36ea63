"""The example of every public function runs, and prints what it says."""

import doctest
import inspect
from pathlib import Path

import pytest
from html_page import only_html

import gaitval

SECTIONS = ("Parameters", "Returns", "Raises", "References", "Examples")


LONG = ("compare", "rollout", "write_report")
"""Examples that walk or write whole pages."""
EXAMPLES = [
    pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in gaitval.__all__
]


@pytest.mark.usefixtures("policy")
@pytest.mark.parametrize("name", EXAMPLES)
def test_example(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    only_html(monkeypatch)
    function = getattr(gaitval, name)
    (found,) = doctest.DocTestFinder(recurse=False).find(function, name, globs={})
    assert found.examples, f"{name} has no example"
    result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(found)
    assert result.failed == 0


@pytest.mark.parametrize("name", gaitval.__all__)
def test_documentation_is_whole(name: str):
    function = getattr(gaitval, name)
    text = inspect.getdoc(function) or ""
    assert [section for section in SECTIONS if f"\n{section}\n---" not in text] == []
    # Data come by position, all that has a default by name.
    options = [
        p for p in inspect.signature(function).parameters.values() if p.default is not p.empty
    ]
    assert all(each.kind is inspect.Parameter.KEYWORD_ONLY for each in options)
