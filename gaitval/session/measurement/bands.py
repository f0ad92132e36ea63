"""A band of 90 % on every curve, by derivatives: each source of error is perturbed once.

The body is scaled and its markers are placed again with a landmark beside its place, in standing
and in walking; one gait cycle of each side then goes through inverse kinematics and dynamics as in
the import. The joint fit to both trials is not repeated: what a landmark does to the standing pose
and to the joint centres is what moves the curves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from scipy.special import ndtr

from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import COORDINATES, SIDES, Side
from gaitval.errors import GaitvalError
from gaitval.gait.cycles import GaitCycle, normalise
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.kinetics.inverse.marker_placement import place_markers
from gaitval.mocap.recording import FootForces
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.model.tree import segment_frames
from gaitval.scaling.hip_regressions import REGRESSIONS
from gaitval.scaling.joint_centres import locate, measure
from gaitval.scaling.scaling import build_body
from gaitval.session.average import side_angles
from gaitval.session.measurement.estimate import Examined
from gaitval.session.measurement.kinds import KINDS
from gaitval.session.measurement.otherwise import heavier, with_fault
from gaitval.session.measurement.second_sessions import at_once
from gaitval.session.measurement.sources import (
    ANKLE_CENTRES,
    FLESH,
    HIP_CENTRE,
    INERTIAS,
    LANDMARKS,
    MASSES,
    NINETY,
    ONE_CYCLE,
    PLATE_GAIN,
    TISSUE,
    TISSUE_TURN,
    of_stature,
)
from gaitval.session.session import Import
from gaitval.session.standing import standing_places
from gaitval.session.trial import WalkingTrial, completed, smoothed, valid_cycles

MARGIN_SECONDS: Final = 0.2
"""s before and after the cycle, in which filters settle."""
ABOVE: Final = {
    "pelvis": "hip_flexion",
    "thigh": "hip_flexion",
    "shank": "knee_angle",
    "foot": "ankle_angle",
}
"""The joint whose excursion moves the soft tissue of a segment."""
PLATES: Final = ("delay", "place x", "place y", "rotation", "gain", "cross-talk x", "cross-talk y")
REMEDIES: Final = {
    "landmarks": "a range-of-motion trial of hips and knees (functional), and landmarks found "
    "twice",
    "plates": "a trial in which markers stand on the corners of the plates and the person stands "
    "still on each of them",
    "cycles": "a longer trial, with more gait cycles",
    "soft tissue": "clusters of markers on plates of thigh and shank",
}

HIPS: Final = "hip centres"
CHOICE: Final = "hip centres, by which regression"
ANKLES: Final = "ankle centres"
FLESH_OVER: Final = "flesh over the spines"
LASTING: Final = (HIPS, ANKLES, FLESH_OVER, "mass of the ")
"""Sources that are the person's, not the session's: what a regression misses by in this body, it
misses by in every session. All others are counted as new in each, soft tissue and plates too,
which is the safe side: a change must be larger to be more than re-measuring."""

_HELD: Final = 0.90
"""Share that the bands hold, of which `NINETY` is the half width of a normal error."""
_HALVINGS: Final = 40
_BandCurves = dict[str, Array]
AXES: Final = ("forward", "left", "up")
"""Of a force, in the names of its curves."""


@dataclass(frozen=True)
class Bands:
    """Bands of 90 % of the mean curves of an import.

    Attributes
    ----------
    half : (101,) half of the width by the name of the curve ("angle_knee_angle_r",
        "moment_…", "force_up_r"), rad, Nm/kg and body weights.
    lengths : m, likewise of the lengths of the body.
    shares : by curve ("length_thigh_right" of a length), the sources of its variance over the
        cycle, the largest first, with their shares.
    remedy : which recording would make the bands narrower most, and by how much of the variance.
    again : `half` of what a second session of the same person would have otherwise: without
        `LASTING` sources.
    at_once : standard deviations of `again` within which 95 % of second sessions are at every
        point of every curve.
    by_hip : by each regression of the hip centre other than the chosen one, how much each curve
        would be larger.
    """

    half: _BandCurves
    lengths: dict[str, float]
    shares: dict[str, tuple[tuple[str, float], ...]]
    remedy: tuple[str, float]
    again: _BandCurves
    at_once: float
    by_hip: Mapping[str, _BandCurves] = field(default_factory=dict)


@dataclass(frozen=True)
class _Window:
    """A gait cycle of one side, with its margins."""

    walk: WalkingTrial
    side: Side
    cycle: GaitCycle
    frames: slice


@dataclass(frozen=True)
class _Change:
    """A perturbation of size one standard deviation."""

    source: str
    places: Mapping[str, Array]
    walking: Mapping[tuple[Side, str], Array]
    hips: Mapping[str, Array]

    def opposite(self) -> "_Change":
        return _Change(
            self.source,
            {name: -moved for name, moved in self.places.items()},
            {place: -moved for place, moved in self.walking.items()},
            {side: -moved for side, moved in self.hips.items()},
        )


def bands(found: Import, seen: Examined | None) -> Bands | None:
    """The bands of the import `found`, whose faults were `seen`; None if no whole cycle of either
    side is shown.
    """
    chain = _Chain(found)
    if not chain.windows:
        return None
    base, lengths = chain.run(chain.nothing)
    parts: dict[str, _BandCurves] = {}
    session: list[_BandCurves] = []
    of_lengths: dict[str, dict[str, float]] = {}
    for change in chain.changes():
        try:
            curves, other = chain.run(change)
        except GaitvalError:
            # A landmark that may not be there gives no body; to the other side it may.
            try:
                curves, other = chain.run(change.opposite())
            except GaitvalError:
                continue
        moved = {name: curves[name] - base[name] for name in base}
        _add(parts, change.source, moved)
        if not change.source.startswith(LASTING):
            session.append(moved)
        for name in lengths:
            of = of_lengths.setdefault(change.source, {})
            of[name] = of.get(name, 0.0) + (other[name] - lengths[name]) ** 2
    for source, curves in chain.of_loads(seen):
        moved = {name: curves[name] - base[name] for name in curves}
        _add(parts, source, moved)
        if not source.startswith(LASTING):
            session.append(moved)
    between = _between_cycles(found)
    _add(parts, "cycle to cycle", between)
    by_hip = chain.by_hip(base)
    if by_hip:
        rest = {n: sum(of[n] for of in parts.values() if n in of) for n in base}
        _add(parts, CHOICE, _farthest(by_hip, {n: np.sqrt(each) for n, each in rest.items()}))
    found_bands = _summed(parts, of_lengths, at_once(session, between))
    return replace(found_bands, by_hip=by_hip)


def _farthest(by_hip: Mapping[str, _BandCurves], rest: _BandCurves) -> _BandCurves:
    """What the regression that is farthest off at each point moves a moment, as a standard
    deviation beside the `rest` of them: so that the band of 90 % about the chosen curve holds 90 %
    of what is likely by that regression, too. A choice has no chance to be right, and is no error
    that others average out. Of an angle it is a convention, which is named beside it
    (`gaitval.conventions`).
    """
    names = set.intersection(*(set(each) for each in by_hip.values()))
    names = {name for name in names if name.startswith("moment_")}
    found = {}
    for name in names:
        away = np.max([np.abs(each[name]) for each in by_hip.values()], axis=0)
        half = half_holding(away, rest[name])
        found[name] = np.sqrt(np.maximum((half / NINETY) ** 2 - rest[name] ** 2, 0.0))
    return found


def half_holding(away: Array, deviation: Array) -> Array:
    """Half of the width of an interval about 0 that holds 90 % of what is normal about `away` with
    a standard `deviation`; of any shape, one unit. From `NINETY` deviations, at none away, to away
    and 1.28 of them.
    """
    away = np.abs(away)
    size = np.where(deviation > 0.0, deviation, 1.0)
    low, high = away, away + NINETY * deviation
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        # Of both tails the far one matters only near none away.
        enough = ndtr((middle - away) / size) - ndtr(-(middle + away) / size) >= _HELD
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.where(deviation > 0.0, high, away)


def _add(parts: dict[str, _BandCurves], source: str, moved: _BandCurves) -> None:
    of = parts.setdefault(source, {})
    for name, values in moved.items():
        of[name] = of.get(name, 0.0) + values**2


def _summed(
    parts: dict[str, _BandCurves], lengths: dict[str, dict[str, float]], at_once: float
) -> Bands:
    names = sorted({name for of in parts.values() for name in of})
    total = {name: sum(of[name] for of in parts.values() if name in of) for name in names}
    own = {
        name: sum(of[name] for s, of in parts.items() if name in of and not s.startswith(LASTING))
        for name in names
    }
    shares = {}
    groups = dict.fromkeys(REMEDIES, 0.0)
    for name in names:
        size = float(np.mean(total[name]))
        each = {s: float(np.mean(of[name])) / size for s, of in parts.items() if name in of}
        shares[name] = tuple(sorted(each.items(), key=lambda item: -item[1])[:5])
        for source, share in each.items():
            groups[_group(source)] += share / len(names)
    widest = max(groups, key=lambda group: groups[group])
    sizes = {
        name: NINETY * float(np.sqrt(sum(of[name] for of in lengths.values())))
        for name in next(iter(lengths.values()), {})
    }
    for name, half in sizes.items():
        each = {s: of[name] * (NINETY / half) ** 2 for s, of in lengths.items() if half > 0.0}
        shares[f"length_{name}"] = tuple(sorted(each.items(), key=lambda item: -item[1])[:5])
    return Bands(
        # An angle that the markers hardly show goes from one end of its range to the other with a
        # landmark; it cannot be further off than that.
        half={name: np.minimum(NINETY * np.sqrt(total[name]), _widest(name)) for name in names},
        lengths=sizes,
        shares=shares,
        remedy=(REMEDIES[widest], groups[widest]),
        again={name: np.minimum(NINETY * np.sqrt(own[name]), _widest(name)) for name in names},
        at_once=at_once,
    )


def _widest(name: str) -> float:
    """The whole range of a coordinate, rad, of an angle by the `name` of its curve."""
    low, high = MEASURED_RANGES.get(name.removeprefix("angle_"), (-np.inf, np.inf))
    return float(high - low)


def _group(source: str) -> str:
    if source == "cycle to cycle":
        return "cycles"
    if source.startswith("plates"):
        return "plates"
    return "soft tissue" if source.startswith("soft tissue") else "landmarks"


def _between_cycles(found: Import) -> _BandCurves:
    """Standard errors of the means."""
    curves: _BandCurves = {}
    for kind, of in (("angle", found.angles), ("moment", found.moments)):
        for name, curve in of.items():
            curves[f"{kind}_{name}"] = _error(curve.deviation, len(curve.curves), kind)
    for side, curve in found.forces.items():
        for axis, name in enumerate(AXES):
            curves[f"force_{name}_{side[0]}"] = _error(
                curve.deviation[:, axis], len(curve.curves), "force"
            )
    return curves


def _error(deviation: Array, count: int, kind: str) -> Array:
    if count < 2:
        return np.full(len(deviation), ONE_CYCLE[kind])
    # Few cycles show their own spread badly; it is at least half of what others have.
    return np.asarray(np.maximum(np.nan_to_num(deviation), 0.5 * ONE_CYCLE[kind]) / np.sqrt(count))


class _Chain:
    """From landmarks to the curves of one cycle of each side."""

    def __init__(self, found: Import) -> None:
        self.found = found
        self.set = found.session.marker_set
        self.stature = of_stature(found.request.height_m)
        self.places = standing_places(found.session.standing)
        self.windows = [w for side in SIDES if (w := _window(found, side)) is not None]
        self.given = found.body.centres if found.request.joint_centres == "given" else {}
        self.located = self.moved_given({})
        self.nothing = _Change("", {}, {}, {})
        model, markers, pose = self.body(self.nothing)
        self.of_marker = {marker.name: marker.segment for marker in markers}
        self.stand = segment_frames(model, pose[None])[0]
        self.pose = pose
        self.moving = {
            window.side: self.positions(window, model, markers, self.nothing)
            for window in self.windows
        }
        self.turning = {
            side: segment_frames(model, positions)[:, :, :3, :3]
            for side, positions in self.moving.items()
        }
        hip = {s: self.stand[SEGMENTS.index(f"thigh_{s}"), :3, 3] for s in "rl"}
        self.nothing = replace(self.nothing, hips={s.upper(): hip[s] for s in "rl"})
        self.regressed = self.regression(self.places, found.request.hip_regression)

    def regression(self, places: Mapping[str, Array], name: str) -> dict[str, Array]:
        """(3,) m, both hips in standing by the regression of this `name`."""
        landmarks = self.set.on_landmarks({n: at.tolist() for n, at in places.items()})
        widths = self.found.request.widths | {"hip_regression": name}
        points = locate(landmarks, **widths)
        return {side: points[f"{side}.Hip.Centre"] for side in "RL"}

    def moved_hips(self, change: _Change) -> dict[str, Array]:
        """The hips with a change: a regression goes with the landmarks, a functional centre does
        not.
        """
        hips = dict(change.hips or self.nothing.hips)
        if change.hips or not change.places or self.found.request.joint_centres == "functional":
            return hips
        places = {name: at + change.places.get(name, 0.0) for name, at in self.places.items()}
        now = self.regression(places, self.found.request.hip_regression)
        return {side: at + now[side] - self.regressed[side] for side, at in hips.items()}

    def moved_given(self, moved: Mapping[str, Array]) -> dict[str, Array]:
        """Where landmarks put the centres that are given: whoever gave them had these, too."""
        if not self.given:
            return {}
        places = {name: at + moved.get(name, 0.0) for name, at in self.places.items()}
        found = locate(self.set.on_landmarks(places), **self.found.request.widths)
        return {name: found[name] for name in self.given}

    def by_hip(self, base: _BandCurves) -> dict[str, _BandCurves]:
        """What the curves gain with the hips of each regression that was not chosen."""
        found, given = {}, self.found.given_hips
        for name in REGRESSIONS:
            if name == self.found.request.hip_regression and not given:
                continue
            there = self.regression(self.places, name)
            hips = {
                side: at + there[side] - (at if given else self.regressed[side])
                for side, at in self.nothing.hips.items()
            }
            try:
                curves, _ = self.run(_Change(HIPS, {}, {}, hips))
            except GaitvalError:  # a body that cannot be
                continue
            found[name] = {curve: curves[curve] - base[curve] for curve in base}
        return found

    def body(self, change: _Change) -> tuple[BodyModel, Sequence[ModelMarker], Array]:
        """Model, markers and standing pose with changed landmarks."""
        request = self.found.request
        places = {name: place + change.places.get(name, 0.0) for name, place in self.places.items()}
        landmarks = self.set.on_landmarks({name: at.tolist() for name, at in places.items()})
        hips = {f"{side}.Hip.Centre": at for side, at in change.hips.items()}
        now = self.moved_given(change.places)
        given = {name: at + now[name] - self.located[name] for name, at in self.given.items()}
        centres = {**given, **hips} or None
        measured = measure(landmarks, **request.widths, centres=centres)
        self.measured = replace(measured, symmetric=self.found.body.chosen.symmetric)
        scaled = build_body(request, self.measured)
        placed = place_markers(
            scaled.model, self.measured, places, self.set, **request.widths, centres=centres
        )
        return scaled.model, placed.markers, placed.standing

    def positions(
        self,
        window: _Window,
        model: BodyModel,
        markers: Sequence[ModelMarker],
        change: _Change,
    ) -> Array:
        """(T, 31) of a window, low-passed."""
        recording = window.walk.recording
        there = [marker for marker in markers if marker.name in recording.names]
        measured = recording.columns([m.name for m in there])
        measured = measured[window.frames].copy()
        for i, marker in enumerate(there):
            measured[:, i] += change.walking.get((window.side, marker.name), 0.0)
        poses = inverse_kinematics(model, there, measured)
        processing = self.found.processing
        return completed(poses, smoothed(poses, recording.marker_rate, processing))

    def run(self, change: _Change) -> tuple[_BandCurves, dict[str, float]]:
        """Curves and lengths with a change."""
        change = replace(change, hips=self.moved_hips(change))
        model, markers, _ = self.body(change)
        curves: _BandCurves = {}
        for window in self.windows:
            positions = self.positions(window, model, markers, change)
            curves |= self.curves(window, model, positions, None)
        lengths = {
            name: value
            for name, value in self.measured.to_dict().items()
            if isinstance(value, float) and name != "pelvic_tilt"
        }
        return curves, lengths

    def curves(
        self, window: _Window, model: BodyModel, positions: Array, loads: FootForces | None
    ) -> _BandCurves:
        """Of a window's side: angles, moments and forces over its cycle."""
        walk, side = window.walk, window.side
        time = walk.recording.time[window.frames]
        angles = side_angles(model, positions, side)
        found = {f"angle_{n}": normalise(time, v, window.cycle) for n, v in angles.items()}
        loads = loads or _cut(walk.loads, window.frames)
        if loads is None or not window.cycle.kinetics_valid:
            return found
        moments = inverse_dynamics(
            model, time, positions, loads.force, loads.centre_of_pressure, loads.free_moment
        ).recorded_moments()
        mass = self.found.request.mass_kg
        for name, values in moments.items():
            if name.endswith(f"_{side[0]}"):
                found[f"moment_{name}"] = normalise(time, values / mass, window.cycle)
        force = normalise(time, loads.force[:, SIDES.index(side)], window.cycle)
        for axis, name in enumerate(AXES):
            found[f"force_{name}_{side[0]}"] = force[:, axis] / (mass * STANDARD_GRAVITY)
        return found

    def changes(self) -> list[_Change]:
        """One for each landmark, hip centre and segment of soft tissue, and direction."""
        found = []
        axes = np.eye(3)
        for landmark, deviation in LANDMARKS.items():
            pelvis = landmark in ("ASIS", "PSIS", "Sacrum")
            # What a leg's landmark does to the other leg's curves is nothing, so both go together.
            sides = (["R."], ["L."]) if pelvis else (["R.", "L."],)
            for of in sides if landmark != "Sacrum" else ([""],):
                names = {self.set.landmarks.get(f"{s}{landmark}"): s for s in of}
                marks = {n: s for n, s in names.items() if n in self.places}
                for axis in axes:
                    if marks:
                        word = f"landmark {of[0] if pelvis else ''}{landmark}"
                        found.append(self.displaced(word, marks, self.stature * deviation * axis))
        for axis in axes:
            turn = self.stand[SEGMENTS.index("pelvis"), :3, :3]
            hips = {
                s: at + turn @ (self.stature * HIP_CENTRE * axis)
                for s, at in self.nothing.hips.items()
            }
            found.append(_Change(HIPS, {}, {}, hips))
        found += self.definitions()
        for segment, size in TISSUE.items():
            found += [self.tissue(segment, self.stature * size * axis, 0.0) for axis in axes]
        found += [self.tissue(s, np.zeros(3), turn) for s, turn in TISSUE_TURN.items()]
        return found

    def definitions(self) -> list[_Change]:
        """Flesh over the spines, and other places of the ankle's centre."""
        found, lengths = [], self.measured.to_dict()
        for landmark, thick in FLESH.items():
            sides = ("",) if landmark == "Sacrum" else ("R.", "L.")
            marks = {self.set.landmarks.get(f"{s}{landmark}", ""): s for s in sides}
            marks = {name: s for name, s in marks.items() if name in self.places}
            if marks:
                by = self.stature * np.array([thick, 0.0, 0.0])
                found.append(self.displaced(FLESH_OVER, marks, by))
        marks = {
            name: s
            for s in ("R.", "L.")
            for each in ("Ankle", "Ankle.Medial")
            if (name := self.set.landmarks.get(f"{s}{each}", "")) in self.places
        }
        shank = float(np.mean([float(str(lengths[f"shank_{side}"])) for side in SIDES]))
        foot = float(
            np.mean([each.foot_length for each in (self.measured.right, self.measured.left)])
        )
        share = 1.0 / np.sqrt(1.0 + len(ANKLE_CENTRES))
        for forward, up in ANKLE_CENTRES:
            by = share * np.array([forward * foot, 0.0, up * shank])
            found.append(self.displaced(ANKLES, marks, by))
        return found

    def displaced(self, word: str, marks: Mapping[str, str], by: Array) -> _Change:
        """Markers beside their landmarks: fixed to the segment, in standing and in walking."""
        places, walking = {}, {}
        for name in marks:
            segment = SEGMENTS.index(self.of_marker.get(name, "pelvis"))
            places[name] = self.stand[segment, :3, :3] @ by
            for side, turning in self.turning.items():
                if name in self.of_marker:
                    walking[side, name] = turning[:, segment] @ by
        return _Change(word, places, walking, {})

    def tissue(self, segment: str, by: Array, turn: float) -> _Change:
        """All markers of a segment move on it with the joint above, and turn about its length."""
        walking = {}
        for side, positions in self.moving.items():
            suffix = "" if segment == "pelvis" else f"_{side[0]}"
            joint = COORDINATES.index(f"{ABOVE[segment]}_{side[0]}")
            moved = (positions[:, joint] - self.pose[joint])[:, None]
            index = SEGMENTS.index(f"{segment}{suffix}")
            for name, whose in self.of_marker.items():
                if whose != f"{segment}{suffix}":
                    continue
                place = self.stand[index, :3, :3].T @ (self.places[name] - self.stand[index, :3, 3])
                own = by + turn * np.cross([0.0, 0.0, 1.0], place)
                walking[side, name] = moved * (self.turning[side][:, index] @ own)
        return _Change(f"soft tissue of the {segment}", {}, walking, {})

    def of_loads(self, seen: Examined | None) -> list[tuple[str, _BandCurves]]:
        """Curves with faults of plates as large as usual, or as found, and with other masses."""
        model, _, _ = self.body(self.nothing)
        found = []
        large = {} if seen is None else {
            part: value for each in seen.found for part, value in each.parts.items()
        }  # fmt: skip
        for window in self.windows:
            positions = self.moving[window.side]
            loads = window.walk.loads
            for fault in PLATES:
                if loads is None:
                    break
                usual = PLATE_GAIN if fault == "gain" else KINDS[split_axis(fault)].sound
                worst = [abs(v) for name, v in large.items() if name.startswith(fault)]
                size = float(np.hypot(usual, max(worst, default=0.0)))
                moved = _cut(with_fault(loads, fault, size), window.frames)
                found.append(
                    (f"plates: {split_axis(fault)}", self.curves(window, model, positions, moved))
                )
            others = [
                *((segment, share, share) for segment, share in MASSES.items()),
                *((segment, 0.0, share) for segment, share in INERTIAS.items()),
            ]
            for segment, mass, inertia in others:
                other = heavier(model, segment, mass, inertia)
                found.append(
                    (f"mass of the {segment}", self.curves(window, other, positions, None))
                )
        return found


