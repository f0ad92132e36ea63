"""Sets of faults are weighed by the probability of the data, and their sizes are the posterior."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import multivariate_normal

from gaitval.measurement.balance import Data
from gaitval.measurement.estimate import (
    DELAY,
    Cause,
    Examined,
    FoundFault,
    Lag,
    _apart,
    _evidence,
    _left_by_delay,
    _matters,
    _of_set,
    _sizes,
    faults_of,
    standing_up,
    together,
    weigh,
)
from gaitval.measurement.expected import USUAL
from gaitval.measurement.fault_text import warnings
from gaitval.measurement.likelihood import Balance, balance, scales

GAINS = tuple(Cause(f"gain {plate}", (f"gain {plate}",)) for plate in "12")
MASS = Cause("mass", ("mass",))
PLACE = Cause("place 1", ("place x 1", "place y 1"))
NAMES = ("gain 1", "gain 2", "mass", "place x 1", "place y 1")
COUNT = 40


@pytest.fixture
def model():
    """Data of two plates of which each shows a half of the weight."""
    random = np.random.default_rng(39)
    half = np.repeat([1.0, 0.0], COUNT // 2)
    effects = np.column_stack(
        [half, 1.0 - half, -np.ones(COUNT), *random.standard_normal((2, COUNT))]
    )
    usual = [USUAL[name.split(" ")[0]] for name in NAMES]
    sound = np.array([each.sound for each in usual])
    own = np.diag(np.full(COUNT, 0.03**2))
    covariance = own + (effects * sound**2) @ effects.T
    factor = cho_factor(covariance, lower=True)
    solved = cho_solve(factor, effects)

    def of(faults):
        rest = effects @ np.array([faults.get(name, 0.0) for name in NAMES])
        rest = rest + 0.002 * random.standard_normal(COUNT)
        return Balance(
            rest=rest, factor=factor, left=1.0, order={n: i for i, n in enumerate(NAMES)},
            effects=effects, precision=effects.T @ solved, towards=solved.T @ rest,
            prior=np.array([each.faulty for each in usual]), sound=sound,
            mean=np.zeros(len(NAMES)),
        )  # fmt: skip

    return of, own, covariance


@pytest.mark.parametrize("whole", [0.0, 1.0])
def test_evidence_is_the_ratio_of_the_probabilities_of_the_data(model, whole):
    """Also of what is there whole or not at all."""
    of, _, covariance = model
    seen = of({"gain 1": whole or 0.1})
    seen = replace(seen, mean=np.array([whole, 0.0, 0.0, 0.0, 0.0]))
    effect = seen.effects[:, [0, 3]] * seen.prior[[0, 3]]
    with_faults = multivariate_normal(whole * seen.effects[:, 0], covariance + effect @ effect.T)
    expected = with_faults.logpdf(seen.rest) - multivariate_normal(cov=covariance).logpdf(seen.rest)
    assert _evidence(seen, ("gain 1", "place x 1")) == pytest.approx(expected, rel=1e-6)
    assert _sizes(seen, ("gain 1",))[0][0] == pytest.approx(whole or 0.1, abs=0.02)


@pytest.mark.parametrize(
    ("log", "left", "said"), [(3.0, 1.0, False), (8.0, 1.0, True), (3.0, 2.8, True)]
)
def test_what_contradicts_itself_without_one_cause_is_said(model, log, left, said):
    of, *_ = model
    data = Data(
        names=("mass",), kind=("force z",), group=("right",), phase=np.zeros(1),
        value=np.zeros(1), noise=np.ones(1), effect=np.ones((1, 1)), middles={},
    )  # fmt: skip
    weighed = {frozenset(): 0.0, frozenset({MASS}): log, frozenset({PLACE}): log - 0.5}
    seen = Examined((), data, replace(of({}), left=left), 0.0, Lag(0.0, 0.003, 0.0), weighed)
    flags = warnings(seen)
    assert [flag.check for flag in flags] == ["measurement: unexplained"] * said
    assert all("body mass; plate 1: its place" in str(flag) for flag in flags)
    assert not warnings(replace(seen, found=(replace(_found(MASS, 0.001), matters=False),)))


def test_sizes_are_the_posterior_of_the_whole_fault(model):
    of, own, _ = model
    seen = of({"gain 1": 0.1, "gain 2": -0.05})
    at = [0, 1]
    others = [2, 3, 4]
    rest_covariance = own + (seen.effects[:, others] * seen.sound[others] ** 2) @ (
        seen.effects[:, others].T
    )
    prior = np.diag(seen.prior[at] ** 2 + seen.sound[at] ** 2)
    effect = seen.effects[:, at]
    gain = prior @ effect.T @ np.linalg.inv(rest_covariance + effect @ prior @ effect.T)
    values, covariance = _sizes(seen, ("gain 1", "gain 2"))
    np.testing.assert_allclose(values, gain @ seen.rest, rtol=1e-6)
    np.testing.assert_allclose(covariance, prior - gain @ effect @ prior, atol=1e-9)


@pytest.mark.parametrize(
    ("faults", "named"),
    [
        ({}, set()),
        ({"mass": 0.1}, {"mass"}),
        ({"gain 2": -0.12}, {"gain 2"}),
        ({"place x 1": 0.05}, {"place 1"}),
        ({"mass": 0.15, "place y 1": -0.06}, {"mass", "place 1"}),
    ],
)
def test_the_fewest_faults_that_explain_the_data_are_named(model, faults, named):
    seen = model[0](faults)
    weighed = weigh(seen, (*GAINS, MASS, PLACE), None)
    best = max(weighed, key=lambda one: weighed[one])
    found = faults_of(weighed, best, seen, Lag(0.0, 0.004, -5.0))
    assert {f.cause.name for f in found} == named
    for f in found:
        assert f.cause.name not in {cause.name for cause, _ in f.others}


def test_what_all_plates_have_is_one_cause():
    assert not _apart(frozenset(GAINS), 2)
    assert not _apart(frozenset({GAINS[0], MASS}), 1)
    assert _apart(frozenset({GAINS[0], MASS}), 2)
    assert _apart(frozenset({GAINS[0]}), 1)
    crossed, offset, other = (Cause(n, (n,)) for n in ("cross-talk 1", "offset 1", "offset 2"))
    assert not _apart(frozenset({crossed, offset}), 2)
    assert _apart(frozenset({crossed, other}), 2)


@pytest.mark.slow
def test_sets_of_causes_have_one_order_in_every_process():
    # Sums over a set are made in its order, on which their last digits depend.
    code = (
        "from gaitval.measurement.estimate import Cause; from gaitval.measurement.expected import "
        "USUAL; print([each.name for each in frozenset(Cause(n, (n,)) for n in USUAL)])"
    )
    messages = {
        subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True, text=True, check=True,
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(messages) == 1


def test_a_wrong_frame_rate_is_rarer_than_a_wrong_plate(model):
    of, _, _ = model
    seen = of({})
    rate = Cause("rate", ("mass",))
    weighed = weigh(seen, (*GAINS, MASS, rate), None)
    odds = weighed[frozenset({MASS})] - weighed[frozenset({rate})]
    assert np.exp(odds) == pytest.approx((0.25 / 0.75) / (0.15 / 0.85))


def _forces(value):
    """Data of the vertical force, in the order of the fixture's frames."""
    return Data(
        names=NAMES, kind=("force z",) * COUNT, group=("",) * COUNT,
        phase=np.linspace(0.0, 0.95, COUNT), value=value, noise=np.full(COUNT, 0.01),
        effect=np.zeros((COUNT, len(NAMES))), middles={},
    )  # fmt: skip


