"""Electromyograms of a recording: analog channels of a C3D file, or columns of a table.

Channels are known by their names. A name says the muscle and, before or after it, the side:
`L_VASLAT`, `soleus_r`, `Right Tibialis Anterior`. What is no muscle's name is another signal and
left out; what could be two muscles (GM) is, too.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.signal import butter, sosfiltfilt

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.errors import RecordError
from gaitval.gait.filters import low_pass

ALIASES: Final[Mapping[str, str]] = {
    **dict.fromkeys(("grac", "gracilis", "gra"), "grac"),
    **dict.fromkeys(("semimem", "semimembranosus", "sm"), "semimem"),
    **dict.fromkeys(("semiten", "semitendinosus", "st"), "semiten"),
    **dict.fromkeys(("medialhamstrings", "medialhamstring", "medham", "mh"), "semimem semiten"),
    **dict.fromkeys(
        ("bifeml", "bflh", "bicepsfemoris", "bicepsfemorislonghead", "bf", "lateralhamstrings",
         "lateralhamstring", "latham", "lh"),
        "bflh",
    ),
    **dict.fromkeys(("hamstrings", "hamstring", "ham", "hams"), "bflh semimem semiten"),
    **dict.fromkeys(("vasmed", "vastusmedialis", "vm", "vmo"), "vasmed"),
    **dict.fromkeys(("vaslat", "vastuslateralis", "vl"), "vaslat"),
    **dict.fromkeys(("vasint", "vastusintermedius", "vi"), "vasint"),
    **dict.fromkeys(("recfem", "rectusfemoris", "rf", "rectus"), "recfem"),
    **dict.fromkeys(
        ("gasmed", "medgas", "medialgastrocnemius", "gastrocnemiusmedialis", "medialgastroc", "mg"),
        "gasmed",
    ),
    **dict.fromkeys(
        ("gaslat", "latgas", "lateralgastrocnemius", "gastrocnemiuslateralis", "lateralgastroc",
         "lg"),
        "gaslat",
    ),
    **dict.fromkeys(("gastrocnemius", "gastroc", "gas", "gastrocs"), "gasmed gaslat"),
    **dict.fromkeys(("soleus", "sol"), "soleus"),
    **dict.fromkeys(("tibant", "tibialisanterior", "ta", "tib"), "tibant"),
    **dict.fromkeys(("tibpost", "tibialisposterior"), "tibpost"),
    **dict.fromkeys(("perlong", "peronl", "peroneuslongus", "peroneus", "pl"), "perlong"),
    **dict.fromkeys(("perbrev", "peroneusbrevis", "pb"), "perbrev"),
    **dict.fromkeys(("tfl", "tensorfasciaelatae", "tensorfascialata"), "tfl"),
    **dict.fromkeys(
        ("addmag", "adductormagnus"), "addmagDist addmagIsch addmagMid addmagProx"
    ),
    **dict.fromkeys(("addlong", "adductorlongus", "adductors", "add"), "addlong"),
    **dict.fromkeys(("gmax", "glmax", "gluteusmaximus", "glutmax"), "glmax1 glmax2 glmax3"),
    **dict.fromkeys(("gmed", "glmed", "gluteusmedius", "glutmed"), "glmed1 glmed2 glmed3"),
    **dict.fromkeys(("sart", "sartorius"), "sart"),
}  # fmt: skip
"""Muscles of the leg's table by what laboratories call them, without signs between letters."""

_PARTS: Final = {
    part: part.lower() for group in dict.fromkeys(ALIASES.values()) for part in group.split()
}


@dataclass(frozen=True)
class SignalSettings:
    """How envelopes of electromyograms are made."""

    least_samples: int = 3
    lowest_hz: float = 30.0
    """High-pass of a raw signal: below it are movements of cables and skin (convention)."""
    envelope_hz: float = 6.0
    """Low-pass of what is rectified (convention)."""
    raw: float = -0.05
    """A signal that falls below this share of its largest value is raw, not an envelope."""


SIGNALS: Final = SignalSettings()


@dataclass(frozen=True)
class Channel:
    """One electromyogram.

    Attributes
    ----------
    name : as in the file.
    side : of the leg.
    muscles : of the leg's table that it is of.
    envelope : (N,) 0 to 1, of its largest value in this recording.
    """

    name: str
    side: Side
    muscles: tuple[str, ...]
    envelope: Array


@dataclass(frozen=True)
class Electromyograms:
    """Electromyograms of one trial; `time` (N,) s, on the clock of the markers."""

    source: str
    time: Array
    channels: tuple[Channel, ...]