def split_axis(fault: str) -> str:
    """A fault's kind: "place" of "place x"."""
    return fault.removesuffix(" x").removesuffix(" y")


def _window(found: Import, side: Side) -> _Window | None:
    """The cycle of a side whose duration is nearest to the median, of those with most shown."""
    for kinetics in (True, False):
        cycles = [
            (walk, cycle) for walk in found.trials
            for cycle in valid_cycles(walk, side, kinetics=kinetics)
        ]  # fmt: skip
        if cycles:
            middle = np.median([cycle.duration for _, cycle in cycles])
            walk, cycle = min(cycles, key=lambda one: abs(one[1].duration - middle))
            time = walk.recording.time
            inside = np.flatnonzero(
                (time >= cycle.start - MARGIN_SECONDS) & (time <= cycle.end + MARGIN_SECONDS)
            )
            return _Window(walk, side, cycle, slice(int(inside[0]), int(inside[-1]) + 1))
    return None


def _cut(loads: FootForces | None, frames: slice) -> FootForces | None:
    if loads is None:
        return None
    return replace(
        loads,
        start=float(loads.time[frames.start]),
        force=loads.force[frames],
        centre_of_pressure=loads.centre_of_pressure[frames],
        free_moment=loads.free_moment[frames],
        valid=loads.valid[frames],
    )
