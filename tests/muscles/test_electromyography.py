"""Electromyograms: names of channels, envelopes, agreement, staying near; and settings, once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_walk import loaded_walk

import gaitval as gv
from gaitval.apps.muscles.sharing import MuscleSettings, shared_motions
from gaitval.errors import ConfigurationError, RecordError
from gaitval.gait.electromyograms import muscle_of, read_electromyograms
from gaitval.kinetics.musculature.electromyography import DELAY
from gaitval.kinetics.musculature.gait import muscles_of
from gaitval.kinetics.musculature.paths import COORDINATES, table
from gaitval.mocap.mot_writing import StorageTable, write_storage


@pytest.fixture(scope="module")
def motion():
    walk = loaded_walk()
    return replace(walk, name="walk.trc", cycles={"right": walk.cycles["right"]})


@pytest.fixture(scope="module")
def computed(motion):
    return muscles_of([motion], sides=("right",))


def _storage(path: Path, time: np.ndarray, **columns: np.ndarray) -> Path:
    write_storage(path, StorageTable(tuple(columns), time, np.column_stack([*columns.values()])))
    return path


def _as_seen(computed, names: tuple[str, ...]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Envelopes that are what was computed, as much earlier as muscles lag."""
    piece = computed.pieces[0][2]
    which = [table().names.index(name) for name in names]
    activation = piece.legs["right"].activation[:, which]
    return piece.time - DELAY, {
        f"{name}_r": 0.7 * curve for name, curve in zip(names, activation.T, strict=True)
    }


@pytest.mark.parametrize(
    ("name", "muscles", "side"),
    [
        ("L_VASLAT", ("vaslat",), "left"),
        ("soleus_r", ("soleus",), "right"),
        ("Right Tibialis Anterior", ("tibant",), "right"),
        ("EMG bifeml", ("bflh",), None),
        ("R.Gastrocnemius", ("gasmed", "gaslat"), "right"),
        ("glmax2_l", ("glmax2",), "left"),
        ("addmagIsch_r", ("addmagIsch",), "right"),
        ("gmed", ("glmed1", "glmed2", "glmed3"), None),
        ("rf", ("recfem",), None),
    ],
)
def test_names_of_laboratories_are_muscles(name, muscles, side):
    assert muscle_of(name) == (muscles, side)
    assert set(muscles) <= set(table().names)


@pytest.mark.parametrize("name", ["Fz1", "load cell", "GM", "L", "", "goniometer", "FP2.Mx"])
def test_other_signals_are_none(name):
    assert muscle_of(name) is None


def test_what_is_computed_is_found_again(motion, computed, tmp_path):
    """At its own time, but for the low-pass; half a cycle later it is not."""
    names = ("soleus", "glmed1", "vaslat")
    time, columns = _as_seen(computed, names)
    half = len(time) // 2
    for shift, least, most in ((0, 0.85, 1.0), (half, -1.0, 0.5)):
        moved = {name: np.roll(curve, shift) for name, curve in columns.items()}
        path = _storage(tmp_path / f"walk{shift}.sto", time, **moved)
        settings = MuscleSettings(side="right", emg=(path,))
        shared = shared_motions([motion], settings)
        assert [each.channel for each in shared.seen] == list(columns)
        assert least <= np.mean([each.correlation for each in shared.seen]) <= most
        agree = np.mean([each.agrees for each in shared.seen])
        assert (agree > 0.8) == (shift == 0)


def test_activations_are_kept_near_what_is_seen(motion, computed, tmp_path):
    """A soleus that another time is planted for: nearer to it, and the moments are still made."""
    time, columns = _as_seen(computed, ("soleus",))
    planted = {name: np.roll(curve, len(curve) // 5) for name, curve in columns.items()}
    path = _storage(tmp_path / "walk.sto", time, **planted)
    alone, near = (
        shared_motions([motion], MuscleSettings(side="right", emg=(path,), emg_weight=weight))
        for weight in (0.0, 30.0)
    )
    assert near.seen[0].correlation > alone.seen[0].correlation + 0.1
    for _, side, piece in near.muscles.pieces:
        ankle = COORDINATES.index("ankle_angle")
        assert piece.legs[side].reserve_share()[ankle] < 0.02


def test_a_raw_signal_becomes_its_envelope(tmp_path):
    """Noise that swells twice a second, about an offset, with a slow drift."""
    rate, random = 1000.0, np.random.default_rng(3)
    time = np.arange(0.0, 4.0, 1.0 / rate)
    swells = np.clip(np.sin(2 * np.pi * 1.0 * time), 0.0, None) ** 2
    raw = swells * random.standard_normal(len(time)) + 0.4 + 0.5 * np.sin(2 * np.pi * 0.5 * time)
    channel = read_electromyograms(_storage(tmp_path / "a.sto", time, ta_l=raw)).channels[0]
    assert (channel.side, channel.muscles) == ("left", ("tibant",))
    assert channel.envelope.max() == pytest.approx(1.0)
    assert channel.envelope.min() >= 0.0
    assert np.corrcoef(channel.envelope, swells)[0, 1] > 0.95


def test_what_cannot_be_read_is_refused(tmp_path):
    time = np.arange(0.0, 2.0, 0.01)
    wave = np.sin(7 * time)
    for name, columns, side, words in (
        ("none", {"Fz1": wave}, None, ("Fz1", "soleus_r")),
        ("side", {"soleus": wave**2}, None, ("soleus", "--emg-side")),
        ("rate", {"soleus_r": wave}, None, ("100 Hz", "500 Hz")),
        ("silent", {"soleus_r": 0.0 * wave}, None, ("soleus_r", "amplifier")),
    ):
        path = _storage(tmp_path / f"{name}.sto", time, **columns)
        with pytest.raises(RecordError) as found:
            read_electromyograms(path, side)
        assert all(word in str(found.value) for word in (str(path), *words))


def test_electromyograms_are_of_a_trial(motion, tmp_path):
    wave = 1.0 + np.sin(np.arange(200) / 9)
    late = _storage(tmp_path / "late.sto", 1000 + np.arange(200) / 100, soleus_r=wave)
    with pytest.raises(ConfigurationError, match=r"1000\.00 .* one clock"):
        shared_motions([motion], MuscleSettings(emg=(late,)))
    with pytest.raises(ConfigurationError, match=r"late\.sto.*walk\.trc"):
        shared_motions([motion, motion], MuscleSettings(emg=(late,)))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"side": "up"}, ("up", "right or left")),
        ({"strength": 7.0}, ("7", "0.05 to 5")),
        ({"strength": float("nan")}, ("nan", "0.05 to 5")),
        ({"strength": {"soleus": -1.0}}, ("soleus", "-1", "0.05 to 5")),
        ({"emg_weight": 3.0}, ("3", "--emg")),
        ({"emg_side": "both"}, ("both", "right or left")),
        ({"emg": "walk.sto", "emg_weight": 3.0, "bands": True}, ("bands",)),
    ],
)
def test_settings_are_checked_in_one_place(options, words):
    """The command makes the same object."""
    with pytest.raises(ConfigurationError) as found:
        gv.muscles("nowhere", **options)
    assert all(word in str(found.value) for word in words)
