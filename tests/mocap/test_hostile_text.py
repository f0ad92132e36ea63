"""Whatever the text is, a reader refuses it in words or gives a recording that can be."""

import re

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from motion_files import forces, recording, trc

from gaitval.errors import RecordError
from gaitval.mocap.mot import read_ground_reaction
from gaitval.mocap.trc import read_trc
from gaitval.mocap.wbds_text import read_wbds_markers

# Examples take milliseconds; the clock of a busy machine must not decide.
FEW = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
TOKENS = st.one_of(
    st.floats().map(repr),
    st.integers().map(str),
    st.text(max_size=8),
    st.sampled_from(["\t", "\n", "\t\t", "1,5", "1e999", "endheader", "Time", "NaN", "inf", "mm"]),
)


def replaced(text: str, place: float, token: str) -> str:
    """The text with the field at a fraction of it (0 to 1) replaced."""
    fields = re.split(r"(\s)", text)
    at = min(int(place * len(fields)), len(fields) - 1)
    return "".join([*fields[:at], token, *fields[at + 1 :]])


@pytest.fixture(scope="module")
def texts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    trc(folder / "a.trc")
    forces(folder / "a.mot")
    names = [f"{name}{axis}" for name in recording().names for axis in "XYZ"]
    rows = np.column_stack([recording().time, 1e3 * recording().markers.reshape(20, -1)])
    lines = ["\t".join(["Time", *names]), *("\t".join(f"{v:.9g}" for v in row) for row in rows)]
    (folder / "amkr.txt").write_text("\n".join(lines) + "\n")
    return {path.suffix: path.read_text() for path in folder.iterdir()}


def read_or_refused(read, path):
    """What was read; None if it was refused by a message that names the file."""
    try:
        return read(path)
    except RecordError as error:
        if str(path) not in str(error):
            raise
        return None


def believable(found):
    """A recording as readers promise it: a rate, and as many names as columns."""
    assert 0.0 < found.marker_rate < np.inf
    assert np.isfinite(found.start)
    assert found.markers.shape[1:] == (len(found.names), 3)
    assert not np.isinf(found.markers).any()


@pytest.mark.parametrize(
    ("suffix", "read"), [(".trc", read_trc), (".txt", read_wbds_markers)], ids=["trc", "wbds"]
)
@FEW
@given(changes=st.lists(st.tuples(st.floats(0, 1), TOKENS), min_size=1, max_size=3))
@example(changes=[(0.0, "")])
def test_markers(tmp_path, texts, suffix, read, changes):
    text = texts[suffix]
    for place, token in changes:
        text = replaced(text, place, token)
    path = tmp_path / f"a{suffix}"
    path.write_text(text, encoding="utf-8", errors="replace", newline="")
    found = read_or_refused(read, path)
    if found is not None:
        believable(found)


@FEW
@given(changes=st.lists(st.tuples(st.floats(0, 1), TOKENS), min_size=1, max_size=3))
def test_forces(tmp_path, texts, changes):
    text = texts[".mot"]
    for place, token in changes:
        text = replaced(text, place, token)
    path = tmp_path / "a.mot"
    path.write_text(text, encoding="utf-8", errors="replace", newline="")
    found = read_or_refused(read_ground_reaction, path)
    if found is not None:
        rate, start, plates = found
        assert 0.0 < rate < np.inf
        assert np.isfinite(start)
        for plate in plates:
            loaded = np.isfinite(plate.centre_of_pressure).all(axis=1)
            assert np.isfinite(plate.force).all()
            assert not plate.free_moment[~loaded].any()


@FEW
@given(data=st.binary(max_size=400), at=st.floats(0, 1))
def test_any_bytes_in_the_middle(tmp_path, texts, data, at):
    whole = texts[".trc"].encode()
    path = tmp_path / "a.trc"
    place = int(at * len(whole))
    path.write_bytes(whole[:place] + data + whole[place:])
    found = read_or_refused(read_trc, path)
    if found is not None:
        believable(found)
