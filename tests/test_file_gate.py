"""What is no file, or too large, is refused by every reader before anything is read of it."""

import os
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import (
    copy_file,
    file_hash,
    read_arrays,
    read_json,
    read_toml,
)
from gaitval.apps.cohort.table import read_table
from gaitval.apps.patients.people import read_people
from gaitval.apps.patients.strides import read_strides
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError, GaitvalError, RecordError
from gaitval.kinetics.inverse.scaled_markers import MarkedBody, load_markers
from gaitval.mocap.kistler_text import read_kistler_text
from gaitval.mocap.mot import read_storage
from gaitval.mocap.motion_analysis import read_motion_analysis_forces
from gaitval.mocap.qualisys_tsv import read_qualisys_forces
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.model.urdf import read_urdf
from gaitval.policy.storage import load_policy
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.opensim.fields import read_document
from gaitval.session.importing.batch_imports import read_batch
from gaitval.session.importing.program_folders import opencap_sessions
from gaitval.subjects.curve_files import read_mean_curves
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.rollout import Rollout

ROOT = Path(__file__).parents[1]
NOBODY = Recording("nobody", "laboratory", ("a",), np.zeros((1, 1, 3)), 100.0)
posix = pytest.mark.skipif(os.name != "posix", reason="pipes and devices as POSIX has them")

READERS = {
    "a.toml": lambda path: read_batch([path]),
    "c.toml": load_subject,
    "d.toml": load_configuration,
    "e.toml": load_marker_set,
    "f.toml": lambda path: read_toml(path, RecordError),
    "a.csv": read_table,
    "b.csv": lambda path: read_mean_curves([path]),
    "ang.txt": lambda path: read_mean_curves([path]),
    "d.csv": read_strides,
    "e.csv": read_people,
    "curves.csv": lambda path: read_mean_curves([path]),
    "a.json": read_json,
    "b.json": load_markers,
    "policy.json": lambda path: load_policy(path.parent),
    "policy.safetensors": lambda path: load_policy(path.parent),
    "a.npz": lambda path: read_arrays(path, ("x",)),
    "b.npz": ReferenceMotion.load,
    "c.npz": Rollout.load,
    "d.npz": Recording.load,
    "a.trc": read_recording,
    "a.c3d": read_recording,
    "amkr.txt": read_recording,
    "vicon.csv": read_recording,
    "qualisys.tsv": read_recording,
    "a_f_1.tsv": lambda path: read_qualisys_forces(path, NOBODY),
    "a.forces": lambda path: read_motion_analysis_forces(path, NOBODY),
    "bioware.txt": lambda path: read_kistler_text(path, NOBODY),
    "sessionMetadata.yaml": lambda path: opencap_sessions(path.parent),
    "a.mot": read_storage,
    "a.sto": read_storage,
    "a.urdf": read_urdf,
    "a.osim": read_document,
    "scaling.csv": lambda path: MarkedBody.load(path.parent),
    "a.any": file_hash,
    "b.any": lambda path: copy_file(path, path.with_suffix(".copy")),
}
"""What reads a file of each kind, given its path."""


def read(reader: str, folder: Path) -> None:
    """Read the file of this name with its reader, beside what else is wanted."""
    stored = ROOT / "reports" / "S05" / "baseline" / "policy"
    for name in ("policy.json", "policy.safetensors"):
        if reader.startswith("policy") and name != reader:
            shutil.copy(stored / name, folder / name)
    READERS[reader](folder / reader)


@posix
@pytest.mark.parametrize("reader", READERS)
def test_a_pipe_and_a_device_are_refused_by_every_reader(reader, tmp_path):
    """A pipe would be waited for, and /dev/zero never ends."""
    os.mkfifo(tmp_path / reader)
    with pytest.raises(GaitvalError, match=r"pipe or a device|is not a file|no policy|no such"):
        read(reader, tmp_path)
    (tmp_path / reader).unlink()
    (tmp_path / reader).symlink_to("/dev/zero")
    with pytest.raises(GaitvalError, match=r"pipe or a device|is not a file|no policy|no such"):
        read(reader, tmp_path)


@pytest.mark.parametrize("reader", READERS)
def test_a_folder_and_nothing_are_refused_by_every_reader(reader, tmp_path):
    if reader != "sessionMetadata.yaml":  # without it a folder is another program's
        with pytest.raises(GaitvalError):
            read(reader, tmp_path)
    (tmp_path / reader).unlink(missing_ok=True)
    (tmp_path / reader).mkdir()
    with pytest.raises(GaitvalError):
        read(reader, tmp_path)


@posix
@pytest.mark.parametrize("reader", READERS)
def test_what_is_too_large_is_refused_by_every_reader(reader, tmp_path):
    """A file of 5 GB that has no content takes no place."""
    (tmp_path / reader).touch()
    os.truncate(tmp_path / reader, 5_000_000_000)
    with pytest.raises(GaitvalError):
        read(reader, tmp_path)


