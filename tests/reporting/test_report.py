import copy
import json
import re
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import weasyprint
from html_page import (
    Page,
    an_hour_later,
    both_pages,
    only_html,
    without_figures,
)
from report_run import build_run
from seen_figures import figure_of, lines
from synthetic_walk import MODEL, perfect_walk, sharp_filter, walks_of
from verdict_words import headline, rows_of, says

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval._internal.io.partial_files import PARTIAL
from gaitval._internal.text.number_text import degree_signs, number, rough
from gaitval.coordinates import SIDES, split_side
from gaitval.correction.walked import accuracy_of
from gaitval.errors import ArtefactError
from gaitval.metrics.results import Metrics, metrics_from
from gaitval.metrics.validation import validate
from gaitval.reporting import figures, stick_figures, tables
from gaitval.reporting.grids import curve_name
from gaitval.reporting.report import within_text, write_report
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject

HOSTILE = "<script>alert('x')</script><img src=http://evil.example/x>{{ 7 * 7 }} & \"quoted\""


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    build_run(folder)
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def html(run_folder) -> str:
    return (run_folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(html) -> Page:
    return Page(html)


@pytest.fixture(scope="module")
def whole(run_folder) -> Page:
    """The report, and what stands behind it."""
    return Page(both_pages(run_folder))


@pytest.fixture(scope="module")
def metrics(run_folder) -> dict:
    return json.loads((run_folder / "metrics.json").read_text(encoding="utf-8"))


def test_an_error_within_the_record_s_own_uncertainty_is_said():
    def angle(measure, target, value):
        return SimpleNamespace(measure=measure, target=target, value=value)

    own = {"angle_knee_angle_r": np.radians(4.0), "force_up_l": 0.05}
    message = " (within the record's own uncertainty, ± {})"
    assert within_text(angle("angle_rmse", "knee_angle_r", 3.9), own) == message.format(4)
    assert within_text(angle("force_rmse", "vertical_l", 3.0), own) == message.format(5)
    assert within_text(angle("angle_rmse", "knee_angle_r", 4.1), own) == ""
    assert within_text(angle("angle_rmse", "knee_angle_l", 0.1), own) == ""
    assert within_text(angle("falls", "walk", 0.0), own) == ""


@pytest.mark.parametrize("name", ["report.html", "report-details.html"])
def test_the_page_is_whole_and_needs_nothing_else(run_folder, name):
    html = (run_folder / name).read_text(encoding="utf-8")
    page = Page(html)
    assert page.open == []
    assert not {"link", "iframe", "object"} & set(page.tags)
    inside = [link for link in page.links if link.startswith(("#", "data:text/csv;"))]
    beside = {link.partition("#")[0] for link in page.links if link not in inside}
    other = {
        "report.html": {"report-details.html"},
        "report-details.html": {"report.html"},
    }
    assert beside >= other[name]
    assert all((run_folder / each).is_file() for each in beside)
    assert "@import" not in html
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", html))
    assert len(page.identifiers) == len(set(page.identifiers))
    targets = [link[1:] for link in page.links if link.startswith("#")]
    assert set(targets) <= set(page.identifiers)


def test_a_guess_and_the_skill_stand_beside_the_errors(page, run_folder):
    """Of the anterior-posterior force under the right foot: 1 - RMSE / that of the prediction."""
    metrics = json.loads((run_folder / "metrics.json").read_text(encoding="utf-8"))
    guess = metrics["lights"]["forces"]["forward_r"]["guess_error"]
    error = metrics["walks"][metrics["final"]]["errors"]["forces"]["forward_r"]["rmse"]
    cells = (number(error, 1), number(guess, 1), number(1.0 - error / guess, 2))
    (row,) = [
        each for each in rows_of((run_folder / "report.html").read_text(encoding="utf-8"))
        if each.cells[:1] == ["Anterior-posterior"] and len(each.cells) == 13
    ]  # fmt: skip
    assert (row.cells[1], row.cells[7], row.cells[9]) == cells, "of the right side"


def test_every_section_is_there(whole):
    for heading in (
        *("Kinematics", "Kinetics and power", "Ground reaction forces", "Errors of every curve"),
        *(
            "Spatiotemporal",
            "Walks from each start phase",
            "Body parameters μ: what this record determines",
            "of 14 parameters",
        ),
        *("Correction of the reference", "Beside healthy people"),
        *("Contradictions in the record", "Pushes: "),
        *("Learning", "Tolerances and where they come from", "Context of use"),
        "Provenance",
    ):
        assert heading in whole.text
    assert "Not shown" not in whole.text
    assert whole.tags.count("svg") == 10  # the first grid twice, for narrow screens too
    assert "compliant" not in whole.text.lower()


def test_rounds_of_algorithm_1_are_held_against_the_reference_itself(whole):
    row = whole.text[whole.text.index("Round of training and identification") :][:250]
    for shown in ("0.400", "0.012", "0.348", "1.15"):
        assert shown in row


def test_failures_come_first_and_are_named(page, metrics):
    assert metrics["summary"]["refused"] > 0
    verdicts = re.findall(r"passed|FAILED", page.text[: page.text.index("The verdict is on")])
    verdicts = verdicts[verdicts.index("FAILED") :]
    assert verdicts == sorted(verdicts)  # capitals sort first
    assert "acceptance criteria failed" in page.text


def verdict_of(rows: list[dict]) -> str:
    """The word of a limit by its rows in metrics.json."""
    states = {row["state"] for row in rows if not row["passed"]}
    return "passed" if not states else "not shown" if states == {"not shown"} else "FAILED"


@pytest.mark.parametrize("turned", [False, True])
def test_every_limit_is_said_to_be_what_it_is(run_folder, tmp_path, monkeypatch, turned):
    """In both tables and the headline, in words and in marks; `turned`: what failed is kept, what
    was kept fails."""
    only_html(monkeypatch)
    without_figures(monkeypatch)
    shutil.copytree(run_folder, tmp_path, dirs_exist_ok=True)
    stored = read_json(tmp_path / "metrics.json")
    limits: dict[str, list[dict]] = {}
    for row in stored["tolerances"]:
        limits.setdefault(row["id"], []).append(row)
    for rows in limits.values():
        for row in rows if turned else ():
            row["turned"] = verdict_of(rows) != "passed"
    for row in stored["tolerances"] if turned else ():
        row["passed"] = row.pop("turned")
        row["state"] = "passed" if row["passed"] else "failed"
    write_json(tmp_path / "metrics.json", stored)
    write_report(tmp_path)
    page = both_pages(tmp_path)
    shown = rows_of(page)
    found = set()
    for rows in limits.values():
        title = degree_signs(rows[0]["title"])
        expected = verdict_of(rows)
        found.add(expected)
        mark = "fail" if expected == "FAILED" else "pass"
        table = [each for each in shown if len(each.cells) == 8 and each.cells[0] == title]
        assert [each.cells[-1] for each in table] == [expected] * (rows[0]["role"] == "acceptance")
        (sources,) = [
            each for each in shown
            if len(each.cells) == 4 and re.match(re.escape(title) + "([≤≥=]|nearer)", each.cells[0])
        ]  # fmt: skip
        message = sources.marked[0][1]
        assert says(message) == "failed" or message == expected, title
        assert (says(message) == "failed") is (expected == "FAILED"), title
        for each in (*table, sources):
            assert (each.failed, each.marked[0][0]) == (mark == "fail", mark)
    assert {"FAILED", "passed"} <= found
    counts = [
        sum(verdict_of(rows) == "FAILED" for rows in limits.values() if rows[0]["role"] == role)
        for role in ("acceptance", "context")
    ]
    marked, sentence = headline(page)
    assert marked is (counts[0] > 0)
    assert says(sentence) == "failed"
    assert re.findall(r"\d+", sentence)[0] == str(counts[0])


@pytest.mark.parametrize("fell", [False, True])
def test_a_fall_is_called_a_fall(run_folder, tmp_path, monkeypatch, fell):
    only_html(monkeypatch)
    without_figures(monkeypatch)
    shutil.copytree(run_folder, tmp_path, dirs_exist_ok=True)
    stored = read_json(tmp_path / "metrics.json")
    starts = stored["walks"][stored["final"]]["starts"]
    for start in starts:
        start["fell"] = fell
    stored["second_engine"]["fell"] = fell
    write_json(tmp_path / "metrics.json", stored)
    write_report(tmp_path)
    page = both_pages(tmp_path)
    ends = {True: "fell", False: "walked to the planned end"}
    rows = [each for each in rows_of(page) if each.cells and each.cells[-1] in ends.values()]
    assert {each.cells[-1] for each in rows} == {ends[fell]}
    assert {each.failed for each in rows} == {fell}
    assert len(rows) >= len(starts)
    assert ("The walker falls there." in page) is fell


def test_what_one_repeat_did_to_many_values_is_said_once(run_folder, tmp_path, monkeypatch):
    """A repeated walk that fell kept no limit; of two values each is still named."""
    only_html(monkeypatch)
    without_figures(monkeypatch)
    shutil.copytree(run_folder, tmp_path, dirs_exist_ok=True)
    stored = read_json(tmp_path / "metrics.json")
    close = {"close": True, "kept": 7, "repeats": 8, "low": 0.1, "high": 0.2}
    counts = {"sagittal-angles": 6, "skill-forces": 2}
    of = {name: [row for row in stored["tolerances"] if row["id"] == name] for name in counts}
    for name, count in counts.items():
        assert len(of[name]) >= count
        for at, row in enumerate(of[name]):
            spread = close if at < count else None
            row |= {"passed": True, "failed_by": [], "spread": spread}
    write_json(tmp_path / "metrics.json", stored)
    write_report(tmp_path)
    text = both_pages(tmp_path)
    assert text.count("6 of 6; passes, but not in every repeated walk.") == 1
    assert text.count("7 of 8 walks; passes, but not in every repeated walk.") == 2


def test_a_person_among_the_controls_is_named_so_and_the_worse_side_comes_first(whole, metrics):
    text = " ".join(whole.text.split())
    profiles = metrics["gait_profiles"]
    by_side = {side: profiles["walk"][side] - profiles["record"][side] for side in SIDES}
    worse = max(by_side, key=lambda side: abs(by_side[side]))
    record, walk = (number(profiles[which][worse], 1) for which in ("record", "walk"))
    assert f"The {worse} side differs more: measured {record}°, walk {walk}°." in text
    assert ("differs from the measured gait by more than that" in text) == (
        abs(by_side[worse]) >= 1.6
    )
    assert "does not matter clinically" not in text
    assert "This person is one of the 42 and is not left out of their mean" in text


def walked_figures(metrics):
    """By label and side."""
    return {
        (label, side): shown.table.figure(shown.walked, kind, name, side)
        for shown in tables.figure_tables(metrics_from(metrics, "here"))
        for label, kind, name in shown.table.rows
        for side in shown.table.columns
    }


def test_bursts_that_a_curve_lacks_are_not_found(page, metrics):
    """Also where a stored file has a number from the edge of the part."""
    found, bursts = walked_figures(metrics), metrics["walks"]["identified"]["joint_power"]["bursts"]
    assert {key: found[key] for key in found if f"{key[0]}_{key[1][0]}" in bursts} == {
        (key[:-2], {"r": "right", "l": "left"}[key[-1]]): value for key, value in bursts.items()
    }
    flat = copy.deepcopy(metrics)
    flat["walks"]["identified"]["joint_power"]["power"]["knee_angle_r"] = [
        float(each) for each in range(101)
    ]
    lacking = walked_figures(flat)
    assert [lacking[name, "right"] for name in ("K1", "K2", "K3", "K4")] == [None] * 4


FIT = "fitted to the measured gait", "The walk is a fit"


def test_the_numbers_are_those_of_the_metrics(whole, metrics):
    text = " ".join(whole.text.split())
    walk = metrics["walks"]["identified"]
    assert number(walk["epsilon"]["total"], 3) in text
    assert number(metrics["walks"]["nominal"]["epsilon"]["total"], 3) in text
    consistency = metrics["record"]["consistency"]
    assert number(consistency["mean_force"]["vertical"], 3) in text
    plates = metrics["record"]["plates"]
    assert f"{number(100 * (1 - 1 / plates['scale']), 1)} % too small" in text
    assert f"{number(abs(100 * plates['shift_right']), 1)} ± " in text
    assert "The record has no step width" in text
    assert number(metrics["record"]["joint_power"]["bursts"]["A2_r"], 2) in text
    message = metrics["second_engine"]
    assert f"{message['limits_met']} of {message['limits']} acceptance limits are met" in text
    assert "the subject's weight" in text
    assert "at its bound" in text
    assert "12.2 less than with the body as scaled" in text or "12.3 less" in text
    assert re.search(r"leg length, thigh \+ shank, m ?0.0000 ?0.0200 ?0.0105 ?0.0050 ?0.25", text)
    assert "not read in full" in text


def corrected_error(metrics) -> str:
    """Root mean square of the fitted curves' errors over their accuracies, as the page has it."""
    shares = [
        (row["after"] / accuracy_of(row["kind"], row["curve"])) ** 2
        for row in metrics["correction"]["curves"]
        if row["fitted"]
    ]
    return number(np.sqrt(np.mean(shares)), 2)


def test_the_correction_is_told_in_degrees(whole, metrics):
    text = " ".join(whole.text.split())
    assert f"0.95 before, {corrected_error(metrics)} with it; 2 steps looked for it" in text
    assert "The correction has 170 numbers, of which its prior leaves 102 free" in text
    assert "Change of the height of the pelvis: −2.1 mm" in text
    assert re.search("angles ?2.250 ?1.600 ?°", text)
    assert re.search("angles of the pelvis, not fitted ?0.700 ?0.750 ?°", text)


@pytest.mark.slow  # that of an import is always made twice (test_recording_report.py)
def test_an_equal_run_gives_equal_bytes_an_hour_later(run_folder, tmp_path, monkeypatch):
    an_hour_later(monkeypatch)
    build_run(tmp_path)
    # A report that is written again does not show what the first one took.
    provenance = read_json(tmp_path / "provenance.json")
    provenance["stages"]["report"] = {"seconds": 12.3}
    write_json(tmp_path / "provenance.json", provenance)
    write_report(tmp_path)
    for name in ("report.html", "report-details.html", "report.pdf"):
        assert (tmp_path / name).read_bytes() == (run_folder / name).read_bytes()


@pytest.mark.slow  # makes a whole PDF
def test_nothing_is_written_outside_the_run_where_a_kill_would_leave_it(tmp_path, monkeypatch):
    run, temporary = tmp_path / "run", tmp_path / "tmp"
    for folder in (run, temporary):
        folder.mkdir()
    build_run(run)
    without_figures(monkeypatch)
    before = {path.name for path in run.iterdir()}
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    seen = []
    drawn = weasyprint.Document.write_pdf

    def watched(document, target, **options):
        drawn(document, target, **options)
        seen.extend([*temporary.iterdir(), *run.glob(f"{PARTIAL}*/*")])

    monkeypatch.setattr(weasyprint.Document, "write_pdf", watched)
    write_report(run)
    assert (run / "report.pdf").stat().st_size > 50_000
    assert len(seen) == 5, "the faces of the fonts, in a folder of ours"
    assert not list(temporary.iterdir())
    assert {path.name for path in run.iterdir()} - before == {
        *("report.html", "report-details.html", "report.pdf", "figures"),
    }


def test_hostile_text_stays_text(tmp_path, monkeypatch):
    only_html(monkeypatch)
    without_figures(monkeypatch)
    build_run(tmp_path, source=HOSTILE, identified=False)
    write_report(tmp_path)
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    details = Page((tmp_path / "report-details.html").read_text(encoding="utf-8"))
    assert details.tags.count("script") == 1  # the page's own
    assert all("evil" not in link for link in details.links)
    assert page.tags.count("script") == 5  # the scene of the replay, its three, the page's own
    assert all("evil" not in link for link in page.links)
    assert "{{ 7 * 7 }}" in page.text
    assert "alert('x')" in page.text
    # the same run has no identification
    assert "No identified body parameters were simulated" in page.text
    assert "Not shown: identification.json" in details.text
    assert "Not shown: correction.json" in details.text


def test_a_search_by_rollouts_shows_what_it_found_and_no_posterior(
    run_folder, tmp_path, monkeypatch
):
    """`identification.method=rollouts` has values, and no SD or verdict of them."""
    only_html(monkeypatch)
    without_figures(monkeypatch)
    shutil.copytree(run_folder, tmp_path, dirs_exist_ok=True)
    metrics = read_json(tmp_path / "metrics.json")
    metrics["identification"] |= {"deviance_nominal": None, "deviance_identified": None}
    write_json(tmp_path / "metrics.json", metrics)
    write_report(tmp_path)
    text = Page(both_pages(tmp_path)).text
    found = text.index("CMA-ES looked for the body")
    table = text[found : text.index("± SD: of the prior", found)]
    values = metrics["identification"]["posterior_mean"]
    assert [number(value, 4) in table for value in values] == [True] * len(values)
    assert "Not looked for" not in text
    assert "SD, after / before" not in text


def test_damaged_inputs_are_named(run_folder, tmp_path):
    for name in ("subject.toml", "metrics.json"):
        (tmp_path / name).write_bytes((run_folder / name).read_bytes())
    (tmp_path / "push.json").write_text("{}", encoding="utf-8")
    with pytest.raises(
        ArtefactError, match=r"push\.json: does not match the schema of push\.json: at recovery"
    ):
        write_report(tmp_path)
    (tmp_path / "metrics.json").write_text("{}", encoding="utf-8")
    with pytest.raises(ArtefactError, match="does not match the schema"):
        write_report(tmp_path)


def changed_page(run_folder, folder, monkeypatch, **changed) -> str:
    """The text of the page of a run whose metrics are changed."""
    only_html(monkeypatch)
    without_figures(monkeypatch)
    shutil.copytree(run_folder, folder, dirs_exist_ok=True)
    metrics = read_json(folder / "metrics.json")
    for name, values in changed.items():
        metrics[name] |= values
    write_json(folder / "metrics.json", metrics)
    write_report(folder)
    return " ".join(Page(both_pages(folder)).text.split())


def test_the_hips_that_moments_are_about_are_told(run_folder, tmp_path, monkeypatch):
    """A goal reached about the record's hips only must not look as if it were the body's."""
    walks = read_json(run_folder / "metrics.json")["walks"]
    hips = {
        side: {
            "forward": -0.021 * factor,
            "outward": 0.004 * factor,
            "rmse_about_model": {"hip_flexion": 0.147 * factor, "hip_adduction": 0.073 * factor},
        }
        for side, factor in (("right", 1.0), ("left", 2.0))
    }
    identified = {"identified": walks["identified"] | {"hip_centres": hips}}
    text = changed_page(run_folder, tmp_path, monkeypatch, walks=identified)
    assert "−2.1 cm (right) and −4.2 cm (left) forward of the model’s own and 0.4 and 0.8" in text
    assert "0.147 (right) and 0.294 (left) Nm/kg in flexion, 0.073 and 0.146 in adduction" in text


def test_what_the_whole_correction_reached_is_not_told_of_a_part(run_folder, tmp_path, monkeypatch):
    text = changed_page(*(run_folder, tmp_path / "a", monkeypatch), correction={"share": 0.7})
    metrics = read_json(tmp_path / "a" / "metrics.json")
    assert f"{corrected_error(metrics)} with it" in text
    assert "found, reference corrected" in text
    refused = changed_page(
        *(run_folder, tmp_path / "b", monkeypatch), correction={"refused": "it falls"}
    )
    assert "found, reference corrected" not in refused


def test_what_was_not_recorded_was_not_held_out(run_folder, tmp_path, monkeypatch):
    message = read_json(run_folder / "metrics.json")["known"]
    nothing = {name: [] for name in message if name in ("moments", "forces", "stance")}
    fixed = changed_page(*(run_folder, tmp_path / "a", monkeypatch), known=nothing)
    assert "Held out: moments, forces, stance" in fixed
    folder = tmp_path / "b"
    shutil.copytree(tmp_path / "a", folder)
    metrics = read_json(folder / "metrics.json")
    write_json(folder / "metrics.json", metrics | {"recorded": ["angles", "timing"]})
    write_report(folder)
    text = " ".join(Page(both_pages(folder)).text.split())
    assert "Held out: nothing" in text
    assert "Moments and forces were not measured" in text


def test_a_slope_and_a_load_are_told(run_folder, tmp_path, monkeypatch):
    only_html(monkeypatch)
    without_figures(monkeypatch)
    monkeypatch.setattr(Metrics, "is_recorded_at_all", False)
    shutil.copytree(run_folder, tmp_path, dirs_exist_ok=True)
    write_report(tmp_path)
    level = " ".join(Page(both_pages(tmp_path)).text.split())
    (tmp_path / "configuration.toml").write_text("[record]\nslope = -7.5\nload = 20.0\n", "utf-8")
    write_report(tmp_path)
    text = " ".join(Page(both_pages(tmp_path)).text.split())
    for value in ("slope −7.5 %", "load 20.0 %", "on this slope or with this load"):
        assert value in text
        assert value not in level


def test_a_fall_at_once_and_missing_files_still_give_a_report(tmp_path, monkeypatch):
    only_html(monkeypatch)
    subject = load_subject("S05")
    record = subject.record()
    fallen = replace(perfect_walk(record, cycles=0.4), fell=np.array([1.0]))
    configuration = sharp_filter()
    walks = walks_of([fallen], configuration)
    metrics = validate(subject, record, MODEL, walks, walks, configuration)
    write_json(tmp_path / "metrics.json", metrics.as_dict())
    (tmp_path / "subject.toml").write_text(subject.to_toml(), encoding="utf-8")
    write_report(tmp_path)
    text = Page(both_pages(tmp_path)).text
    assert "no complete gait cycle" in text
    assert "not measured" in text
    assert "fell" in text
    for what in (
        *("reference motion", "provenance.json"),
        "a test of pushes",
    ):
        assert re.search(f"Not shown: [^.]*{what}", text)


def test_the_stick_figure_stands_where_the_model_stands():
    model = scale_subject(load_subject("S05")).model
    upright = np.zeros((1, 31))
    bent = np.zeros((1, 31))
    bent[0, 9] = np.pi / 2  # right knee
    figure = stick_figures.stick_figure(model, np.vstack([upright, bent]))
    hip, knee, ankle = figure["right"][0, :3]
    assert hip[2] - knee[2] == pytest.approx(-model["shank_r"].joint_position[2], abs=1e-9)
    assert figure["right"][1, 2, 0] < knee[0] - 0.2  # the shank points backwards
    for side, sign in zip(SIDES, (-1, 1), strict=True):
        assert sign * figure[side][0, 0, 1] > 0
        heel, tip = figure[side][0, 3], figure[side][0, 5]
        assert tip[0] - heel[0] > 0.15
        assert heel[2] < ankle[2]
    assert figure["trunk"][0, -1, 2] > figure["right arm"][0, 0, 2]


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(-1.25, 1, "−1.2"), (-0.001, 2, "0.00"), (None, 2, "–"), (float("nan"), 1, "–"), (3, 0, "3")],
)
def test_numbers_have_true_minus_signs_and_no_negative_zero(value, digits, text):
    assert number(value, digits) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0314, "0.031"), (1.26, "1.3"), (9.97, "10"), (0.0996, "0.10"), (123.4, "123"),
        (-0.501, "−0.50"), (0.0, "0"), (None, "–"), (float("nan"), "–"),
    ],
)  # fmt: skip
def test_two_figures_count_of_an_error(value, text):
    assert rough(value) == text


