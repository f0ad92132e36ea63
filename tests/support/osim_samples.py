"""Small models in OpenSim's own words, in the forms of its versions 3 and 4."""

SPLINE = "<SimmSpline{name}><x>-1 -0.3 0.2 0.9 1.4</x><y>0.01 0.04 -0.02 0.03 0.05</y></SimmSpline>"
FUNCTIONS = {
    "none": "",
    "empty": "<function/>",
    "constant": "<Constant{name}><value>0.03</value></Constant>",
    "linear": "<LinearFunction{name}><coefficients>-1 0.02</coefficients></LinearFunction>",
    "half": "<LinearFunction{name}><coefficients>0.5 0.02</coefficients></LinearFunction>",
    "polynomial": "<PolynomialFunction{name}><coefficients>0.1 -0.2 0.3 0.01</coefficients>"
    "</PolynomialFunction>",
    "spline": SPLINE,
    "three points": "<SimmSpline{name}><x>-1 0.2 1</x><y>0 0.1 0.05</y></SimmSpline>",
    "two points": "<SimmSpline{name}><x>-1 1</x><y>0 0.1</y></SimmSpline>",
    "multiplier": "<MultiplierFunction{name}><function>" + SPLINE.format(name="")
    + "</function><scale>1.7</scale></MultiplierFunction>",
    "pieces": "<PiecewiseLinearFunction{name}><x>-1 0 1</x><y>0 0.1 0.05</y>"
    "</PiecewiseLinearFunction>",
    "natural": "<NaturalCubicSpline{name}><x>-1 -0.3 0.2 0.9</x><y>0 0.1 0.05 0.2</y>"
    "</NaturalCubicSpline>",
}  # fmt: skip
"""Functions of a joint, with a place for the name that the version wants."""


def version_4(function: str = "spline", *, extra: str = "", joints: str = "") -> str:
    """A thigh and a shank on a pelvis; the knee slides by a function; a patella follows."""
    of_axis = FUNCTIONS[function].format(name=' name="function"')
    return f"""<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40000"><Model name="sample">{extra}
<BodySet name="bodyset"><objects>
{_body("pelvis", 11.0)}{_body("femur_r", 9.0)}{_body("tibia_r", 3.5)}{_body("patella_r", 0.1)}
</objects></BodySet>
<JointSet name="jointset"><objects>
<FreeJoint name="ground_pelvis">{_sockets("/ground", "/bodyset/pelvis")}
<coordinates>{"".join(f'<Coordinate name="q{i}"/>' for i in range(6))}</coordinates></FreeJoint>
<CustomJoint name="hip_r">{_sockets("offset_a", "offset_b")}
<coordinates>{"".join(f'<Coordinate name="{n}"/>' for n in ("hip_flexion_r", "hip_rotation_r"))}
</coordinates><frames>{_frame("offset_a", "/bodyset/pelvis", "-0.05 -0.08 0.09", "0.1 0.2 0.3")}
{_frame("offset_b", "/bodyset/femur_r", "0.01 0.02 0.03", "-0.2 0.1 0")}</frames>
<SpatialTransform>
{_axis("rotation1", "hip_flexion_r", "0 0 2", "<LinearFunction name='function'/>")}
{_axis("rotation2", "", "1 0 0", "<Constant name='function'><value>0.2</value></Constant>")}
{_axis("rotation3", "hip_rotation_r", "0.1 1 0.2", "<LinearFunction name='function'/>")}
</SpatialTransform></CustomJoint>
<CustomJoint name="knee_r">{_sockets("offset_c", "/bodyset/tibia_r")}
<coordinates><Coordinate name="knee_angle_r"><range>-0.2 2</range></Coordinate></coordinates>
<frames>{_frame("offset_c", "/bodyset/femur_r", "0 -0.4 0", "0 0 0")}</frames>
<SpatialTransform>
{_axis("rotation1", "knee_angle_r", "0 0 -1", "<LinearFunction name='function'/>")}
{_axis("rotation2", "", "0 1 0", "<Constant name='function'><value>0</value></Constant>")}
{_axis("rotation3", "", "1 0 0", "<Constant name='function'><value>0</value></Constant>")}
{_axis("translation1", "knee_angle_r", "1 0 0", of_axis)}
{_axis("translation2", "knee_angle_r", "0 1 0.1", of_axis)}
</SpatialTransform></CustomJoint>
<PinJoint name="patella_r">{_sockets("offset_d", "/bodyset/patella_r")}
<coordinates><Coordinate name="beta_r"/></coordinates>
<frames>{_frame("offset_d", "/bodyset/femur_r", "0.05 -0.4 0", "0.3 0 0")}</frames></PinJoint>
{joints}</objects></JointSet>
<ConstraintSet name="constraintset"><objects><CoordinateCouplerConstraint name="patella">
<coupled_coordinates_function>{SPLINE.format(name="")}</coupled_coordinates_function>
<independent_coordinate_names>knee_angle_r</independent_coordinate_names>
<dependent_coordinate_name>beta_r</dependent_coordinate_name>
</CoordinateCouplerConstraint></objects></ConstraintSet>
<MarkerSet name="markerset"><objects>
<Marker name="on_shank"><socket_parent_frame>/bodyset/tibia_r</socket_parent_frame>
<location>0.04 -0.2 0.05</location></Marker>
</objects></MarkerSet>
</Model></OpenSimDocument>"""


