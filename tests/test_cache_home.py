"""Where compiled code is kept, and what is said where it cannot be."""

import os
from pathlib import Path

import pytest

from gaitval._internal.numba.cache_home import cache_home
from gaitval.errors import ConfigurationError


def test_it_is_what_the_user_says_or_in_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "new" / "cache"))
    assert cache_home() == tmp_path / "new" / "cache"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_home() == tmp_path / ".cache"


def test_without_a_home_folder_the_way_out_is_said(monkeypatch):
    def none():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", none)
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(ConfigurationError, match="XDG_CACHE_HOME"):
        cache_home()
