"""What the user says of force plates: which do not count, and whose foot is on which."""

from collections.abc import Sequence
from dataclasses import replace

from gaitval.coordinates import SIDES, opposite
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording


def with_stated_plates(recording: Recording, stated: Sequence[tuple[str, str]]) -> Recording:
    """A `recording` with its plates as `stated`, a list of names and `request.PlateUse`: with the
    feet that are on them, and without those that do not count.

    Raises RecordError if a plate is not there, or is said to be of either foot alone.
    """
    plates = {plate.name: plate for plate in recording.plates}
    for name, use in stated:
        if name not in plates:
            raise RecordError(
                f"{recording.source}: --plate {name}={use}: there is no such plate; the trial has "
                f"{', '.join(plates) or 'none'}."
            )
        if use in SIDES and (name, opposite(use)) in stated:
            raise RecordError(
                f"--plate {name}=right and --plate {name}=left: a plate is said to be of one foot. "
                "Give one of them, or neither if both feet step on it."
            )
        if use in SIDES:
            plates[name] = replace(plates[name], foot=use)
    kept = [plate for name, plate in plates.items() if (name, "none") not in stated]
    return replace(recording, plates=tuple(kept))
