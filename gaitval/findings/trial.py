"""The parts of a worked-out walk that findings look at."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from gaitval.findings import Result, look
from gaitval.findings.laboratory import Laboratory
from gaitval.findings.motion import Balance, Swings
from gaitval.findings.plates import Plates
from gaitval.findings.stances import stances_of
from gaitval.gait.plate_contacts import OUTSIDE
from gaitval.gait.sampling import interpolated
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.mocap.activities import FEET
from gaitval.mocap.foot_markers import pelvis_markers
from gaitval.mocap.recording import Event, FootForces, Recording
from gaitval.mocap.repairs import Repair

Measured = tuple[FootForces, FootForces, InverseDynamics]
"""Forces at their own rate, at the marker frames, and inverse dynamics with these."""


def findings_of_trial(
    recording: Recording,
    landmarks: Mapping[str, str],
    events: Sequence[Event],
    repairs: Sequence[Repair],
    measured: Measured | None,
    *,
    height_m: float,
    mass_kg: float,
    laboratory: Laboratory | None = None,
    aid: str | None = None,
    before: Collection[str] = (),
) -> Result:
    """All findings of a walk but those of its markers, which were made `before`.

    `recording` is cleaned and zeroed, and `landmarks` names its markers; `events` were found;
    `repairs` are of `assign_forces`; `measured` is None without forces. `height_m`, `mass_kg` and
    `aid` (what carries a part of the weight) are the person's.
    """
    parts: list[object] = [Swings(events, height_m, measured is not None), laboratory]
    if measured is not None:
        parts = [*parts, *_of_forces(recording, landmarks, repairs, measured, mass_kg, aid)]
    return look(*(part for part in parts if part is not None), before=before)


def _of_forces(
    recording: Recording,
    landmarks: Mapping[str, str],
    repairs: Sequence[Repair],
    measured: Measured,
    mass_kg: float,
    aid: str | None,
) -> Iterator[object]:
    forces, loads, dynamics = measured
    needed = loads.force.sum(axis=1) + dynamics.residual_force
    if aid is not None:
        # The aid is in none of the balances of force and motion; channels can still be dead.
        yield Plates(recording.plates, recording.force_rate, {}, {})
        return
    frames = (forces.time - recording.start) * recording.marker_rate
    pelvis = interpolated(pelvis_markers(recording, landmarks), frames)
    stances = stances_of(recording, forces, pelvis)
    yield stances
    yield Balance(needed, loads, mass_kg)
    yield Plates(
        recording.plates,
        recording.force_rate,
        Counter(stance.plate for stance in stances.every),
        Counter(
            one.names[0].removeprefix("plate ")
            for one in repairs
            if OUTSIDE in one.action and forefoot_seen(recording, landmarks, one)
        ),
    )


def forefoot_seen(recording: Recording, landmarks: Mapping[str, str], contact: Repair) -> bool:
    """Whether a marker of a forefoot is seen in half of a contact, on the foot that it is of, or on
    either where that is not known: without one, where the foot is does not tell where a centre of
    pressure may be.
    """
    named = [side for side in ("right", "left") if f"{side} foot" in contact.names]
    begin, end = (
        round((at - recording.start) * recording.marker_rate) for at in (contact.start, contact.end)
    )
    for side in named or ["right", "left"]:
        names = [landmarks.get(f"{side[0].upper()}.{at}", "") for at in FEET if at != "Heel"]
        paths = [recording.marker(name) for name in names if name in recording.names]
        seen = [np.isfinite(path[begin : end + 1]).all(axis=1) for path in paths]
        if not seen or np.any(seen, axis=0).mean() < 0.5:
            return False
    return True
