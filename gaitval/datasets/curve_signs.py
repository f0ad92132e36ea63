"""Signs of mean curves, against what physics and the other curves allow.

Programs differ in signs, most of all outside the sagittal plane. Each curve is held against what it
must agree with: moments of neighbouring joints differ by the lever of the ground reaction, the
flat foot is level, the thigh stays upright while the pelvis lists, the angles of pelvis and leg
together turn the foot as it is turned. Where nothing of this speaks, against healthy people's.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import AXES, SIDES, Side
from gaitval.gait.healthy_controls import load_controls
from gaitval.gait.sampling import SAMPLES
from gaitval.model.rotations import foot_angles
from gaitval.scaling.anthropometry import STATURE, WINTER

FLAT: Final = slice(15, 36)
"""Rows, % of the cycle, in which the foot is flat; built-in people's and 104 patients' soles are
level then to 3°."""
ON_ONE_LEG: Final = slice(15, 46)
"""Rows of single stance: no impact, and the weight and inertia of the leg are small beside the
ground reaction."""
NEARER: Final = 1.6
"""How many times nearer to healthy people's a curve must be with the sign changed, as of all people
together in `gaitval.apps.patients.strides`; of 104 patients, one side each, at most 3 % are."""
SURE: Final = 0.75
"""A curve that is not even so near with the sign changed has the right sign."""
BALANCE: Final = 3.0
"""How many times smaller the rest of the balance must be with signs of moments changed. Of the ten
built-in people's, each change makes it at least 1.3 times as large."""
UNBALANCED: Final = 0.15
"""Nm/kg. A smaller rest, RMS, is inertia and calibration."""
ABDUCTORS: Final = 0.1
"""Nm/kg, mean of single stance: nobody's hip is held by its adductors then."""
TURNED_FOOT: Final = 3.0
"""deg, RMS. The built-in people's angles turn their feet as these are turned to 0.1 to 1.6°."""
LEVEL: Final = (8.0, 4.0)
"""deg. A sole that is more than the first off the level, and less than the second with the tilt of
the pelvis the other way, shows that the tilt is."""

OF_EACH_LEG: Final = ("hip_adduction", "hip_rotation", "subtalar_angle")
"""Angles of which one side may have the other sign; those of the pelvis would be two pelves."""
ONE_SIDE: Final = 2.5
"""`NEARER` for a moment of one side alone, whose other side is as healthy people's."""

POSITIVE: Final[Mapping[str, str]] = {
    "hip_flexion": "flexion is positive",
    "hip_adduction": "adduction is positive on both sides (about y of Visual3D, on the right only)",
    "hip_rotation": "internal rotation is positive on both sides (about z of Visual3D, on the "
    "right only)",
    "knee_angle": "flexion is positive (in Visual3D and Gait2392, negative)",
    "ankle_angle": "dorsiflexion is positive",
    "subtalar_angle": "inversion is positive on both sides",
    "pelvis_tilt": "forward tilt is positive (as in Plug-in Gait; OpenSim's is positive backwards)",
    "pelvis_list": "own side up is positive on both sides (as in Plug-in Gait; OpenSim's one "
    "pelvis_list is positive with the left side up)",
    "pelvis_rotation": "own side forward is positive on both sides (OpenSim's one pelvis_rotation "
    "is positive with the right side forward)",
}
"""Of angles, and what other programs have."""
_FOOT: Final = ("foot_pitch", "foot_list", "foot_progression")
_CHAIN: Final = (*_FOOT, "knee_adduction", "knee_rotation", "ankle_rotation")
"""Angles with which all turns from the pelvis to the foot are known."""
MOMENTS: Final = (
    "Moments are internal, as in OpenSim, and positive where they increase the angle. In Plug-in "
    "Gait those of extensors, abductors and plantarflexors are positive"
)


@dataclass(frozen=True)
class Signs:
    """What is known of the signs of a trial's curves.

    Attributes
    ----------
    wrong : a sentence for each sign that cannot be right.
    warnings : one for each that is more likely wrong.
    untold : angles whose sign nothing shows.
    """

    wrong: tuple[str, ...]
    warnings: tuple[str, ...]
    untold: tuple[str, ...]


