"""Lengths, moment arms and lines of action of the 40 muscles of a leg, from the shipped table.

The table, `paths.npz`, is computed by `experiments/muscle_paths.py` from the model of Rajagopal et
al. (2016) IEEE Trans Biomed Eng 63:2068, with the changes of Lai et al. (2017) Ann Biomed Eng
45:2762 and of Uhlrich et al. (2022) Sci Rep 12:9842. No file of theirs is part of gaitval. Passive
strains about the hip are ours (`passive.json`).

Everything here is a right leg, in OpenSim's axes of its bones (x forward, y up, z to the right); a
left leg is a right one in the mirror. Angles are that model's own (`mapping` makes them of
gaitval's). A moment arm is -∂L/∂q, everywhere.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array, Flags, Index
from gaitval.coordinates import LEG

COORDINATES: Final = LEG[:-1]
"""Coordinates that move the muscles; toes are straight."""

BONES: Final = ("pelvis", "femur", "tibia", "foot")

MUSCLES: Final = {
    **{"addbrev": "adductor brevis", "addlong": "adductor longus"},
    **{"addmagDist": "adductor magnus, distal part", "addmagIsch": "adductor magnus, ischial part"},
    **{"addmagMid": "adductor magnus, middle part", "addmagProx": "adductor magnus, proximal part"},
    **{"bflh": "biceps femoris, long head", "bfsh": "biceps femoris, short head"},
    **{"edl": "extensor digitorum longus", "ehl": "extensor hallucis longus"},
    **{"fdl": "flexor digitorum longus", "fhl": "flexor hallucis longus"},
    **{"gaslat": "lateral gastrocnemius", "gasmed": "medial gastrocnemius"},
    **{"glmax1": "gluteus maximus, upper part", "glmax2": "gluteus maximus, middle part"},
    **{"glmax3": "gluteus maximus, lower part", "glmed1": "gluteus medius, front part"},
    **{"glmed2": "gluteus medius, middle part", "glmed3": "gluteus medius, back part"},
    **{"glmin1": "gluteus minimus, front part", "glmin2": "gluteus minimus, middle part"},
    **{"glmin3": "gluteus minimus, back part", "grac": "gracilis", "iliacus": "iliacus"},
    **{"perbrev": "peroneus brevis", "perlong": "peroneus longus", "piri": "piriformis"},
    **{"psoas": "psoas", "recfem": "rectus femoris", "sart": "sartorius"},
    **{"semimem": "semimembranosus", "semiten": "semitendinosus", "soleus": "soleus"},
    **{"tfl": "tensor fasciae latae", "tibant": "tibialis anterior"},
    **{"tibpost": "tibialis posterior", "vasint": "vastus intermedius"},
    **{"vaslat": "vastus lateralis", "vasmed": "vastus medialis"},
}
"""What muscles are called, by their names in OpenSim's files."""

JOINTS: Final = ("hip", "knee", "patella", "ankle")
"""Joints at which the muscles' pull on what is beyond them is known; the patella is pulled against
the femur. Axes are of the pelvis, the femur, the femur and the tibia."""

KNEE: Final = COORDINATES.index("knee_angle")


@dataclass(frozen=True)
class Muscle:
    """One muscle as published, of a man of 75 kg and 1.70 m.

    Attributes
    ----------
    name : without the side.
    coordinates : which of `COORDINATES` move it, as indices.
    max_force : N, isometric.
    optimal_fibre, tendon_slack : m.
    pennation : rad, at the optimal fibre length.
    passive_from, passive_to : fibre strain at which passive force begins, and is `max_force`; of
        muscles that cross the hip from `passive.json` (`experiments/passive_hip.py`), else as
        published.
    """

    name: str
    coordinates: tuple[int, ...]
    max_force: float
    optimal_fibre: float
    tendon_slack: float
    pennation: float
    passive_from: float
    passive_to: float


