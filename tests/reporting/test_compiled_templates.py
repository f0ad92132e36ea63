"""Compiled templates are kept, and only what this user wrote is taken."""

import os

import jinja2
import pytest

from gaitval.reporting import compiled_templates
from gaitval.reporting.compiled_templates import CompiledTemplates

pytestmark = pytest.mark.skipif(os.name != "posix", reason="folders as POSIX has them")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """That of the templates, in a cache of this test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    compiled_templates._folder.cache_clear()
    yield tmp_path / "gaitval" / "templates"
    compiled_templates._folder.cache_clear()


def rendered(monkeypatch, source="{{ 1 + one }}"):
    """A page by a new environment, and how many templates were compiled for it."""
    compiled = []
    generate = jinja2.Environment._generate

    def counted(*arguments, **named):
        compiled.append(1)
        return generate(*arguments, **named)

    monkeypatch.setattr(jinja2.Environment, "_generate", counted)
    loader = jinja2.DictLoader({"page": source})
    environment = jinja2.Environment(loader=loader, bytecode_cache=CompiledTemplates())
    page = environment.get_template("page").render(one=1)
    monkeypatch.setattr(jinja2.Environment, "_generate", generate)
    return page, len(compiled)


def test_a_template_is_compiled_once(folder, monkeypatch):
    assert rendered(monkeypatch) == ("2", 1)
    assert rendered(monkeypatch) == ("2", 0)
    assert rendered(monkeypatch, "{{ 2 + one }}") == ("3", 1)
    assert folder.stat().st_mode & 0o077 == 0


def test_what_somebody_else_wrote_is_not_run(folder, monkeypatch, tmp_path):
    rendered(monkeypatch)
    (kept,) = folder.iterdir()
    good, mark = kept.read_bytes(), tmp_path / "mark"
    for content in (b"", good[:20], good[:-1] + b"x", bytes(32) + good[32:]):
        kept.write_bytes(content)
        assert rendered(monkeypatch) == ("2", 1)
    evil = jinja2.Environment().compile(f"{{{{ open('{mark}') }}}}", raw=False)
    bucket = jinja2.bccache.Bucket(jinja2.Environment(), kept.name, "checksum")
    bucket.code = evil
    kept.write_bytes(good[:32] + bucket.bytecode_to_string())
    assert rendered(monkeypatch) == ("2", 1)
    assert rendered(monkeypatch) == ("2", 0)
    # and one of another template
    assert rendered(monkeypatch, "other")[1] == 1


def test_without_a_folder_it_is_compiled_each_time(folder, monkeypatch):
    def refuse():
        raise compiled_templates.ConfigurationError("no folder")

    monkeypatch.setattr(compiled_templates, "own_cache", refuse)
    assert rendered(monkeypatch) == ("2", 1)
    assert rendered(monkeypatch) == ("2", 1)
