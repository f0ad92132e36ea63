"""What the page is sent."""

import json
import struct

import numpy as np

from gaitval.apps.devices.of_subject import tables
from gaitval.apps.live.pictures import NUMBERS, message_of, scene_of
from gaitval.apps.live.session import LiveSession
from gaitval.apps.live.walk import LiveWalk
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import PARAMETERS
from gaitval.model.tree import segment_frames


def test_a_scene_is_json_with_every_segment_and_parameter(person, walk):
    scene = json.loads(json.dumps(scene_of(person, walk, replay=False), allow_nan=False))
    assert scene["recorded"] == sorted(scene["recorded"])  # as the page lists them, m/s
    # the body as the replay of a report draws it; nothing is worn
    assert set(scene["body"]["joints"]) == set(SEGMENTS)
    assert scene["body"]["mass"] == person.body.mass
    assert scene["shapes"] == []
    assert [each["name"] for each in scene["parameters"]] == list(PARAMETERS)
    for each in scene["parameters"]:
        assert each["lowest"] <= each["nominal"] <= each["highest"]
    speed = scene["speed"]
    assert speed["lowest"] < walk.speed < speed["highest"]


def test_a_device_is_seen_on_its_segments(person):
    worn = tables(["backpack", "ankle_exo"])
    fitted = LiveWalk(person, person.speeds[1], worn)
    shapes = json.loads(json.dumps(scene_of(person, fitted, replay=False), allow_nan=False))[
        "shapes"
    ]
    assert {"torso", "shank_r", "shank_l"} <= {shape["segment"] for shape in shapes}


def test_a_message_has_the_poses_of_the_walk(person, walk):
    for _ in range(100):
        walk.act()
    session = LiveSession(walk)
    data = message_of(session.shown, session)
    (size,) = struct.unpack("<I", data[:4])
    values = np.frombuffer(data[4:], dtype="<f8")
    assert size == len(data) - 4 == 8 * len(values)
    ends = np.cumsum([len(NUMBERS), len(PARAMETERS), 2, 6, 4, 3 * len(SEGMENTS), 4 * len(SEGMENTS)])
    assert ends[-1] == len(values)
    numbers, mu, push, force, pressure, origin, quaternion = np.split(values, ends[:-1])
    assert dict(zip(NUMBERS, numbers, strict=True))["step"] == 100
    np.testing.assert_array_equal(mu, walk.mu)
    assert not push.any()
    frames = segment_frames(person.body, walk.see().positions[None])[0]
    np.testing.assert_allclose(origin.reshape(-1, 3), frames[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(quaternion.reshape(-1, 4), axis=1), 1.0)
    loaded = force.reshape(2, 3)[:, 2] > 0.1
    feet = [SEGMENTS.index(name) for name in ("foot_r", "foot_l")]
    off = pressure.reshape(2, 2) - frames[feet][:, :2, 3]
    # Under a foot: from a heel behind the ankle to the toes.
    assert np.all(np.hypot(*off[loaded].T) < 0.25)
    assert 0.3 < force.reshape(2, 3)[:, 2].sum() < 2.0