def version_3(function: str = "spline", *, reverse: bool = False) -> str:
    """The thigh and the shank in the words of OpenSim 3."""
    of_axis = f"<function>{FUNCTIONS[function].format(name='')}</function>"
    straight = (
        "<function><LinearFunction><coefficients>1 0</coefficients></LinearFunction></function>"
    )
    free = "".join(
        _axis(f"{kind}{i + 1}", f"q{3 * (kind == 'translation') + i}", axis, straight)
        for kind in ("rotation", "translation")
        for i, axis in enumerate(("1 0 0", "0 1 0", "0 0 1"))
    )
    rest = "".join(
        _axis(place, "", axis, "<function><Constant><value>0</value></Constant></function>")
        for place, axis in (
            ("rotation2", "0 1 0"),
            ("rotation3", "1 0 0"),
            ("translation2", "0 1 0"),
            ("translation3", "0 0 1"),
        )
    )
    return f"""<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="30000"><Model name="sample">
<BodySet><objects><Body name="ground"><mass>0</mass><mass_center>0 0 0</mass_center></Body>
{_body_3("femur_r", _custom_3("free", "ground", [f"q{i}" for i in range(6)], free))}
{
        _body_3(
            "tibia_r",
            _custom_3(
                "knee_r",
                "femur_r",
                ["knee_angle_r"],
                _axis("rotation1", "knee_angle_r", "0 0 1", straight)
                + _axis("translation1", "knee_angle_r", "1 0 0", of_axis)
                + rest,
                reverse=reverse,
            ),
        )
    }
</objects></BodySet>
<MarkerSet><objects><Marker name="on_shank"><body>tibia_r</body>
<location>0.04 -0.2 0.05</location></Marker></objects></MarkerSet>
</Model></OpenSimDocument>"""


SIMPLE_JOINTS = {
    "WeldJoint": 0, "PinJoint": 1, "SliderJoint": 1, "UniversalJoint": 2, "GimbalJoint": 3,
    "BallJoint": 3, "PlanarJoint": 3, "FreeJoint": 6,
}  # fmt: skip
"""Joints and the number of their coordinates."""


def with_joint(kind: str) -> str:
    """The sample with one more body, on the shank by a joint of a kind."""
    coordinates = "".join(f'<Coordinate name="x{i}"/>' for i in range(SIMPLE_JOINTS[kind]))
    joint = f"""<{kind} name="more">{_sockets("offset_e", "offset_f")}
<coordinates>{coordinates}</coordinates>
<frames>{_frame("offset_e", "/bodyset/tibia_r", "0 -0.4 0.1", "0.1 -0.3 0.2")}
{_frame("offset_f", "/bodyset/calcn_r", "0.02 0.03 0", "0 0.4 0")}</frames></{kind}>"""
    model = version_4(joints=joint)
    return model.replace("</objects></BodySet>", _body("calcn_r", 1.0) + "</objects></BodySet>")


def _body(name: str, mass: float) -> str:
    return (
        f'<Body name="{name}"><mass>{mass}</mass><mass_center>0 -0.1 0.01</mass_center>'
        "<inertia>0.1 0.02 0.11 0 0.001 0</inertia></Body>"
    )


def _body_3(name: str, joint: str) -> str:
    return (
        f'<Body name="{name}"><mass>5</mass><mass_center>0 -0.1 0.01</mass_center>'
        "<inertia_xx>0.1</inertia_xx><inertia_yy>0.02</inertia_yy><inertia_zz>0.11</inertia_zz>"
        "<inertia_xy>0</inertia_xy><inertia_xz>0.001</inertia_xz><inertia_yz>0</inertia_yz>"
        f"<Joint>{joint}</Joint></Body>"
    )


def _custom_3(
    name: str, parent: str, coordinates: list[str], axes: str, *, reverse: bool = False
) -> str:
    inside = "".join(f'<Coordinate name="{each}"/>' for each in coordinates)
    return (
        f'<CustomJoint name="{name}"><parent_body>{parent}</parent_body>'
        "<location_in_parent>0.01 -0.4 0.02</location_in_parent>"
        "<orientation_in_parent>0.1 0.2 -0.3</orientation_in_parent>"
        "<location>0 0.01 0</location><orientation>0 0.1 0</orientation>"
        f"<CoordinateSet><objects>{inside}</objects></CoordinateSet>"
        f"<reverse>{str(reverse).lower()}</reverse>"
        f"<SpatialTransform>{axes}</SpatialTransform></CustomJoint>"
    )


def _sockets(parent: str, child: str) -> str:
    return (
        f"<socket_parent_frame>{parent}</socket_parent_frame>"
        f"<socket_child_frame>{child}</socket_child_frame>"
    )


def _frame(name: str, parent: str, translation: str, orientation: str) -> str:
    return (
        f'<PhysicalOffsetFrame name="{name}"><socket_parent>{parent}</socket_parent>'
        f"<translation>{translation}</translation><orientation>{orientation}</orientation>"
        "</PhysicalOffsetFrame>"
    )


def _axis(place: str, coordinate: str, axis: str, function: str) -> str:
    return (
        f'<TransformAxis name="{place}"><coordinates>{coordinate}</coordinates>'
        f"<axis>{axis}</axis>{function}</TransformAxis>"
    )