def _found(cause, *values):
    return FoundFault(cause, np.array(values), np.full(len(values), 0.01), 0.9, 0.9, (), True)


def test_a_fault_whose_removal_leaves_more_is_not_there(model):
    seen = model[0]({"mass": 0.1, "gain 2": -0.1})
    mass, gain = _found(MASS, 0.1), _found(GAINS[1], -0.1)
    data = _forces(seen.rest)
    assert standing_up((mass, gain), data, seen, 1.7) == (mass, gain)
    wrong = _found(GAINS[0], 0.1)
    assert standing_up((mass, gain, wrong), data, seen, 1.7) == (mass, gain)


@pytest.mark.parametrize(("late", "is_there"), [(0.01, True), (0.03, False)])
def test_a_delay_without_which_newtons_law_holds_less_is_not_there(model, late, is_there):
    # Beside what everybody shows both leave as much.
    seen = model[0]({})
    shifted, recorded = _forces(np.full(COUNT, late)), _forces(np.full(COUNT, 0.02))
    found = (_found(DELAY, 0.02),)
    assert _left_by_delay(found, (shifted, seen), (recorded, seen), 1.7) is is_there


def test_a_fault_may_be_along_one_axis(model):
    seen = model[0]({"place x 1": 0.05})
    along, both = _evidence(seen, ("place x 1",)), _evidence(seen, PLACE.parts)
    assert both < _of_set(seen, frozenset({PLACE})) < along


