"""Where markers lie on a standing person whom one does not know: a mean and a covariance.

People of all sizes are drawn, with legs, trunk and arms of their own proportions, standing as
people stand (feet turned out, knees not quite straight), with arms that hang, are held out, or are
bent; and each place of `sites.toml` is put on them. The places of all of these people are then
described by one normal distribution for each way to stand. So a knee that was found says
how high the hip is, how far the foot is turned out says where its toes are, and so on.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Final, Protocol

import numpy as np

from gaitval.arrays import Array


@dataclass(frozen=True)
class DrawnPeople:
    """The people of whom the likely places of markers are drawn."""

    count: int = 3000
    """Drawn people; the standard error of a standard deviation is 1.3 % of it."""
    stature_m: tuple[float, float] = (1.55, 0.25)
    """m. Mean and standard deviation of the people drawn: children and adults."""
    hang: tuple[
        tuple[float, float],
        tuple[float, float],
        tuple[float, float],
        tuple[float, float],
        tuple[float, float],
    ] = ((12.0, 7.0), (0.0, 14.0), (18.0, 14.0), (10.0, 30.0), (5.0, 20.0))
    """Arms that hang: abduction, flexion, flexion of the elbow, turn of the forearm (palm forward
    is positive) and inward turn of the upper arm, degrees, mean and standard deviation."""
    upright: tuple[tuple[float, float], tuple[float, float], tuple[float, float]] = (
        (0.0, 4.0),
        (0.0, 3.0),
        (0.0, 0.0),
    )
    """Legs of a standing person: flexion of the right hip, which is the left one's extension,
    abduction of both, and how far both knees are bent, the hips half as much, likewise."""
    place_sd_m: tuple[float, float, float] = (0.05, 0.02, 0.015)
    """m. Error of where a person is taken to stand: forward, to the left, height of the floor."""
    carrying: tuple[float, float] = (8.0, 6.0)
    """Degrees, mean and standard deviation: by how much the forearm points outwards from the upper
    arm: 11 to 15 with the palm forward, less with it turned back (Paraskevas et al. 2004, from
    memory)."""
    toe_out_deg: float = 9.0
    knee_flexion_deg: float = 4.0


PEOPLE: Final = DrawnPeople()


POSES: Final = {
    "arms hang": (PEOPLE.hang, PEOPLE.upright),
    "arms out": (
        ((45.0, 14.0), (5.0, 12.0), (12.0, 10.0), (10.0, 30.0), (0.0, 20.0)),
        PEOPLE.upright,
    ),
    "arms level": (
        ((85.0, 10.0), (5.0, 10.0), (10.0, 10.0), (-60.0, 35.0), (0.0, 20.0)),
        PEOPLE.upright,
    ),
    "forearms hang": (
        ((80.0, 12.0), (5.0, 10.0), (80.0, 18.0), (0.0, 35.0), (60.0, 20.0)),
        PEOPLE.upright,
    ),
    "elbows bent": (
        ((14.0, 10.0), (10.0, 15.0), (85.0, 18.0), (0.0, 30.0), (0.0, 0.0)),
        PEOPLE.upright,
    ),
    "arms forward": (
        ((10.0, 10.0), (75.0, 15.0), (15.0, 12.0), (0.0, 35.0), (20.0, 30.0)),
        PEOPLE.upright,
    ),
    "astride": (PEOPLE.hang, ((0.0, 4.0), (20.0, 7.0), (0.0, 0.0))),
    "crouched": (PEOPLE.hang, ((0.0, 4.0), (0.0, 3.0), (25.0, 10.0))),
    "right foot ahead": (PEOPLE.hang, ((16.0, 6.0), (0.0, 3.0), (0.0, 0.0))),
    "left foot ahead": (PEOPLE.hang, ((-16.0, 6.0), (0.0, 3.0), (0.0, 0.0))),
}
"""Ways to stand, each a distribution of its own: how the arms are held, and the legs: feet side by
side, astride a belt, knees bent (crouch of cerebral palsy: 20 degrees and more, Rodda et al. 2004),
or one foot ahead of the other. An upper arm that is held out turns about itself as it likes, and
inwards where it is held forward with the palm down."""

POSTURE: Final = {
    "lean": 6.0, "tilt": 6.0, "sway": 2.5, "hip": 3.0, "abduction": 2.0, "turn": 7.0,
    "knee": 7.0, "toe_out": 7.0, "pitch": 3.0, "ankle": 4.0, "facing": 4.0,
    "nod": 8.0, "look": 6.0,
}  # fmt: skip
"""Degrees. How standing people differ: trunk forward and sideways, pelvis, thigh, knee, foot, head;
and the error of the direction in which they are taken to face."""


MIDDLE: Final = ("pelvis", "torso", "head")
"""Parts of which there is one."""


@dataclass(frozen=True)
class Site:
    """A place on the body, of one side ("R", "L") or the middle ("")."""

    name: str
    side: str
    part: str
    at: Array
    sd: Array
    there: float
    landmark: str | None
    many: bool
    use: bool

    @property
    def label(self) -> str:
        """Its name with the side."""
        return f"{self.side}.{self.name}" if self.side else self.name

    @property
    def mirrored(self) -> str:
        """The label of the same place on the other side, or of itself."""
        return f"{'RL'[self.side == 'R']}.{self.name}" if self.side else self.name

    @property
    def segment(self) -> str:
        """Segment of gaitval's body; "" where it has none."""
        if not self.use:
            return ""
        if self.part in ("pelvis", "torso"):
            return self.part
        part = {"Toe": "toes"}.get(self.name, {"ankle": "shank"}.get(self.part, self.part))
        return f"{part}_{self.side.lower()}"


