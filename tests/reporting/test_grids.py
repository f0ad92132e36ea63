"""Grids of curves: both sides, record, walk, norm and events."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from report_run import build_run
from seen_figures import bands, figure_of, forward, legend, lines

from gaitval.configuration import ReportSettings
from gaitval.metrics.norms import Norm, norms_at
from gaitval.metrics.results import read_metrics
from gaitval.quantities.joint_power import BURSTS
from gaitval.reporting import figures, grids, run_grids
from gaitval.reporting.grids import DrawnCurve, Panel
from gaitval.subjects.subject_file import load_subject

WAVE = np.sin(np.linspace(0.0, 2.0 * np.pi, 101))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory):
    folder: Path = tmp_path_factory.mktemp("grids")
    build_run(folder)
    metrics = read_metrics(folder / "metrics.json")
    subject = load_subject(str(folder / "subject.toml"))
    strides = run_grids.strides_in(folder, metrics)
    return metrics, run_grids.figures(metrics, subject, strides, ReportSettings())


def test_every_panel_of_a_run_has_record_walk_norm_and_events(run) -> None:
    metrics, (draws, _) = run
    (rows,) = draws["kinematics"].args
    hip = next(panel for row in rows for panel in row if panel.name == "angles/hip_flexion")
    assert {(each.side, each.which) for each in hip.curves} == {
        (side, which) for side in ("right", "left") for which in ("record", "walk")
    }
    assert all(each.strides is not None for each in hip.curves if each.which == "walk")
    assert hip.norm is not None
    stance = metrics.record.spatiotemporal.stance_fraction_right
    assert hip.toe_off["right"] == pytest.approx(100 * stance)
    walked = next(each for each in hip.curves if each.which == "walk" and each.side == "right")
    assert list(walked.mean) == metrics.walk.curves.angles["hip_flexion_r"].mean
    foot = next(panel for row in rows for panel in row if panel.name == "angles/foot_progression")
    assert {each.which for each in foot.curves} == {"record", "walk"}


ENDINGS = {
    **{"angles": "deg", "moments": "nm_kg", "forces": "percent_bw"},
    **{"power": "w_kg", "metabolic_joints": "w_kg", "tendon_force": "bw"},
}


@pytest.mark.parametrize("name", ["kinematics", "kinetics", "forces"])
def test_what_is_drawn_is_what_the_table_has(run, name) -> None:
    """Curve by curve and side by side, with one SD, over 0 to 100 %."""
    _, (draws, tables) = run
    (rows,) = draws[name].args
    head, *lines_of = (line.split(",") for line in tables[name].splitlines())
    table = {key: np.array([float(c or "nan") for c in column]) for key, column in
             zip(head, zip(*lines_of, strict=True), strict=True)}  # fmt: skip
    kinds = {panel.kind for row in rows for panel in row if panel.name}
    figure = figure_of(draws[name])
    every = [panel for row in rows for panel in row]
    assert len(figure.axes) == len(every)
    for axes, panel in zip(figure.axes, every, strict=True):
        if not panel.curves:
            continue
        assert forward(axes)
        assert axes.get_title(loc="left") == grids.title(panel.name)
        key = panel.name.replace("/", "_") if len(kinds) > 1 else panel.name.partition("/")[2]
        unit = ENDINGS[panel.kind]
        for curve in panel.curves:
            recorded = curve.which == "record"
            side = f"{key}_{curve.side[0]}"
            column = table[f"{side}_{'record' if recorded else 'mean'}_{unit}"]
            np.testing.assert_allclose(column, curve.mean, rtol=1e-4, atol=1e-4)
            colour = figures.RECORD_COLOUR if recorded else figures.COLOURS[curve.side]
            width = figures.RECORD_WIDTH if recorded else figures.WALK_WIDTH
            shown = [each[:, 1] for each in lines(axes, colour, width)]
            assert any(np.array_equal(each, curve.mean) for each in shown)
            if curve.sd is not None:
                sd = table[f"{side}_sd_{unit}"]
                np.testing.assert_allclose(sd, curve.sd, rtol=1e-4, atol=1e-4)
        if panel.norm is not None:
            for what in ("mean", "sd"):
                column = table[f"{key}_norm_{what}_{unit}"]
                np.testing.assert_allclose(column, getattr(panel.norm, what), rtol=1e-4, atol=1e-4)


def test_a_panel_draws_each_number_in_its_place() -> None:
    """Each side in its colour and with its own band of one SD, as the legend says."""
    step = np.arange(101.0)
    curves, size = [], {}
    for number, (side, which) in enumerate(
        (side, which) for side in figures.COLOURS for which in ("record", "walk")
    ):
        mean, sd = step**1.5 + 100.0 * number, 20.0 + 0.2 * step + 20.0 * number
        size[side, which] = mean, sd
        strides = mean + np.array([[-60.0], [40.0], [20.0]])
        walked = which == "walk"
        curves.append(
            DrawnCurve(side, mean, sd if walked else None, strides if walked else None, which)
        )
    norm = Norm(500.0 - step, 20.0 + 0.1 * step, 41)
    panel = Panel(
        "moments/hip_flexion", tuple(curves), norm, {"right": 61.0, "left": 57.0},
        error="1 / 2",
    )  # fmt: skip
    figure = figure_of(lambda: grids.grid([[panel]], height=2.0, figure_name="a"))
    (axes,) = figure.axes
    assert forward(axes)
    assert axes.get_ylabel() == "moment, Nm/kg"
    assert axes.get_xlabel() == "% of gait cycle"
    shown = legend(figure)
    for (side, which), (mean, sd) in size.items():
        handle = shown[f"{which}, {side}"]
        colour, width = handle.get_color(), handle.get_linewidth()
        assert colour == (figures.COLOURS[side] if which == "walk" else figures.RECORD_COLOUR)
        assert (handle.get_linestyle() == "-") is (side == "right")
        mine = [e for e in lines(axes, colour, width) if np.array_equal(e[:, 1], mean)]
        assert len(mine) == 1
        np.testing.assert_array_equal(mine[0][:, 0], step)
        if which == "walk":
            (band,) = bands(axes, colour)
            np.testing.assert_allclose(band[:, 0], step[::2])
            np.testing.assert_allclose(band[:, 1:].T, [(mean - sd)[::2], (mean + sd)[::2]])
            (thin,) = lines(axes, colour, 0.35)
            parts = thin[: 3 * 35].reshape(3, 35, 2)[:, :-1]
            np.testing.assert_array_equal(parts[..., 0], np.tile(step[::3], (3, 1)))
            np.testing.assert_allclose(
                parts[..., 1] - mean[::3], [[-60.0] * 34, [40.0] * 34, [20.0] * 34]
            )
    (band,) = bands(axes, figures.BAND_COLOUR)
    mean, sd = norm.mean[::2], norm.sd[::2]
    np.testing.assert_allclose(band[:, 1:].T, [mean - sd, mean + sd])
    short = {
        (tuple(each.get_xdata()), each.get_color())
        for each in axes.lines if len(each.get_xdata()) == 2 and each.get_color() in
        figures.COLOURS.values()
    }  # fmt: skip
    assert short == {
        ((61.0, 61.0), figures.COLOURS["right"]), ((57.0, 57.0), figures.COLOURS["left"]),
    }  # fmt: skip


def test_a_burst_of_power_stands_where_it_is_on_its_own_side_of_zero() -> None:
    (name, burst), (other, _) = (
        next((n, b) for n, b in BURSTS.items() if b.sign == sign) for sign in (1, -1)
    )
    wave = 3.0 * np.sin(2 * np.pi * np.arange(101) / 100)
    panel = Panel(
        f"power/{burst.joint}", (DrawnCurve("right", wave),), bursts={name: 25, other: 75}
    )
    (axes,) = figure_of(lambda: grids.grid([[panel]], height=2.0, figure_name="a")).axes
    places = {each.get_text(): each.xy for each in axes.texts}
    assert places[name] == pytest.approx((25, 3.0))
    assert places[other] == pytest.approx((75, -3.0))


def test_the_tables_have_what_is_drawn(run) -> None:
    metrics, (_, tables) = run
    head, *rows = (line.split(",") for line in tables["kinetics"].splitlines())
    column = head.index("power_knee_angle_r_record_w_kg")
    power = metrics.record.joint_power.power["knee_angle_r"]
    assert [float(row[column]) for row in rows] == pytest.approx(power, rel=1e-4)
    assert "moments_hip_flexion_norm_sd_nm_kg" in head


def test_a_panel_without_curves_says_so_and_one_without_a_name_is_empty() -> None:
    panels = [
        [Panel("angles/knee_angle", (DrawnCurve("right", WAVE),)), Panel("angles/knee_rotation")]
    ]
    svg = grids.grid([[*panels[0], Panel("")]], height=1.5, figure_name="one")
    assert ">not measured<" in svg
    assert svg.count(">Knee") == 2
    assert "single strides" not in svg


def test_a_curve_without_a_side_is_black() -> None:
    panels = [[Panel("angles/lumbar_extension", (DrawnCurve(None, WAVE, which="record"),))]]
    svg = grids.grid(panels, height=1.5, figure_name="one", words=("trunk", "x"))
    assert ">trunk<" in svg
    assert ">Lumbar extension<" in svg


def test_the_band_says_of_how_many_people_it_is_and_whether_they_walk_so_slowly() -> None:
    """The fewest and the most of a grid's panels; beyond their speeds the band is the nearest."""
    normal = norms_at(1.1, 0.9, 40.0)
    assert _legend(normal) == "10–41 healthy adults at this speed, ± SD"
    assert _legend({"moments": normal["moments/knee_angle"]}) == (
        "10 healthy adults at this speed, ± SD"
    )
    slow = norms_at(0.6, 0.9, 40.0)
    assert _legend({"angles": slow["angles/knee_angle"]}) == (
        "41 healthy adults at this speed or their nearest to it, ± SD"
    )
    assert _legend(norms_at(1.1, 0.6, 8.0)) == "typically developing children, free speed, ± SD"