def test_headings_say_how_far_curves_are_off_and_which_most(page, metrics):
    """Of the recorded ones, both sides, in two figures."""
    errors = metrics["walks"][metrics["final"]]["errors"]
    for kind, unit in (("angles", "°"), ("moments", " Nm/kg"), ("forces", " %")):
        rmse = {curve: each["rmse"] for curve, each in errors[kind].items()}
        worst = max(rmse, key=rmse.get)
        side, name = split_side(worst)
        text = " ".join(page.text.split())
        heading = re.search(
            rf"{rough(np.mean(list(rmse.values())))}{unit}[^()]* off on average, "
            rf"most {curve_name(kind, name)}, {side} \({rough(rmse[worst])}",
            text,
        )
        assert heading, kind


@pytest.mark.parametrize(
    ("message", "subtitle", "sentence"),
    [
        pytest.param({}, *FIT, marks=pytest.mark.slow),  # that of the whole page is read always
        (
            {"use": "kinematics"},
            "moments and forces are predicted",
            "Moments, forces and stance are predicted from the motion",
        ),
        (
            {"holdout": "even"},
            "predicted from other trials",
            "The person’s other trials, and of this one only the speed",
        ),
    ],
)
def test_the_page_says_what_the_walker_was_told(tmp_path, monkeypatch, message, subtitle, sentence):
    """And shows the other half of the cycles, which it was not; a prediction knows that trial."""
    only_html(monkeypatch)
    without_figures(monkeypatch)
    person = load_subject("S05")
    half = person.trials[0].model_copy(
        update={"name": "even", "walking_speed_m_s": person.walking_speed_m_s}
    )
    build_run(tmp_path, subject=person.model_copy(update={"trials": (half,)}), messages=message)
    write_report(tmp_path)
    found = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    text = " ".join(found.text.split())
    assert subtitle in text
    assert sentence in text
    assert ("Held-out trial even" in text) == ("holdout" not in message)
    # the same speed again is no guess, unless it is what was known
    assert ("Nearest trial copied" in text) == ("holdout" in message)


def test_poses_are_drawn_from_the_right_at_their_percent_each_leg_in_its_colour():
    positions = np.zeros((3, 31))
    positions[:, 9] = [0.0, 0.5, 1.0]  # right knee
    percent = np.array([0, 40, 80])
    sticks = {
        which: {name: points + 0.01 * number for name, points in
                stick_figures.stick_figure(MODEL, positions).items()}
        for number, which in enumerate(("record", "simulation"))
    }  # fmt: skip
    (axes,) = figure_of(lambda: stick_figures.pose_strip(sticks, percent)).axes
    for name in ("right", "left"):
        for place in range(3):
            for which, colour in (
                ("record", figures.RECORD_SHADE), ("simulation", figures.COLOURS[name]),
            ):  # fmt: skip
                points = sticks[which][name][place]
                drawn = [each for each in lines(axes, colour) if len(each) == len(points)]
                expected = np.column_stack([points[:, 0] + place, points[:, 2]])
                assert any(np.allclose(each, expected) for each in drawn), (name, place, which)
    assert [each.get_text() for each in axes.texts] == ["0 %", "40 %", "80 %"]
    assert [each.get_position()[0] for each in axes.texts] == [0.0, 1.0, 2.0]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert left < right
    assert low < high