@posix
def test_a_file_that_says_that_it_has_no_size_is_bounded():
    with pytest.raises(RecordError, match="more than 10 bytes"):
        file_gate.read_bytes(Path("/proc/cpuinfo"), RecordError, largest=10)


@pytest.mark.parametrize("name", ["a\0b", "a\udc80b", "a" * 5000])
def test_what_is_no_name_of_a_file_is_refused(tmp_path, name):
    with pytest.raises(RecordError, match=r"no name of a file|cannot be opened|no such file"):
        file_gate.read_bytes(tmp_path / name, RecordError, largest=10)


def test_text_that_is_not_ascii_may_have_a_quarter(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"a" * 100)
    assert file_gate.read_text(path, RecordError, largest=100) == "a" * 100
    path.write_text("é" * 20, encoding="utf-8")
    with pytest.raises(RecordError, match="more than 25 bytes"):
        file_gate.read_text(path, RecordError, largest=100)
    assert file_gate.read_text(path, RecordError, largest=200) == "é" * 20


def test_ends_of_lines_are_those_of_this_system(tmp_path):
    (tmp_path / "a.txt").write_bytes(b"\xef\xbb\xbfa\r\nb\rc\n")
    assert file_gate.read_text(tmp_path / "a.txt", RecordError, largest=99) == "a\nb\nc\n"


def npy(shape: str, kind: str = "<f8", data: bytes = b"") -> bytes:
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + data


LIES = {
    "more values than bytes": npy("(10000000000000,)"),
    "more than any number": npy("(9223372036854775807, 9223372036854775807)"),
    "fewer than none": npy("(-1,)", data=bytes(8)),
    "values without a size": npy("(3,)", "|V0"),
    "python's own objects": npy("(1,)", "|O", b"cos\nsystem\n(S'true'\ntR."),
    "no numbers": npy("(1,)", "<U1", b"abcd"),
    "no header": b"\x93NUMPY\x01\x00\xff\xff{",
    "no array": b"x",
}


@pytest.mark.parametrize("lie", LIES)
@pytest.mark.parametrize("load", [ReferenceMotion.load, Rollout.load, Recording.load])
def test_arrays_that_lie_are_refused(tmp_path, lie, load):
    path = tmp_path / "a.npz"
    names = ("phase", "time", "positions", "__about__", "stride_time", "speed")
    with zipfile.ZipFile(path, "w") as members:
        for name in names:
            members.writestr(f"{name}.npy", LIES[lie])
    with pytest.raises(ArtefactError, match=r"a\.npz"):
        load(path)


@pytest.fixture
def little_unpacks(monkeypatch) -> int:
    """A hundredth of what may be unpacked: to pack all of it takes seconds."""
    assert file_gate.SIZES.unpacked <= 1_000_000_000
    little = replace(file_gate.SIZES, unpacked=file_gate.SIZES.unpacked // 100)
    monkeypatch.setattr(file_gate, "SIZES", little)
    return file_gate.SIZES.unpacked


def test_a_bomb_of_arrays_is_refused(tmp_path, little_unpacks):
    """Some 50 kB that unpack to more than a hundred times as much."""
    path = tmp_path / "a.npz"
    count = little_unpacks // 8
    values = npy(f"({count},)") + bytes(8 * count)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as members:
        members.writestr("x.npy", values)
    assert path.stat().st_size < little_unpacks / 100
    with pytest.raises(ArtefactError, match="unpacks to more than"):
        read_arrays(path, ("x",))


def test_a_copy_that_finds_no_room_names_the_copy(tmp_path, monkeypatch):
    """Not what is copied, which is as it should be."""
    (tmp_path / "source").write_text("x")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("shutil.copyfileobj", full)
    with pytest.raises(ArtefactError, match=r"target: cannot be written: there is no space left"):
        copy_file(tmp_path / "source", tmp_path / "target")
    assert [path.name for path in tmp_path.iterdir()] == ["source"]


@posix
def test_results_are_not_written_where_nothing_can_be(tmp_path):
    """Exit code 2 and a sentence: it was 70."""
    done = subprocess.run(
        [sys.executable, "-P", "-m", "gaitval", "stage", "scale", "5", "--out", "/proc/nowhere"],
        capture_output=True, text=True, check=False, env={**os.environ, "COLUMNS": "500"},
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "/proc/nowhere" in done.stderr


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-8"])
def test_the_mark_of_a_text_says_its_encoding(tmp_path, encoding):
    path = tmp_path / "a.txt"
    path.write_bytes(("\ufeffé 1\r\n2").encode(encoding))
    assert file_gate.read_text(path, RecordError, largest=1000) == "é 1\n2"
