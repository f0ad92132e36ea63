"""The person as files that walk in plain MuJoCo: MJCF, policy, reference, and a script."""

from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from safetensors.numpy import save_file
from scipy.spatial.transform import Rotation

from gaitval._internal.io.artefacts import replacing, write_json, write_text
from gaitval.apps.export.walked import ExportedWalk
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED
from gaitval.errors import PolicyError
from gaitval.metrics.walk_muscles import lost_joints
from gaitval.model.body import PARENTS, BodyModel
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.policy.observation import MIRROR_ORDER, MIRROR_SIGNS
from gaitval.policy.storage import save_policy
from gaitval.walk.contact import cubic, hunt_crossley
from gaitval.walk.reference.motion import END_EFFECTORS
from gaitval.walk.simulation.mujoco_body import mjcf
from gaitval.walk.simulation.mujoco_muscles import muscle_mjcf
from gaitval.walk.simulation.tables import read_row

FILES = (
    *("person.xml", "walker.json", "reference.safetensors"),
    *("policy.safetensors", "policy.json", "walk.py"),
    "person_with_muscles.xml",
)
_ABOUT = """
  Written by gaitval. SI units; x forward, y left, z up. Joint angles: flexion, adduction, internal
  rotation positive on both sides. An actuator's ctrl is the joint's target, rad. Damping has the
  time step times the stiffness added, which makes the joints' springs implicit (see walk.py).
  The contact here is MuJoCo's own; walk.py replaces it by the law the person was validated with.
"""
_MUSCLES = """
  Written by gaitval. SI units; x forward, y left, z up. Muscles of Rajagopal et al. (2016) with the
  changes of Lai et al. (2017) and Uhlrich et al. (2022), of this person's size and strength. Over
  gait, tendons are as long as gaitval's muscles to about a millimetre.
"""
_LIMB = {"torso": 0.08, "thigh": 0.065, "shank": 0.045, "foot": 0.03, "upper_arm": 0.04}
"""m, radius of a limb as drawn; convention."""
_SCENERY = (
    '<visual><headlight ambient="0.6 0.6 0.6" diffuse="0.5 0.5 0.5"/><map force="0.03"/></visual>',
    '<asset><texture name="sky" type="skybox" builtin="flat" rgb1="1 1 1" width="8" height="48"/>'
    '<texture name="tiles" type="2d" builtin="checker" rgb1="0.9 0.9 0.9" rgb2="0.8 0.8 0.8"'
    ' width="300" height="300"/>'
    '<material name="tiles" texture="tiles" texrepeat="1 1" texuniform="true"/></asset>',
)
"""To be looked at: light, sky, tiles on the floor, and how long the arrow of a force is."""
_HEAD = 0.1, 0.2
"""m, radius of the head as drawn, and how high its centre is above the shoulders; convention."""


