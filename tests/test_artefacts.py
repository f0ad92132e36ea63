"""Files are written whole or not at all; damaged ones are refused with a way to fix them."""

import errno
import json
import math
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from safetensors import SafetensorError

from gaitval._internal.io.artefacts import (
    file_hash,
    read_arrays,
    read_json,
    replacing,
    there_below,
    value_hash,
    versions,
    without_nan,
    write_arrays,
    write_json,
    write_text,
)
from gaitval._internal.io.partial_files import PARTIAL
from gaitval.errors import ArtefactError


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "old")

    def fail_half_way() -> None:
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_written_files_are_readable_by_others(tmp_path: Path) -> None:
    write_text(tmp_path / "new" / "a.txt", "")
    assert (tmp_path / "new" / "a.txt").stat().st_mode & 0o777 == 0o644


def test_equal_values_give_equal_bytes(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"x": 1, "y": [0.1, None]})
    write_json(tmp_path / "b.json", {"y": [0.1, None], "x": 1})
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    arrays = {"q": np.arange(12.0).reshape(3, 4)}
    write_arrays(tmp_path / "a.npz", arrays)
    write_arrays(tmp_path / "b.npz", arrays)
    assert file_hash(tmp_path / "a.npz") == file_hash(tmp_path / "b.npz")


@pytest.mark.parametrize(
    "content",
    [
        *(b"", b'{"x": 1', b"\xff\xfe", b"[" * 100_000, b"9" * 400, b"9" * 5000),
        b"[" * 60 + b"]" * 60,
        b'{"x": ' * 100_000,
    ],
    ids=[
        "empty",
        "cut",
        "not text",
        "deep",
        "400 digits",
        "5000 digits",
        "60 levels",
        "deep tables",
    ],
)
def test_damaged_json_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(ArtefactError, match=r"a\.json: cannot be read.*Delete it"):
        read_json(tmp_path / "a.json")


def test_missing_files_name_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match=r"a\.json: no such file. Run the stage"):
        read_json(tmp_path / "a.json")
    with pytest.raises(ArtefactError, match=r"a\.npz: no such file. Run the stage"):
        read_arrays(tmp_path / "a.npz", ("q",))


def test_truncated_arrays_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write_arrays(path, {"q": np.arange(1000.0)})
    path.write_bytes(path.read_bytes()[:-300])
    with pytest.raises(ArtefactError, match="truncated"):
        read_arrays(path, ("q",))


def test_arrays_of_another_version_are_refused(tmp_path: Path) -> None:
    write_arrays(tmp_path / "a.npz", {"q": np.zeros(2)})
    with pytest.raises(ArtefactError, match=r"tau are missing; .*another version"):
        read_arrays(tmp_path / "a.npz", ("q", "tau"))


def test_pickled_objects_are_never_loaded(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, q=np.array([{"x": 1}], dtype=object))
    with pytest.raises(ArtefactError, match="cannot be read as npz"):
        read_arrays(path, ("q",))


def test_letters_that_are_none_are_refused(tmp_path: Path) -> None:
    """NumPy makes a text of them, at which the next that touches it ends or shows other memory."""
    path = tmp_path / "a.npz"
    for order in "<>":
        broken = np.array([0x61, 0x7FFFFFFF], f"{order}u4").view(f"{order}U2")
        np.savez(path, names=broken)
        with pytest.raises(ArtefactError, match=r"cannot be read as npz .*letters that are none"):
            read_arrays(path, ("names",))
    whole = {"names": np.array(["R.ASIS", "\U0001f6b6"]), "none": np.zeros(0, "U3")}
    write_arrays(path, whole)
    assert read_arrays(path, ("names", "none"))["names"].tolist() == whole["names"].tolist()


def test_value_hash_does_not_hang_on_the_order_of_keys() -> None:
    assert value_hash({"a": 1, "b": 2}) == value_hash({"b": 2, "a": 1})
    assert value_hash({"a": 1}) != value_hash({"a": 2})