@dataclass(frozen=True)
class Population:
    """Places of all people who stand in one way.

    Attributes
    ----------
    sites : the K places.
    mean : (K, 3) m, axes forward, left, up; origin on the floor below the middle of the hips.
    shared : (3K + 1, 3K + 1) covariance of the places and, last, of the stature; m².
    own : (K, 3, 3) covariance of where a marker is put, for each place, m².
    """

    sites: tuple[Site, ...]
    mean: Array
    shared: Array
    own: Array


@cache
def sites() -> tuple[Site, ...]:
    """All places, the right side's before the left's."""
    found = []
    for part, places in _table().items():
        if part == "lengths":
            continue
        for name, place in places.items():
            for side in ("",) if place.get("middle") else ("R", "L"):
                region = place.get("many", False)
                alone = region and part in MIDDLE
                if alone and side == "L":
                    continue
                found.append(
                    Site(
                        name,
                        "" if alone else side,
                        part,
                        np.array(place["at"]) * ([1, 0, 1] if alone else 1),
                        np.array(place["sd"]),
                        place["there"],
                        _landmark(place, side),
                        region,
                        place.get("use", True),
                    )
                )
    return tuple(found)


@cache
def populations() -> Mapping[str, Population]:
    """The places of all people, for each way to stand."""
    return {pose: _population(pose) for pose in POSES}


def drawn_places(pose: str) -> tuple[Array, Array]:
    """Places (N, K, 3) m of the `sites` on drawn people who stand in one way: where markers were
    put, and where the places are.
    """
    marked, true = (
        _people(np.random.default_rng(1986), pose, placed=placed)[0] for placed in (True, False)
    )
    return marked, true


def _landmark(place: Mapping[str, Any], side: str) -> str | None:
    name = place.get("landmark")
    return None if name is None else f"{side}.{name}" if side else name


@cache
def _table() -> dict[str, Any]:
    file = resources.files("gaitval.scaling.markers") / "sites.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def _population(pose: str) -> Population:
    random = np.random.default_rng(1986)
    where, stature = _people(random, pose, placed=False)
    placed, _ = _people(np.random.default_rng(1986), pose, placed=True)
    mean = where.mean(axis=0)
    joint = np.column_stack([(where - mean).reshape(PEOPLE.count, -1), stature - stature.mean()])
    apart = placed - where
    own = np.einsum("nki,nkj->kij", apart, apart) / PEOPLE.count
    return Population(sites(), mean, joint.T @ joint / PEOPLE.count, own)


