"""XML from outside: nothing but its elements is read."""

from pathlib import Path

import pytest

from gaitval.errors import ModelError
from gaitval.model.safe_xml import DEPTH, parse_xml


def parsed(content: bytes):
    return parse_xml(Path("a.xml"), content, root="a", kind="a test")


def test_texts_and_attributes_are_kept():
    root = parsed(b'<?xml version="1.0"?><a><b c="d">one &amp; two<!-- no --></b></a>')
    assert root.findtext("b") == "one & two"
    assert root.find("b").get("c") == "d"


def test_depth_is_bounded():
    assert parsed(b"<a>" * DEPTH + b"</a>" * DEPTH).tag == "a"
    with pytest.raises(ModelError, match="lie in each other"):
        parsed(b"<a>" * (DEPTH + 1) + b"</a>" * (DEPTH + 1))


def test_entities_are_not_read():
    bomb = b'<!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;&b;">]><a>&c;</a>'
    with pytest.raises(ModelError, match="document type"):
        parsed(bomb)
    with pytest.raises(ModelError, match="undefined entity"):
        parsed(b"<a>&c;</a>")