def signs(
    degrees: Mapping[str, Array], moments: Mapping[str, Array], forces: Mapping[str, Array]
) -> Signs:
    """What angles (deg), moments (Nm/kg) and forces (body weights), (101,) by their names without
    the kind, show of their signs; without gaps.
    """
    warnings, untold = [], []
    found = {name: _angle(name, degrees) for name in (*POSITIVE, *_CHAIN)
             if f"{name}_r" in degrees and f"{name}_l" in degrees}  # fmt: skip
    for name, of_sides in found.items():
        bad = [side for side, (verdict, _) in of_sides.items() if verdict == "wrong"]
        if bad:
            columns = " and ".join(f"angle_{name}_{side}" for side in bad)
            why = "; ".join(dict.fromkeys(of_sides[side][1] for side in bad))
            warnings.append(
                f"{columns}: {why}. Here {POSITIVE.get(name, 'signs are those of an import')}: "
                "if yours is the other way round, change the sign of the column."
            )
        elif any(verdict == "untold" for verdict, _ in of_sides.values()) or (
            name in OF_EACH_LEG and _opposed(*(degrees[f"{name}_{side}"] for side in "rl"))
        ):
            untold.append(name)
    if not warnings:
        warnings += [*_odd_sole(degrees), *_odd_chain(degrees)]
    wrong: list[str] = []
    for side in SIDES if moments and forces else ():
        if fixed := _not_abducted(moments, side):
            wrong.append(fixed)
    # With a wrong angle the levers are wrong, and the moments would be blamed.
    if moments and forces and not wrong and not warnings:
        for side in SIDES:
            wrong += _unbalanced(degrees, moments, forces, side, _SAGITTAL)
            # Across the midline a wrong lever or size of the moments looks like a wrong sign.
            warnings += _unbalanced(degrees, moments, forces, side, _FRONTAL[:2])
    if not wrong and not warnings:
        warnings += _odd_moments(moments)
    return Signs(tuple(wrong), tuple(warnings), tuple(untold))


# ---- Angles. ----


def _angle(name: str, degrees: Mapping[str, Array]) -> dict[str, tuple[str, str]]:
    """Of each side: "right", "wrong" or "untold", and why it is wrong."""
    return {side: _of_side(name, side, degrees) for side in "rl"}


def _of_side(name: str, side: str, degrees: Mapping[str, Array]) -> tuple[str, str]:
    by_chain = _by_chain(name, side, degrees)
    if by_chain is not None:
        return by_chain
    if name == "pelvis_tilt" and (by_sole := _by_sole(side, degrees)) is not None:
        return by_sole
    if name in _CHAIN:
        return "right", ""  # what their signs are, only the whole chain shows
    shape = nearness(degrees[f"{name}_{side}"], healthy()[f"angle_{name}"])
    if name in ("hip_adduction", "pelvis_list"):
        adduction, tilted = (
            values - values.mean()
            for values in (degrees[f"{each}_{side}"] for each in ("hip_adduction", "pelvis_list"))
        )
        # In the ground's axes the thigh is turned by their difference.
        swing = _rms(adduction - tilted) / max(_rms(adduction + tilted), 1e-9)
        if swing > NEARER and shape > 1.0:
            return "wrong", (
                "hip adduction and the list of the pelvis go against each other, so the thigh "
                f"would swing sideways {swing:.1f} times as much as with one of the signs changed, "
                "and this one is nearer to healthy people's with it"
            )
    if shape > NEARER:
        return "wrong", f"{shape:.1f} times nearer to healthy people's with the sign changed"
    return ("right" if shape < SURE else "untold"), ""


def _opposed(right: Array, left: Array) -> bool:
    """Whether one side is nearer to the other with its sign changed."""
    return _rms(right - left) > NEARER * _rms(right + left)


def nearness(values: Array, usual: Array) -> float:
    """How many times nearer `values` (101,) are to the `usual` ones with the sign changed."""
    return _rms(values - usual) / max(_rms(-values - usual), 1e-9)