def write_mujoco(folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write `FILES` into `folder`; returns their paths. Raises ArtefactError, and PolicyError for a
    policy that feels its body late.
    """
    if not walked.environment.senses.immediate:
        raise PolicyError(
            f"{walked.stored.folder}: this policy feels its body late, with noise, or is told its "
            "past actions (environment.observation_delays, observation_noise, action_memory), "
            "which walk.py of the MuJoCo folder does not do. Export another run."
        )
    write_text(folder / "person.xml", person_xml(walked))
    write_text(folder / "person_with_muscles.xml", muscle_xml(walked))
    write_json(folder / "walker.json", _numbers(walked))
    targets, walker = walked.environment.yardstick.targets, walked.environment.walker
    tables = {
        "positions": targets.positions,
        "velocities": targets.velocities,
        "feed_forward": walker.tables.moments,
        "end_effectors": targets.end_effectors,
        "ground_reaction": targets.ground_reaction,
        "action_bias": walked.environment.habits(),
    }
    with replacing(folder / "reference.safetensors") as temporary:
        save_file({name: np.ascontiguousarray(each) for name, each in tables.items()}, temporary)
    save_policy(walked.stored.network, folder)
    write_text(
        folder / "walk.py", files("gaitval.apps.export").joinpath("walk.py").read_text("utf-8")
    )
    return [folder / name for name in FILES]


def _started(walked: ExportedWalk) -> None:
    """Body parameters, height and observed parameters of the validated walk, at phase 0."""
    options = {"phase": 0.0, "mu": walked.mu, "push": None, "noise": 0.0}
    walked.environment.reset(seed=0, options=options)


def person_xml(walked: ExportedWalk) -> str:
    """The body as MJCF: servos as joint springs and actuators, feet on MuJoCo's own contact, limbs
    to look at, and the start of the walk as a keyframe.
    """
    _started(walked)
    body = walked.environment.walker.body
    option = f'timestep="{body.physics_step!r}" integrator="Euler"'
    root = ElementTree.fromstring(mjcf(walked.body, option=option, floor=True))
    root.set("model", walked.stored.subject.identifier)
    root.insert(0, ElementTree.Comment(_ABOUT))
    free = root.find(".//freejoint")
    floor = root.find("./worldbody/geom")
    assert free is not None
    assert floor is not None
    free.set("name", "root")
    floor.set("name", "floor")
    floor.set("material", "tiles")
    for number, part in enumerate(_SCENERY, 1):
        root.insert(number, ElementTree.fromstring(part))
    floor.set("friction", f"{walked.friction!r} 0.005 0.0001")
    _joints(root, body.stiffness, body.total_damping + body.physics_step * body.stiffness)
    _spheres(root, walked.body, walked.friction)
    _limbs(root, walked.body)
    actuators = ElementTree.SubElement(root, "actuator")
    for name, stiffness in zip(ACTUATED, body.stiffness.tolist(), strict=True):
        ElementTree.SubElement(actuators, "general", name=name, joint=name, gainprm=repr(stiffness))
    _keyframe(root, walked)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def muscle_xml(walked: ExportedWalk) -> str:
    """The same person with the muscles of the legs in the servos' place, as MJCF: 80 tendons and
    muscle actuators, whose ctrl is excitation, 0 to 1. Trunk, arms and toes are limp.
    """
    subject = walked.stored.subject
    person, _ = walked.person
    root = muscle_mjcf(
        walked.body, height=subject.height_m, lost=lost_joints(subject), person=person
    )
    root.set("model", f"{subject.identifier} with muscles")
    root.insert(0, ElementTree.Comment(_MUSCLES))
    _limbs(root, walked.body)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _joints(root: ElementTree.Element, stiffness: Array, damping: Array) -> None:
    for joint in root.iter("joint"):
        name = joint.attrib["name"]
        place = ACTUATED.index(name)
        joint.set("stiffness", repr(float(stiffness[place])))
        joint.set("damping", repr(float(damping[place])))
        # To be seen in viewers; a walk stays within, and a limit would be a force of its own.
        joint.set("range", " ".join(map(repr, map(float, MEASURED_RANGES[name]))))
        joint.set("limited", "false")


def _spheres(root: ElementTree.Element, model: BodyModel, friction: float) -> None:
    for sphere in model.spheres:
        named = root.findall(f".//body[@name='{sphere.segment}']/geom[@type='sphere']")
        geom = next(each for each in named if "name" not in each.attrib)
        geom.set("name", sphere.name)
        geom.set("friction", f"{friction!r} 0.005 0.0001")


def _limbs(root: ElementTree.Element, model: BodyModel) -> None:
    """Capsules from joint to joint, and a head; they touch nothing and weigh nothing."""
    for segment in model.segments:
        body = root.find(f".//body[@name='{segment.name}']")
        assert body is not None
        ends = [s.joint_position for s in model.segments if PARENTS.get(s.name) == segment.name]
        for number, end in enumerate(ends or [2.0 * segment.centre_of_mass]):
            radius = repr(_LIMB.get(segment.kind, 0.03))
            line = _text([0.0, 0.0, 0.0, *end])
            _drawn(body, f"{segment.name}_{number}", type="capsule", fromto=line, size=radius)
        if segment.name == "torso":
            middle = np.mean(ends, axis=0)
            place = _text([*middle[:2], middle[2] + _HEAD[1]])
            _drawn(body, "head", type="sphere", pos=place, size=repr(_HEAD[0]))


def _drawn(body: ElementTree.Element, name: str, **shape: str) -> None:
    looks = {"contype": "0", "conaffinity": "0", "group": "1", "rgba": "0.85 0.75 0.6 1"}
    ElementTree.SubElement(body, "geom", {"name": name, **looks, **shape})


def _text(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in numbers)


def _keyframe(root: ElementTree.Element, walked: ExportedWalk) -> None:
    walker = walked.environment.walker
    q, rates = walker.state
    turn = Rotation.from_rotvec(q[:3])
    places = [*q[3:6], *turn.as_quat(scalar_first=True), *q[6:]]
    speeds = [*rates[3:6], *turn.inv().apply(rates[:3]), *rates[6:]]
    angle, rate, moment = (np.empty(len(ACTUATED)) for _ in range(3))
    for table, row in zip(walker.tables, (angle, rate, moment), strict=True):
        read_row(table, 0.0, row)
    body = walker.body
    target = angle + (body.damping * rate + moment) / body.stiffness
    # MJCF has the joints in the order of the bodies.
    order = [ACTUATED.index(joint.attrib["name"]) for joint in root.iter("joint")]
    places[7:], speeds[6:] = (np.array(each)[order] for each in (places[7:], speeds[6:]))
    key = ElementTree.SubElement(ElementTree.SubElement(root, "keyframe"), "key", name="start")
    for name, values in (("qpos", places), ("qvel", speeds), ("ctrl", target)):
        key.set(name, _text(values))


def _numbers(walked: ExportedWalk) -> dict[str, object]:
    """What `walk.py` reads beside the model and the tables."""
    _started(walked)
    environment, walker = walked.environment, walked.environment.walker
    constants, yardstick = environment.constants, environment.yardstick
    contact = walked.stored.configuration.contact
    numbers = dict(walker.law._asdict())  # type: ignore[attr-defined]  # a law is a named tuple
    if contact.law == "cubic":
        numbers["slowest"] = cubic.SLOWEST
    else:
        numbers |= {
            "smoothing": hunt_crossley.SMOOTHING,
            "penetration_slope": hunt_crossley.PENETRATION_SLOPE,
            "rate_slope": hunt_crossley.RATE_SLOPE,
            "faded": hunt_crossley.FADED,
        }
    return {
        "subject": walked.stored.subject.identifier,
        "law": contact.law,
        "law_numbers": numbers,
        "lag": walker.lag.tolist(),
        "spheres": [sphere.name for sphere in walked.body.spheres],
        "coordinates": list(ACTUATED),
        "end_effectors": list(END_EFFECTORS),
        "stiffness": walker.body.stiffness.tolist(),
        "damping": walker.body.damping.tolist(),
        "total_damping": walker.body.total_damping.tolist(),
        "phase_step": walker.body.phase_step,
        "steps_per_action": walker.steps_per_action,
        "stride_length": yardstick.targets.stride_length,
        "speed": yardstick.targets.speed,
        "lift": environment.lift,
        "weight": yardstick.weight,
        "tolerances": yardstick.tolerances.tolist(),
        "extended": yardstick.extended,
        "mirrors": yardstick.mirrors,
        "mirror_order": MIRROR_ORDER.tolist(),
        "mirror_signs": MIRROR_SIGNS.tolist(),
        "parameters": environment.episode.parameters.tolist(),
        "shares": environment.shares.tolist(),
        "action_scale": constants.action_scale,
        "action_limit": constants.action_limit,
        "entering": environment.entering,
        "pace_scale": constants.pace_scale,
    }
