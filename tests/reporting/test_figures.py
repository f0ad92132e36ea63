"""Figures of the report show the numbers of the metrics, each in its place."""

import json
from pathlib import Path

import numpy as np
import pytest
from report_run import build_run
from seen_figures import bands, figure_of, forward, legend, lines

from gaitval.metrics.results import Metrics, StoredPushes, read_metrics
from gaitval.reporting import figures
from gaitval.reporting.figures import COLOURS, PERCENT, RECORD_COLOUR


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("figures")
    build_run(folder)
    return folder


@pytest.fixture(scope="module")
def metrics(run: Path) -> Metrics:
    return read_metrics(run)


@pytest.fixture(scope="module")
def pushes(run: Path) -> StoredPushes:
    return StoredPushes.model_validate(json.loads((run / "push.json").read_text("utf-8")))


def test_learning_is_over_millions_of_samples() -> None:
    columns = ("episode_length", "cycles", "episode_reward")
    training = {name: np.arange(1.0, 5.0) ** (n + 1) for n, name in enumerate(columns)}
    training["samples"] = np.array([1e5, 2e5, 4e5, 8e5])
    figure = figure_of(lambda: figures.learning(training))
    for axes, name in zip(figure.axes, columns, strict=True):
        (line,) = lines(axes)
        np.testing.assert_allclose(line.T, [[0.1, 0.2, 0.4, 0.8], training[name]])
        assert axes.get_xlabel() == "samples, millions"
        assert axes.get_title().lower().replace(" ", "_").startswith(name.split("_")[0][:5]) or (
            name == "cycles" and "cycles" in axes.get_title()
        )


def test_the_centre_of_mass_is_in_millimetres_along_its_own_axis(metrics: Metrics) -> None:
    figure = figure_of(lambda: figures.centre_of_mass(metrics))
    titles = ["Forward, mm", "To the left, mm", "Up, mm"]
    assert [axes.get_title() for axes in figure.axes] == titles
    for column, axes in enumerate(figure.axes):
        assert forward(axes)
        for colour, path in (
            (RECORD_COLOUR, metrics.record.centre_of_mass),
            (COLOURS["right"], metrics.walk.centre_of_mass),
        ):
            (line,) = lines(axes, colour)
            np.testing.assert_allclose(line[:, 0], PERCENT)
            np.testing.assert_allclose(line[:, 1], 1000.0 * np.array(path)[:, column])
    shown = legend(figure)
    assert shown["record"].get_color() == RECORD_COLOUR
    assert shown["simulated"].get_color() == COLOURS["right"]


def test_each_foot_has_its_own_path_with_one_sd_and_the_midline_between_them(
    metrics: Metrics,
) -> None:
    left, right, progress = figure_of(lambda: figures.pressure_path(metrics)).axes
    assert forward(progress)
    for side, axes in (("right", right), ("left", left)):
        contact = metrics.walk.foot_contact.of(side)
        along, across = contact.path.along, contact.path.across
        assert axes.get_title() == f"{side} foot"
        (line,) = lines(progress, COLOURS[side])
        np.testing.assert_allclose(line.T, [PERCENT, along.mean])
        (band,) = bands(progress, COLOURS[side])
        mean, sd = np.array(along.mean)[::2], np.array(along.sd)[::2]
        np.testing.assert_allclose(band[:, 1:].T, [mean - sd, mean + sd])
        # towards the midline is to the left of the right foot, and the tip is up
        inwards = -1.0 if side == "right" else 1.0
        (sole,) = lines(axes, COLOURS[side])
        np.testing.assert_allclose(sole.T, [inwards * np.array(across.mean), along.mean])
        (spread,) = bands(axes, COLOURS[side], across=True)
        order = np.argsort(along.mean)
        np.testing.assert_allclose(
            0.5 * np.diff(spread[:, 1:], axis=1)[:, 0], np.array(across.sd)[order], atol=1e-9
        )
        marks = {each.get_text(): each.xy for each in axes.texts}
        for percent in (10, 50, 90):
            np.testing.assert_allclose(marks[str(percent)], sole[percent])
        low, high = axes.get_xlim()
        assert low < high
        assert axes.get_ylim()[0] < axes.get_ylim()[1]
        ends = np.array([np.ptp(each.get_xy(), axis=0) for each in axes.patches[:-1]])
        middle = [each.get_xy()[:, 0].min() for each in axes.patches[:-1]] + 0.5 * ends[:, 0]
        spheres = 100.0 * inwards * np.array(contact.spheres)[:, 1]
        np.testing.assert_allclose(middle, spheres, atol=0.1)


