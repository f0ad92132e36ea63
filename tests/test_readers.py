"""Every door has one reader: whatever reads a file is behind the gate (`file_gate`)."""

import ast
from pathlib import Path

from file_readers import OWN, readers, readers_in


def test_every_reader_is_behind_the_gate():
    outside = [each for each in readers() if not each.gated]
    assert not outside, (
        "read it by file_gate, or say in OWN of support/file_readers.py whose it is:\n"
        + "\n".join(f"{each.place} (line {each.line}): {each.call}" for each in outside)
    )


def test_every_exception_is_a_reader_still():
    assert not OWN.keys() - {each.place for each in readers()}


def test_readers_are_found():
    """Else the first test proves nothing."""
    found = {each.place for each in readers()}
    assert len(found) > 25
    here = {"gaitval/_internal/io/artefacts.py:read_arrays", "gaitval/policy/storage.py:_read"}
    assert here <= found


def test_the_gate_counts_for_the_file_that_it_was_given_before():
    def gated(*lines: str) -> bool:
        text = "def f(path, other):\n" + "".join(f"    {line}\n" for line in lines)
        (found,) = readers_in(text, "gaitval/_internal/text/display.py")
        return found.gated

    gate = "file_gate.passed(path, E, largest=9)"
    assert gated(gate, "np.load(path)")
    assert gated(f"np.load({gate})")
    assert gated(f"known = {gate}", "np.load(known)")
    assert gated("text = file_gate.read_text(path, E, largest=9)", "pd.read_csv(io.StringIO(text))")
    assert not gated(gate, "np.load(other)")
    assert not gated("np.load(path)", gate)


def test_sources_are_those_of_the_package_and_its_applications():
    places = [Path(each.place) for each in readers()]
    assert {each.parts[0] for each in places} == {"gaitval"}
    assert any(each.parts[1] == "apps" for each in places)
    assert all(ast.parse(each.call) for each in readers())
