"""`make paper`, in a small version: a few cycles and one push."""

import copy
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from html_page import Page

from experiments.paper import claims, drawings
from experiments.paper import data as paper_data
from experiments.paper import figures as paper_figures
from gaitval.metrics.comparison import rms
from gaitval.study.stored_policy import StoredPolicy

SUBJECT = paper_figures.SUBJECT
BASELINE = paper_data.REPORTS / SUBJECT / "baseline"


@pytest.fixture(scope="module")
def simulated():
    return paper_data.simulated(BASELINE, cycles=3, phases=1, people=[SUBJECT])


@pytest.fixture(scope="module")
def runs():
    return paper_data.stored()


@pytest.fixture(scope="module")
def written(simulated, tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper")
    found = paper_figures.figures(SUBJECT, simulated, None)
    paper_figures.write_all(folder, found)
    return folder, found


@pytest.mark.slow  # draws every figure
def test_every_figure_of_the_paper_is_there(written):
    folder, found = written
    # the model, seven with curves, of which the paper numbers two 7, and one that it lacks
    assert len(found) == 9
    assert paper_figures.complete(folder, found) == 8
    names = {each.name for each in found}
    for end in (".svg", ".png", ".csv"):
        assert {path.stem for path in folder.glob(f"*{end}")} == names
    for path in folder.glob("*.csv"):
        assert not pd.read_csv(path).select_dtypes("number").dropna(how="all").empty, path.name


@pytest.mark.slow  # draws every figure
def test_the_page_shows_each_figure_and_links_its_files(written):
    folder, found = written
    page = Page((folder / "index.html").read_text(encoding="utf-8"))
    assert page.tags.count("svg") == len(found)
    links = {link for link in page.links if link and not link.startswith("#")}
    assert links == {f"{each.name}{end}" for each in found for end in (".svg", ".png", ".csv")}
    assert all((folder / link).is_file() for link in links)
    assert len(page.identifiers) == len(set(page.identifiers))
    for each in found:
        for claim in each.claims:
            assert claim.found.split(":")[0] in page.text


@pytest.mark.slow  # draws every figure
def test_numbers_on_the_page_are_those_of_the_curves(written, simulated):
    folder, found = written
    curves = pd.read_csv(folder / "figure6_ground_reaction.csv")
    error = rms(
        curves["vertical_r | simulated | mean"].to_numpy()
        - curves["vertical_r | record | mean"].to_numpy()
    )
    (claim,) = next(each.claims for each in found if each.number == "6")
    assert f"vertical {error:.2f} and" in claim.found
    walked = simulated.walks[paper_data.FINAL]["forces"]["vertical_r"]
    assert len(walked) == 3
    assert np.allclose(
        curves["vertical_r | simulated | mean"], walked.mean(axis=0), rtol=1e-4, atol=1e-4
    )


@pytest.mark.slow  # simulates every figure
def test_the_walks_are_of_different_bodies(simulated):
    before, after, final = (
        simulated.walks[name]["angles"]["knee_angle_r"].mean(axis=0)
        for name in (paper_data.RL, paper_data.IDENTIFIED, paper_data.FINAL)
    )
    walker = StoredPolicy.load(BASELINE)  # which may have kept the body as scaled
    apart = not np.array_equal(walker.identified[2:], walker.nominal[2:])
    assert (rms(before - after) > 0.05) == apart
    assert rms(after - final) > 0.05
    (trace,) = simulated.traces
    assert trace.cycles[0] < -0.9
    assert trace.cycles[-1] > 3.9


@pytest.mark.slow  # draws every figure
def test_without_winters_tables_that_is_said(written):
    _, found = written
    loop = next(each for each in found if each.number == "4")
    assert [claim.verdict for claim in loop.claims].count("cannot be judged") == 1


def test_winters_loop_is_read_where_the_data_are(gait_data):
    angle, moment = paper_data.winter(gait_data)
    assert angle.shape == moment.shape == (101,)
    # heel strike: flexed, extensor; 50 %: extended, flexor
    assert angle[0] > 10.0 > 0.0 > angle[50]
    assert moment[3] < 0.0 < moment[50] < 1.0


@pytest.mark.slow  # simulates every figure
def test_a_loop_that_runs_backwards_does_not_agree(simulated, runs):
    record = runs[SUBJECT]["record"]["curves"]
    curves = drawings.loop_curves(simulated.walks, record, None)
    assert claims.torque_loop(curves)[1].verdict == "agrees"
    angle, moment = curves["simulated"]
    backwards = {**curves, "simulated": (angle[::-1], moment[::-1])}
    assert claims.torque_loop(backwards)[1].verdict == "does not agree"


def test_errors_that_do_not_fall_do_not_agree():
    found = paper_data.ablation(SUBJECT)
    same = {body: {**walks, paper_data.IDENTIFIED: walks[paper_data.RL]}
            for body, walks in found.items()}  # fmt: skip
    assert {claim.verdict for claim in claims.errors(same)} == {"does not agree"}
    lower = {
        body: {
            **walks,
            paper_data.IDENTIFIED: [
                {name: 0.5 * value for name, value in seed.items()} for seed in walks[paper_data.RL]
            ],
        }
        for body, walks in found.items()
    }
    assert {claim.verdict for claim in claims.errors(lower)} == {"agrees"}
    assert all(len(walks[paper_data.RL]) == 6 for walks in found.values())


def test_walkers_that_are_mixed_up_are_not_their_people(runs):
    assert claims.knees(runs)[1].verdict == "agrees"
    names = list(runs)
    mixed = {
        name: {**runs[name], "walks": runs[other]["walks"], "final": runs[other]["final"]}
        for name, other in zip(names, names[1:] + names[:1], strict=True)
    }
    assert claims.knees(mixed)[1].verdict != "agrees"


@pytest.mark.slow  # simulates every figure
def test_a_push_that_is_never_recovered_from_does_not_agree(runs, simulated):
    assert claims.pushes(runs, SUBJECT, simulated.traces)[1].verdict == "agrees"
    (trace,) = simulated.traces
    velocity = trace.velocity + 0.3 * (trace.cycles >= 0.0)[:, None]
    kept = [replace(trace, velocity=velocity)]
    assert claims.pushes(runs, SUBJECT, kept)[1].verdict == "does not agree"


@pytest.mark.slow  # simulates every figure
def test_feet_that_stay_where_they_were_do_not_agree(simulated):
    assert claims.placement(simulated.placed)[0].verdict == "agrees"
    stiff = {
        name: [each.model_copy(update={"foot": each.foot and 0.0}) for each in placed]
        for name, placed in simulated.placed.items()
    }
    assert claims.placement(stiff)[0].verdict == "does not agree"


def test_the_hardest_phase_is_counted(runs):
    late = copy.deepcopy(runs)
    for run in late.values():
        run["push_recovery"]["largest"][3] = [0.0] * len(run["push_recovery"]["directions"])
    found = claims.pushes(runs, SUBJECT, [])[0], claims.pushes(late, SUBJECT, [])[0]
    assert [claim.verdict for claim in found] == ["does not agree", "agrees"]
