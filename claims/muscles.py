"""Muscles: paths in other programs, an instrumented knee, hips, electromyograms, time."""

import csv
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import claims
from claims import Claim
from claims.given import Given

PERSON = 5


@claims.measured()
def tendons(given: Given) -> list[Claim]:
    """Lengths in MuJoCo and as polynomials in OpenSim against ours, over gait, subject 5."""
    import gaitval as gv
    from gaitval.musculature.mapping import sizes
    from gaitval.musculature.own_coordinates import own_lengths, plain_paths
    from gaitval.musculature.paths import COORDINATES
    from gaitval.musculature.strands import gait_poses, own_tendons, strand_lengths

    factors = sizes(gv.load_policy(PERSON).model, "r").factors
    angles = gait_poses()
    lengths, _ = own_lengths(angles, factors)
    straight, plain = [], []
    for i, tendon in enumerate(own_tendons(factors).values()):
        made = strand_lengths(angles, tendon.strands, factors, scaled=True) / len(tendon.strands)
        straight.append(np.abs(made + tendon.more - lengths[:, i]))
    for i, path in enumerate(plain_paths(factors)):
        columns = [COORDINATES.index(name) for name in path.coordinates]
        plain.append(np.abs(path.lengths(angles[:, columns]) - lengths[:, i]))
    return [
        Claim(f"muscle length, {name}, 95 %", 1e3 * float(np.quantile(off, 0.95)), "mm", 40)
        for name, off in (("tendons of MuJoCo", straight), ("polynomials for OpenSim", plain))
    ]


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


@claims.measured()
def hips(given: Given) -> list[Claim]:
    """Peaks of hip and knee contact, reserves and time, of the ten people's walks."""
    from gaitval.musculature.gait import muscles_of

    hip, knee, reserve, taken = [], [], [], []
    for motion in _walks():
        begin = time.process_time()
        found = muscles_of([motion])
        strides = sum(leg.cycles for leg in found.legs.values()) / 2
        taken.append((time.process_time() - begin) / strides)
        hip.append(max(leg.contact["hip"].max() for leg in found.legs.values()))
        knee.append(max(leg.contact["knee"].max() for leg in found.legs.values()))
        for _, side, piece in found.pieces:
            reserve.append(float(piece.legs[side].reserve_share().max()))
    inside = sum(2.0 <= each <= 2.9 for each in hip)
    return [
        Claim("hip contact, lowest peak of ten people", float(min(hip)), "BW", 10),
        Claim("hip contact, highest peak of ten people", float(max(hip)), "BW", 10),
        Claim("hip contact, peaks from 2.0 to 2.9 BW", float(inside), "people", 10),
        Claim("knee contact, mean peak of ten people", float(np.mean(knee)), "BW", 10),
        Claim("muscles, largest reserve over its moment", 100 * max(reserve), "%", len(reserve)),
        Claim("muscles, processor time a stride of both sides", float(np.median(taken)), "s", 10),
    ]


@claims.measured("data")
def electromyograms(given: Given) -> list[Claim]:
    """On and off of the ten walkers' groups of muscles against healthy people's (Perry and
    Burnfield 2010).
    """
    from gaitval.musculature.gait import GROUPS, muscles_of

    columns = {
        "gluteus_maximus": "GluteusMaximusUpper",
        "gluteus_medius": "GluteusMedius",
        "iliopsoas": "Iliacus",
        "hamstrings": "Semimembranosus",
        "rectus_femoris": "RectusFemoris",
        "vasti": "VastusLateralis",
        "gastrocnemius": "Gastrocnemius",
        "soleus": "Soleus",
        "tibialis_anterior": "TibialisAnterior",
    }
    with (given.data / "emg" / "PerryBurnfieldElectromyography.csv").open() as file:
        rows = list(csv.DictReader(file))
    percent = [float(row["percent_gait_cycle"]) for row in rows]
    gaits = [muscles_of([motion]) for motion in _walks()]
    agree, chance = [], []
    for group in GROUPS:
        curves = [leg.group(group) for gait in gaits for leg in gait.legs.values()]
        mean: NDArray[Any] = np.mean(curves, axis=0)
        seen = np.interp(np.arange(101), percent, [float(r[columns[group]] or 0) for r in rows])
        on, usual = mean > 0.25 * mean.max(), np.roll(seen, 4) > 5.0
        agree.append(float((on == usual).mean()))
        chance.append(float(on.mean() * usual.mean() + (1 - on.mean()) * (1 - usual.mean())))
    return [
        Claim("muscles on and off as electromyograms", 100 * float(np.mean(agree)), "%", 9),
        Claim("muscles on and off by chance", 100 * float(np.mean(chance)), "%", 9),
    ]