@dataclass(frozen=True)
class MuscleSkeleton:
    """Joints of the published leg; m, and axes of the bone named.

    Attributes
    ----------
    hip_half_width, thigh, shank, foot : half the distance of the hips; hip to knee and knee to
        ankle centre; ankle centre to the toes' joint, forward.
    hip_from_regression : (3,) from where gaitval's regression puts the hip's centre on this pelvis
        to where the model has it, about which its muscles have their arms; pelvis.
    ankle_in_shank : (3,) from the ankle centre (between the malleoli) to the ankle's axis, tibia.
    ankle_axis : (3,) tibia.
    subtalar_in_talus, subtalar_axis : (3,) from the ankle's axis to the subtalar one, talus.
    shank_axis : (3,) from knee to ankle centre, tibia.
    hip_zero, knee_zero : rad, angles of this model at gaitval's zero, where the plane of the ASIS
        and PSIS is level and hip, knee and ankle are in a line.
    knee_motion : (6, terms) Chebyshev series of the knee's angle: turning of the tibia, and
        velocity (m) of its point at the knee's centre, per rate of the angle; femur.
    """

    hip_half_width: float
    thigh: float
    shank: float
    foot: float
    hip_from_regression: Array
    ankle_in_shank: Array
    ankle_axis: Array
    subtalar_in_talus: Array
    subtalar_axis: Array
    shank_axis: Array
    hip_zero: float
    knee_zero: float
    knee_motion: Array


@dataclass(frozen=True)
class _Paths:
    """Muscles whose polynomials have the same terms, and their coefficients.

    Attributes
    ----------
    muscles : (n,) which.
    coordinates : which coordinates the terms are of.
    powers : (terms, coordinates) degrees of Chebyshev polynomials.
    length : (terms, n, bones).
    pull : (terms, n, joints, 3) on what is beyond the joint, per newton.
    knee_moment : (terms, n, 3) m, about the knee's centre, on what is beyond.
    """

    muscles: Array
    coordinates: tuple[int, ...]
    powers: Array
    length: Array
    pull: Array
    knee_moment: Array


