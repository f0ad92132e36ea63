"""The person with muscles in MuJoCo: tendons of the legs and muscle actuators.

Tendons run straight from site to site (`kinetics.musculature.strands`), as long as our muscles to
the millimetre over gait. MuJoCo's muscles are simpler than ours: its own curves of force over
length and velocity, and tendons that do not stretch. They have our strength, fibre lengths and
slack lengths.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final
from xml.etree import ElementTree

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ModelError
from gaitval.kinetics.musculature.curves import FASTEST, passive_length
from gaitval.kinetics.musculature.forces import FORCES
from gaitval.kinetics.musculature.mapping import sizes
from gaitval.kinetics.musculature.person import LegMuscles, leg_muscles
from gaitval.kinetics.musculature.strands import SEGMENTS, Tendon, own_tendons
from gaitval.model.body import BodyModel
from gaitval.walk.simulation.mujoco_body import mjcf


@dataclass(frozen=True)
class MuscleSettings:
    """MuJoCo's muscles where they differ from the model's."""

    short: float = 0.5
    long: float = 1.5
    """Optimal fibre lengths between which MuJoCo is told a muscle's length."""
    works: tuple[float, float] = (0.44, 1.6)
    """Of the optimal fibre length: where MuJoCo's muscles have active force, about as Millard's."""
    eccentric: float = 1.4
    damping: float = 1.0
    armature: float = 0.01
    toes: float = 25.0
    """Nms/rad and kg m² of every joint, and Nm/rad of the toes, so that limp limbs can be
    integrated; convention."""


MUSCLES: Final = MuscleSettings()

OPTION: Final = 'timestep="0.001" integrator="implicitfast"'
_COLOUR: Final = "0.75 0.15 0.12 1"


def muscle_mjcf(
    model: BodyModel,
    *,
    height: float,
    lost: Mapping[Side, Collection[str]] | None = None,
    option: str = OPTION,
    person: BodyModel | None = None,
) -> ElementTree.Element:
    """The body `model` as MJCF, with a floor, the feet's spheres and the muscles of both legs, of a
    person of `height` m; `lost` are coordinates of joints that a prosthesis has. `option` has
    attributes of MuJoCo's <option>. `person` is the own body of whoever wears a load in `model`:
    the muscles are theirs.
    """
    root = ElementTree.fromstring(mjcf(model, option=option, floor=True))
    for joint in root.iter("joint"):
        joint.set("damping", repr(MUSCLES.damping))
        joint.set("armature", repr(MUSCLES.armature))
        if joint.attrib["name"].startswith("mtp_angle"):
            joint.set("stiffness", repr(MUSCLES.toes))
    every = ElementTree.SubElement(root, "tendon")
    actuators = ElementTree.SubElement(root, "actuator")
    for side in SIDES:
        own = sizes(person or model, side[0])
        gone = () if lost is None else lost.get(side, ())
        muscles = leg_muscles(own, mass=(person or model).mass, height=height, lost=gone)
        bodies = _bodies(root, side[0])
        hip = model[f"thigh_{side[0]}"].joint_position
        tendons = own_tendons(own.factors)
        for i, name in enumerate(muscles.names):
            if muscles.present[i]:
                _tendon(every, bodies, tendons[name], f"{name}_{side[0]}", hip)
                _actuator(actuators, muscles, i, f"{name}_{side[0]}")
    return root


def _bodies(root: ElementTree.Element, side: str) -> dict[str, ElementTree.Element]:
    found = {}
    for segment in SEGMENTS:
        name = segment if segment == "pelvis" else f"{segment}_{side}"
        body = root.find(f".//body[@name='{name}']")
        if body is None:
            raise ModelError(f"The body has no segment {name}, to which muscles of the leg attach.")
        found[segment] = body
    return found


def _tendon(
    every: ElementTree.Element,
    bodies: Mapping[str, ElementTree.Element],
    tendon: Tendon,
    name: str,
    hip: Array,
) -> None:
    spatial = ElementTree.SubElement(every, "spatial", name=name, width="0.003", rgba=_COLOUR)
    mirror = np.array([1.0, 1.0 if name.endswith("_r") else -1.0, 1.0])

    def site(segment: str, place: Array, label: str) -> None:
        where = " ".join(repr(float(each)) for each in place)
        ElementTree.SubElement(
            bodies[segment], "site", name=label, pos=where, size="0.004", group="4"
        )
        ElementTree.SubElement(spatial, "site", site=label)

    for number, strand in enumerate(tendon.strands):
        if len(tendon.strands) > 1:
            ElementTree.SubElement(spatial, "pulley", divisor=str(len(tendon.strands)))
        for at, (segment, place) in enumerate(strand):
            own = mirror * np.asarray(place)
            if segment == "pelvis":
                own = own + hip
            site(segment, own, f"{name}_{number}_{at}")
    # What no straight strand has of the length lies on the pelvis, where nothing moves it.
    if (more := tendon.more) > 0.0:
        ElementTree.SubElement(spatial, "pulley", divisor="1")
        site("pelvis", hip, f"{name}_more_0")
        site("pelvis", hip + np.array([0.0, 0.0, more]), f"{name}_more_1")


def _actuator(actuators: ElementTree.Element, of: LegMuscles, i: int, name: str) -> None:
    fibre = float(of.optimal_fibre[i] * np.cos(of.pennation[i]))
    low, high = (
        float(of.tendon_slack[i] + share * fibre) for share in (MUSCLES.short, MUSCLES.long)
    )
    longest = np.array([MUSCLES.works[1]])
    passive = float(
        passive_length(longest, of.passive_from[i : i + 1], of.passive_to[i : i + 1])[0]
    )
    force = float(of.max_force[i] * np.cos(of.pennation[i]))
    numbers = (
        MUSCLES.short,
        MUSCLES.long,
        force,
        1.0,
        *MUSCLES.works,
        FASTEST,
        passive,
        MUSCLES.eccentric,
    )
    values = " ".join(repr(float(each)) for each in numbers)
    ElementTree.SubElement(
        actuators, "general", name=name, tendon=name, ctrllimited="true", ctrlrange="0 1",
        lengthrange=f"{low!r} {high!r}", dyntype="muscle", gaintype="muscle", biastype="muscle",
        dynprm=f"{FORCES.rise!r} {FORCES.fall!r}", gainprm=values, biasprm=values,
    )  # fmt: skip
