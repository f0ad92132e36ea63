"""`make paper`, in a small version: a few cycles and one push."""

import numpy as np
import pandas as pd
import pytest

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
