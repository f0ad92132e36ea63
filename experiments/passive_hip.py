"""Passive forces of the muscles that cross the hip, from what passive hips were measured to do.

    python -m experiments.passive_hip SILDER.mat [--write]

SILDER.mat has the passive moments of Silder et al. (2007) J Biomech 40:2628-2635 about hip, knee
and ankle, as Uhlrich et al. (2022) digitised them (`DigitizedPassiveMoments_Silder2007.mat` of
stanfordnmbl/PassiveMuscleForceCalibration, Apache-2.0).

The published model's passive strains were fitted to these moments, which are of the sagittal plane
alone. What flexes an extended hip was left to whatever muscle flexes it, and half of it was given
to the adductors: at 10 degrees of extension they pull an unmoved leg inwards with 12 Nm, and its
abductors have to hold against that in every step. A relaxed leg in its neutral abduction and
rotation is not pulled to a side.

So the strains of the muscles that cross the hip are fitted again, within wider bounds than Uhlrich
et al. had, for those left Silder's moments unmet: to Silder's hip moments over gait's range, to the
published model's passive knee moment, and to no moment of adduction and of rotation in neutral.
Strains that are not needed stay near the published ones. No walking person and no implant is looked
at. `gaitval/kinetics/musculature/passive.json` has the result. Seconds.
"""

import argparse
import json
from importlib.resources import files
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.optimize import least_squares

from gaitval.arrays import Array
from gaitval.kinetics.musculature.curves import passive_length
from gaitval.kinetics.musculature.forces import capacity
from gaitval.kinetics.musculature.mapping import BoneSizes
from gaitval.kinetics.musculature.paths import KNEE, geometry, table
from gaitval.kinetics.musculature.person import leg_muscles

FOLDER = files("gaitval.kinetics.musculature")

HIP_RANGE = (-15.0, 40.0)
KNEES = (15.0, 60.0)
"""deg: what Silder moved the hip over, at the knee angles that gait has."""

KEPT_HIPS = (-20.0, 50.0, 5.0)
"""deg, from, to, step: of the poses where the frontal and the horizontal plane are without moment,
and the knee's moment is kept."""

FROM, FULL, APART = (-0.2, 0.2), (0.2, 3.0), 0.3
"""Bounds of the strains without force and of full force, and how far they are apart at least. At a
full strain of 3 a muscle has no passive force in gait."""

SIZE = 1.0
"""Nm, of a difference of moments that counts as much as a strain that is off by `STRAIN`."""
STRAIN = 1.0

MASS, HEIGHT = 75.0, 1.70


def silder(path: Path) -> tuple[Array, Array]:
    """Poses (N, 6) rad, `paths.COORDINATES`, and hip moments (N,) Nm."""
    read = loadmat(path, simplify_cells=True)
    angles, moments = np.asarray(read["JAngles"][0], float), np.asarray(read["PassiveM"][0], float)
    hip, knee = angles[:, 0], angles[:, 2]
    kept = (hip >= HIP_RANGE[0]) & (hip <= HIP_RANGE[1]) & np.isin(knee, KNEES)
    poses = np.zeros((int(kept.sum()), 6))
    poses[:, 0], poses[:, KNEE] = np.radians(hip[kept]), np.radians(knee[kept])
    return poses, moments[kept]


def published_strains() -> tuple[Array, Array]:
    """(40,) strains without and of full passive force, of the published model."""
    with FOLDER.joinpath("paths.npz").open("rb") as file, np.load(file) as stored:
        rows = json.loads(stored["about"].tobytes().decode())["muscles"]
    start, full = ([row[name] for row in rows] for name in ("passive_from", "passive_to"))
    return np.array(start), np.array(full)


class Passive:
    """Passive moments of the published leg at some poses, by the strains of its muscles."""

    def __init__(self, poses: Array) -> None:
        muscles = leg_muscles(BoneSizes(np.ones(4)), mass=MASS, height=HEIGHT)
        paths = geometry(poses)
        length = paths.length.sum(axis=2)
        self.arms = -paths.slope.sum(axis=3)
        self.fibre = capacity(length, np.zeros_like(length), muscles).fibre
        pennation = np.arcsin(np.sin(muscles.pennation) / np.maximum(self.fibre, 0.3))
        self.most = muscles.max_force * np.cos(pennation)

    def moments(self, start: Array, full: Array) -> Array:
        """(N, 6) Nm."""
        force = self.most * passive_length(self.fibre, start, full)
        return np.asarray(np.einsum("tm,tmj->tj", force, self.arms))


def main() -> None:
    """Fit, print moments before and after, and write the strains if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("silder", type=Path)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    poses, wanted = silder(given.silder)
    hips = np.radians(np.arange(KEPT_HIPS[0], KEPT_HIPS[1] + 1e-9, KEPT_HIPS[2]))
    still = np.zeros((len(hips) * len(KNEES), 6))
    still[:, 0] = np.tile(hips, len(KNEES))
    still[:, KNEE] = np.radians(np.repeat(KNEES, len(hips)))
    moved, neutral = Passive(poses), Passive(still)
    muscles = table().muscles
    crossing = [i for i, each in enumerate(muscles) if set(each.coordinates) & {0, 1, 2}]
    start, full = published_strains()
    knee = neutral.moments(start, full)[:, KNEE]

    def strains(x: Array) -> tuple[Array, Array]:
        own, most = start.copy(), full.copy()
        own[crossing], most[crossing] = x[: len(crossing)], x[len(crossing) :]
        return own, np.maximum(most, own + APART)

    def off(x: Array) -> Array:
        own, most = strains(x)
        hip = moved.moments(own, most)[:, 0] - wanted
        side = neutral.moments(own, most)
        parts = (
            hip / np.sqrt(len(hip)),
            (side[:, KNEE] - knee) / np.sqrt(len(knee)),
            side[:, 1] / np.sqrt(len(knee)),
            side[:, 2] / np.sqrt(len(knee)),
        )
        near = np.concatenate([own - start, 1 / (most - own) - 1 / (full - start)])
        return np.concatenate([*(each / SIZE for each in parts), near / STRAIN])

    x = np.concatenate([start[crossing], full[crossing]])
    low = np.repeat([FROM[0], FULL[0]], len(crossing))
    high = np.repeat([FROM[1], FULL[1]], len(crossing))
    fit = least_squares(off, np.clip(x, low + 1e-6, high - 1e-6), bounds=(low, high))
    own, most = strains(fit.x)

    def rms(values: Array) -> float:
        return float(np.sqrt(np.mean(np.square(values))))

    for label, a, b in (("published", start, full), ("fitted", own, most)):
        side = neutral.moments(a, b)
        print(
            f"{label}: hip {rms(moved.moments(a, b)[:, 0] - wanted):.1f} Nm from Silder (RMS), "
            f"knee {rms(side[:, KNEE] - knee):.1f} from the published; in neutral adduction "
            f"{rms(side[:, 1]):.1f}, rotation {rms(side[:, 2]):.1f}"
        )
        for i in range(0, len(hips), 2):
            print(f"  hip {np.degrees(hips[i]):.0f}, knee {KNEES[0]:.0f}:", side[i].round(1))
    found = {}
    for i in crossing:
        name = muscles[i].name
        found[name] = [round(float(own[i]), 4), round(float(most[i]), 4)]
        print(f"{name}: {start[i]:.2f} to {full[i]:.2f} -> {own[i]:.2f} to {most[i]:.2f}")
    if given.write:
        Path(str(FOLDER.joinpath("passive.json"))).write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
