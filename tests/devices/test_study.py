from dataclasses import replace

import numpy as np
import pytest
from html_page import only_html, without_figures
from made_curves import made_curves
from seen_figures import figure_of, legend, lines

from gaitval.apps.devices import command, study
from gaitval.apps.devices.curves import JOINTS
from gaitval.apps.devices.page import (
    LINES,
    OF_DEVICE,
    ROWS,
    _device_figure,
    _figure,
    _force_figure,
    strap_loads,
    write_report,
)
from gaitval.apps.devices.results import TITLES, figures_of
from gaitval.apps.devices.study import DeviceOutcome, Wearer, outcomes, wearer
from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ConfigurationError, SubjectError
from gaitval.model.devices.device import load_devices


@pytest.fixture(scope="module")
def who(person):
    return Wearer("S05", person.task, person.policy, person.mu)


@pytest.fixture(scope="module")
def found(who):
    patch = pytest.MonkeyPatch()
    patch.setattr(study, "PUSHES", study.PUSHES[:2])
    try:
        return outcomes(who, load_devices("ankle_spring"), samples=0, cycles=8.0)[0]
    finally:
        patch.undo()


def test_pushes_come_from_eight_sides_evenly():
    pushes = study.pushes_of(200.0)
    np.testing.assert_allclose(np.degrees([push[2] for push in pushes]), 45.0 * np.arange(8))
    assert {push[1] for push in pushes} == {200.0}
    assert len(study.PUSHES) == 24


def test_figures_have_both_ends_of_a_curve():
    curves = made_curves()
    curves.own["knee_angle", "left"][:3] = -0.7, 0.2, 0.9
    curves.own["knee_angle", "left"][3:] = 0.0
    figures = figures_of(DeviceOutcome("without", None, curves, 5.0, False, None), "left")
    assert figures["knee: highest moment of the muscles (Nm/kg)"] == pytest.approx(0.9)
    assert figures["knee: lowest moment of the muscles (Nm/kg)"] == pytest.approx(-0.7)


def test_a_person_is_shown_by_every_assumption(found):
    assert [each.assumption for each in found] == ["without", "kinematics kept", "moments kept"]
    plain, kept, moments = (figures_of(each, "right") for each in found)
    name = "ankle: lowest moment of the muscles (Nm/kg)"
    assert plain[name] < kept[name] < 0.0
    assert plain[name] < moments[name] < 0.0
    # the same motion; of its few cycles one may begin a step of the physics later
    assert kept["stride time (s)"] == pytest.approx(plain["stride time (s)"], abs=0.002)
    assert found[1].survived is None
    assert found[0].survived == 2


def test_who_walks_with_a_device_is_held_to_the_speed_without(found):
    """Left to herself she would walk slower with these springs, and seem to save work for that."""
    plain, _, moments = found
    assert moments.held
    assert moments.curves.speed == pytest.approx(plain.curves.speed, rel=0.01)
    assert study.at_kept_speed(moments, plain)


def test_straps_carry_what_the_device_gives(found):
    rows = strap_loads(found[2])
    assert [row["hinge"] for row in rows] == ["ankle angle r", "ankle angle l"]
    assert all(row["largest"] > row["rms"] > 0.0 and row["apart"] > 0.1 for row in rows)


def test_no_device_is_refused(who):
    with pytest.raises(ConfigurationError, match="no device"):
        outcomes(who, [], samples=0)


def test_a_device_is_drawn_at_the_joints_where_it_acts(found):
    curves = {each.assumption: each.curves for each in found}
    # angles, moments and powers of three joints, and torque and power of the one with a spring
    # and no panel is empty
    assert _figure(curves, "right", "right").count('id="right-cycle.right.') == 3 * 3
    assert _device_figure(curves, "right", "d").count('id="d-cycle.right.') == 2


def test_a_walk_that_fell_is_called_so_and_no_other(who, found, tmp_path, monkeypatch):
    """On the page and in the terminal, with the pushes that each survived."""
    only_html(monkeypatch)
    without_figures(monkeypatch)
    mixed = [replace(each, fell=number == 2, survived=number) for number, each in enumerate(found)]
    write_report(tmp_path, who, load_devices("ankle_spring"), mixed, None)
    page = (tmp_path / "device.html").read_text(encoding="utf-8")
    for number, each in enumerate(mixed):
        card = page[page.index(f"<dt>{each.assumption}</dt>") :].split("</div>")[0]
        assert ("falls after" in card, "walks" in card) == (number == 2, number != 2)
        assert f"survives {number} of {len(study.PUSHES)} pushes" in card


def test_lines_are_told_apart_without_colour():
    assert len({each["linestyle"] for each in LINES.values()}) == len(LINES)


@pytest.mark.slow
def test_the_report_has_all(who, found, tmp_path):
    write_report(tmp_path, who, load_devices("ankle_spring"), found, None)
    page = (tmp_path / "device.html").read_text(encoding="utf-8")
    assert "Nobody knows which" in page
    assert "by two assumptions" in page  # nothing was learned
    assert "<b>Learned</b>" not in page
    assert "ankle: highest torque of the device" in page
    assert "hip: highest torque of the device" not in page
    assert "stroke: #1a1a1a" not in page  # the walk without, unseen on a dark page
    assert (tmp_path / "device.pdf").stat().st_size > 10_000
    table = (tmp_path / "device.csv").read_text(encoding="utf-8")
    assert "moments kept,left,ankle: lowest torque of the device,Nm/kg," in table


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
        command.device.app(["5", "jetpack"], standalone_mode=False)


def test_the_command_puts_no_prosthesis_on_the_sound_leg(tmp_path):
    """The main job refused it, and `gaitval device` let both legs be prostheses."""
    path = tmp_path / "patient.toml"
    left = load_subject("5").model_copy(update={"prosthesis": "left"})
    path.write_text(left.to_toml(), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="prosthesis is on the left, but the device below"):
        command.device.app([str(path), "below_knee"], standalone_mode=False)


def told_apart():
    """Curves of which no two are equal: by kind, joint, side and assumption."""
    found = {}
    for number, assumption in enumerate(LINES):
        curves = made_curves()
        for kind, size in zip((*ROWS, *OF_DEVICE), (0.1, 1.0, 2.0, 3.0, 4.0), strict=True):
            for j, joint in enumerate(JOINTS):
                for s, side in enumerate(SIDES):
                    rising = size + 0.01 * np.arange(101) + 10 * j + 100 * s + 1000 * number
                    getattr(curves, kind)[joint, side] = rising
        for s, side in enumerate(SIDES):
            curves.forces[side] = np.arange(101.0) + 100 * s + 1000 * number
        found[assumption] = curves
    return found


@pytest.mark.parametrize("side", SIDES)
def test_each_panel_shows_its_joint_kind_and_assumption(side):
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