def _legend(normal: Mapping[str, Norm]) -> str:
    """What the legend calls the bands of angles, moments, forces and power in `normal`."""
    curves = (DrawnCurve("right", WAVE),)
    panels = [
        Panel("angles/knee_angle", curves, norm)
        for name, norm in normal.items()
        if name.startswith(("angles", "moments", "forces", "power"))
    ]
    svg = grids.grid([panels], height=1.5, figure_name="one")
    (found,) = re.findall(">([^<]*±[^<]*)<", svg)
    return found


@pytest.mark.parametrize(("size", "there"), [(np.nan, False), (0.01, False), (0.02, True)])
def test_the_legend_and_the_panel_have_only_what_the_lines_do_not_hide(size, there) -> None:
    """A single cycle has no SD; 1 % of the height of a panel is within its line."""
    spread = size * np.ptp(WAVE)
    curve = DrawnCurve("right", WAVE, np.full(101, spread), WAVE + np.array([[spread], [-spread]]))
    figure = figure_of(
        lambda: grids.grid([[Panel("angles/knee_angle", (curve,))]], height=1.5, figure_name="one")
    )
    labels = legend(figure)
    assert ("± SD of the cycles" in labels) is there
    assert ("single strides" in labels) is there
    assert bool(bands(figure.axes[0], figures.COLOURS["right"])) is there
