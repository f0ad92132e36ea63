"""Damage to files, as laboratories, mail programs, spreadsheets and disks do it.

A mutator takes the bytes of a file and a seeded generator, and returns other bytes. Groups of them
by what they know of a file: nothing, text, a table of one format, C3D, a tree of values, or
safetensors. It is long because there are many ways to damage a file, each a few lines.
"""

import json
import re
import struct
import tempfile
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
import tomli_w

Random = np.random.Generator
Mutator = Callable[[bytes, Random], bytes]

NUMBERS = (
    *("nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-1", "1e6", "9" * 400),
    *("0x10", "1,5", "1.2.3", "--3", "", "x", "１２", "1e999", "None", "true", "-0.0"),
)
"""What stands where a number should; some are numbers."""
NAMES = (
    "",
    " ",
    "x" * 5000,
    "Ä\u202e🦶",
    "../../etc/passwd",
    "<script>",
    "a\x00b",
    "nan",
    "*1",
    ":",
)


def _some(random: Random, size: int, most: int = 8) -> np.ndarray:
    return random.integers(0, max(size, 1), random.integers(1, most + 1))


def flip_bits(data: bytes, random: Random) -> bytes:
    """Single bits, as of a bad disk."""
    found = bytearray(data)
    for place in _some(random, len(found)):
        found[place] ^= 1 << int(random.integers(8))
    return bytes(found)


def flip_early_bits(data: bytes, random: Random) -> bytes:
    """Bits of the first kilobyte, where headers are."""
    return flip_bits(data[:1024], random) + data[1024:]


def random_bytes(data: bytes, random: Random) -> bytes:
    """A piece of up to 64 bytes is noise."""
    place, size = int(random.integers(len(data))), int(random.integers(1, 65))
    return data[:place] + random.bytes(size) + data[place + size :]


def cut(data: bytes, random: Random) -> bytes:
    """The end is lost."""
    return data[: int(random.integers(len(data)))]


def cut_start(data: bytes, random: Random) -> bytes:
    """The beginning is lost."""
    return data[int(random.integers(1, len(data))) :]


def zeroed(data: bytes, random: Random) -> bytes:
    """A block of 512 bytes that never came to the disk."""
    place = int(random.integers(len(data)))
    return data[:place] + bytes(min(512, len(data) - place)) + data[place + 512 :]


def repeated(data: bytes, random: Random) -> bytes:
    """A block is there twice."""
    place = int(random.integers(len(data)))
    return data[: place + 512] + data[place:]


def appended(data: bytes, random: Random) -> bytes:
    """Something follows the end."""
    return data + random.bytes(int(random.integers(1, 2048)))


def emptied(data: bytes, random: Random) -> bytes:
    """Nothing, or blanks only."""
    return (b"", b"\n", b" " * 100, b"\0" * 1000)[int(random.integers(4))]


BYTES: tuple[Mutator, ...] = (
    *(flip_bits, flip_early_bits, random_bytes, cut, cut_start, zeroed, repeated, appended),
    emptied,
)


def _text(data: bytes) -> str:
    return data.decode("utf-8", "replace")


def _pick(random: Random, values: Sequence[Any]) -> Any:
    return values[int(random.integers(len(values)))]


def other_encoding(data: bytes, random: Random) -> bytes:
    """UTF-16, a byte order mark, the page of an old computer, or the ends of lines of another."""
    text = _text(data)
    return _pick(
        random,
        (
            lambda: text.encode("utf-16"),
            lambda: text.encode("utf-8-sig"),
            lambda: ("é" + text).encode("latin-1", "replace"),
            lambda: text.replace("\n", "\r\n").encode(),
            lambda: text.replace("\n", "\r").encode(),
            lambda: text.encode("utf-32"),
        ),
    )()


def other_number(data: bytes, random: Random) -> bytes:
    """A number anywhere in the text is something else."""
    return _exchanged(data, random, r"-?\d+\.?\d*(?:[eE][-+]?\d+)?", NUMBERS)


def other_word(data: bytes, random: Random) -> bytes:
    """A word anywhere in the text is something else."""
    return _exchanged(data, random, r"[A-Za-z_][\w.]*", NAMES)


