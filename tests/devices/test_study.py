"""A person without and with devices: figures, curves, page, table."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from html_page import only_html
from made_curves import made_curves
from seen_figures import figure_of, legend, lines

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.devices import study
from gaitval.apps.devices.curves import JOINTS
from gaitval.apps.devices.page import (
    LINES,
    OF_DEVICE,
    ROWS,
    _device_figure,
    _figure,
    _force_figure,
    write_report,
)
from gaitval.apps.devices.results import MARGINS, TITLES, DeviceResult, figures_of
from gaitval.apps.devices.study import DeviceOutcome, Wearer, outcomes, wearer
from gaitval.cli.device import device
from gaitval.coordinates import SIDES
from gaitval.errors import ConfigurationError, SubjectError
from gaitval.model.devices.device import load_devices
from gaitval.subjects.subject_file import load_subject


@pytest.fixture(scope="module")
def who(person):
    return Wearer("S05", person.task, person.policy, person.mu, origin="5", height=1.75)


@pytest.fixture(scope="module")
def found(who):
    return outcomes(who, load_devices("ankle_spring"), cycles=8.0)


def test_figures_have_both_ends_of_a_curve():
    curves = made_curves()
    curves.own["knee_angle", "left"][:3] = -0.7, 0.2, 0.9
    curves.own["knee_angle", "left"][3:] = 0.0
    figures = figures_of(DeviceOutcome(None, curves, 5.0, False), "left")
    assert figures["knee: highest moment of the muscles (Nm/kg)"] == pytest.approx(0.9)
    assert figures["knee: lowest moment of the muscles (Nm/kg)"] == pytest.approx(-0.7)


def test_a_spring_at_the_ankle_takes_a_part_of_the_calfs_moment(found):
    plain, worn = (figures_of(each, "right") for each in found)
    name = "ankle: lowest moment of the muscles (Nm/kg)"
    assert plain[name] < worn[name] < 0.0
    assert plain["ankle: lowest torque of the device (Nm/kg)"] == 0.0
    assert worn["ankle: lowest torque of the device (Nm/kg)"] < -0.1


def test_who_walks_with_a_device_is_held_to_the_speed_without(found):
    """Left to herself she would walk slower with these springs, and seem to save work for that."""
    plain, worn = found
    assert worn.held
    assert worn.curves.speed == pytest.approx(plain.curves.speed, rel=0.01)
    assert study.at_kept_speed(worn, plain)


def test_no_device_is_refused(who):
    with pytest.raises(ConfigurationError, match="no device"):
        outcomes(who, [])


def test_a_result_its_table_and_its_page_have_the_same_figures(who, found, tmp_path, monkeypatch):
    only_html(monkeypatch)
    plain, worn = found
    write_report(tmp_path, who, load_devices("ankle_spring"), plain, replace(worn, fell=True))
    result = DeviceResult.model_validate(read_json(tmp_path / "device.json"))
    assert (result.person, result.cycles) == (who.name, 20.0)
    known = {(each.quantity, each.side, each.walk): each for each in result.figures}
    assert known["hip: lowest moment of the muscles", "left", "with"].unit == "Nm/kg"
    assert {each.unit for each in result.figures} == set(MARGINS)
    rows = list(csv.DictReader((tmp_path / "device.csv").open(encoding="utf-8")))
    assert [each["quantity"] for each in rows] == [each.quantity for each in result.figures]
    assert [float(each["value"]) for each in rows] == [each.value for each in result.figures]
    page = (tmp_path / "device.html").read_text(encoding="utf-8")
    assert "ankle: highest torque of the device" in page
    assert "hip: highest torque of the device" not in page
    assert "<dt>without</dt><dd>walks 8 cycles" in page
    assert "<dt>with</dt><dd>falls after 8 cycles" in page


@pytest.mark.slow
def test_a_subject_may_have_a_prosthesis(tmp_path):
    path = tmp_path / "patient.toml"
    device = "\n".join(
        [
            "",
            "[[devices]]",
            'name = "brace"',
            'source = "a test"',
            'sides = ["left"]',
            "[[devices.hinges]]",
            'joint = "knee_angle"',
            "damping = 2.0",
        ]
    )
    path.write_text(load_subject("5").to_toml() + device, encoding="utf-8")
    found = wearer(str(path))
    assert [each.name for each in found.own] == ["brace"]
    path.write_text(path.read_text().replace("damping = 2.0", "damping = -2.0"))
    with pytest.raises(SubjectError, match="damping"):
        wearer(str(path))


def test_a_wrong_device_is_refused_before_the_person_is_made(monkeypatch):
    monkeypatch.setattr(study, "wearer", lambda *_: pytest.fail("too early"))
    with pytest.raises(ConfigurationError, match="no such device"):
        device.app(["5", "jetpack"], standalone_mode=False)


def test_the_command_puts_no_prosthesis_on_the_sound_leg(tmp_path):
    """The main job refused it, and `gaitval device` let both legs be prostheses."""
    path = tmp_path / "patient.toml"
    left = load_subject("5").model_copy(update={"prosthesis": "left"})
    path.write_text(left.to_toml(), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="prosthesis is on the left, but the device below"):
        device.app([str(path), "below_knee"], standalone_mode=False)


def told_apart():
    """Curves of which no two are equal: by kind, joint, side and walk."""
    found = {}
    for number, walk in enumerate(LINES):
        curves = made_curves()
        for kind, size in zip((*ROWS, *OF_DEVICE), (0.1, 1.0, 2.0, 3.0, 4.0), strict=True):
            for j, joint in enumerate(JOINTS):
                for s, side in enumerate(SIDES):
                    rising = size + 0.01 * np.arange(101) + 10 * j + 100 * s + 1000 * number
                    getattr(curves, kind)[joint, side] = rising
        for s, side in enumerate(SIDES):
            curves.forces[side] = np.arange(101.0) + 100 * s + 1000 * number
        found[walk] = curves
    return found


@pytest.mark.parametrize("side", SIDES)
def test_each_panel_shows_its_joint_kind_and_walk(side):
    given = told_apart()
    figure = figure_of(lambda: _figure(given, side, "a"))
    panels = np.reshape(figure.axes, (len(ROWS), len(JOINTS)))
    colours = {name: handle.get_color() for name, handle in legend(figure).items()}
    assert colours == {name: look["color"] for name, look in LINES.items()}
    for row, kind in zip(panels, ROWS, strict=True):
        assert (
            row[0]
            .get_ylabel()
            .endswith({"angles": "(°)", "own": "(Nm/kg)", "device": "(Nm/kg)"}.get(kind, "(W/kg)"))
        )
        for axes, joint in zip(row, JOINTS, strict=True):
            for name, curves in given.items():
                (line,) = lines(axes, colours[name])
                factor = 180.0 / np.pi if kind == "angles" else 1.0
                np.testing.assert_allclose(line[:, 0], np.arange(101))
                np.testing.assert_allclose(line[:, 1], factor * getattr(curves, kind)[joint, side])
    assert [axes.get_title() for axes in panels[0]] == [TITLES[joint] for joint in JOINTS]
    device = figure_of(lambda: _device_figure(given, side, "b"))
    for row, joint in zip(np.reshape(device.axes, (len(JOINTS), 2)), JOINTS, strict=True):
        for axes, kind in zip(row, OF_DEVICE, strict=True):
            assert axes.get_title().startswith(f"{TITLES[joint]}: ")
            for name, curves in given.items():
                shown = [line[:, 1] for line in lines(axes, colours[name])]
                # without a device there is none
                expected = [] if name == "without" else [getattr(curves, kind)[joint, side]]
                np.testing.assert_allclose(shown, expected)


def test_forces_stand_under_their_own_foot():
    given = told_apart()
    figure = figure_of(lambda: _force_figure(given))
    assert [axes.get_title() for axes in figure.axes] == ["right foot", "left foot"]
    for axes, side in zip(figure.axes, SIDES, strict=True):
        for name, curves in given.items():
            (line,) = lines(axes, LINES[name]["color"])
            np.testing.assert_allclose(line.T, [np.arange(101), curves.forces[side]])
    assert figure.axes[0].get_ylabel() == "Vertical force (BW)"
