"""What criterion shares moments to muscles as people do: timing against EMG, and joint forces.

    python -m experiments.muscle_criteria PERRY.csv

PERRY.csv has EMG of 29 muscles over the gait cycle (Perry and Burnfield 2010, as digitised for
Moco's paper; `percent_gait_cycle`, then a column a muscle). The walks are those of the ten built-in
people's stored policies. `gaitval.musculature.sharing.CRITERIA` has its weights of contact forces
from here. Minutes. `claims.muscles.measured_people` has people with electromyograms of their own.
"""

import argparse
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

import gaitval as gv
from claims.muscle_measures import MUSCLES, as_implants_say, on_and_off, perry
from gaitval.arrays import Array, runs
from gaitval.gait.filters import low_pass
from gaitval.inverse.inverse_dynamics import InverseDynamics, inverse_dynamics
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.musculature import CRITERIA, Criterion, share

CYCLES, SETTLED = 4, 0.35
"""Gait cycles of a walk, and the part of it that does not count."""
RATE, MOTION_HZ, FORCE_HZ, LEAST_N = 100.0, 8.0, 10.0, 30.0


@dataclass(frozen=True)
class Walk:
    """One person's; `strikes` s of the right and of the left foot."""

    model: BodyModel
    height: float
    positions: Array
    dynamics: InverseDynamics
    strikes: tuple[Array, Array]


def walk_of(subject: int) -> Walk:
    """The stored policy's walk, filtered, with its moments."""
    policy = gv.load_policy(subject)
    found = gv.rollout(policy, cycles=CYCLES)
    rate = 1.0 / float(np.median(np.diff(found.time)))
    every = slice(None, None, max(1, round(rate / RATE)))
    positions = low_pass(found.positions, rate=rate, cutoff_hz=MOTION_HZ)[every]
    flat = found.ground_reaction.reshape(len(found.time), -1)
    force = low_pass(flat, rate=rate, cutoff_hz=FORCE_HZ).reshape(-1, 2, 3)
    point, strikes = found.centre_of_pressure.copy(), []
    for side in range(2):
        known = np.isfinite(point[:, side, 0])
        for axis in range(3):
            point[:, side, axis] = np.interp(
                found.time, found.time[known], point[known, side, axis]
            )
        on = force[:, side, 2] > LEAST_N
        point[~on, side] = np.nan
        first, last = runs(on)
        long = (last - first) / rate > 0.2
        strikes.append(found.time[first[long]])
    model = apply_parameters(policy.model, found.mu)
    dynamics = inverse_dynamics(
        model, found.time[every], positions, force[every], point[every], 0 * force[every]
    )
    return Walk(model, policy.subject.height_m, positions, dynamics, (strikes[0], strikes[1]))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("emg", type=Path)
    emg, grid = perry(parser.parse_args().emg), np.arange(101.0)
    walks = [walk_of(subject) for subject in range(1, 11)]
    weights = (0.0, 0.01, 0.03, 0.1, 0.3, 1.0)
    criteria = [Criterion(f"contact {w:g}", knee=w, hip=w) for w in weights]
    criteria += [CRITERIA[name] for name in ("cubes", "volume", "spared knee", "contact by volume")]
    print("criterion: r to EMG (mean), on and off agree (by chance), peaks of hip and knee in BW")
    for criterion in criteria:
        curves: dict[str, list[Array]] = {name: [] for name in MUSCLES}
        hips, knees, implants = [], [], []
        for walk in walks:
            found = share(
                walk.model, walk.positions, walk.dynamics, height=walk.height, criterion=criterion
            )
            settled = found.time > SETTLED * found.time[-1]
            settled[-8:] = False
            for leg, strikes in zip(found.legs.values(), walk.strikes, strict=True):
                hips.append(np.quantile(leg.contact.size("hip")[settled], 0.995))
                knees.append(np.quantile(leg.contact.compression[settled], 0.995))
                hips[-1] /= found.body_weight
                knees[-1] /= found.body_weight
                names = leg.muscles.names
                late = strikes[strikes > SETTLED * found.time[-1]]
                for start, end in pairwise(late):
                    span = (float(start), float(end))
                    implants.append(as_implants_say(leg, found.time, span, found.body_weight))
                    at = start + (end - start) * grid / 100
                    for name, parts in MUSCLES.items():
                        which = [names.index(part) for part in parts]
                        most = leg.muscles.max_force[which]
                        together = leg.activation[:, which] @ most / most.sum()
                        curves[name].append(np.interp(at, found.time, together))
        correlation, agree, chance = [], [], []
        for name, each in curves.items():
            mean = np.mean(each, axis=0)
            flat = np.ptp(mean) < 1e-9
            correlation.append(0.0 if flat else np.corrcoef(mean, emg[name])[0, 1])
            same, both = on_and_off(mean, emg[name])
            agree.append(same)
            chance.append(both)
        hip, knee = (np.reshape(v, (-1, 2)).mean(axis=1) for v in (hips, knees))
        print(
            f"{criterion.name}: {np.mean(correlation):.2f}, {np.mean(agree):.3f} "
            f"({np.mean(chance):.3f}), hip {hip.mean():.2f} ({hip.min():.2f} to {hip.max():.2f}), "
            f"knee {knee.mean():.2f} ({knee.min():.2f} to {knee.max():.2f}), "
            f"hip as implants say {np.mean(implants):.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