@cache
def healthy() -> Mapping[str, Array]:
    """Healthy people's mean curves (101,), deg and Nm/kg, by kind and name without side."""
    from gaitval.datasets.subject_file import builtin_subjects

    phase = np.linspace(0.0, 1.0, SAMPLES)
    records = [subject.measured() for subject in builtin_subjects()]
    found = {}
    for kind, factor in (("angle", float(np.degrees(1.0))), ("moment", 1.0)):
        curves = [record.angles if kind == "angle" else record.moments for record in records]
        for name in {each[:-2] for each in curves[0]}:
            own = [each[f"{name}_{side}"](phase) for each in curves for side in "rl"]
            found[f"{kind}_{name}"] = factor * np.mean(own, axis=0)
    return found | {f"angle_{name}": curve for name, curve in load_controls().curves.items()}


def _of_leg(side: str, degrees: Mapping[str, Array]) -> tuple[float, float]:
    """deg, by which the leg's angles pitch the flat foot, and the tilt of the pelvis."""
    hip, knee, ankle, tilt = (
        float(degrees[f"{name}_{side}"][FLAT].mean())
        for name in ("hip_flexion", "knee_angle", "ankle_angle", "pelvis_tilt")
    )
    return hip - knee + ankle, tilt


def _odd_sole(degrees: Mapping[str, Array]) -> list[str]:
    """A sentence about a sole that is off the level while the other side's is level, or about both:
    an angle of its side, or of both, has an offset.
    """
    pitched = {side: leg - tilt for side in "rl" for leg, tilt in (_of_leg(side, degrees),)}
    least, most = sorted(pitched, key=lambda side: abs(pitched[side]))
    if abs(pitched[least]) > LEVEL[0]:
        return [
            "angle_hip_flexion, angle_knee_angle, angle_ankle_angle and angle_pelvis_tilt: "
            "together they put both soles off the level when the foot is flat, by "
            f"{pitched['r']:.0f} and {pitched['l']:.0f}° (right and left). One of them has another "
            "zero: hip flexion is from the pelvis and not from the vertical, the ankle is 0 in "
            "standing."
        ]
    if not (abs(pitched[most]) > LEVEL[0] and abs(pitched[least]) < LEVEL[1]):
        return []
    return [
        f"angle_hip_flexion_{most}, angle_knee_angle_{most}, angle_ankle_angle_{most}: together "
        f"they put the sole {abs(pitched[most]):.0f}° off the level when the foot is flat, those "
        f"of the other side {abs(pitched[least]):.0f}°. One of them has an offset (another zero "
        "than on the other side), unless the foot is never put down flat."
    ]


def _by_sole(side: str, degrees: Mapping[str, Array]) -> tuple[str, str] | None:
    leg, tilt = _of_leg(side, degrees)
    own, other = abs(leg - tilt), abs(leg + tilt)
    if own > LEVEL[0] and other < LEVEL[1]:
        return "wrong", (
            f"by the angles the sole is {own:.0f}° off the level when the foot is flat, with the "
            f"sign changed {other:.0f}°"
        )
    return ("right", "") if other > LEVEL[0] and own < LEVEL[1] else None


def _by_chain(name: str, side: str, degrees: Mapping[str, Array]) -> tuple[str, str] | None:
    """By how the foot is turned, where a file has that too."""
    if not _has_chain(side, degrees):
        return None
    own = _turned_off(side, degrees)
    others = {each: _turned_off(side, degrees, f"{each}_{side}") for each in (*POSITIVE, *_CHAIN)}
    best = min(others, key=lambda each: others[each])
    if own > TURNED_FOOT and others[best] < 0.5 * own:
        # One wrong sign disturbs all; the one that explains it is named.
        return ("right", "") if name != best else ("wrong", (
            f"the angles from pelvis to ankle turn the foot {own:.0f}° (RMS) otherwise than its "
            f"own angles do, with the sign changed {others[name]:.1f}°"
        ))  # fmt: skip
    return ("right", "") if own < TURNED_FOOT and others[name] > own + 1.0 else None