def test_value_hash_is_the_same_in_another_process() -> None:
    code = "from gaitval._internal.io import artefacts as a; print(a.value_hash({'a': [1.5, 'x']}))"
    other = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    ).stdout.strip()
    assert value_hash({"a": [1.5, "x"]}) == other


def test_versions_name_what_results_depend_on() -> None:
    found = versions()
    assert {"gaitval", "python", "dartpy", "torch", "numpy", "cma"} <= set(found)
    json.dumps(found)


def test_a_folder_in_the_place_of_a_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="is a folder, but a file is read here"):
        read_json(tmp_path)
    with pytest.raises(ArtefactError, match="is a folder, but a file is read here"):
        read_arrays(tmp_path, ("q",))


NO_SPACE = OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    ("error", "why"),
    [
        (NO_SPACE, "no space left for it. Free some space"),
        (OSError(errno.EROFS, "Read-only file system"), "its folder may not be written to"),
        (OSError(errno.EACCES, "Permission denied"), "its folder may not be written to"),
        (OSError(errno.EIO, "Input/output error"), "its disk or network share reports an error"),
        (SafetensorError("I/O error: No space left on device (os error 28)"), "no space left"),
    ],
)
def test_a_disk_that_cannot_be_written_names_the_file_and_keeps_the_old(
    tmp_path: Path, error: Exception, why: str
) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "old")

    def fail() -> None:
        with replacing(path):
            raise error

    with pytest.raises(ArtefactError, match=why) as refused:
        fail()
    assert str(path) in str(refused.value)
    assert "--out" in str(refused.value)
    assert refused.value.exit_code == 2
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_may_not_be_read_is_not_taken_for_the_one_that_is_written(
    tmp_path: Path,
) -> None:
    def fail() -> None:
        with replacing(tmp_path / "a.txt"):
            raise PermissionError(errno.EACCES, "Permission denied", "/somewhere/else.txt")

    with pytest.raises(PermissionError, match=r"else\.txt"):
        fail()


def test_a_fault_that_is_not_the_disks_stays_what_it_is(tmp_path: Path) -> None:
    def fail() -> None:
        with replacing(tmp_path / "a.txt"):
            raise OSError(errno.EINVAL, "Invalid argument")

    with pytest.raises(OSError, match="Invalid argument"):
        fail()


def test_who_names_the_folder_of_several_runs_is_told_where_they_are(tmp_path: Path) -> None:
    assert there_below(tmp_path / "none", "metrics.json") == ""
    assert there_below(tmp_path, "metrics.json") == ""
    for name in ("d", "b", "a", "c"):
        (tmp_path / name / "policy").mkdir(parents=True)
        (tmp_path / name / "policy" / "policy.json").touch()
    (tmp_path / "x").touch()
    said = there_below(tmp_path, "policy/policy.json")
    assert (
        said == f" There is one in {tmp_path / 'a'}, {tmp_path / 'b'}, {tmp_path / 'c'} and 1 more."
    )


@pytest.mark.parametrize("constant", ["NaN", "Infinity", "-Infinity"])
def test_what_is_no_number_is_no_json(constant: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(f'{{"value": {constant}}}')
    with pytest.raises(ArtefactError, match=rf"{constant} is no number"):
        read_json(tmp_path / "a.json")


def test_what_is_no_number_is_written_as_null() -> None:
    value = {1: [math.nan, 2.0], "a": (np.float64("inf"), np.int64(3), "NaN")}
    assert without_nan(value) == {"1": [None, 2.0], "a": [None, 3, "NaN"]}


def test_two_that_write_at_once_leave_one_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    values = [{"of": number, "long": "x" * 100_000} for number in range(4)]
    each = [threading.Thread(target=write_json, args=(path, value)) for value in values]
    for one in each:
        one.start()
    for one in each:
        one.join()
    assert read_json(path) in values
    assert not list(tmp_path.glob(f"{PARTIAL}*"))
