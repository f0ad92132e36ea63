"""Which criterion shares moments as people's own electromyograms say.

    python -m experiments.emg_criteria [--no-activation-dynamics]

Five people with moments and electromyograms of their own, none of whom has an implant or is one of
the ten: the three of `claims.muscles.measured_people`, imported; and two whose angles, moments and
ground reaction others published. `GAITVAL_PUBLIC` has clones, named OWNER+NAME, of
stanfordnmbl/balance-exo-sim, opensim-org/opensim-core, antoinefalisse/3dpredictsim (a man of 62 kg,
means of 11 walks) and stanfordnmbl/MatlabStaticOptimization (a man of 86 kg on a treadmill).

Printed are, by criterion, the correlation of activations with the electromyograms 40 ms before,
mean over each person's muscles, and hips of the imported ones as implants say. Minutes.
"""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from claims.given import Given
from claims.muscles import _hips, _recorded
from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.gait.electromyograms import read_electromyograms
from gaitval.gait.filters import low_pass
from gaitval.mocap.mot import read_storage
from gaitval.musculature.electromyography import DELAY, seen_activations
from gaitval.musculature.forces import share_leg
from gaitval.musculature.gait import muscles_of
from gaitval.musculature.mapping import BoneSizes, LegLoads, tibia_axes
from gaitval.musculature.paths import COORDINATES, KNEE, geometry, table
from gaitval.musculature.person import leg_muscles
from gaitval.musculature.sharing import CRITERIA, Criterion

WEIGHTS: Final = (0.0, 0.03, 0.1, 0.3, 1.0)
NAMED: Final = ("cubes", "spared knee")

PELVIS: Final = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")

BELOW: Final = {0: 0.161, 1: 0.061, 3: 0.0145}
"""Share of the body's mass beyond hip, knee and ankle (Winter 2009), which weighs but is not
accelerated here: forces of contact weigh little in a criterion."""

STATURE: Final = 1.70
"""m, of the published model."""

LATERAL: Final[Mapping[str, tuple[str, ...]]] = {
    "Hamstrings-lateralis": ("bflh",),
    "Tibialis-anterior": ("tibant",),
    "Peroneus-longus": ("perlong",),
    "Gastrocnemius-lateralis": ("gaslat",),
    "Hamstrings-medialis": ("semimem", "semiten"),
    "Soleus": ("soleus",),
    "Vastus-lateralis": ("vaslat",),
    "Vastus-medialis": ("vasmed",),
    "Gluteus-medialis": ("glmed1", "glmed2", "glmed3"),
    "Rectus-femoris": ("recfem",),
    "Peroneus-brevis": ("perbrev",),
    "Gastrocnemius-medialis": ("gasmed",),
    "Adductor-longus": ("addlong",),
    "Tensor-fasciae-latae": ("tfl",),
}
"""Channels of 3dpredictsim."""

LEFT: Final = ("soleus", "gasmed", "gaslat", "vasmed", "vaslat", "recfem")
"""Channels of MatlabStaticOptimization; its vastus intermedius is a copy."""


@dataclass(frozen=True)
class PublishedLeg:
    """One leg of a person whose moments others computed; T frames, a left leg mirrored.

    Attributes
    ----------
    time : (T,) s.
    loads : of the muscles.
    mass, height : kg, m.
    channels : muscles and envelope (T,) of each electromyogram.
    counts : frames that count.
    """

    time: Array
    loads: LegLoads
    mass: float
    height: float
    channels: tuple[tuple[tuple[str, ...], Array], ...]
    counts: slice


def _loads(angles: Array, pelvis: Array, moments: Array, ground: Array, mass: float) -> LegLoads:
    """Of `angles` (T, 6) rad and `moments` (T, 6) Nm of the published model, its `pelvis` (T, 3)
    rad, and the `ground` reaction (T, 3) N on the foot; axes x forward, y up, z to the leg's side.
    """
    of_pelvis = Rotation.from_euler("ZXY", pelvis).as_matrix()
    femur = of_pelvis @ Rotation.from_euler("ZXY", angles[:, :3]).as_matrix()
    tibia = femur @ tibia_axes(angles[:, KNEE])
    force = np.zeros((len(angles), 4, 3))
    for (place, share), axes in zip(BELOW.items(), (of_pelvis, femur, tibia), strict=True):
        needed = -ground + share * mass * GRAVITY * np.array([0.0, 1.0, 0.0])
        force[:, place] = np.einsum("tji,tj->ti", axes, needed)
    none = np.zeros((len(angles), 6, 3))
    return LegLoads(
        angles, moments, none, np.zeros(3), force, np.zeros_like(force), np.zeros(len(angles))
    )