def read_electromyograms(path: Path, side: Side | None = None) -> Electromyograms:
    """Envelopes of the electromyograms in the C3D, MOT or STO file `path`; of channels whose names
    do not say it, `side` is the side.

    Raises RecordError if no channel is named like a muscle, a side is missing, the rate is too low
    for raw signals, or the file is damaged.
    """
    path = Path(path)
    time, columns = _c3d(path) if path.suffix.lower() == ".c3d" else _storage(path)
    named = {name: found for name in columns if (found := muscle_of(name)) is not None}
    if not named:
        shown = ", ".join(list(columns)[:12]) or "none"
        raise RecordError(
            f"{path}: none of its {len(columns)} channels is named like a muscle ({shown}). Name "
            "electromyograms by muscle and side, for example soleus_r or L_VASLAT."
        )
    without = [name for name, (_, own) in named.items() if own is None]
    if without and side is None:
        raise RecordError(
            f"{path}: {', '.join(without)} are electromyograms, but their names do not say of "
            "which leg. Give the side (--emg-side right or left), or name them soleus_r."
        )
    if len(time) < SIGNALS.least_samples or not time[-1] > time[0]:
        raise RecordError(
            f"{path}: {len(time)} samples at {len(set(time))} times are no electromyogram of a "
            "walk. Export the whole trial."
        )
    rate = (len(time) - 1) / float(time[-1] - time[0])
    channels = []
    for name, (muscles, own) in named.items():
        shape = _envelope(path, name, columns[name], rate)
        if shape is not None:
            channels.append(Channel(name, own or side or "right", muscles, shape))
    if not channels:
        raise RecordError(
            f"{path}: {', '.join(named)} have no signal at all. Give a recording in which the "
            "amplifier was on."
        )
    return Electromyograms(str(path), time, tuple(channels))


def muscle_of(name: str) -> tuple[tuple[str, ...], Side | None] | None:
    """Muscles, and the side if it is said, of a channel `name`; None for other signals."""
    words = [word for word in re.split(r"[^a-z0-9]+", name.lower()) if word and word != "emg"]
    side: Side | None = None
    for words_of, value in ((("r", "right", "rt"), "right"), (("l", "left", "lt"), "left")):
        for at in (0, -1):
            if len(words) > 1 and words[at] in words_of:
                side = "right" if value == "right" else "left"
                del words[at]
                break
    plain = "".join(words)
    own = next((part for part, low in _PARTS.items() if low == plain), None)
    if own is not None:
        return (own,), side
    found = ALIASES.get(plain)
    return None if found is None else (tuple(found.split()), side)


def _c3d(path: Path) -> tuple[Array, dict[str, Array]]:
    from gaitval.mocap.c3d_contents import check_size, labels_of, read_contents

    check_size(path)
    contents = read_contents(path)
    markers, analogs = contents.number("POINT", "RATE"), contents.number("ANALOG", "RATE")
    labels = labels_of(contents, "ANALOG", "LABELS")
    if not labels or not len(contents.analogs) or not (markers > 0 and analogs > 0):
        raise RecordError(
            f"{path}: has no analog channels with names, so no electromyograms. Export the trial "
            "with its analog data."
        )
    time = contents.first_frame / markers + np.arange(len(contents.analogs)) / analogs
    return time, dict(zip(labels, contents.analogs.T, strict=False))


def _storage(path: Path) -> tuple[Array, dict[str, Array]]:
    from gaitval.mocap.mot import read_storage

    table = read_storage(path)
    # Other programs' times are not always even, which filters need.
    count = len(table.time)
    even = np.linspace(table.time[0], table.time[-1], count)
    columns = {
        name: np.interp(even, table.time, values)
        for name, values in zip(table.columns, table.values.T, strict=True)
    }
    return even, columns


def _envelope(path: Path, name: str, values: Array, rate: float) -> Array | None:
    """(N,) of its largest value; None of a channel without a signal."""
    if not np.isfinite(values).all():
        raise RecordError(
            f"{path}: {name} is not a number in {int((~np.isfinite(values)).sum())} of "
            f"{len(values)} samples. Cut the trial to where the electromyogram is whole."
        )
    raw = values.min() < SIGNALS.raw * np.abs(values).max()
    if raw and rate < 4.0 * SIGNALS.lowest_hz:
        raise RecordError(
            f"{path}: {name} is a raw electromyogram at {rate:.0f} Hz; it takes 500 Hz or more to "
            "find how active the muscle is. Export it as it was recorded, or as an envelope."
        )
    if raw:
        sections = butter(2, SIGNALS.lowest_hz, "highpass", fs=rate, output="sos")
        values = np.abs(sosfiltfilt(sections, values - values.mean()))
    if rate > 2.5 * SIGNALS.envelope_hz:
        values = low_pass(values, rate=rate, cutoff_hz=SIGNALS.envelope_hz)
    values = np.maximum(values, 0.0)
    most = float(values.max(initial=0.0))
    return values / most if most > 0.0 else None


__all__ = ["Channel", "Electromyograms", "muscle_of", "read_electromyograms"]
