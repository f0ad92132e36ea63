"""Muscles of the ten walks: hips beside implants, timing beside electromyograms, time."""

import time
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import claims
from claims import Claim, Given
from claims.muscle_measures import (
    MUSCLES,
    as_implants_say,
    in_time,
    on_and_off,
    perry,
    together,
)

if TYPE_CHECKING:
    from gaitval.kinetics.musculature.gait import LoadedMotion, MuscleGait

PATIENTS_WALK: Final = 1.1
"""m/s: four people with implants carried 2.38 body weights at 4 km/h (Bergmann et al. 2001, J
Biomech 34:859, abstract)."""


def _walks() -> list[Any]:
    """The ten people's stored walks, as motions with moments."""
    import gaitval as gv
    from gaitval.metrics.cycles import find_cycles
    from gaitval.metrics.walk_muscles import walk_motion
    from gaitval.model.parameters import apply_parameters

    found = []
    for number in range(1, 11):
        policy = gv.load_policy(number)
        walk = gv.rollout(policy, cycles=6)
        body = apply_parameters(policy.model, walk.mu)
        cycles = find_cycles(walk, policy.configuration)
        found.append(walk_motion(walk, cycles, body, height=policy.subject.height_m))
    return found


@claims.measured("data")
def hips(given: Given) -> list[Claim]:
    """Hip and knee contact, reserves, timing and time, of the ten people's walks."""
    from gaitval.kinetics.musculature.gait import muscles_of

    taken, gaits, implants = [], [], []
    motions = _walks()
    for motion in motions:
        begin = time.process_time()
        found = muscles_of([motion])
        strides = sum(leg.cycles for leg in found.legs.values()) / 2
        taken.append((time.process_time() - begin) / strides)
        gaits.append(found)
        implants.append(max(_hips(motion, found)))
    hip, knee = (
        [max(leg.contact[name].max() for leg in found.legs.values()) for found in gaits]
        for name in ("hip", "knee")
    )
    inside = sum(2.0 <= one <= 2.9 for one in implants)
    speeds = np.array([found.speed for found in motions], dtype=float)
    steeper, at = np.polyfit(speeds - PATIENTS_WALK, implants, 1)
    return [
        Claim("hip contact, lowest peak of ten people", float(min(hip)), "BW", 10),
        Claim("hip contact, highest peak of ten people", float(max(hip)), "BW", 10),
        Claim("hip contact as implants say, ten people", float(np.median(implants)), "BW", 10),
        Claim("hip contact as implants say, from 2.0 to 2.9 BW", float(inside), "people", 10),
        Claim(f"hip contact as implants say, line at {PATIENTS_WALK:g} m/s", float(at), "BW", 10),
        Claim("hip contact as implants say, line, of a m/s", float(steeper), "BW", 10),
        Claim("knee contact, mean peak of ten people", float(np.mean(knee)), "BW", 10),
        Claim("muscles, largest reserve over its moment", _reserve(gaits), "%", 20),
        Claim("muscles, processor time a stride of both sides", float(np.median(taken)), "s", 10),
        *_timing(given, "ten walkers", gaits),
    ]


def _hips(motion: "LoadedMotion", found: "MuscleGait") -> list[float]:
    """As implants say, of every cycle."""
    return [
        as_implants_say(piece.legs[side], piece.time, span, found.body_weight)
        for _, side, piece in found.pieces
        for span in motion.cycles[side]
        if piece.time[0] <= span[0] and span[1] <= piece.time[-1]
    ]


def _reserve(gaits: "list[MuscleGait]") -> float:
    return 100.0 * max(
        float(piece.legs[side].reserve_share().max())
        for found in gaits
        for _, side, piece in found.pieces
    )


def _timing(given: Given, who: str, gaits: "list[MuscleGait]") -> list[Claim]:
    """Beside electromyograms of healthy people (Perry and Burnfield 2010)."""
    seen = perry(given.data / "emg" / "PerryBurnfieldElectromyography.csv")
    legs = [leg for found in gaits for leg in found.legs.values()]
    both = [on_and_off(together(legs, muscles), seen[name]) for name, muscles in MUSCLES.items()]
    agree, chance = 100 * np.mean(both, axis=0)
    n = len(MUSCLES)
    return [
        Claim(f"muscles on and off as electromyograms, {who}", float(agree), "%", n),
        Claim(f"muscles on and off by chance, {who}", float(chance), "%", n),
        Claim(f"muscles timed within 10 %, {who}", float(in_time(legs, seen)), "of 9", 9),
    ]
