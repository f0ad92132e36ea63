"""The documentation site builds without a warning, has a place for everything, and leads nowhere
that is not there.
"""

import importlib
from pathlib import Path

import docs_links
import docs_pages
import pytest
import yaml
from typer.main import get_command

from gaitval.cli import app
from gaitval.configuration import Configuration
from gaitval.metrics.tolerances import load_registry

ROOT = Path(__file__).parents[2]
BUILT = pytest.mark.slow  # `make docs` builds the site, with warnings as errors, and checks links
NO_EXTRA = "the extra `docs` is not installed; `make docs` installs it"


@pytest.fixture(scope="module")
def hooks():
    pytest.importorskip("mkdocs", reason=NO_EXTRA)
    pytest.importorskip("latex2mathml", reason=NO_EXTRA)
    return importlib.import_module("docs_hooks")


@pytest.fixture(scope="module")
def site(request):
    """The site as `make docs` has built it."""
    built = request.config.getoption("--site")
    if built is None:
        pytest.skip("no site: `make docs`, then --site=site")
    return Path(built).resolve(strict=True)


@BUILT
def test_the_site_builds_with_warnings_as_errors(site):
    """Links are checked as it is built (`on_post_build`)."""
    assert yaml.load((ROOT / "mkdocs.yml").read_text(), yaml.BaseLoader)["strict"] == "true"
    assert (site / "index.html").is_file()
    assert "<math" in (site / "method.html").read_text(encoding="utf-8")
    assert "arithmatex" not in (site / "method.html").read_text(encoding="utf-8")


@BUILT
def test_the_reference_shows_docstrings(site):
    page = (site / "reference" / "model.html").read_text(encoding="utf-8")
    assert "gaitval.model.parameters.apply_parameters" in page
    assert "The model with its leg lengths and joint positions changed by mu." in page


def test_every_folder_of_the_package_has_a_page():
    folders = {path.parent.name for path in (ROOT / "gaitval").glob("[!_]*/__init__.py")}
    assert set(docs_pages.FOLDERS) == folders
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for page, _ in docs_pages.generated():
        assert page in nav, page


def test_every_setting_is_in_the_configuration_page():
    page = docs_pages.configuration_page()
    for name, field in Configuration.model_fields.items():
        assert f"## {name}" in page
        for key in getattr(field.annotation, "model_fields", {}):
            assert f"| `{key}` |" in page, (name, key)


def test_every_command_and_option_is_in_the_command_page():
    page = docs_pages.commands_page()
    for name, command in get_command(app).commands.items():
        for part, each in getattr(command, "commands", {"": command}).items():
            assert f"## {' '.join(['gaitval', name, part]).strip()}" in page
            for parameter in each.params:
                assert all(f"`{option}`" in page for option in parameter.opts), (name, parameter)


def test_every_limit_is_in_the_limits_page_with_its_source():
    page = docs_pages.limits_page()
    for entry in load_registry().tolerance:
        assert entry.title in page
        assert entry.citation in page


def test_links_into_the_repository_lead_to_the_page_that_shows_the_file(hooks):
    def led(link: str) -> str:
        return hooks.with_links(f"[x]({link})", "how-to/formats.md", "docs/how-to/formats.md")

    assert led("../../gaitval/configuration.py") == "[x](../reference/configuration.md)"
    assert led("../learning.md#ablations") == "[x](../learning.md#ablations)"
    assert led("../../LICENSE") == "x (`LICENSE`)"
    assert led("../../no_such") == "[x](../../no_such)"  # left for mkdocs to refuse


def test_broken_links_are_found(tmp_path):
    (tmp_path / "b.html").write_text('<h1 id="here">B</h1>')
    (tmp_path / "a.html").write_text(
        '<a href="b.html#here">x</a><a href="b.html#there">x</a><a href="c.html">x</a>'
        '<script src="https://somewhere/x.js"></script><a href="https://somewhere">x</a>'
    )
    assert docs_links.broken_links(tmp_path) == [
        "a.html: b.html#there leads to no such anchor",
        "a.html: c.html leads to no file",
        "a.html: https://somewhere/x.js is loaded from the network",
    ]
