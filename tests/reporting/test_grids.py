"""Grids of curves: both sides, record, walk, norm and events."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from report_run import build_run

from gaitval.datasets.subject_file import load_subject
from gaitval.metrics.norms import Norm, norms_at
from gaitval.metrics.results import read_metrics
from gaitval.reporting import figures, grids, run_grids
from gaitval.reporting.drawing import drawn, new_figure
from gaitval.reporting.grids import DrawnCurve, Panel
from gaitval.reporting.page import _with_letters

WAVE = np.sin(np.linspace(0.0, 2.0 * np.pi, 101))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory):
    folder: Path = tmp_path_factory.mktemp("grids")
    build_run(folder)
    metrics = read_metrics(folder / "metrics.json")
    subject = load_subject(str(folder / "subject.toml"))
    return metrics, run_grids.figures(metrics, subject, run_grids.strides_of(folder, metrics))


def test_the_grids_of_a_run_are_those_that_clinicians_know() -> None:
    assert [len(row) for row in grids.KINEMATICS] == [3] * 5
    assert [len(row) for row in grids.KINETICS] == [3] * 3
    assert [row[2].partition("/")[0] for row in grids.KINETICS] == ["power"] * 3


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


def test_the_strides_are_about_their_mean(run) -> None:
    _, (draws, _) = run
    (rows,) = draws["forces"].args
    for panel in rows[0]:
        for each in panel.curves:
            if each.strides is not None:
                assert np.abs(each.strides.mean(axis=0) - each.mean).max() < 8.0  # of body weight


def test_the_tables_have_what_is_drawn(run) -> None:
    metrics, (_, tables) = run
    head, *rows = (line.split(",") for line in tables["kinetics"].splitlines())
    column = head.index("power_knee_angle_r_record")
    power = metrics.record.joint_power.power["knee_angle_r"]
    assert [float(row[column]) for row in rows] == pytest.approx(power, rel=1e-4)
    assert "moments_hip_flexion_norm_sd" in head


def test_sizes_of_texts_and_widths_of_lines(run) -> None:
    _, (draws, _) = run
    for draw in draws.values():
        svg = drawn(draw)
        sizes = [float(each) for each in re.findall(r'font-size="([\d.]+)"', _with_letters(svg))]
        assert min(sizes) >= 7.5
        widths = [float(each) for each in re.findall(r"stroke-width: ([\d.]+)", svg)]
        assert max(widths) <= figures.RECORD_WIDTH


def test_a_panel_without_curves_says_so_and_one_without_a_name_is_empty() -> None:
    panels = [
        [Panel("angles/knee_angle", (DrawnCurve("right", WAVE),)), Panel("angles/knee_rotation")]
    ]
    svg = drawn(lambda: grids.grid([[*panels[0], Panel("")]], height=1.5, figure_name="one"))
    assert "<!-- not measured -->" in svg
    assert svg.count("<!-- Knee") == 2
    assert "single strides" not in svg


def test_a_curve_without_a_side_is_black() -> None:
    panels = [[Panel("angles/lumbar_extension", (DrawnCurve(None, WAVE, which="record"),))]]
    svg = drawn(lambda: grids.grid(panels, height=1.5, figure_name="one", words=("trunk", "x")))
    assert "<!-- trunk -->" in svg
    assert "<!-- Lumbar extension -->" in svg


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
    svg = drawn(lambda: grids.grid([panels], height=1.5, figure_name="one"))
    (found,) = re.findall("<!-- (.*±.*) -->", svg)
    return found


def test_the_legend_has_no_band_that_a_single_cycle_lacks() -> None:
    words = ("recorded", "simulated")
    for sd, there in ((np.full(101, np.nan), False), (np.full(101, 0.1), True)):
        panel = Panel("angles/knee_angle", (DrawnCurve("right", WAVE, sd),))
        labels = [each.get_label() for each in grids._handles([panel], words, "")]
        assert ("± SD of the cycles" in labels) is there


def test_the_last_number_of_an_axis_is_within_the_figure() -> None:
    with new_figure(3.0, placed=True) as figure:
        axes = grids._subplots(figure, [[Panel("angles/hip_flexion")] * 3])[0]
        for each in axes:
            each.set_xlim(0, 100)
        figure.canvas.draw()
        last = axes[-1].get_xticklabels()[-1]
        assert last.get_text() == "100"
        assert last.get_window_extent().x1 <= figure.bbox.x1