def _odd_chain(degrees: Mapping[str, Array]) -> Iterator[str]:
    """A sentence if the angles of a side do not turn its foot as its own angles do, and no single
    sign explains it.
    """
    for side in "rl":
        if not _has_chain(side, degrees):
            continue
        own = _turned_off(side, degrees)
        names = [f"{each}_{side}" for each in (*POSITIVE, *_CHAIN) if f"{each}_{side}" in degrees]
        if own <= TURNED_FOOT:
            continue
        exchanged = {
            pair: _turned_off(side, {**degrees, pair[0]: degrees[pair[1]],
                                     pair[1]: degrees[pair[0]]})
            for pair in combinations(names, 2)
        }  # fmt: skip
        best = min(exchanged, key=lambda pair: exchanged[pair])
        why = (
            f"with angle_{best[0]} and angle_{best[1]} exchanged {exchanged[best]:.1f}°. Are they?"
            if exchanged[best] < 0.5 * own
            else "and no single sign explains it. Is one of them exchanged, of another zero, or "
            "of another order of axes?"
        )
        yield (
            f"angles of side {side}: those from pelvis to ankle turn the foot {own:.0f}° (RMS) "
            f"otherwise than its own angles (foot_pitch, foot_list, foot_progression) do, {why}"
        )


def _has_chain(side: str, degrees: Mapping[str, Array]) -> bool:
    return all(f"{each}_{side}" in degrees for each in _CHAIN)


def _turned_off(side: str, degrees: Mapping[str, Array], *changed: str) -> float:
    """deg, RMS, by which the angles from pelvis to ankle turn the foot otherwise than its own
    angles do; those `changed` with the other sign.
    """
    rows = slice(SAMPLES)
    turned = {each: -values if each in changed else values for each, values in degrees.items()}
    seen = np.stack([turned[f"{each}_{side}"][rows] for each in _FOOT], axis=1)
    rotation = _turns(turned, side, rows)[-1].as_matrix()
    angles = np.degrees(foot_angles(rotation, "right" if side == "r" else "left"))
    return float(np.abs(_rms(angles - seen)))


def _turns(degrees: Mapping[str, Array], side: str, rows: slice) -> tuple[Rotation, ...]:
    """Orientations of pelvis, thigh, shank and foot in the ground's axes; angles that are not given
    are 0.
    """
    flexion, knee, adduction, rotation = _axes(side)
    still = np.zeros(SAMPLES)

    def turn(axis: Array, name: str, sign: float = 1.0) -> Rotation:
        values = np.radians(np.asarray(degrees.get(f"{name}_{side}", still))[rows])
        return Rotation.from_rotvec(np.outer(sign * values, axis))

    # Own side forward is internal rotation's axis, own side up adduction's reversed, anterior tilt
    # flexion's reversed.
    pelvis = (
        turn(rotation, "pelvis_rotation")
        * turn(adduction, "pelvis_list", -1.0)
        * turn(flexion, "pelvis_tilt", -1.0)
    )
    thigh = (
        pelvis
        * turn(flexion, "hip_flexion")
        * turn(adduction, "hip_adduction")
        * turn(rotation, "hip_rotation")
    )
    shank = (
        thigh
        * turn(knee, "knee_angle")
        * turn(adduction, "knee_adduction")
        * turn(rotation, "knee_rotation")
    )
    foot = (
        shank
        * turn(flexion, "ankle_angle")
        * turn(adduction, "subtalar_angle")
        * turn(rotation, "ankle_rotation")
    )
    return pelvis, thigh, shank, foot


def _axes(side: str) -> tuple[Array, Array, Array, Array]:
    """Of flexion of hip and ankle, of the knee, of adduction and of internal rotation."""
    names = ("hip_flexion", "knee_angle", "hip_adduction", "hip_rotation")
    flexion, knee, adduction, rotation = (np.array(AXES[f"{name}_{side}"]) for name in names)
    return flexion, knee, adduction, rotation


# ---- Moments. ----

_SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")
_FRONTAL: Final = ("hip_adduction", "knee_adduction", "subtalar_angle")
_UP_DOWN: Final = ("hip_rotation", "knee_rotation", "ankle_rotation")


def _not_abducted(moments: Mapping[str, Array], side: Side) -> str:
    """A sentence if the hip is held by its adductors in single stance; else an empty one."""
    fixed = moments[f"hip_adduction_{side[0]}"][ON_ONE_LEG].mean()
    if fixed <= ABDUCTORS:
        return ""
    return (
        f"column moment_hip_adduction_{side[0]}: {fixed:.2g} Nm/kg in single stance (15-45 %), "
        f"where the abductors hold the pelvis, so it is below 0. {MOMENTS}. Change its sign."
    )


