"""The muscles of a person's legs in an OpenSim model, with polynomial paths (OpenSim 4.6).

The paths are those of `kinetics.musculature.own_coordinates`: OpenSim then has our lengths, and our
arms as their derivatives, without surfaces to wrap around. The model draws no muscles, for a
polynomial has no place. OpenSim's tools that need lines of action (joint reaction forces) do not
see where such a muscle attaches; `gaitval muscles` writes those forces itself.
"""

from collections.abc import Collection, Mapping
from xml.etree.ElementTree import Element, SubElement

from gaitval.coordinates import SIDES, Side
from gaitval.kinetics.musculature.curves import FASTEST, STRETCHED
from gaitval.kinetics.musculature.forces import FORCES
from gaitval.kinetics.musculature.mapping import sizes
from gaitval.kinetics.musculature.own_coordinates import PlainPath, plain_paths
from gaitval.kinetics.musculature.person import LegMuscles, leg_muscles
from gaitval.model.body import BodyModel

_JOINT = {
    "hip_flexion": "hip",
    "hip_adduction": "hip",
    "hip_rotation": "hip",
    "knee_angle": "knee",
    "ankle_angle": "ankle",
    "subtalar_angle": "ankle",
}


def add_muscles(
    forces: Element,
    model: BodyModel,
    *,
    height: float,
    lost: Mapping[Side, Collection[str]] | None = None,
) -> None:
    """Add the muscles of both legs to the objects of a ForceSet, `forces`."""
    for side in SIDES:
        own = sizes(model, side[0])
        gone = () if lost is None else lost.get(side, ())
        muscles = leg_muscles(own, mass=model.mass, height=height, lost=gone)
        paths = plain_paths(own.factors)
        for number, path in enumerate(paths):
            if muscles.present[number]:
                _muscle(forces, muscles, number, path, side[0])


def _muscle(forces: Element, of: LegMuscles, i: int, path: PlainPath, side: str) -> None:
    muscle = SubElement(forces, "Millard2012EquilibriumMuscle", name=f"{of.names[i]}_{side}")
    shape = SubElement(muscle, "FunctionBasedPath", name="path")
    SubElement(shape, "coordinate_paths").text = " ".join(
        f"/jointset/{_JOINT[name]}_{side}/{name}_{side}" for name in path.coordinates
    )
    function = SubElement(SubElement(shape, "length_function"), "MultivariatePolynomialFunction")
    SubElement(function, "coefficients").text = " ".join(
        repr(float(each)) for each in path.coefficients
    )
    SubElement(function, "dimension").text = str(len(path.coordinates))
    SubElement(function, "order").text = str(path.order)
    for tag, value in (
        ("max_isometric_force", of.max_force[i]),
        ("optimal_fiber_length", of.optimal_fibre[i]),
        ("tendon_slack_length", of.tendon_slack[i]),
        ("pennation_angle_at_optimal", of.pennation[i]),
        ("max_contraction_velocity", FASTEST),
        ("activation_time_constant", FORCES.rise),
        ("deactivation_time_constant", FORCES.fall),
    ):
        SubElement(muscle, tag).text = repr(float(value))
    SubElement(muscle, "ignore_tendon_compliance").text = "false" if of.elastic[i] else "true"
    passive = SubElement(muscle, "FiberForceLengthCurve", name="FiberForceLengthCurve")
    SubElement(passive, "strain_at_zero_force").text = repr(float(of.passive_from[i]))
    SubElement(passive, "strain_at_one_norm_force").text = repr(float(of.passive_to[i]))
    tendon = SubElement(muscle, "TendonForceLengthCurve", name="TendonForceLengthCurve")
    SubElement(tendon, "strain_at_one_norm_force").text = repr(STRETCHED)
