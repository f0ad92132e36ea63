"""Damaged files of every kind that gaitval reads: each is refused in a sentence, or read.

`GAITVAL_DAMAGED=500` tries so many of each kind; a case is made again from its number.
"""

import os
import re
import zlib

import numpy as np
import pytest
from readable_files import SLOW, Kind, kinds

from gaitval.errors import GaitvalError

CASES = int(os.environ.get("GAITVAL_DAMAGED", "25"))
NUMBERS = ("nan", "inf", "-1", "0", "1e400", "9" * 400, "1,5", "", "x", "1e-320", "-0.0")

Random = np.random.Generator


def flipped(data: bytes, random: Random) -> bytes:
    """Up to eight bits, half of the times near the beginning."""
    found = bytearray(data)
    end = min(len(found), 512) if random.integers(2) else len(found)
    for place in random.integers(end, size=random.integers(1, 9)):
        found[place] ^= 1 << random.integers(8)
    return bytes(found)


def cut(data: bytes, random: Random) -> bytes:
    place = int(random.integers(len(data)))
    return data[:place] if random.integers(2) else data[place:]


def zeroed(data: bytes, random: Random) -> bytes:
    begin, end = sorted(random.integers(len(data) + 1, size=2))
    return data[:begin] + bytes(int(end - begin)) + data[end:]


def inserted(data: bytes, random: Random) -> bytes:
    place = int(random.integers(len(data)))
    return data[:place] + random.bytes(int(random.integers(1, 200))) + data[place:]


def repeated(data: bytes, random: Random) -> bytes:
    begin, end = sorted(random.integers(len(data) + 1, size=2))
    return data[:end] + data[begin:end] + data[end:]


def other_number(data: bytes, random: Random) -> bytes:
    found = list(re.finditer(rb"-?\d+(\.\d+)?(e-?\d+)?", data))
    if not found:
        return flipped(data, random)
    at = found[int(random.integers(len(found)))]
    return data[: at.start()] + str(random.choice(NUMBERS)).encode() + data[at.end() :]


def other_word(data: bytes, random: Random) -> bytes:
    found = list(re.finditer(rb"[A-Za-z_]{3,}", data))
    words = (b"", b"../../etc/passwd", b"x" * 3000, "Ünïcode\u202e".encode(), b"\x1b[31m", b"[[[[")
    if not found:
        return cut(data, random)
    at = found[int(random.integers(len(found)))]
    return data[: at.start()] + words[int(random.integers(len(words)))] + data[at.end() :]


def other_lines(data: bytes, random: Random) -> bytes:
    """A line is missing, is there twice, or is at another place."""
    lines = data.split(b"\n")
    line = lines.pop(int(random.integers(len(lines))))
    for _ in range(int(random.integers(3))):
        lines.insert(int(random.integers(len(lines) + 1)), line)
    return b"\n".join(lines)


def other_separators(data: bytes, random: Random) -> bytes:
    both = [(b"\t", b","), (b",", b";"), (b".", b","), (b"\n", b"\r"), (b"=", b":"), (b'"', b"'")]
    return data.replace(*both[int(random.integers(len(both)))])


def other_encoding(data: bytes, random: Random) -> bytes:
    text = data.decode("utf-8", "replace")
    return text.encode(("utf-16", "utf-8-sig", "utf-32")[int(random.integers(3))])


ROW = re.compile(rb"[-+\d.]\S*([\t,; ]+[-+\d.ena]\S*)+[\t,; ]*\r?")


def few_rows(data: bytes, random: Random) -> bytes:
    """No, one or two rows of each table, and a header that says so."""
    left, kept, count = int(random.integers(3)), [], 0
    for line in data.split(b"\n"):
        count = count + 1 if ROW.fullmatch(line) else 0
        if count <= left:
            kept.append(line)
    rows = str(left).encode()
    return re.sub(rb"(?i)(nRows|datarows|OF_FRAMES|OF_SAMPLES)([=\t ]+)\d+", rb"\1\g<2>" + rows,
                  b"\n".join(kept))  # fmt: skip


BYTES = (flipped, cut, zeroed, inserted, repeated)
TEXT = (*BYTES, *(other_number, other_word, few_rows) * 4, *(other_lines, other_separators))
TEXT += (other_encoding,)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> dict[str, Kind]:
    return kinds(tmp_path_factory.mktemp("sound"))


NAMES = (
    *("c3d_standing", "c3d_walking", "trc", "mot", "wbds", "subject", "configuration", "urdf"),
    *("policy", "baseline", "vicon_csv", "qualisys_tsv", "qualisys_forces", "motion_analysis"),
    *("kistler_text", "kistler_places", "opencap", "pose2sim", "session", "marker_set", "cohort"),
    *("curves_csv", "judged_model", "judged_motion", "judged_moments", "judged_loads"),
    *("judged_forces", "judged_markers", "configuration_command", "subject_command"),
    *("reference_npz", "rollout_npz", "walk_npz", "recording_npz", "markers_json"),
    "training_log",
)
WHOLE = {"c3d_standing", "c3d_walking", "trc", "mot", "wbds", *SLOW}
"""Kinds of which a case is a whole command, a second or more: a fifth of the cases."""


def test_every_kind_is_tried(made):
    assert set(NAMES) == set(made)


def written(kind: Kind, folder) -> None:
    for name, content in kind.seeds.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_undamaged_file_is_read(name, made, tmp_path):
    """Else every refusal below would prove nothing."""
    written(made[name], tmp_path)
    made[name].run(tmp_path)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", NAMES)
def test_a_damaged_file_is_refused_in_a_sentence_or_read(name, made, tmp_path):
    kind, refused = made[name], 0
    for case in range(CASES // 5 if name in WHOLE else CASES):
        random = np.random.default_rng([zlib.crc32(name.encode()), case])
        file = kind.files[int(random.integers(len(kind.files)))]
        binary = file.endswith((".c3d", ".npz", ".safetensors"))
        damages = BYTES if binary else TEXT
        damage = damages[int(random.integers(len(damages)))]
        written(kind, tmp_path)
        (tmp_path / file).write_bytes(damage(kind.seeds[file], random))
        try:
            kind.run(tmp_path)
        except GaitvalError as error:
            refused += bool(str(error))
        except Exception as error:
            pytest.fail(f"{name}, case {case}, {damage.__name__} of {file}: {error!r}")
    assert refused, "nothing was damaged enough to be refused"
