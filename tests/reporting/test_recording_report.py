"""The page of an import: it says what the summary holds, and text from outside stays text."""

import os
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pikepdf
import pytest
from html_page import Page, an_hour_later, only_html, without_figures, words_of
from recording_summary import ANGLES, curves, sample
from seen_figures import bands, figure_of, lines
from verdict_words import headline, rows_of, says

from gaitval.configuration import ReportSettings
from gaitval.metrics.norms import Norm
from gaitval.quantities import BY_NAME
from gaitval.reporting import grids
from gaitval.reporting import recording_figures as figures
from gaitval.reporting.figures import COLOURS, WALK_WIDTH
from gaitval.reporting.recording_report import (
    ConsistencyChange,
    Decision,
    FunctionalRow,
    GateRow,
    GivenCentreRow,
    InputFile,
    LeftOut,
    MarkerError,
    ResidualCurves,
    SpatiotemporalRow,
    write_recording_report,
)
from gaitval.reporting.recording_report import _drawings as recording_drawings
from gaitval.scaling.segments import ScaledSegment

HOSTILE = "<script>alert('x')</script><img src=http://evil.example/x>{{ 7 * 7 }} $x_{$ -->"
NAN = float("nan")
SHEETS, WORDS = 6, 2500


DRAWN = {n for n, each in BY_NAME.items() if each.of_muscles is None and each.shown == "curves"}
"""Quantities with a figure, without those of muscles, which the recording here does not have."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("import")
    write_recording_report(made, sample())
    return made


def page_of(folder: Path) -> Page:
    page = Page((folder / "recording.html").read_text(encoding="utf-8"))
    page.text = " ".join(page.text.split())
    return page


@pytest.fixture(scope="module")
def page(folder: Path) -> Page:
    return page_of(folder)


def test_given_joint_centres_have_a_table_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    row = GivenCentreRow("left", "hip", f"own{HOSTILE}.osim", -30.4, 9.6, 5.0, 0.284, NAN)
    write_recording_report(tmp_path, sample(given_centres=[row]))
    page = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert "Joint centres that came with the recording" in page
    assert "left hip" in page
    for figure in ("-30", "10", "0.28"):
        assert f">{figure}<" in page.replace("−", "-")
    assert "<script>alert" not in page
    write_recording_report(tmp_path, sample())
    page = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert "Joint centres that came" not in page


def test_functional_joints_have_a_table_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    found = FunctionalRow("swing.c3d", "left hip", "", "+3 mm forward", "2.0 mm", "802 ± 2 mm")
    refused = FunctionalRow("swing.c3d", "right hip", "turned by 9°", "", "", "")
    write_recording_report(tmp_path, sample(functional=[found, refused]))
    page = (tmp_path / "recording.html").read_text()
    assert "<td>+3 mm forward</td><td>2.0 mm</td><td>802 ± 2 mm</td>" in page
    assert "not found: turned by 9°" in page
    write_recording_report(tmp_path, sample())
    assert "Functional hip centres" not in (tmp_path / "recording.html").read_text()


def test_the_page_is_whole_and_needs_nothing_else(page: Page, folder: Path) -> None:
    html = (folder / "recording.html").read_text(encoding="utf-8")
    assert page.open == []
    assert not {"link", "iframe", "object", "img"} & set(page.tags)
    assert page.tags.count("script") == 1  # ours, which copies tables
    assert all(link.startswith(("#", "data:text/csv;")) for link in page.links if link)
    assert "@import" not in html
    assert not any("nan" in path for path in re.findall(r' d="([^"]*)"', html))
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", html))
    assert len(page.identifiers) == len(set(page.identifiers))
    inside = {link[1:] for link in page.links if link and link.startswith("#")}
    assert inside <= set(page.identifiers)
    assert len(html) < 2_000_000
    assert {path.name for path in folder.iterdir()} == {
        "recording.html",
        "recording.pdf",
        "figures",
    }
    tables = {path.name for path in (folder / "figures").iterdir()}
    assert tables == {
        f"{name}.csv" for name in ("angles", "moments", "forces", "residuals", *DRAWN)
    }


def test_it_has_few_sheets_and_words_and_starts_with_its_curves(page: Page, folder: Path) -> None:
    with pikepdf.open(folder / "recording.pdf") as document:
        assert len(document.pages) <= SHEETS
    assert words_of(folder / "recording.pdf") <= WORDS
    below = page.text[page.text.index("Joint angles") :]
    for later in ("Spatiotemporal parameters", "Quality limits", "Decisions", "Marker errors"):
        assert f"{later} " in below


def test_every_section_says_what_the_summary_holds(page: Page) -> None:
    for text in (
        "Recording of subject WBDS01",
        "74.3 kg",
        "1.725 m",
        "150 Hz, forces 300 Hz",
        "21 right, 20 left",
        "1 of 4 quality limits failed.",
        "x forward, y up, from head over feet",
        "L.MT5: 1 spike of 14 mm at 12.35 s removed.",
        "Cadence 92.1 ± 1.4 92.3 ± 1.2 steps/min",
        "Stance 0.670 ± 0.010–of the cycle",
        "2 × both feet on one plate; 1 × the trial ends before the next heel strike.",
        "right thigh0.402110.4000.984",
        "residual force, RMS11.204.10N",
        "WBDS01walkT01.c3d4,325,376" + "1b" * 32,
        "gaitval 0.3.0, numpy 2.2.1.",
    ):
        assert text.replace(" ", "") in page.text.replace(" ", "")
    assert "Not shown" not in page.text
    assert page.tags.count("svg") == 4 + len(DRAWN)


@pytest.mark.parametrize("failing", [False, True])
def test_each_limit_is_said_to_be_what_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: bool
) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    gates = [
        GateRow("Residual force, largest", 38.4, 25.0, "N", not failing, ""),
        GateRow("Marker error, RMS", 1.21, 2.0, "cm", True, ""),
        GateRow("Residual moment, RMS", 18.9, 50.0, "Nm", failing, "", applies=False),
    ]
    write_recording_report(tmp_path, sample(gates=gates))
    page = (tmp_path / "recording.html").read_text(encoding="utf-8")
    rows = [each for each in rows_of(page) if len(each.cells) == 5 and "≤" in each.cells[2]]
    states = ["FAILED" if failing else "passed", "passed", "not judged"]
    assert [gate.state for gate in gates] == states
    assert [each.cells[-1] for each in rows] == states
    assert [each.failed for each in rows] == [failing, False, False]
    marks = [["fail" if failing else "pass"], ["pass"], []]
    assert [[mark for mark, _ in each.marked] for each in rows] == marks
    (sentence,) = [
        text for text in (headline(page, which)[1] for which in range(page.count('"headline')))
        if says(text)
    ]  # fmt: skip
    assert says(sentence) == ("failed" if failing else "kept")
    assert re.findall(r"\d+", sentence) == (["1", "2"] if failing else ["2"])


def test_markers_are_ordered_and_judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    errors = [
        MarkerError("good", 0.005, 0.010),
        MarkerError("wide", 0.010, 0.050),
        MarkerError("bad", 0.030, 0.035),
        MarkerError("unseen", NAN, NAN, 0.0),
    ]
    write_recording_report(tmp_path, sample(marker_errors=errors))
    html = (tmp_path / "recording.html").read_text(encoding="utf-8")
    table = html[html.index('<table class="markers">') :]
    rows = re.findall(r'<tr class="(\w*)"><td>(\w+)</td>', table[: table.index("</table>")])
    assert rows == [("failed", "unseen"), ("failed", "bad"), ("failed", "wide"), ("", "good")]
    # the scale ends a quarter after the largest error, 5 cm: 3 cm is 48 % of it
    assert 'class="size" style="width:48.0%"' in table
    assert re.findall(r'class="bound" style="left:([\d.]+)%"', table)[:2] == ["32.0", "64.0"]
    assert "nan" not in table[: table.index("</table>")]


@pytest.mark.parametrize("layout", ["html", pytest.param("pdf", marks=pytest.mark.slow)])
def test_text_from_outside_stays_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, layout: str
) -> None:
    summary = sample(
        identifier=HOSTILE,
        sex=HOSTILE,
        trial=HOSTILE,
        inputs=[InputFile(HOSTILE, HOSTILE, HOSTILE, 1)],
        decisions=[Decision(HOSTILE, HOSTILE)],
        gates=[GateRow(HOSTILE, 1.0, 2.0, HOSTILE, True, HOSTILE)],
        marker_errors=[MarkerError(HOSTILE, 0.01, 0.02)],
        segments=[ScaledSegment(HOSTILE, None, None, 0.4, 1.0, 1.0, HOSTILE)],
        spatiotemporal=[SpatiotemporalRow(HOSTILE, HOSTILE)],
        changes=[ConsistencyChange(HOSTILE, 1.0, 2.0, HOSTILE)],
        repairs=[HOSTILE],
        left_out=[LeftOut(HOSTILE, "right", 1.0, HOSTILE)],
        versions={HOSTILE: HOSTILE},
        angles={f"{HOSTILE}_r": (np.zeros(101), np.zeros(101))},
    )
    if layout == "html":
        only_html(monkeypatch)
        write_recording_report(tmp_path, summary)
    else:
        write_recording_report(tmp_path, summary)
    page = page_of(tmp_path)
    assert page.open == []
    assert "img" not in page.tags
    assert page.tags.count("script") == 1
    assert all("evil" not in (link or "") for link in page.links)
    assert page.text.count("{{ 7 * 7 }}") >= 20
    assert "49" not in page.text.split("{{ 7 * 7 }}")[1]
    if layout == "pdf":
        assert (tmp_path / "recording.pdf").stat().st_size > 10_000


def test_what_was_not_measured_is_a_dash_or_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    unknown = np.full(101, NAN)
    some = {"right": NAN, "left": NAN}
    write_recording_report(
        tmp_path,
        sample(
            walking_speed=NAN,
            stance_fraction=some,
            gates=[GateRow("Residual force", None, 25.0, "N", False, "Hicks 2015")],
            angles={"knee_angle_r": (unknown, unknown), "knee_angle_l": (unknown, unknown)},
            residuals=ResidualCurves(np.arange(3.0), np.full((3, 3), NAN), np.full((3, 3), NAN)),
        ),
    )
    text = page_of(tmp_path).text
    assert re.search("Walking speed ?– m/s", text)
    assert not re.search(r"\bnan\b", text, re.IGNORECASE)


def test_recording_without_forces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only_html(monkeypatch)
    bare = sample(
        force_rate=0.0,
        moments={},
        forces={},
        residuals=None,
        changes=(),
        repairs=(),
        left_out=(),
        decisions=(),
        segments=(),
        spatiotemporal=(),
        marker_errors=(),
        gates=(),
    )
    write_recording_report(tmp_path, bare)
    text = page_of(tmp_path).text
    assert "From markers to the scaled model, joint angles" in text
    assert "No quality limit could be applied." in text
    assert "No gap, spike or exchange of markers was found." in text
    assert "No gait cycle was left out of the means." in text
    assert text.count("Not shown: the trial has no usable force plate data") == 2
    assert "Not shown: there is no inverse dynamics without forces." in text
    assert "Not shown: no marker was tracked." in text


@pytest.mark.parametrize("layout", ["html", pytest.param("pdf", marks=pytest.mark.slow)])
def test_equal_summaries_give_equal_bytes_an_hour_later(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, layout: str
) -> None:
    """Of the PDF, the next test looks always at what its fonts are dated with."""
    an_hour_later(monkeypatch)
    if layout == "html":
        only_html(monkeypatch)
        write_recording_report(tmp_path, sample())
    else:
        write_recording_report(tmp_path, sample())
    for name in ("recording.html", "recording.pdf")[: 1 + (layout == "pdf")]:
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
    assert "SOURCE_DATE_EPOCH" not in os.environ


@pytest.mark.parametrize("outside", [None, "86400"])
def test_a_date_given_from_outside_is_that_of_the_fonts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, outside: str | None
) -> None:
    """fontTools dates the fonts of a PDF with SOURCE_DATE_EPOCH, with the clock where it is not
    set."""
    without_figures(monkeypatch)
    seen = []
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    if outside is not None:
        monkeypatch.setenv("SOURCE_DATE_EPOCH", outside)
    document = SimpleNamespace(
        pages=[], write_pdf=lambda *_, **__: seen.append(os.environ["SOURCE_DATE_EPOCH"])
    )
    monkeypatch.setattr("weasyprint.HTML.render", lambda *_, **__: document)
    write_recording_report(tmp_path, sample())
    assert seen == [outside or "0"]
    assert os.environ.get("SOURCE_DATE_EPOCH") == outside


def test_coordinates_without_a_place_in_the_grid_are_drawn_below_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    more = {**curves(ANGLES, 0.03), "lumbar_extension": (np.zeros(101), np.ones(101))}
    write_recording_report(tmp_path, sample(angles=more))
    html = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert html.count("<svg") == 4 + len(DRAWN)
    assert ">Lumbar extension<" in html


def test_a_short_peak_of_a_long_trial_is_drawn() -> None:
    force = np.zeros((100_000, 3))
    force[12_345, 0] = 1000.0
    force[50_000:50_500] = NAN
    drawing = figures.residuals(
        np.arange(100_000) / 1000.0,
        force,
        np.zeros_like(force),
        force_limit=NAN,
        moment_limit=75.0,
        figure_name="long",
    )
    assert ">1000<" in drawing
    assert len(drawing) < 400_000


def test_each_side_has_a_column_and_the_factor_is_the_population_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    row = SpatiotemporalRow("Cadence", "steps/min", (92.0, 1.2), (92.3, 1.1), digits=1)
    write_recording_report(tmp_path, sample(spatiotemporal=[row]))
    page = page_of(tmp_path)
    assert "Parameter Right Left Unit" in re.sub(r"(?<=[a-z])(?=[A-Z])", " ", page.text)
    assert "length in the model over the population’s mean for this stature" in page.text


def test_residuals_are_drawn_axis_by_axis_with_their_limits() -> None:
    time = np.linspace(0.0, 1.0, 50)
    force, moment = (np.outer(np.sin(time), [1.0, 2.0, 3.0]) + shift for shift in (0.0, 10.0))
    figure = figure_of(
        lambda: figures.residuals(
            time, force, moment, force_limit=25.0, moment_limit=75.0, figure_name="a"
        )
    )
    titles = ["Forward", "To the left", "Up", "About forward", "About left", "About up"]
    assert [axes.get_title() for axes in figure.axes] == titles
    for number, axes in enumerate(figure.axes):
        values = (force, moment)[number // 3][:, number % 3]
        (line,) = lines(axes)
        np.testing.assert_array_equal(line.T, [time, values])
        limit = (25.0, 75.0)[number // 3]
        ends = {float(each.get_ydata()[0]) for each in axes.lines if len(each.get_xdata()) == 2}
        assert ends == {0.0, limit, -limit}
        assert axes.get_ylim()[0] < axes.get_ylim()[1]
    labels = [figure.axes[n].get_ylabel() for n in (0, 3)]
    assert labels == ["force, N", "moment, Nm"]


def test_a_long_series_keeps_its_time() -> None:
    time = np.linspace(2.0, 8.0, 6000)
    one = np.column_stack([time, -time, time**2])
    figure = figure_of(
        lambda: figures.residuals(
            time, one, one, force_limit=NAN, moment_limit=NAN, figure_name="a"
        )
    )
    for number, axes in enumerate(figure.axes):
        (band,) = bands(axes)
        middle = 0.5 * (band[:, 1] + band[:, 2])
        expected = np.interp(band[:, 0], time, one[:, number % 3])
        np.testing.assert_allclose(middle, expected, atol=0.1)


@pytest.mark.parametrize("factor", [1.0, 100.0])
def test_every_recorded_curve_is_in_its_panel_with_its_sd_strides_and_norm(factor: float) -> None:
    given = curves(ANGLES, 0.03)
    strides = {
        f"angles/{name}": mean + np.array([[0.1], [-0.1]]) for name, (mean, _) in given.items()
    }
    norm = {"angles/knee_angle": Norm(np.arange(101.0), np.ones(101), 3)}
    rows = figures.curve_rows(
        given, {"right": 0.6, "left": 0.7}, "angles", factor=factor, norms=norm, strides=strides,
        layout=grids.KINEMATICS,
    )  # fmt: skip
    seen = {}
    for panel in (panel for row in rows for panel in row if panel.curves):
        assert panel.toe_off == pytest.approx({"right": 60.0, "left": 70.0})
        assert (panel.norm is not None) is (panel.name == "angles/knee_angle")
        for each in panel.curves:
            name = f"{panel.name.partition('/')[2]}_{each.side[0]}"
            seen[name] = each
    assert seen.keys() == given.keys()
    for name, each in seen.items():
        mean, sd = given[name]
        np.testing.assert_allclose(each.mean, factor * mean)
        np.testing.assert_allclose(each.sd, factor * sd)
        np.testing.assert_allclose(each.strides, factor * strides[f"angles/{name}"])


@pytest.mark.parametrize("kind", ["angles", "moments", "forces"])
def test_the_figures_of_an_import_have_the_unit_of_their_axis(kind: str) -> None:
    """Angles from rad in degrees, forces from body weights in % of it."""
    summary = sample()
    figure = figure_of(recording_drawings(summary, ReportSettings())["drawings"][kind])
    factor = {"angles": 180.0 / np.pi, "moments": 1.0, "forces": 100.0}[kind]
    given = getattr(summary, kind)
    shown = 0
    for axes in figure.axes:
        title = axes.get_title(loc="left")
        for name, (mean, sd) in given.items():
            side = "right" if name.endswith("_r") else "left"
            if title != grids.title(f"{kind}/{name[:-2]}"):
                continue
            (line,) = lines(axes, COLOURS[side], WALK_WIDTH)
            np.testing.assert_allclose(line[:, 1], factor * mean)
            (band,) = bands(axes, COLOURS[side])
            np.testing.assert_allclose(band[:, 2], factor * (mean + sd)[::2])
            shown += 1
    assert shown == len(given)
    assert figure.axes[0].get_ylabel() == grids.UNITS[kind]