@dataclass(frozen=True)
class PathTable:
    """The shipped muscles: see `table`. `ranges` (6, 2) rad is where the paths were computed."""

    muscles: tuple[Muscle, ...]
    skeleton: MuscleSkeleton
    ranges: Array
    paths: tuple[_Paths, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the 40 muscles, without side."""
        return tuple(muscle.name for muscle in self.muscles)


@dataclass(frozen=True)
class Geometry:
    """Paths of the 40 muscles over T frames, of bones of the published size, one bone a time.

    Attributes
    ----------
    length : (T, 40, 4) m, what each of `BONES` adds to the length if its size is 1.
    slope : (T, 40, 6, 4) m/rad, ∂/∂q of that.
    pull : (T, 40, 4, 3) on what is beyond each of `JOINTS`, per newton of tension.
    knee_moment : (T, 40, 3) m: moment on it about the knee's centre, per newton, femur's axes.
    outside : (T, 6) whether the table does not reach so far; there the nearest angle is used.
    """

    length: Array
    slope: Array
    pull: Array
    knee_moment: Array
    outside: Flags

    def part(self, rows: Index) -> "Geometry":
        """The frames `rows` of it."""
        return Geometry(
            self.length[rows],
            self.slope[rows],
            self.pull[rows],
            self.knee_moment[rows],
            self.outside[rows],
        )


class _Member(NamedTuple):
    """Coefficients of one muscle; see `_Paths`."""

    muscle: int
    length: Array
    pull: Array
    knee_moment: Array


@cache
def table() -> PathTable:
    """The shipped muscles and their paths."""
    with (
        files("gaitval.kinetics.musculature").joinpath("paths.npz").open("rb") as file,
        np.load(file) as stored,
    ):
        arrays = {name: stored[name] for name in stored.files}
    rows = json.loads(arrays["about"].tobytes().decode())["muscles"]
    refitted = files("gaitval.kinetics.musculature").joinpath("passive.json").read_text("utf-8")
    passive: dict[str, tuple[float, float]] = json.loads(refitted)
    muscles: list[Muscle] = []
    groups: dict[tuple[tuple[int, ...], bytes], tuple[Array, list[_Member]]] = {}
    for index, row in enumerate(rows):
        name, own = row["name"], tuple(COORDINATES.index(c) for c in row["coordinates"])
        start, full = passive.get(name, (row["passive_from"], row["passive_to"]))
        muscles.append(
            Muscle(
                name=name,
                coordinates=own,
                max_force=row["max_force_n"],
                optimal_fibre=row["optimal_fibre_m"],
                tendon_slack=row["tendon_slack_m"],
                pennation=row["pennation_rad"],
                passive_from=start,
                passive_to=full,
            )
        )
        powers = arrays[f"{name}/powers"].astype(np.int64)
        length = np.zeros((len(powers), len(BONES)))
        for bone, series in zip(row["bones"], arrays[f"{name}/length"], strict=True):
            length[:, BONES.index(bone)] = series
        pull = np.zeros((len(powers), len(JOINTS), 3))
        for j, joint in enumerate(JOINTS):
            if (found := arrays.get(f"{name}/{joint}_force")) is not None:
                pull[:, j] = found.T
        moment = arrays.get(f"{name}/knee_moment", np.zeros((3, len(powers)))).T
        key = (own, powers.tobytes())
        member = _Member(index, length, pull, moment)
        groups.setdefault(key, (powers, []))[1].append(member)
    return PathTable(
        muscles=tuple(muscles),
        skeleton=MuscleSkeleton(
            hip_half_width=float(arrays["hip_half_width"]),
            thigh=float(arrays["thigh"]),
            shank=float(arrays["shank"]),
            foot=float(arrays["foot"]),
            hip_from_regression=arrays["hip_from_regression"],
            ankle_in_shank=arrays["ankle_in_shank"],
            ankle_axis=arrays["ankle_axis"],
            subtalar_in_talus=arrays["subtalar_in_talus"],
            subtalar_axis=arrays["subtalar_axis"],
            shank_axis=arrays["shank_axis"],
            hip_zero=float(arrays["hip_zero"]),
            knee_zero=float(arrays["knee_zero"]),
            knee_motion=arrays["knee_motion"],
        ),
        ranges=arrays["ranges"],
        paths=tuple(
            _Paths(
                np.array([each.muscle for each in members]),
                own,
                powers,
                np.stack([each.length for each in members], axis=1),
                np.stack([each.pull for each in members], axis=1),
                np.stack([each.knee_moment for each in members], axis=1),
            )
            for (own, _), (powers, members) in groups.items()
        ),
    )


def geometry(angles: Array) -> Geometry:
    """Paths at `angles` (T, 6) rad, of `COORDINATES` in the published model."""
    found = table()
    low, high = found.ranges.T
    outside = (angles < low) | (angles > high)
    half = (high - low) / 2
    unit = np.clip((angles - (low + high) / 2) / half, -1.0, 1.0)
    top = 1 + max(int(each.powers.max()) for each in found.paths)
    value = np.polynomial.chebyshev.chebvander(unit, top)  # (T, 6, degrees)
    slope = _slopes(value) / half[:, None]
    frames, count = len(angles), len(found.muscles)
    length = np.zeros((frames, count, len(BONES)))
    slopes = np.zeros((frames, count, len(COORDINATES), len(BONES)))
    pull = np.zeros((frames, count, len(JOINTS), 3))
    moment = np.zeros((frames, count, 3))
    for each in found.paths:
        columns = each.coordinates
        parts = [value[:, c, each.powers[:, i]] for i, c in enumerate(columns)]
        terms = _product(parts)
        at = each.muscles
        length[:, at] = np.tensordot(terms, each.length, axes=1)
        pull[:, at] = np.tensordot(terms, each.pull, axes=1)
        moment[:, at] = np.tensordot(terms, each.knee_moment, axes=1)
        for i, c in enumerate(columns):
            down = slope[:, c, each.powers[:, i]]
            turned = _product([down if k == i else part for k, part in enumerate(parts)])
            slopes[:, at, c] = np.tensordot(turned, each.length, axes=1)
    return Geometry(length, slopes, pull, moment, outside)


def _product(parts: list[Array]) -> Array:
    total = parts[0]
    for part in parts[1:]:
        total = total * part
    return total


def _slopes(value: Array) -> Array:
    """Derivatives of Chebyshev polynomials T₀… in the last axis, of their own values:
    T'ₙ = 2 n (Tₙ₋₁ + Tₙ₋₃ + …), the last of an odd n counting half.
    """
    slope = np.zeros_like(value)
    for n in range(1, value.shape[-1]):
        slope[..., n] = 2.0 * n * value[..., n - 1]
        if n > 2:
            slope[..., n] += n / (n - 2.0) * slope[..., n - 2]
        elif n == 1:
            slope[..., n] = 1.0
    return slope