def _exchanged(data: bytes, random: Random, pattern: str, others: Sequence[str]) -> bytes:
    """One match of a pattern, early ones more often, is another text."""
    text = _text(data)
    found = list(re.finditer(pattern, text))
    if not found:
        return cut(data, random)
    match = found[int(random.integers(min(len(found), 4 ** int(random.integers(1, 12)))))]
    return (text[: match.start()] + _pick(random, others) + text[match.end() :]).encode()


def without_line(data: bytes, random: Random) -> bytes:
    """Up to three lines are missing."""
    lines = _text(data).split("\n")
    for _ in range(int(random.integers(1, 4))):
        lines.pop(int(random.integers(len(lines)))) if len(lines) > 1 else None
    return "\n".join(lines).encode()


def line_twice(data: bytes, random: Random) -> bytes:
    """A line is there twice."""
    lines = _text(data).split("\n")
    place = int(random.integers(len(lines)))
    return "\n".join([*lines[: place + 1], *lines[place:]]).encode()


def lines_exchanged(data: bytes, random: Random) -> bytes:
    """Two lines have changed places."""
    lines = _text(data).split("\n")
    a, b = (int(random.integers(len(lines))) for _ in range(2))
    lines[a], lines[b] = lines[b], lines[a]
    return "\n".join(lines).encode()


def other_separator(data: bytes, random: Random) -> bytes:
    """Commas, semicolons or blanks for tabs; commas for points, as in half of Europe."""
    text = _text(data)
    old, new = _pick(random, (("\t", ","), ("\t", ";"), ("\t", " "), (".", ","), ("\t", "\t\t")))
    return text.replace(old, new).encode()


def first_line_damaged(data: bytes, random: Random) -> bytes:
    """A word or a number of the first eight lines is something else."""
    lines = _text(data).split("\n")
    head, rest = "\n".join(lines[:8]).encode(), "\n".join(lines[8:]).encode()
    return _pick(random, (other_number, other_word))(head, random) + b"\n" + rest


TEXT: tuple[Mutator, ...] = (
    *(other_encoding, other_number, other_word, without_line, line_twice, lines_exchanged),
    *(other_separator, first_line_damaged),
)


@dataclass(frozen=True)
class Table:
    """A table of a text format: `head` is the lines above, `values` (T, C) numbers.

    `clock` are the columns of the frame's number and time.
    """

    head: tuple[str, ...]
    values: np.ndarray
    clock: tuple[int, ...]

    @property
    def vectors(self) -> range:
        """First columns of each marker or vector."""
        return range(len(self.clock), self.values.shape[1] - 2, 3)


def _rows(lines: Sequence[str]) -> np.ndarray:
    return np.array([[float(cell or "nan") for cell in line.split("\t")] for line in lines])


def _joined(table: Table, head: Sequence[str] | None = None) -> bytes:
    rows = ("\t".join(f"{value:.9g}" for value in row) for row in table.values)
    return "\n".join([*(table.head if head is None else head), *rows, ""]).encode()


@dataclass(frozen=True)
class Format:
    """How a text format is taken apart: lines above the numbers, and columns of the clock."""

    above: Callable[[Sequence[str]], int]
    clock: tuple[int, ...]
    count: Callable[[Sequence[str], int], Sequence[str]]

    def read(self, data: bytes) -> Table:
        """The table of a file."""
        lines = _text(data).split("\n")
        above = self.above(lines)
        return Table(
            tuple(lines[:above]), _rows([s for s in lines[above:] if s.strip()]), self.clock
        )

    def write(self, table: Table) -> bytes:
        """With the number of rows that the header promises put right."""
        return _joined(table, self.count(table.head, len(table.values)))


def _trc_count(head: Sequence[str], rows: int) -> Sequence[str]:
    cells = head[2].split("\t")
    cells[2] = cells[7] = str(rows)
    return [*head[:2], "\t".join(cells), *head[3:]]


def _mot_count(head: Sequence[str], rows: int) -> Sequence[str]:
    return [re.sub(r"^nRows=.*", f"nRows={rows}", line) for line in head]