def _people(random: np.random.Generator, pose: str, *, placed: bool) -> tuple[Array, Array]:
    """Places (N, K, 3) of drawn people in m, and their statures (N,)."""
    n = PEOPLE.count
    lengths = {
        key: mean * (1.0 + deviation * random.standard_normal(n))
        for key, (mean, deviation) in _table()["lengths"].items()
    }
    stature = np.maximum(random.normal(*PEOPLE.stature_m, n), 0.7)

    def angle(deviation: float, mean: float = 0.0) -> Array:
        return np.radians(random.normal(mean, deviation, n))

    arms, legs = POSES[pose]
    stride, wide, bent = (angle(sd, mean) for mean, sd in legs)
    lean, sway = angle(POSTURE["lean"]), angle(POSTURE["sway"])
    tilt = angle(POSTURE["tilt"])
    hips = np.zeros((n, 3))
    hips[:, 2] = lengths["hip_height"]
    frames = {
        "pelvis": (hips, _pitch(tilt)),
        "torso": (hips, _roll(sway) @ _pitch(lean)),
    }
    neck = np.stack([np.full(n, -0.015), np.zeros(n), lengths["trunk"]], axis=1)
    frames["head"] = (
        hips + np.einsum("nij,nj->ni", frames["torso"][1], neck),
        _yaw(angle(POSTURE["look"])) @ _roll(sway) @ _pitch(angle(POSTURE["nod"])),
    )
    for side, sign in (("R", -1.0), ("L", 1.0)):
        hip = hips + _across(sign * lengths["hip_half_width"])
        parts = _leg(lengths, hip, sign, angle, (stride, wide, bent))
        parts |= _arm(lengths, hips, frames["torso"][1], sign, angle, arms)
        frames |= {f"{part}_{side}": frame for part, frame in parts.items()}
    found = _sites_on(frames, lengths, random, placed=placed) * stature[:, None, None]
    # Nobody knows exactly which way the person faces, nor where between the feet the hips are.
    turned = _yaw(angle(POSTURE["facing"]))
    stood = np.stack([random.normal(0.0, sd, n) for sd in PEOPLE.place_sd_m], axis=1)
    return np.einsum("nij,nkj->nki", turned, found) + stood[:, None], stature


class _Angle(Protocol):
    """Draws an angle (N,) rad of each person, of this deviation and mean in degrees."""

    def __call__(self, deviation: float, mean: float = ..., /) -> Array: ...


_Frame = tuple[Array, Array]
"""Of a segment of each person: where its origin is (N, 3), and its axes as columns (N, 3, 3)."""


def _leg(
    lengths: Mapping[str, Array],
    hip: Array,
    sign: float,
    angle: _Angle,
    fixed: tuple[Array, Array, Array],
) -> dict[str, _Frame]:
    """Segments of a leg below the `hip`, `fixed` as in `PEOPLE.upright`, rad. `sign` is that of
    y.
    """
    stride, wide, bent = fixed
    thigh = (
        _yaw(sign * angle(POSTURE["turn"]))
        @ _roll(sign * (wide + angle(POSTURE["abduction"])))
        @ _pitch(sign * stride - angle(POSTURE["hip"]) - bent / 2.0)
    )
    knee = hip - _up(thigh, lengths["hip_height"] - lengths["knee_height"])
    shank = thigh @ _pitch(angle(POSTURE["knee"], PEOPLE.knee_flexion_deg) + bent)
    ankle = knee - _up(shank, lengths["knee_height"] - lengths["ankle_height"])
    # Feet stand on the floor.
    ankle[:, 2] = lengths["ankle_height"]
    # The malleoli turn outwards with the foot, not with the knee.
    out = sign * (angle(POSTURE["toe_out"], PEOPLE.toe_out_deg))
    foot = _yaw(out) @ _pitch(angle(POSTURE["pitch"]))
    malleoli = _yaw(out + sign * angle(POSTURE["ankle"]))
    return {
        "thigh": (hip, thigh),
        "shank": (knee, shank),
        "ankle": (ankle, malleoli),
        "foot": (ankle * [1, 1, 0], foot),
    }


