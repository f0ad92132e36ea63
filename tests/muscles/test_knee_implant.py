"""Contact force of a knee that measures it: three walks of one man, through the import.

He has an instrumented left knee (Fregly et al. 2012, J Orthop Res 30:503; 75 kg, 1.80 m). His
trials show one cycle of the left side. No number was fitted to his forces: the criterion's weights
and where knees usually are come of ten other people, where his knee is of the markers on it, and
which criterion is the default of five people with electromyograms. But that contact forces belong
in a criterion at all was seen on him, too (`sharing.CRITERIA`).
"""

import csv
from pathlib import Path

import numpy as np
import pytest
from knee_implant import HEIGHT, MASS, knee_request

from gaitval.configuration import load_configuration
from gaitval.constants import GRAVITY
from gaitval.errors import RecordError
from gaitval.gait.electromyograms import read_electromyograms
from gaitval.kinetics.musculature import share
from gaitval.kinetics.musculature.bands import draw
from gaitval.kinetics.musculature.electromyography import seen_activations
from gaitval.kinetics.musculature.gait import _cycle_of, muscles_of
from gaitval.mocap.reading import read_recording
from gaitval.session.importing.importing import work_out
from gaitval.session.loaded import loaded_motion, measured_knees
from gaitval.session.request import silent
from gaitval.session.session import ImportProgress

TRIALS = ("ss1", "ss3", "ss11")


@pytest.fixture(scope="module")
def progress(gait_data, tmp_path_factory) -> ImportProgress:
    request, found = (
        knee_request(gait_data, tmp_path_factory.mktemp("knee"), TRIALS),
        ImportProgress(),
    )
    work_out(request, load_configuration().processing, silent, found)
    return found


def _cycle(folder: Path, trial: str, time: np.ndarray) -> np.ndarray:
    """101 times of the left cycle that the measured force is of: the TRC file is cut to it."""
    cut = read_recording(folder / f"PS_{trial}.trc").marker("LHeel")[:, 1]
    whole = read_recording(folder / f"PS_{trial}.c3d").marker("LHeel")[:, 2]
    off = [np.abs(whole[i : i + len(cut)] - cut).mean() for i in range(len(whole) - len(cut) + 1)]
    start = int(np.argmin(off))
    assert off[start] < 1e-5
    return np.linspace(time[start], time[start + len(cut) - 1], 101)


