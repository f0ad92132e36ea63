"""Figures of the report show the numbers of the metrics, each in its place."""

import json
from pathlib import Path

import numpy as np
import pytest
from report_run import build_run
from seen_figures import figure_of, lines

from gaitval.metrics.results import Metrics, StoredPushes, read_metrics
from gaitval.reporting import figures


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