@pytest.mark.parametrize(
    ("name", "reach", "matters"),
    [("rotation all", 0.3, False), ("rotation all", 0.6, True), ("rotation 1", 0.6, False)],
)
def test_plates_that_turn_together_matter_by_how_far_they_move_aside(name, reach, matters):
    angle = 0.02  # rad: half of what matters of a turn, and of 10 mm at half a metre
    assert _matters(Cause(name, (name,)), np.array([angle]), reach) is matters


def test_how_the_rates_of_a_file_fall_is_not_scaled_with_a_persons_own_pattern():
    factors = scales(("force z", "pressure along", "fall of markers"), 4.0)
    np.testing.assert_allclose(factors, [[4.0, 4.0, 2.0], [4.0, 4.0, 2.0], [2.0, 2.0, 1.0]])


def test_a_session_in_which_no_plate_was_stepped_on():
    """What all plates have in common is then nothing."""
    names, count = ("mass", "scale"), 12
    data = Data(
        names=names, kind=("force z",) * count, group=("right",) * count,
        phase=np.linspace(0.0, 0.9, count), value=np.full(count, 0.01), noise=np.full(count, 0.01),
        effect=np.ones((count, len(names))), middles={},
    )  # fmt: skip
    found = balance(data, 1.7)
    assert not found.effects[:, found.order["place x all"]].any()


@pytest.mark.parametrize(("feet", "turned"), [(("right 1", "left 1"), True), (("right 1",), False)])
def test_a_plate_under_one_foot_alone_is_not_turned_back(feet, turned):
    """Its markers may be what is turned: the warning says so, and `--correct` leaves the plate."""
    usual, count = USUAL["rotation"], len(feet)
    data = Data(
        names=("rotation 1",), kind=("pressure across",) * count, group=feet,
        phase=np.full(count, 0.5), value=np.full(count, 0.02), noise=np.full(count, 0.001),
        effect=np.full((count, 1), 0.2), middles={},
    )  # fmt: skip
    precision = np.array([[9e3]])  # less than 1 over the square of what is usual
    seen = Examined(
        (_found(Cause("rotation 1", ("rotation 1",)), 0.1),), data,
        Balance(
            data.value, (np.eye(count), True), 1.0, {"rotation 1": 0}, data.effect, precision,
            0.1 * precision[0], np.array([usual.faulty]), np.array([usual.sound]), np.zeros(1),
        ),
        0.0, Lag(0.0, 0.003, 0.0), {},
    )  # fmt: skip
    found = together(seen, ("rotation", "gain"))
    assert [*found] == (["rotation 1"] if turned else [])
    assert sum(found.values()) == pytest.approx(0.1 if turned else 0.0, rel=0.05)
    (flag,) = warnings(seen)
    assert ("--correct rotation" in str(flag), "one foot alone" in str(flag)) == (
        turned,
        not turned,
    )
    (flag,) = warnings(seen, corrected=("rotation",))
    assert ("corrected, as" in str(flag), "one foot alone" in str(flag)) == (turned, not turned)


@pytest.mark.parametrize(("fault", "alike"), [("gain 2", True), ("mass", True), ("delay", False)])
def test_a_saturated_plate_is_named_beside_what_it_looks_like(fault, alike):
    """What one plate does not show looks like a gain of the other, or a wrong mass."""
    data = Data(
        names=("mass",), kind=("force z",), group=("right",), phase=np.zeros(1),
        value=np.zeros(1), noise=np.ones(1), effect=np.ones((1, 1)), middles={},
    )  # fmt: skip
    seen = Examined(
        (_found(Cause(fault, (fault,)), 0.1),), data, balance(data, 1.7), 0.0,
        Lag(0.0, 0.003, 0.0), {},
    )  # fmt: skip
    (flag,), (beside,) = warnings(seen), warnings(seen, ("1",))
    assert "saturated" not in str(flag)
    assert ("the saturated plate 1 does not show" in str(beside)) == alike
    assert ("--correct" in str(beside)) == (not alike)