def _unbalanced(
    degrees: Mapping[str, Array],
    moments: Mapping[str, Array],
    forces: Mapping[str, Array],
    side: Side,
    names: tuple[str, ...],
) -> Iterator[str]:
    """A sentence if moments `names` of a `side` balance the ground reaction with other signs."""
    own = {name[:-2]: values for name, values in moments.items() if name.endswith(side[0])}
    if not all(name in own for name in names):
        return
    rest = _Balance(degrees, own, forces, side)
    along = np.array([0.0, 1.0, 0.0] if names == _SAGITTAL else [1.0, 0.0, 0.0])
    signed = {
        each: rest.of(names, along, list(each)) for each in product((1.0, -1.0), repeat=len(names))
    }
    usual, best = signed[(1.0,) * len(names)], min(signed, key=lambda each: signed[each])
    if usual > UNBALANCED and usual > BALANCE * signed[best]:
        changed = [n for n, sign in zip(names, best, strict=True) if sign < 0.0]
        columns = " and ".join(f"moment_{name}_{side[0]}" for name in changed)
        yield (
            f"column {columns}: moments of neighbouring joints differ by the lever of the ground "
            f"reaction, but {usual:.2g} Nm/kg are left over in single stance, with the sign "
            f"changed {signed[best]:.2g}. {MOMENTS}. Change the sign."
        )


def _odd_moments(moments: Mapping[str, Array]) -> Iterator[str]:
    """A sentence for each moment whose balance says nothing, and that is nearer to healthy people's
    with the sign changed.
    """
    for name in dict.fromkeys(each[:-2] for each in moments):
        usual = healthy().get(f"moment_{name}")
        if usual is None:
            continue
        near = {side: nearness(moments[f"{name}_{side}"], usual) for side in "rl"
                if f"{name}_{side}" in moments}  # fmt: skip
        bad = [side for side, times in near.items() if times > NEARER]
        if len(bad) == len(near) or any(near[side] > ONE_SIDE for side in bad):
            columns = " and ".join(f"moment_{name}_{side}" for side in bad)
            times = max(near[side] for side in bad)
            yield (
                f"{columns}: {times:.1f} times nearer to healthy people's with the sign changed. "
                f"{MOMENTS}: if yours is the other way round, change the sign of the column."
            )


class _Balance:
    """What moments of neighbouring joints differ by besides the lever of the ground reaction."""

    def __init__(
        self,
        degrees: Mapping[str, Array],
        moments: Mapping[str, Array],
        forces: Mapping[str, Array],
        side: Side,
    ) -> None:
        letter, rows = side[0], ON_ONE_LEG
        _, thigh, shank, foot = _turns(degrees, letter, rows)
        flexion, knee, adduction, rotation = _axes(letter)
        axes = ((flexion, adduction, rotation), (knee, adduction, rotation),
                (flexion, adduction, rotation))  # fmt: skip
        force = STANDARD_GRAVITY * np.stack(
            [forces[f"{axis}_{letter}"][rows] for axis in ("forward", "left", "up")], axis=1
        )
        # N/kg times m; lengths of a person of mean stature, which no sign depends on.
        up = np.array([0.0, 0.0, float(np.mean(list(STATURE.values())))])
        self.levers = (
            np.cross(thigh.apply(WINTER["thigh"] * up), force),
            np.cross(shank.apply(WINTER["shank"] * up), force),
        )
        still = np.zeros(SAMPLES)
        self.parts = [
            {
                name: segment.apply(np.outer(moments.get(name, still)[rows], axis))
                for name, axis in zip(names, own, strict=True)
            }
            for names, own, segment in zip(
                zip(_SAGITTAL, _FRONTAL, _UP_DOWN, strict=True), axes, (thigh, shank, foot),
                strict=True,
            )
        ]  # fmt: skip

    def of(self, names: tuple[str, ...], along: Array, signed: list[float]) -> float:
        """RMS, Nm/kg, of the part along an axis of the ground, of the joints of `names`, their
        moments times `signed`.
        """
        sign = dict(zip(names, signed, strict=True))
        vectors = [
            sum(sign.get(name, 1.0) * part for name, part in joint.items())
            for joint in self.parts[: len(names)]
        ]
        rests = [
            (np.asarray(upper) - np.asarray(lower) - lever) @ along
            for upper, lower, lever in zip(vectors, vectors[1:], self.levers, strict=False)
        ]
        return _rms(np.concatenate(rests))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