def mean_walk(public: Path) -> PublishedLeg:
    """Of 3dpredictsim."""
    path = public / "antoinefalisse+3dpredictsim/ExperimentalData/ExperimentalData.mat"
    data = loadmat(path, simplify_cells=True)["ExperimentalData"]
    motion, emg = data["Q"]["subject1"], data["EMG"]["subject1"]
    names = [str(name) for name in motion["Qs"]["colheaders"]]
    rows = [names.index(name) for name in COORDINATES]
    mass, height = 62.0, 1.70
    forward = motion["Qs"]["mean"][:, names.index("pelvis_tx")]
    speed = motion["Qdots"]["mean"][:, names.index("pelvis_tx")].mean()
    period = (forward[-1] - forward[0]) / speed * len(forward) / (len(forward) - 1)

    def thrice(values: Array) -> Array:
        return np.concatenate([values] * 3)

    angles = np.radians(thrice(motion["Qs"]["mean"][:, rows]))
    moments = thrice(data["Torques"]["subject1"]["mean"][:, rows])
    # Their knee extends with its angle.
    angles[:, KNEE] *= -1.0
    moments[:, KNEE] *= -1.0
    pelvis = np.radians(thrice(motion["Qs"]["mean"][:, [names.index(name) for name in PELVIS]]))
    ground = thrice(data["GRFs"]["subject1"]["mean"]) / 100 * mass * GRAVITY
    channels = [
        (LATERAL[str(name)], thrice(emg["mean"][:, i]))
        for i, name in enumerate(emg["colheaders"])
        if np.isfinite(emg["mean"][:, i]).all()
    ]
    count = len(forward)
    return PublishedLeg(
        time=np.arange(3 * count) / count * period,
        loads=_loads(angles, pelvis, moments, ground, mass),
        mass=mass,
        height=height,
        channels=tuple(channels),
        counts=slice(count, 2 * count),
    )


def treadmill_walk(public: Path, start: float = 9.5, end: float = 17.0) -> PublishedLeg:
    """Of MatlabStaticOptimization, its left leg from `start` to `end` s."""
    folder = public / "stanfordnmbl+MatlabStaticOptimization/TestData"
    motion, forces = (read_storage(folder / name) for name in ("results_ik.sto", "results_id.sto"))
    plates, emg = (
        read_storage(folder / name)
        for name in ("walking_baseline1_forces.mot", "EMG_allMuscles.sto")
    )
    rate = 1.0 / float(np.median(np.diff(motion.time)))
    rows = np.flatnonzero((motion.time >= start) & (motion.time <= end))
    mass, height = 86.04, 1.85

    def taken(columns: list[str]) -> Array:
        values = np.column_stack([motion.column(name) for name in columns])
        return np.radians(low_pass(values, rate=rate, cutoff_hz=6.0)[rows])

    mirror = np.array([1.0, -1.0, -1.0])
    ground = np.column_stack(
        [np.interp(motion.time, plates.time, plates.column(f"1_ground_force_v{c}")) for c in "xyz"]
    )[rows] * np.array([1.0, 1.0, -1.0])
    moments = np.column_stack([forces.column(f"{name}_l_moment") for name in COORDINATES])[rows]
    time = motion.time[rows]
    channels = [
        ((name,), np.interp(time, emg.time, emg.column(f"{name}_l_activation"))) for name in LEFT
    ]
    angles = taken([f"{name}_l" for name in COORDINATES])
    loads = _loads(angles, mirror * taken(list(PELVIS)), moments, ground, mass)
    return PublishedLeg(time, loads, mass, height, tuple(channels), slice(None))


def correlation(person: PublishedLeg, criterion: Criterion, dynamics: bool = True) -> float:
    """Mean over the channels; `dynamics` is whether activations rise and fall as muscles can."""
    sizes = BoneSizes(np.full(4, person.height / STATURE))
    muscles = leg_muscles(sizes, mass=person.mass, height=person.height)
    paths = geometry(person.loads.angles)
    leg = share_leg(
        person.time, person.loads, paths, muscles, criterion, person.mass,
        dynamics_of_activation=dynamics,
    )  # fmt: skip
    found = []
    for names, envelope in person.channels:
        which = [table().names.index(name) for name in names]
        strength = muscles.max_force[which]
        activation = leg.activation[:, which] @ strength / strength.sum()
        seen = np.interp(person.time - DELAY, person.time, envelope)
        found.append(np.corrcoef(activation[person.counts], seen[person.counts])[0, 1])
    return float(np.nanmean(found))


def criteria() -> Iterator[Criterion]:
    """Squares, by volume or not, with all weights of contact forces; and those of other shape."""
    for by_volume in (False, True):
        for knee in WEIGHTS[:-1]:
            for hip in WEIGHTS:
                name = f"{'volume' if by_volume else 'squares'}, knee {knee:g}, hip {hip:g}"
                yield Criterion(name, by_volume=by_volume, knee=knee, hip=hip)
    yield from (CRITERIA[name] for name in NAMED)


def main() -> None:
    """Print a row for each criterion."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-activation-dynamics", dest="dynamics", action="store_false")
    dynamics = parser.parse_args().dynamics
    given = Given()
    imported = [(motion, read_electromyograms(emg, "right")) for motion, emg in _recorded(given)]
    published = [treadmill_walk(given.public), mean_walk(given.public)]
    print("criterion: r of each of five people (mean); hips as implants say, BW")
    for criterion in criteria():
        found, hips = [], []
        for motion, emg in imported:
            gait = muscles_of([motion], criterion=criterion, dynamics_of_activation=dynamics)
            seen = seen_activations(gait, {motion.name: emg})
            found.append(float(np.nanmean([each.correlation for each in seen])))
            hips.append(float(np.median(_hips(motion, gait))))
        found += [correlation(person, criterion, dynamics) for person in published]
        print(
            f"{criterion.name}: {' '.join(f'{r:.3f}' for r in found)} ({np.mean(found):.3f}); "
            f"{np.mean(hips):.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