def _measured(folder: Path, trial: str) -> dict[str, np.ndarray]:
    with (folder / "knee_force.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["trial"] == trial]
    weight = MASS * GRAVITY
    found = {n: np.array([float(r[f"measured_{n}_n"]) for r in rows]) / weight
             for n in ("medial", "lateral", "total")}  # fmt: skip
    return found | {"expert": np.array([float(row["expert_knee_bw"]) for row in rows])}


@pytest.fixture(scope="module")
def knees(progress) -> dict[str, float]:
    landmarks = progress.session.marker_set.landmarks
    return measured_knees(progress.body.model, progress.body.markers, landmarks)


PARTS = (("total", "compression"), ("medial", "medial"), ("lateral", "lateral"))


def _computed(progress, data: Path, trial: str, knees: dict[str, float], **options):
    """What is found of a trial, and its curves over the measured cycle, body weights; NaN where the
    plates do not show the left foot alone.
    """
    options = {"criterion": "contact"} | options
    walk = progress.trials[TRIALS.index(trial)]
    found = share(
        progress.body.model,
        walk.positions,
        walk.dynamics,
        height=HEIGHT,
        sides=("left",),
        knees=knees,
        **options,
    )
    phase, contact = _cycle(data, trial, found.time), found.legs["left"].contact
    curves = {
        name: np.interp(phase, found.time, getattr(contact, of)) / found.body_weight
        for name, of in PARTS
    }
    return found, phase, curves


def _rms(values: np.ndarray) -> float:
    """Of what is known."""
    return float(np.sqrt(np.nanmean(np.square(values))))


def _correlation(computed: np.ndarray, measured: np.ndarray) -> float:
    known = np.isfinite(computed)
    return float(np.corrcoef(computed[known], measured[known])[0, 1])


def _peak_off(computed: np.ndarray, measured: np.ndarray) -> float:
    """Largest computed over largest measured force of what is known, less 1."""
    return float(np.nanmax(computed) / measured[np.isfinite(computed)].max() - 1.0)


@pytest.mark.slow
def test_the_knee_carries_what_it_measures(progress, gait_data, knees):
    """Nearer than OpenSim by an expert (.31, .34 BW; .49 in ss3, where he knows nothing of the two
    feet on a plate).
    """
    errors, correlations = {}, []
    for trial in TRIALS:
        measured = _measured(gait_data / "knee_implant", trial)
        found, _, computed = _computed(progress, gait_data / "knee_implant", trial, knees)
        leg = found.legs["left"]
        assert leg.solved[leg.known].all()
        assert (leg.reserve_share() < 0.02).all()
        assert not leg.outside.any()
        errors[trial] = {n: _rms(v - measured[n]) for n, v in computed.items()}
        correlations.append(_correlation(computed["total"], measured["total"]))
        assert abs(_peak_off(computed["total"], measured["total"])) < 0.15
        known = np.isfinite(computed["total"])
        assert errors[trial]["total"] < _rms((measured["expert"] - measured["total"])[known])
    assert np.mean([each["total"] for each in errors.values()]) < 0.30
    assert np.mean([each["lateral"] for each in errors.values()]) < 0.27
    assert np.mean([each["medial"] for each in errors.values()]) < 0.28
    assert min(correlations) > 0.92


@pytest.mark.slow
def test_frames_in_which_both_feet_are_on_a_plate_are_not_said(progress, gait_data, knees):
    """In ss3 the other foot is on his plate until 14 % of the cycle and from 53 %, his own then on
    the other's; 60 ms beside that the low-pass has a part of it. As it came before, the first peak
    was 44 % too high. Swing is known.
    """
    shares = {}
    for trial, walk in zip(TRIALS, progress.trials, strict=True):
        _, phase, computed = _computed(progress, gait_data / "knee_implant", trial, knees)
        known = np.isfinite(computed["total"])
        shares[trial] = known.mean()
        frame = walk.moments.to_frame()
        knee = frame[(frame.quantity == "knee_angle moment") & (frame.side == "left")]
        shown = np.interp(phase, walk.moments.time, knee.value.to_numpy())
        np.testing.assert_array_equal(np.isfinite(shown), known)
    assert shares["ss1"] > 0.97
    assert shares["ss11"] > 0.97
    assert 0.55 < shares["ss3"] < 0.65
    assert not np.isfinite(computed["total"][-1])  # ss11 lands beside the plates


@pytest.mark.slow
def test_where_the_plates_are_trusted_the_default_criterion_meets_his_knee(
    progress, gait_data, knees
):
    """It was chosen on other people. In ss3 one foot treads on the other's plate until 14 % of the
    cycle and from 53 %: its centre of pressure is 6 cm behind, and the first peak 43 % too high, in
    an expert's OpenSim, too. The import says so, and shares what is 60 ms away from it.
    """
    errors: dict[str, list[float]] = {name: [] for name, _ in PARTS}
    correlations = []
    for trial, walk in zip(TRIALS, progress.trials, strict=True):
        measured = _measured(gait_data / "knee_implant", trial)
        motion = loaded_motion(walk, progress.body.model, height=HEIGHT, knees=knees)
        ((_, _, piece),) = muscles_of([motion], sides=("left",)).pieces
        phase = _cycle(gait_data / "knee_implant", trial, walk.moments.time)
        known = (phase >= piece.time[0]) & (phase <= piece.time[-1])
        # the last 60 ms before a landing beside the plates are not shared, 5 % of a cycle
        assert known.mean() > (0.2 if trial == "ss3" else 0.92)
        computed = {
            name: np.interp(phase, piece.time, getattr(piece.legs["left"].contact, of))[known]
            / piece.body_weight
            for name, of in PARTS
        }
        for name, curve in computed.items():
            errors[name].append(_rms(curve - measured[name][known]))
        correlations.append(np.corrcoef(computed["total"], measured["total"][known])[0, 1])
        assert abs(computed["total"].max() / measured["total"][known].max() - 1) < 0.15, trial
    assert np.mean(errors["total"]) < 0.30
    assert np.mean(errors["medial"]) < 0.22
    assert np.mean(errors["lateral"]) < 0.30
    assert np.mean(correlations) > 0.90


@pytest.mark.slow
def test_the_markers_of_his_knee_say_how_its_halves_share(progress, gait_data, knees):
    """They lie 14 mm inside of the line from hip to ankle. In that line, or on the other side of
    it, the medial half would carry too much.
    """
    assert -0.017 < knees["left"] < -0.012
    data, trial = gait_data / "knee_implant", "ss1"
    measured = _measured(data, trial)
    off = {
        place: _rms(_computed(progress, data, trial, given)[2]["medial"] - measured["medial"])
        for place, given in (
            ("as marked", knees),
            ("in line", {"left": 0.0}),
            ("outside", {"left": -knees["left"]}),
        )
    }
    assert off["as marked"] < 0.7 * off["in line"] < 0.6 * off["outside"]


@pytest.mark.slow
def test_bands_hold_what_the_knee_measures(progress, gait_data, knees):
    """90 % bands. What shows as a pull (down to .23 BW in swing) no plateau can do: it is 0 here,
    and as measured the medial half is inside in 75 % of the cycle.
    """
    inside: dict[str, list[float]] = {name: [] for name, _ in PARTS}
    data = gait_data / "knee_implant"
    for trial in TRIALS:
        found, phase, _ = _computed(progress, data, trial, knees)
        few = _cycle_of((found, phase[0], phase[-1]), "left")
        drawn, measured = draw(few, "left"), _measured(data, trial)
        for name, of in PARTS:
            low, high = (np.interp(phase, few.time, e) / found.body_weight for e in drawn.band(of))
            seen, known = np.maximum(measured[name], 0.0), np.isfinite(low)
            inside[name].append(100 * float(((low <= seen) & (seen <= high))[known].mean()))
    for name, shares in inside.items():
        assert 75 <= np.mean(shares) <= 98, (name, shares)


@pytest.mark.slow
def test_his_electromyograms_are_read_beside_his_muscles(progress, gait_data):
    """16 of 36 channels of a C3D file are named by muscles, without a side."""
    path = gait_data / "knee_implant" / "PS_ss1.c3d"
    with pytest.raises(RecordError, match=r"--emg-side"):
        read_electromyograms(path)
    seen = read_electromyograms(path, "left")
    assert len(seen.channels) == 16
    walk = progress.trials[0]
    motion = loaded_motion(walk, progress.body.model, height=HEIGHT)
    rows = seen_activations(muscles_of([motion], sides=("left",)), {motion.name: seen})
    by_name = {each.channel: each for each in rows}
    assert by_name.keys() == {each.name for each in seen.channels}
    assert np.nanmean([each.correlation for each in rows]) > 0.2
    assert by_name["soleus"].correlation > 0.5


@pytest.mark.slow
def test_little_effort_alone_loads_it_twice_too_much(progress, gait_data):
    """Why the criterion is part of the band: what every static optimisation does by default."""
    walk = progress.trials[0]
    measured = _measured(gait_data / "knee_implant", TRIALS[0])["total"]
    found = share(
        progress.body.model, walk.positions, walk.dynamics, height=HEIGHT, sides=("left",)
    )
    most = np.nanmax(found.legs["left"].contact.compression) / found.body_weight
    assert most > 1.8 * measured.max()
