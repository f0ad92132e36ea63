import pytest

from gaitval._internal.io.artefacts import parse_toml
from gaitval.errors import ConfigurationError
from gaitval.model.devices.device import (
    check_together,
    devices_of,
    load_devices,
    shipped_device,
    shipped_names,
)

GOOD = """
[[devices]]
name = "brace"
source = "a test"

[[devices.parts]]
name = "cuff"
segment = "shank"
mass = 0.5

[[devices.hinges]]
joint = "knee_angle"
motor = { torque = 20.0, speed = 10.0, power = 100.0 }
strap = { stiffness = 500.0, damping = 2.0 }
controller = { kind = "phase_spline", bumps = [[0.5, 0.2, 0.2, 15.0]] }
"""


def read(text):
    return devices_of(parse_toml(text, "brace.toml", ConfigurationError), "brace.toml")


def test_every_shipped_device_can_be_read_and_says_where_its_numbers_are_from():
    eight = {"hip_exo", "knee_exo", "ankle_exo", "ankle_spring", "below_knee", "above_knee"}
    assert eight | {"afo", "backpack"} <= set(shipped_names())
    for name in shipped_names():
        (device,) = load_devices(name)
        assert device.name == name
        assert len(device.source) > 20


def test_a_part_on_both_sides_counts_twice_and_one_on_the_trunk_once():
    (device,) = load_devices("hip_exo")
    cuff, belt = 0.7, 2.0
    assert device.mass == pytest.approx(2 * cuff + belt)
    assert load_devices("below_knee")[0].mass == pytest.approx(1.08)


def test_a_name_alone_is_the_shipped_device_and_may_say_how_it_is_worn():
    text = '[[devices]]\nname = "afo"\n'
    (shipped,) = load_devices("afo")
    assert read(text) == (shipped,)
    for side in ("right", "left"):
        (found,) = read(text + f'sides = ["{side}"]')
        assert found == shipped.model_copy(update={"sides": (side,)})


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('name = "jetpack"', "brace.toml: 'jetpack': no such device. Those .* hip_exo"),
        ('name = "hip_exo"\nsides = ["up"]', "sides"),
    ],
)
def test_a_short_table_that_cannot_be_is_refused(text, says):
    with pytest.raises(ConfigurationError, match=says):
        read(f"[[devices]]\n{text}\n")


# What is wrong, and words that the message must have: where it is and how to fix it.
REFUSED = {
    "a joint that is not there": (
        'joint = "knee_angle"',
        'joint = "kneecap"',
        "one of hip_flexion",
    ),
    "torque beyond the motor": ("torque = 20.0", "torque = 10.0", "stronger"),
    "negative mass": ("mass = 0.5", "mass = -0.5", "mass"),
    "a strap on nothing": (
        "motor = { torque = 20.0, speed = 10.0, power = 100.0 }\n",
        "",
        "Add `motor`",
    ),
    "a segment that is not there": ('segment = "shank"', 'segment = "tail"', "one of pelvis"),
    "an unknown key": ("mass = 0.5", "mass = 0.5\nweight = 3", "weight"),
    "no source": ('source = "a test"\n', "", "source: missing"),
    "an infinite stiffness": ("stiffness = 500.0", "stiffness = inf", "strap.stiffness"),
    "a side that is none": ('source = "a test"', 'source = "a"\nsides = ["middle"]', "sides"),
    "a controller that is none": ('kind = "phase_spline"', 'kind = "magic"', "controller"),
    "an inertia of no body": (
        "mass = 0.5",
        "mass = 0.5\ninertia = [1.0, 0.1, 0.1, 0.0, 0.0, 0.0]",
        "principal moments",
    ),
    "millimetres": ("mass = 0.5", "mass = 0.5\ncentre = [120.0, 0.0, 0.0]", "metres"),
    "a mass of text": ("mass = 0.5", 'mass = "much"', "mass"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_with_place_and_remedy(case):
    old, new, words = REFUSED[case]
    assert old in GOOD
    with pytest.raises(ConfigurationError) as refused:
        read(GOOD.replace(old, new, 1))
    message = str(refused.value)
    assert "brace.toml" in message
    assert words in message
    assert "devices.0" in message


def test_a_prosthesis_has_no_strap_and_two_hinges_at_a_joint_are_refused():
    with pytest.raises(ConfigurationError, match="Remove `strap`"):
        read(GOOD.replace('joint = "knee_angle"', 'joint = "knee_angle"\nmuscles = false'))
    second = '\n[[devices.hinges]]\njoint = "knee_angle"\ndamping = 1.0\n'
    with pytest.raises(ConfigurationError, match="more than one hinge at"):
        read(GOOD + second)


def test_an_unknown_name_lists_those_that_there_are():
    with pytest.raises(ConfigurationError, match="hip_exo"):
        load_devices("jetpack")
    with pytest.raises(ConfigurationError, match=r"nowhere\.toml"):
        load_devices("nowhere.toml")


def test_a_file_without_a_device_is_refused():
    with pytest.raises(ConfigurationError, match="devices"):
        read("name = 3\n")


@pytest.mark.parametrize("other", ["below_knee", "above_knee"])
def test_two_prostheses_of_one_leg_are_refused(other):
    fitted = [shipped_device(name) for name in ("below_knee", other)]
    with pytest.raises(ConfigurationError, match=r"both replace .*ankle_angle_r.*shank_r"):
        check_together(fitted)
    check_together([fitted[0], fitted[1].model_copy(update={"sides": ("left",)})])
    check_together([fitted[0], shipped_device("afo")])
