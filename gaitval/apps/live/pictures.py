"""What the page draws: the body once, and of each moment where its segments are."""

import struct
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.apps.live.doing import LARGEST_PUSH
from gaitval.apps.live.person import LivePerson
from gaitval.apps.live.session import LiveSession, PageUpdate
from gaitval.apps.live.walk import LiveWalk
from gaitval.model.body import SEGMENTS
from gaitval.model.devices.device import devices_of
from gaitval.model.devices.drawn import shapes
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import segment_frames
from gaitval.prediction.speed import trials_known
from gaitval.reporting.replay import body_of

ARROW: Final = 0.6
"""m in the picture that a force of the ground of one body weight is long, as in the replay."""
NUMBERS: Final = (
    "step",
    "time",
    "phase",
    "speed",
    "cycles",
    "down",
    "rate",
    "pushes",
    "over",
    "worn",
)
"""Of a message, in front of its vectors."""


def scene_of(person: LivePerson, walk: LiveWalk, *, replay: bool) -> dict[str, Any]:
    """What the page needs to know once, as JSON values: the body as the replay of a report draws it
    (`reporting.replay`), the shapes of devices in the frame of their segment, and what can be
    changed between which bounds.
    """
    worn = devices_of({"devices": list(walk.devices)}, "devices") if walk.devices else ()
    nominal = nominal_parameters()
    return {
        "subject": person.subject.identifier,
        "devices": [str(each["name"]).replace("_", " ") for each in walk.devices],
        "recorded": sorted(trial.walking_speed_m_s for trial in trials_known(person.subject)),
        "replay": replay,
        "weight": walk.weight,
        "arrow": ARROW,
        "largest_push": LARGEST_PUSH,
        "speed": {
            "lowest": walk.blend.slowest,
            "highest": walk.blend.fastest,
        },
        "parameters": [
            {
                "name": name,
                "lowest": float(low),
                "highest": float(high),
                "nominal": float(middle),
            }
            for name, low, high, middle in zip(
                PARAMETERS, walk.lower, walk.upper, nominal, strict=True
            )
        ],
        "segments": list(SEGMENTS),
        "numbers": list(NUMBERS),
        "body": body_of(person.body),
        "shapes": shapes(person.body, worn),
    }


def message_of(shown: PageUpdate, session: LiveSession) -> bytes:
    """A moment as the page reads it: the number of bytes that follow (32 bits), then
    little-endian doubles: `NUMBERS`, (14,) body parameters as wanted, (2,) N of the last push,
    (2, 3) body weights and (2, 2) m of the ground's force and its centre, (14, 3) m and (14, 4)
    origins and quaternions (x, y, z, w) of the segments, all in the world.
    """
    seen, walk = shown.seen, session.walk
    replay = session.replay
    numbers = [
        *(seen.step, seen.time, seen.phase, seen.speed, seen.cycles),
        *(float(seen.down), shown.rate, shown.pushes),
        0.0 if replay is None or not replay.over else 1.0 if replay.differs is None else 2.0,
        float(walk.device_on),
    ]
    frames = segment_frames(apply_parameters(walk.body, seen.mu), seen.positions[None])[0]
    quaternion = Rotation.from_matrix(frames[:, :3, :3]).as_quat(canonical=True)
    values = np.concatenate(
        [
            np.array(numbers, dtype=float),
            *(seen.wanted, shown.push, seen.force.ravel() / walk.weight, seen.pressure.ravel()),
            *(frames[:, :3, 3].ravel(), quaternion.ravel()),
        ]
    )
    data = values.astype("<f8").tobytes()
    return struct.pack("<I", len(data)) + data
