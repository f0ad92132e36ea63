"""Gait events that a C3D file stores."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

from gaitval.coordinates import Side
from gaitval.mocap.c3d_contents import Contents, continued, labels_of
from gaitval.mocap.recording import Event, EventKind
from gaitval.mocap.repairs import passed_over

SAME_EVENT_S: Final = 0.2
"""Events of the same side and kind that are closer than this are one event, s; half a running step
takes longer."""

_SIDES: Final[dict[str, Side]] = {
    **dict.fromkeys(("left", "links", "gauche", "izquierda", "izquierdo"), "left"),
    **dict.fromkeys(("esquerda", "esquerdo", "sinistra", "sinistro", "l"), "left"),
    **dict.fromkeys(("right", "rechts", "droite", "droit", "derecha", "derecho"), "right"),
    **dict.fromkeys(("direita", "direito", "destra", "destro", "r"), "right"),
}
_STRIKES: Final = (
    *("hs", "fs", "ic", "fc", "on", "heelstrike", "heelcontact", "footstrike", "footcontact"),
    *("footon", "initialcontact"),
)
_OFFS: Final = ("to", "fo", "off", "toeoff", "footoff")


def _words(text: str) -> list[str]:
    """Words of a label: `R-HS` and `R HS` are the same, and so is `HeelStrikeRight` in three."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])|[^A-Za-z]+", " ", text).lower().split()


def _event(label: str, context: str) -> tuple[Side | None, EventKind, bool] | None:
    """Side (None where nothing says it) and kind of an event, and whether it is a plate's contact;
    None for other events.
    """
    words = _words(label)
    # Lt, Rt, Linker, … begin with the letter.
    side = next((_SIDES.get(of, _SIDES.get(of[0])) for of in _words(context)[:1]), None)
    if words and words[-1] in _SIDES:
        side = _SIDES[words.pop()]
    plain = "".join(words)
    # Ordered with the longest prefixes first: `left` also begins with `l`.
    for prefix, found in _SIDES.items():
        rest = plain.removeprefix(prefix)
        if rest != plain and rest in _STRIKES + _OFFS:
            plain, side = rest, found
            break
    if plain not in _STRIKES + _OFFS:
        return None
    return side, "heel_strike" if plain in _STRIKES else "toe_off", plain in ("on", "off")


def stored_events(
    path: Path, contents: Contents, start: float, duration: float
) -> tuple[Event, ...]:
    """Gait events of the `contents` of the file `path` within the recording, which begins at
    `start` and lasts `duration`, s; in order of time, each once.

    Times are on the clock in which the trial's first frame is frame 1, even if the file has been
    cut. Some programs count from the first frame that is kept; this is assumed if no event fits
    otherwise. If a file has an event twice, as a plate contact (ON, OFF) and as a gait event (HS,
    TO), the contact is kept: in WBDS01walkT01.c3d, 6 of 15 RHS are 53 ms before any force.
    """
    labels = labels_of(contents, "EVENT", "LABELS")
    contexts = labels_of(contents, "EVENT", "CONTEXTS")
    times = continued(contents, "EVENT", "TIMES")
    found, no_side = [], dict[str, None]()
    for index, label in enumerate(labels[: len(times) // 2]):
        # CONTEXTS, which has the side, may be shorter than LABELS or missing.
        meaning = _event(label, contexts[index] if index < len(contexts) else "")
        if meaning is None:
            continue
        side, kind, contact = meaning
        if side is None and not contact:  # an ON alone may be that of any device
            no_side[label] = None
        elif side is not None:
            # EVENT:TIMES is an array of 2 by events, minutes and seconds, with the first index
            # fastest.
            seconds = 60.0 * float(times[2 * index]) + float(times[2 * index + 1])
            found.append((Event(seconds, side, kind), contact))
    if no_side:
        passed_over(
            f"{path}: gait events without a side ({', '.join(no_side)}), which are left out. Write "
            "Left or Right into EVENT:CONTEXTS or into the label"
        )
    inside = [pair for pair in found if start - 0.05 <= pair[0].time <= start + duration]
    if start and not inside:
        found = [(replace(event, time=event.time + start), contact) for event, contact in found]
        inside = [pair for pair in found if start - 0.05 <= pair[0].time <= start + duration]
    kept: list[Event] = []
    # Contacts first, so that of two entries for one event the contact is kept.
    for event, _ in sorted(inside, key=lambda pair: (not pair[1], pair[0].time)):
        if not any(
            (event.side, event.kind) == (other.side, other.kind)
            and abs(event.time - other.time) < SAME_EVENT_S
            for other in kept
        ):
            kept.append(event)
    return tuple(sorted(kept, key=lambda event: event.time))
