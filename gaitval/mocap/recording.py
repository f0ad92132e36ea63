"""A motion-capture trial: marker trajectories, force plates and events, as one type.

Readers (`gaitval.mocap.c3d` and others) return it in the axes of the laboratory;
`Recording.turned` brings it into the project's (REP-103: x forward, y left, z up). SI units
throughout: m, N, Nm, s.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.text.display import Displayed
from gaitval.arrays import Array, Flags
from gaitval.coordinates import Side
from gaitval.errors import RecordError
from gaitval.mocap.centre_points import CentrePoint

EventKind = Literal["heel_strike", "toe_off"]
Axes = Literal["laboratory", "project"]

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Plate:
    """One force plate; T samples at the recording's `force_rate`.

    Attributes
    ----------
    name : as the file names it, or "1", "2", …
    corners : (4, 3) m; NaN where the file does not give them.
    force : (T, 3) N, of the plate on the person (up is positive in standing).
    centre_of_pressure : (T, 3) m; NaN where the plate is not loaded.
    free_moment : (T, 3) Nm, of the plate on the person about the centre of pressure (along the
        vertical); zero where the plate is not loaded.
    moment : (T, 3) Nm, of the plate on the person about the origin of the axes, also where the
        plate is not loaded; None if the file gives only the centre of pressure. A plate that was
        not zeroed can be corrected with this moment, but not with a centre of pressure.
    foot : the only foot that is ever on it, if the user says so.
    fault : why it cannot be used; then there are no forces of it.
    """

    name: str
    corners: Array
    force: Array
    centre_of_pressure: Array
    free_moment: Array
    moment: Array | None = None
    foot: Side | None = None
    fault: str = ""

    def during(self, samples: slice | Flags) -> "Plate":
        """With some of its samples alone."""
        return replace(
            self,
            force=self.force[samples],
            centre_of_pressure=self.centre_of_pressure[samples],
            free_moment=self.free_moment[samples],
            moment=None if self.moment is None else self.moment[samples],
        )


@dataclass(frozen=True)
class DeviceTorque:
    """The torque of a device on the body, such as an exoskeleton, as a file of forces gives it.

    Attributes
    ----------
    name : of its columns.
    torque : (T, 3) Nm, at the times of the marker frames, in the recording's axes, on the distal
        segment of the joint that it spans; the proximal segment bears the opposite. NaN where the
        file has none.
    """

    name: str
    torque: Array

    @property
    def joint(self) -> tuple[str, str] | None:
        """The joint ("hip", "knee", "ankle") and side ("r", "l") that its name says, or None."""
        words = re.findall(r"hip|knee|ankle|right|left|[a-z]+", self.name.lower())
        joints = [word for word in words if word in ("hip", "knee", "ankle")]
        sides = [word[0] for word in words if word in ("r", "l", "right", "left")]
        return (joints[0], sides[0]) if len(joints) == len(sides) == 1 else None


@dataclass(frozen=True)
class Event:
    """A gait event: time in s (on the recording's clock), side and kind."""

    time: float
    side: Side
    kind: EventKind


@dataclass(frozen=True, repr=False)
class Recording(Displayed):
    """One trial.

    Attributes
    ----------
    source : the file or files that it was read from, for messages.
    axes : "laboratory" as read, "project" after `turned`.
    names : M marker names.
    markers : (T, M, 3) m; NaN where a marker was not seen.
    marker_rate : Hz.
    start : s, time of the first marker frame and of the first force sample.
    plates : force plates; empty where the file has none.
    force_rate : Hz, an integer multiple of `marker_rate`; 0 without plates.
    events : events that the file stores, in order of time.
    devices : torques of devices on the body, beside the plates.
    centres : joint centres that the file has as points ("R.Hip.Centre"), for `session.read`; they
        stay as they were read when markers are named, cleaned or moved, and are not saved.
    """

    source: str
    axes: Axes
    names: tuple[str, ...]
    markers: Array
    marker_rate: float
    start: float = 0.0
    plates: tuple[Plate, ...] = ()
    force_rate: float = 0.0
    events: tuple[Event, ...] = ()
    devices: tuple[DeviceTorque, ...] = ()
    centres: Mapping[str, CentrePoint] = field(default_factory=dict)

    @property
    def time(self) -> Array:
        """(T,) s, of the marker frames."""
        return self.start + np.arange(len(self.markers)) / self.marker_rate

    @property
    def force_time(self) -> Array:
        """Times of the force samples, s; empty without plates."""
        count = len(self.plates[0].force) if self.plates else 0
        return self.start + np.arange(count) / (self.force_rate or 1.0)

    def marker(self, name: str) -> Array:
        """Trajectory (T, 3) m of one marker; RecordError if there is none of this `name`."""
        if name not in self.names:
            raise RecordError(f"{self.source}: no marker {name!r}. It has {', '.join(self.names)}.")
        return self.markers[:, self.names.index(name)]

    def columns(self, names: Sequence[str]) -> Array:
        """Trajectories (T, M, 3) m of the markers `names` in this order, NaN for one not there."""
        found = np.full((len(self.markers), len(names), 3), np.nan)
        for place, name in enumerate(names):
            if name in self.names:
                found[:, place] = self.marker(name)
        return found

    def alike(self, one: str, other: str) -> bool:
        """Whether two markers have the same trajectory: one is a copy of the other."""
        return np.array_equal(self.marker(one), self.marker(other), equal_nan=True)

    def between(self, window: tuple[float, float], option: str) -> "Recording":
        """Its part from one time to another, s on its clock, in whole frames of the markers. Raises
        RecordError, which names the `option` that asked for it, if there is no frame in it.
        """
        inside = np.flatnonzero((self.time >= window[0]) & (self.time <= window[1]))
        if not len(inside):
            raise RecordError(
                f"{self.source}: {option} {window[0]:g}:{window[1]:g}: the trial goes from "
                f"{self.time[0]:g} to {self.time[-1]:g} s. Give a time in it."
            )
        first, end = int(inside[0]), int(inside[-1]) + 1
        samples = round(self.force_rate / self.marker_rate)
        of_forces = slice(first * samples, end * samples)
        return replace(
            self.frames(first, end),
            plates=tuple(plate.during(of_forces) for plate in self.plates),
            events=tuple(each for each in self.events if window[0] <= each.time <= window[1]),
        )

    def frames(self, first: int, end: int) -> "Recording":
        """With the frames of the markers from `first` to before `end` alone; plates and events as
        they are.
        """
        return replace(
            self,
            markers=self.markers[first:end],
            start=self.start + first / self.marker_rate,
            devices=tuple(replace(d, torque=d.torque[first:end]) for d in self.devices),
            centres={
                name: replace(each, places=each.places[first:end])
                for name, each in self.centres.items()
            },
        )

    def turned(self, rotation: Array) -> "Recording":
        """The trial in the project's axes, to which `rotation` (3, 3) takes laboratory vectors."""
        # Vectors are rows here, so R v becomes v Rᵀ.
        turn = np.asarray(rotation, dtype=float).T
        return replace(
            self,
            axes="project",
            markers=self.markers @ turn,
            plates=tuple(
                replace(
                    plate,
                    corners=plate.corners @ turn,
                    force=plate.force @ turn,
                    centre_of_pressure=plate.centre_of_pressure @ turn,
                    free_moment=plate.free_moment @ turn,
                    moment=None if plate.moment is None else plate.moment @ turn,
                )
                for plate in self.plates
            ),
            devices=tuple(replace(d, torque=d.torque @ turn) for d in self.devices),
        )

    def with_markers(self, names: Iterable[str], markers: Array) -> "Recording":
        """The same trial with other marker trajectories (T, M, 3) of these names."""
        return replace(self, names=tuple(names), markers=np.asarray(markers, dtype=float))

    def title(self) -> str:
        """File and axes."""
        return f"Recording {self.source}, {self.axes} axes"

    def overview(self) -> "pd.DataFrame":
        """How much of what was recorded."""
        from gaitval._internal.text.frames import value_frame

        seen = np.isfinite(self.markers).all(axis=2).mean() if self.markers.size else np.nan
        return value_frame(
            [
                ("", "duration", len(self.markers) / self.marker_rate, "s"),
                ("", "markers", len(self.names), "1"),
                ("", "marker rate", self.marker_rate, "Hz"),
                ("", "markers seen", 100.0 * float(seen), "%"),
                ("", "force plates", len(self.plates), "1"),
                ("", "force rate", self.force_rate, "Hz"),
                ("", "events", len(self.events), "1"),
            ]
        ).drop(columns=["side", "percent"])

    def to_frame(self) -> "pd.DataFrame":
        """Marker positions: marker, quantity (x, y, z), time (s), value, unit (m)."""
        import pandas as pd

        count, markers, _ = self.markers.shape
        return pd.DataFrame(
            {
                "marker": np.tile(np.repeat(self.names, 3), count),
                "quantity": np.tile(["x", "y", "z"], count * markers),
                "time": np.repeat(self.time, 3 * markers),
                "value": self.markers.reshape(-1),
                "unit": "m",
            }
        )

    def save(self, path: str | Path) -> None:
        """Write one npz file, whole or not at all."""
        from gaitval._internal.io.saved_records import write_record

        arrays = {"markers": self.markers}
        for number, plate in enumerate(self.plates):
            for name, values in vars(plate).items():
                if isinstance(values, np.ndarray):
                    arrays[f"plate{number}.{name}"] = values
        others = {
            each.name: getattr(self, each.name)
            for each in fields(self)
            if each.name not in ("markers", "plates", "events", "centres")
        }
        others["plates"] = [plate.name for plate in self.plates]
        others["events"] = [list(asdict(event).values()) for event in self.events]
        write_record(Path(path), type(self).__name__, arrays, others)

    @classmethod
    def load(cls, path: str | Path) -> "Recording":
        """Read what `save` wrote. Raises ArtefactError (inside, ValueError)."""
        from gaitval._internal.io.artefacts import check_arrays
        from gaitval._internal.io.saved_records import edited, read_record

        arrays, others = read_record(Path(path), cls.__name__)
        plates = []
        try:
            for number, name in enumerate(others.pop("plates")):
                start = f"plate{number}."
                found = {k.removeprefix(start): v for k, v in arrays.items() if k.startswith(start)}
                found = {"force": found.pop("force"), **found}  # T is that of the force
                shapes = {each: (4, 3) if each == "corners" else (0, 3) for each in found}
                check_arrays(found, shapes, Path(path), may_lack=found)
                plates.append(Plate(name, **found))
            events = tuple(Event(*each) for each in others.pop("events"))
            markers = {"markers": arrays["markers"]}
            shape = (0, len(others["names"]), 3)
            check_arrays(markers, {"markers": shape}, Path(path), may_lack=markers)
            if not (others["marker_rate"] > 0 and others["force_rate"] >= 0):
                raise ValueError("its rates are not positive")
            return cls(**markers, plates=tuple(plates), events=events, **others)
        except (KeyError, TypeError, ValueError) as error:
            raise edited(Path(path), error) from None


@dataclass(frozen=True)
class FootForces:
    """Ground reaction on each foot, right first, in the project's axes; T samples.

    Attributes
    ----------
    rate : Hz.  start : s, time of the first sample.
    force : (T, 2, 3) N on the foot; zero where it is in the air.
    centre_of_pressure : (T, 2, 3) m; NaN where it is in the air.
    free_moment : (T, 2, 3) Nm about the centre of pressure.
    valid : (T, 2) False where the plates do not measure this foot's force: it is beside the plates
        or on the other foot's plate, or both feet are on one plate.
    """

    rate: float
    start: float
    force: Array
    centre_of_pressure: Array
    free_moment: Array
    valid: NDArray[np.bool_]

    @property
    def time(self) -> Array:
        """(T,) s, of the samples."""
        return self.start + np.arange(len(self.force)) / self.rate
