"""Every door has one reader: whatever reads a file is behind the gate (`file_gate`)."""

import ast
from pathlib import Path

import pytest
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


NEW = (
    "open(path)",
    "open(path, 'rb')",
    "open(path, mode='r+')",
    "path.open()",
    "path.open('rb')",
    "os.open(path, 0)",
    "path.read_text()",
    "Path(name).read_bytes()",
    "np.load(path)",
    "np.loadtxt(path)",
    "numpy.fromfile(path)",
    "pd.read_csv(path)",
    "pd.read_excel(path)",
    "pandas.read_parquet(path)",
    "json.load(path)",
    "tomllib.load(path)",
    "tomllib.loads(text)",
    "pickle.loads(data)",
    "torch.load(path)",
    "ElementTree.parse(path)",
    "ET.parse(path)",
    "ezc3d.c3d(path)",
    "load_file(path)",
    "safe_open(path, 'pt')",
    "sqlite3.connect(path)",
    "zipfile.ZipFile(path)",
    "gzip.open(path)",
    "shutil.copyfile(path, other)",
)


@pytest.mark.parametrize("call", NEW)
def test_a_new_reader_is_found(call):
    (found,) = readers_in(f"def f(path):\n    return {call}\n", "gaitval/_internal/text/display.py")
    assert not found.gated
    assert found.place == "gaitval/_internal/text/display.py:f"
    (found,) = readers_in(f"{call}\n", "gaitval/_internal/text/display.py")
    assert not found.gated, "outside of functions as well"


@pytest.mark.parametrize("call", ["open(path, 'w')", "path.open('ab')", "model.load(path)",
                                  "file_gate.read_text(path, RecordError, largest=9)",
                                  "read_json(path)", "os.fdopen(handle, 'w')"])  # fmt: skip
def test_what_writes_or_is_the_gate_is_none(call):
    text = f"def f(path):\n    return {call}\n"
    assert not list(readers_in(text, "gaitval/_internal/text/display.py"))


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