TRC = Format(lambda lines: 6, (0, 1), _trc_count)
MOT = Format(lambda lines: lines.index("endheader") + 2, (0,), _mot_count)
WBDS = Format(lambda lines: 1, (0,), lambda head, rows: head)


def _vector(table: Table, random: Random) -> slice:
    first = int(_pick(random, table.vectors))
    return slice(first, first + 3)


def _window(table: Table, random: Random) -> slice:
    size = len(table.values)
    begin = int(random.integers(size))
    return slice(begin, begin + int(random.integers(1, max(size // 3, 2))))


def _set(table: Table, values: np.ndarray) -> Table:
    return replace(table, values=values)


def vector_scaled(table: Table, random: Random) -> Table:
    """A marker or force in another unit."""
    values = table.values.copy()
    values[:, _vector(table, random)] *= _pick(random, (1e3, 1e-3, 10.0, 0.1, 0.0, 2.2046, 9.81))
    return _set(table, values)


def all_scaled(table: Table, random: Random) -> Table:
    """Everything in another unit."""
    values = table.values.copy()
    factor = _pick(random, (1e3, 1e-3, 100.0, 10.0, 0.1, 1 / 25.4, 1.1, 0.9, 0.5, 2.0, 0.0))
    values[:, len(table.clock) :] *= factor
    return _set(table, values)


def sign_turned(table: Table, random: Random) -> Table:
    """One column, or everything, has the opposite sign."""
    values = table.values.copy()
    first = len(table.clock)
    column = _pick(random, (slice(first, None), int(random.integers(first, values.shape[1]))))
    values[:, column] *= -1
    return _set(table, values)


def axis_turned(table: Table, random: Random) -> Table:
    """One axis of all vectors has the opposite sign, so the laboratory is mirrored."""
    values = table.values.copy()
    values[:, len(table.clock) + int(random.integers(3)) :: 3] *= -1
    return _set(table, values)


def axes_exchanged(table: Table, random: Random) -> Table:
    """Axes of all vectors have changed places."""
    values, order = table.values.copy(), random.permutation(3)
    for first in table.vectors:
        values[:, first : first + 3] = table.values[:, first : first + 3][:, order]
    return _set(table, values)


def vectors_exchanged(table: Table, random: Random) -> Table:
    """Two markers, or forces, have each other's values: over all frames, or some."""
    values = table.values.copy()
    a, b = _vector(table, random), _vector(table, random)
    rows = _pick(random, (slice(None), _window(table, random)))
    values[rows, a], values[rows, b] = table.values[rows, b], table.values[rows, a]
    return _set(table, values)


def vector_repeated(table: Table, random: Random) -> Table:
    """A marker is where another one is."""
    values = table.values.copy()
    values[:, _vector(table, random)] = table.values[:, _vector(table, random)]
    return _set(table, values)


def vector_moved(table: Table, random: Random) -> Table:
    """A marker has slipped by 0.1 to 1 of its scale, or a force has an offset."""
    values = table.values.copy()
    part = _vector(table, random)
    values[:, part] += random.normal(0.0, 0.3, 3) * np.nanmax(abs(table.values[:, part]))
    return _set(table, values)


def frozen(table: Table, random: Random) -> Table:
    """A marker stays where it was for some frames."""
    values = table.values.copy()
    rows, part = _window(table, random), _vector(table, random)
    values[rows, part] = values[rows, part][:1]
    return _set(table, values)


def lost(table: Table, random: Random) -> Table:
    """Nothing is seen of a marker, or of all, for some frames: NaN or zero."""
    values = table.values.copy()
    part = _pick(random, (_vector(table, random), slice(len(table.clock), None)))
    values[_window(table, random), part] = _pick(random, (np.nan, 0.0))
    return _set(table, values)


def spikes(table: Table, random: Random) -> Table:
    """Single frames are far off."""
    values = table.values.copy()
    for row in _some(random, len(values)):
        values[row, _vector(table, random)] *= random.normal(0.0, 50.0)
    return _set(table, values)


def noisy(table: Table, random: Random) -> Table:
    """Noise of 0.1 to 10 % on everything."""
    values = table.values.copy()
    part = values[:, len(table.clock) :]
    part += random.normal(0.0, 10.0 ** random.uniform(-3, -1), part.shape) * np.nanmax(abs(part))
    return _set(table, values)


def drifting(table: Table, random: Random) -> Table:
    """Everything drifts away along one axis."""
    values = table.values.copy()
    column = len(table.clock) + int(random.integers(3))
    size = np.nanmax(abs(values[:, column::3])) * random.uniform(0.1, 1.0)
    values[:, column::3] += np.linspace(0.0, size, len(values))[:, None]
    return _set(table, values)


def frames_dropped(table: Table, random: Random) -> Table:
    """Frames are missing; the clock shows it, or was numbered anew."""
    kept = np.ones(len(table.values), dtype=bool)
    kept[_window(table, random)] = False
    if random.integers(2):
        kept = random.random(len(table.values)) > 0.1
    values = table.values[kept]
    if random.integers(2):
        values[:, table.clock] = table.values[: len(values), table.clock]
    return _set(table, values)


def frames_shuffled(table: Table, random: Random) -> Table:
    """Frames in another order, or backwards; the clock as it was, or with them."""
    order = _pick(random, (random.permutation(len(table.values)), slice(None, None, -1)))
    values = table.values[order].copy()
    if random.integers(2):
        values[:, table.clock] = table.values[:, table.clock]
    return _set(table, values)


def shifted(table: Table, random: Random) -> Table:
    """The values are late by 10 to 50 % of the trial; the clock is not."""
    values = table.values.copy()
    by = int(len(values) * random.uniform(0.03, 0.5))
    values[:, len(table.clock) :] = np.roll(values[:, len(table.clock) :], by, axis=0)
    return _set(table, values)


def other_clock(table: Table, random: Random) -> Table:
    """The times are in ms, at another rate, begin elsewhere, or stand still."""
    values = table.values.copy()
    time = table.clock[-1]
    factor, offset = _pick(random, ((1e3, 0), (2, 0), (0.5, 0), (1, 1e6), (1, -50), (0, 0), (1, 3)))
    values[:, time] = values[:, time] * factor + offset
    return _set(table, values)


def clipped(table: Table, random: Random) -> Table:
    """A column goes no further than half of its largest value, as an amplifier does."""
    values = table.values.copy()
    column = int(random.integers(len(table.clock), values.shape[1]))
    largest = np.nanmax(abs(values[:, column])) * random.uniform(0.3, 0.8)
    values[:, column] = values[:, column].clip(-largest, largest)
    return _set(table, values)


TABLES = (
    *(vector_scaled, all_scaled, sign_turned, axis_turned, axes_exchanged, vectors_exchanged),
    *(vector_repeated, vector_moved, frozen, lost, spikes, noisy, drifting, frames_dropped),
    *(frames_shuffled, shifted, other_clock, clipped),
)


def of_table(form: Format) -> tuple[Mutator, ...]:
    """The mutators of tables for one format, and those of its header."""

    def made(change: Callable[[Table, Random], Table]) -> Mutator:
        def mutate(data: bytes, random: Random) -> bytes:
            return form.write(change(form.read(data), random))

        mutate.__name__ = change.__name__
        return mutate

    def labels_exchanged(data: bytes, random: Random) -> bytes:
        """Two names of the header have changed places, or one is another's."""
        table = form.read(data)
        row = len(table.head) - (3 if form is TRC else 1)
        cells = table.head[row].split("\t")
        named = [i for i, cell in enumerate(cells) if cell.strip()][len(form.clock) :]
        a, b = int(_pick(random, named)), int(_pick(random, named))
        cells[a], cells[b] = cells[b], _pick(random, (cells[a], cells[b], *NAMES))
        head = [*table.head[:row], "\t".join(cells), *table.head[row + 1 :]]
        return _joined(table, head)

    return (*map(made, TABLES), labels_exchanged)


def of_c3d() -> tuple[Mutator, ...]:
    """Mutators of what a C3D file means: points, channels, names, units, plates."""

    def made(change: Callable[[Any, Random], None]) -> Mutator:
        def mutate(data: bytes, random: Random) -> bytes:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "a.c3d"
                path.write_bytes(data)
                file = ezc3d.c3d(str(path))
                change(file, random)
                file.write(str(path))
                return path.read_bytes()

        mutate.__name__ = change.__name__
        return mutate

    # ezc3d ends the process rather than write a rate of 0, so this one changes bytes
    return (c3d_rate, *map(made, (c3d_points, c3d_channels, c3d_names, c3d_parameter, c3d_plate)))


def c3d_rate(data: bytes, random: Random) -> bytes:
    """The rate of the points is another one in the header, the parameters, or both."""
    stored = struct.unpack("<f", data[20:24])[0]
    other = struct.pack("<f", _pick(random, (0.0, -100.0, 50.0, 100.0, 300.0, np.nan, np.inf)))
    which = int(random.integers(3))
    head = data[:20] + other + data[24:] if which != 1 else data
    if which == 0:
        return head
    return head[:512] + head[512:].replace(struct.pack("<f", stored), other, 1)


def _as_table(values: np.ndarray, random: Random) -> np.ndarray:
    """Any change of a table, of values (T, C)."""
    while True:
        change = _pick(random, TABLES)
        if change not in (other_clock, frames_dropped):
            return change(Table((), values, ()), random).values


def c3d_points(file: Any, random: Random) -> None:
    """Trajectories, as those of tables."""
    points = file["data"]["points"]
    values = points[:3].transpose(2, 1, 0).reshape(points.shape[2], -1)
    changed = _as_table(values, random).reshape(points.shape[2], -1, 3)
    points[:3] = changed.transpose(2, 1, 0)


def c3d_channels(file: Any, random: Random) -> None:
    """Channels, as columns of tables."""
    analogs = file["data"]["analogs"]
    if not analogs.size:
        c3d_points(file, random)
        return
    analogs[0] = _as_table(analogs[0].T.copy(), random).T


def c3d_names(file: Any, random: Random) -> None:
    """Two names of markers have changed places, or one is another."""
    labels = file["parameters"]["POINT"]["LABELS"]["value"]
    a, b = (int(random.integers(len(labels))) for _ in range(2))
    labels[a], labels[b] = labels[b], _pick(random, (labels[a], labels[b], "x", "*7", "Ä"))


def c3d_parameter(file: Any, random: Random) -> None:
    """A rate, a unit or a scale is another."""
    group, name, values = _pick(
        random,
        (
            ("POINT", "UNITS", ("m", "cm", "in", "", "furlong")),
            ("ANALOG", "UNITS", ("kN", "V", "", "lbf")),
            ("ANALOG", "SCALE", (0.0, 2.0, float("nan"), -1.0)),
            ("ANALOG", "GEN_SCALE", (0.0, 2.0, float("nan"), -1.0)),
            ("ANALOG", "OFFSET", (100, -3000)),
        ),
    )
    stored = file["parameters"][group].get(name)
    if stored is None:
        c3d_names(file, random)
        return
    before = np.atleast_1d(np.asarray(stored["value"])).ravel().tolist()
    value = _pick(random, values)
    if before and random.integers(2):
        before[int(random.integers(len(before)))] = value
        stored["value"] = before
    else:
        stored["value"] = [value] * max(len(before), 1)


def c3d_plate(file: Any, random: Random) -> None:
    """A plate's corners, origin, channels, type or count is other than it was."""
    plates = file["parameters"]["FORCE_PLATFORM"]
    if not np.size(plates["USED"]["value"]) or not int(np.ravel(plates["USED"]["value"])[0]):
        c3d_names(file, random)
        return
    name = _pick(random, ("CORNERS", "ORIGIN", "CHANNEL", "TYPE", "USED"))
    values = np.array(plates[name]["value"])
    if name in ("CORNERS", "ORIGIN"):
        values = values.astype(float)
        values = _pick(
            random,
            (
                lambda: values * _pick(random, (1e-3, 1e3, -1.0, 0.0, np.nan)),
                lambda: values[..., ::-1],
                lambda: values[:, ::-1],
                lambda: values + 400.0 * random.normal(size=values.shape),
                lambda: values + 700.0 * random.normal(),
            ),
        )()
    else:
        flat = values.ravel()
        flat[int(random.integers(flat.size))] = int(_pick(random, (0, 1, 2, 3, 4, 7, 99, -1)))
    plates[name]["value"] = values


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items: Any = ()
    if isinstance(value, Mapping):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value[:200])
    found = [path] if path else []
    for key, each in items:
        found += _leaves(each, (*path, key))
    return found


def _nested(depth: int) -> Any:
    value: Any = 1
    for _ in range(depth):
        value = [value]
    return value


def _changed_tree(value: Any, random: Random) -> Any:
    """One place of a tree of values is missing, renamed, of another type or size."""
    # A place is drawn level by level: most leaves are coefficients of curves.
    path: list[Any] = []
    here = value
    while isinstance(here, dict | list) and here and (not path or random.random() < 0.85):
        path.append(_pick(random, list(here) if isinstance(here, dict) else range(len(here))))
        parent, here = here, here[path[-1]]
    key = path[-1]
    others: list[Any] = [
        *("", "x", "nan", True, False, [], {}, 0, -1, 1e300, -5.5, 10**25, _nested(30)),
        *(float("nan"), float("inf"), _nested(400), {"a": 1}, [1, 2, 3]),
    ]
    if isinstance(here, int | float) and not isinstance(here, bool):
        others += [-here, here * 1e3, here * 1e-3, here * 1.5, here + 1, str(here)] * 3
    if isinstance(here, list):
        others += [here[:-1], here + here, here[::-1], [here]] * 3
    if isinstance(here, dict) and here:
        others += [dict(list(here.items())[1:]), {**here, "unknown": 1}] * 4
    choice = random.random()
    if choice < 0.15:
        parent.pop(key)
    elif choice < 0.25 and isinstance(parent, dict):
        parent[_pick(random, (*NAMES, f"{key}x", str(key).upper()))] = parent.pop(key)
    else:
        parent[key] = _pick(random, others)
    return value


def json_tree(data: bytes, random: Random) -> bytes:
    """A place of the JSON is something else."""
    return json.dumps(_changed_tree(json.loads(data), random)).encode("utf-8", "surrogatepass")


def toml_tree(data: bytes, random: Random) -> bytes:
    """A place of the TOML is something else."""
    try:
        return tomli_w.dumps(_changed_tree(tomllib.loads(_text(data)), random)).encode()
    except RecursionError:  # the writer's, for the deepest lists
        return data + b"\ndeep = " + b"[" * 5000 + b"]" * 5000 + b"\n"


def hostile_xml(data: bytes, random: Random) -> bytes:
    """Entities, a document type, another file's contents, deep or strange elements."""
    text = _text(data)
    head, _, rest = text.partition("?>")
    added = _pick(
        random,
        (
            '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]>',
            '<!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;&b;&b;">]>',
            "<!-- " + "x" * 100 + " -->",
            "<a>" * 3000,
        ),
    )
    if random.integers(2):
        return f"{head}?>{added}{rest}".encode()
    found = list(re.finditer(r"<(link|joint|mass|inertia|origin|axis|limit)\b[^>]*?/?>", text))
    match = found[int(random.integers(len(found)))]
    return (
        text[: match.start()] + _pick(random, ("", match[0] * 2)) + text[match.end() :]
    ).encode()


def safetensors_header(data: bytes, random: Random) -> bytes:
    """The header of safetensors (its length, then JSON) says something else."""
    (size,) = struct.unpack("<Q", data[:8])
    if random.integers(4) == 0:
        size = int(_pick(random, (0, 1, size + 1, 2**31, 2**63 - 1, size - 1)))
        return struct.pack("<Q", size) + data[8:]
    head = json_tree(data[8 : 8 + size], random)
    return struct.pack("<Q", len(head)) + head + data[8 + size :]


def safetensors_value(data: bytes, random: Random) -> bytes:
    """Numbers of a tensor are others: not finite, huge, or of the opposite sign."""
    (size,) = struct.unpack("<Q", data[:8])
    values = np.frombuffer(data[8 + size :], dtype="<f4").copy()
    where = random.integers(0, len(values), int(_pick(random, (1, 100))))
    values[where] = _pick(random, (np.nan, np.inf, 1e30, -values[where], 0.0))
    return data[: 8 + size] + values.tobytes()