def _arm(
    lengths: Mapping[str, Array],
    hips: Array,
    torso: Array,
    sign: float,
    angle: _Angle,
    fixed: Sequence[tuple[float, float]],
) -> dict[str, _Frame]:
    """Segments of an arm on the `torso` (its axes), which is `fixed` as in `PEOPLE.hang`."""
    at = [
        np.full(len(hips), -0.012),
        sign * lengths["shoulder_half_width"],
        lengths["trunk"] * 0.87,
    ]
    shoulder = hips + np.einsum("nij,nj->ni", torso, np.stack(at, axis=1))
    abduction, flexion, bend, turn, inwards = (angle(sd, mean) for mean, sd in fixed)
    arm = torso @ _roll(sign * abduction) @ _pitch(-flexion) @ _yaw(-sign * inwards)
    elbow = shoulder - _up(arm, lengths["upper_arm"])
    carried = _roll(sign * angle(*PEOPLE.carrying[::-1]))
    forearm = arm @ _pitch(-bend) @ carried @ _yaw(sign * turn)
    return {"upper_arm": (shoulder, arm), "forearm": (elbow, forearm)}


def _sites_on(
    frames: Mapping[str, _Frame],
    lengths: Mapping[str, Array],
    random: np.random.Generator,
    *,
    placed: bool,
) -> Array:
    """Places (N, K, 3) of all sites on people with these segments, in statures; of markers that
    somebody has `placed`, with the errors of that.
    """
    wide, foot_size = lengths["width"][:, None], lengths["foot"][:, None]
    scale = {
        "thigh": (lengths["hip_height"] - lengths["knee_height"]) / 0.234,
        "shank": (lengths["knee_height"] - lengths["ankle_height"]) / 0.239,
        "torso": lengths["trunk"] / 0.335,
        "upper_arm": lengths["upper_arm"] / 0.180,
        "forearm": lengths["forearm"] / 0.150,
    }
    n = len(wide)
    found = []
    for site in sites():
        at = np.repeat(site.at[None], n, axis=0)
        at = at * (foot_size if site.part == "foot" else np.hstack([wide, wide, np.ones((n, 1))]))
        at[:, 2] *= scale.get(site.part, 1.0)
        drawn = random.standard_normal((n, 3)) * site.sd
        if placed:
            at = at + drawn
        if site.side == "R":
            at = at * [1, -1, 1]
        key = site.part if site.part in frames else f"{site.part}_{site.side}"
        origin, axes = frames[key]
        found.append(origin + np.einsum("nij,nj->ni", axes, at))
    return np.stack(found, axis=1)


def _across(y: Array) -> Array:
    zero = np.zeros_like(y)
    return np.stack([zero, y, zero], axis=1)


def _up(axes: Array, length: Array) -> Array:
    return np.asarray(axes[:, :, 2] * length[:, None])


def _turned(first: int, second: int, angle: Array) -> Array:
    """Rotations (N, 3, 3) that take axis `first` towards axis `second`."""
    axes = np.repeat(np.eye(3)[None], len(angle), axis=0)
    axes[:, first, first] = axes[:, second, second] = np.cos(angle)
    axes[:, second, first], axes[:, first, second] = np.sin(angle), -np.sin(angle)
    return axes


def _yaw(angle: Array) -> Array:
    return _turned(0, 1, angle)


def _roll(angle: Array) -> Array:
    """About forward: what hangs goes to the left."""
    return _turned(1, 2, angle)


def _pitch(angle: Array) -> Array:
    """About left: the top goes forward, what hangs goes backward."""
    return _turned(2, 0, angle)
