"""A C3D file of integers, written from the format's description (c3d.org) without ezc3d."""

import struct
from pathlib import Path

import numpy as np

BLOCK = 512
"""Bytes; parts of a file begin at multiples."""


def write_integer_c3d(path: Path, counts: np.ndarray, offset: int, gain: float, form: str) -> None:
    """A file of one marker at the origin, whose channels have these counts (T, C) of 16 bits, from
    0 to 65535 of the FORMAT "UNSIGNED", or their two's complement of "SIGNED"."""
    frames, channels = counts.shape

    def group(number: int, name: str) -> bytes:
        return struct.pack("<bb", len(name), -number) + name.encode() + struct.pack("<hB", 3, 0)

    def entry(number: int, name: str, kind: int, shape: list[int], data: bytes) -> bytes:
        body = struct.pack("<bB", kind, len(shape)) + bytes(shape) + data + b"\0"
        head = struct.pack("<bb", len(name), number) + name.encode()
        return head + struct.pack("<h", 2 + len(body)) + body

    def whole(number: int, name: str, value: int) -> bytes:
        return entry(number, name, 2, [], struct.pack("<H", value & 0xFFFF))

    def real(number: int, name: str, value: float) -> bytes:
        return entry(number, name, 4, [], struct.pack("<f", value))

    def text(number: int, name: str, values: list[str]) -> bytes:
        width = max(map(len, values))
        data = b"".join(value.ljust(width).encode() for value in values)
        return entry(number, name, -1, [width, len(values)], data)

    names = [f"C{i}" for i in range(channels)]
    parameters = b"".join(
        (
            *(group(1, "POINT"), group(2, "ANALOG"), group(3, "FORCE_PLATFORM")),
            *(whole(1, "USED", 1), whole(1, "FRAMES", frames), whole(1, "DATA_START", 4)),
            *(real(1, "SCALE", 0.1), real(1, "RATE", 100.0)),
            *(text(1, "LABELS", ["M"]), text(1, "UNITS", ["mm"])),
            *(whole(2, "USED", channels), real(2, "RATE", 100.0), real(2, "GEN_SCALE", 1.0)),
            entry(2, "SCALE", 4, [channels], np.full(channels, gain, "<f4").tobytes()),
            entry(2, "OFFSET", 2, [channels], np.full(channels, offset & 0xFFFF, "<u2").tobytes()),
            *(text(2, "LABELS", names), text(2, "UNITS", ["N"] * channels)),
            *(text(2, "FORMAT", [form]), whole(3, "USED", 0), b"\0\0"),
        )
    )
    header = bytes([2, 80]) + struct.pack("<5H", 1, channels, 1, frames & 0xFFFF, 0)
    header += struct.pack("<f2Hf", 0.1, 4, 1, 100.0)
    marker = np.zeros(4, "<i2").tobytes()
    data = b"".join(marker + row.astype("<u2").tobytes() for row in counts)
    assert len(parameters) <= 2 * BLOCK - 4
    parts = (header, bytes([1, 80, 2, 84]) + parameters, data)
    sizes = (BLOCK, 2 * BLOCK, -(-len(data) // BLOCK) * BLOCK)
    path.write_bytes(
        b"".join(part.ljust(size, b"\0") for part, size in zip(parts, sizes, strict=True))
    )