def test_pushes_are_drawn_by_direction_ahead_up_and_left_to_the_left(pushes: StoredPushes) -> None:
    found = pushes.recovery
    figure = figure_of(lambda: figures.stability_regions(found))
    for row, axes in enumerate(figure.axes):
        assert axes.get_title() == f"{100 * found.phases[row]:g} % of the right cycle"
        outline = next(each for each in lines(axes) if len(each) == len(found.directions) + 1)
        np.testing.assert_allclose(directions(outline[:-1]), found.directions, atol=1e-9)
        np.testing.assert_allclose(np.hypot(*outline[:-1].T), found.largest[row])
        half = next(each for each in lines(axes) if len(each) == 91)
        np.testing.assert_allclose(np.hypot(*half.T), found.force)
        assert (half[:, 1] > -1e-9).all()
        assert axes.get_aspect() == 1.0
        words = {each.get_text(): each.get_position() for each in axes.texts}
        assert words["ahead"][1] > 0.0 > words["back"][1]
        assert words["left"][0] < 0.0 < words["right"][0]
        rings = sorted(
            {round(float(np.hypot(*each[0]))) for each in lines(axes) if len(each) == 73}
        )
        assert figure.get_supxlabel() == f"rings every {rings[0]} N"
        np.testing.assert_allclose(rings, rings[0] * np.arange(1, len(rings) + 1))
        assert rings[-1] >= max(found.largest[row])
        crosses = [each.get_xydata() for each in axes.lines if each.get_marker() == "x"]
        fell = [
            d for d, stood in zip(found.criterion_directions, found.survived[row], strict=True)
            if not stood
        ]  # fmt: skip
        assert list(directions(np.concatenate(crosses))) == pytest.approx(fell)


def directions(places: np.ndarray) -> np.ndarray:
    """Degrees from straight ahead, which is up, to the left."""
    degrees = np.rad2deg(np.arctan2(-places[:, 0], places[:, 1]))
    return np.where(degrees < -179.9, 180.0, degrees)


def test_a_change_of_velocity_is_from_the_cycle_before_along_the_push(pushes: StoredPushes) -> None:
    traces = []
    for trace in pushes.traces:
        cycles = np.array(trace.cycles)
        pushed = (cycles >= 0.0)[:, None] * [0.3, -0.2, 0.9] * (1.0 + trace.phase)
        steady = np.column_stack([np.sin(2 * np.pi * cycles) * k for k in (1.0, 2.0, 3.0)])
        traces.append(trace.model_copy(update={"velocity": (steady + pushed).tolist()}))
    figure = figure_of(lambda: figures.push_velocity(traces))
    ahead, left = figure.axes
    assert "forward" in ahead.get_title(loc="left")
    assert "leftward" in left.get_title(loc="left")
    shown = {name: line.get_color() for name, line in legend(figure).items()}
    assert len(shown) == 2
    for axes, size in ((ahead, 0.3), (left, -0.2)):
        for phase in (0.0, 0.5):
            (line,) = lines(axes, shown[f"at {100 * phase:g} % of the right cycle"])
            after = line[line[:, 0] > 0.05, 1]
            np.testing.assert_allclose(after, size * (1.0 + phase), atol=0.05)
            np.testing.assert_allclose(line[line[:, 0] < 0.0, 1], 0.0, atol=1e-9)
    crosses = [each for each in ahead.lines if each.get_marker() == "x"]
    assert len(crosses) == 1  # the later phase fell
