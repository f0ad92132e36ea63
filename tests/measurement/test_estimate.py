"""Sets of faults are weighed by the probability of the data, and their sizes are the posterior."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import multivariate_normal

from gaitval.consistency import OTHER
from gaitval.session.measurement.balance import Data
from gaitval.session.measurement.estimate import (
    Examined,
    Lag,
    Search,
    _evidence,
    _of_set,
    _parts,
    _sizes,
    together,
)
from gaitval.session.measurement.fault_text import warnings
from gaitval.session.measurement.kinds import KINDS, Fault, faults, kind_of
from gaitval.session.measurement.likelihood import (
    Balance,
    balance,
    log_sound,
    scales,
    something_else,
)

GAINS = tuple(Fault("gain", plate, 0.02) for plate in "12")
MASS = Fault("mass", "", 0.04)
PLACE = Fault("place", "1", 0.04)
DELAY = Fault("delay", "", 0.04)
AMONG = (*GAINS, MASS, PLACE)
NAMES = tuple(part for fault in AMONG for part in fault.parts)
COUNT = 40
SPREAD = 0.03
NO_LAG = Lag(0.0, 0.004, -5.0)


@pytest.fixture
def model():
    """Data of two plates of which each shows a half of the weight, by the faults that they have."""
    random = np.random.default_rng(39)
    half = np.repeat([1.0, 0.0], COUNT // 2)
    effects = np.column_stack(
        [half, 1.0 - half, -np.ones(COUNT), *random.standard_normal((2, COUNT))]
    )
    kinds = [KINDS[kind_of(name)] for name in NAMES]
    sound = np.array([each.sound for each in kinds])
    own = np.diag(np.full(COUNT, SPREAD**2))
    covariance = own + (effects * sound**2) @ effects.T
    factor = cho_factor(covariance, lower=True)
    solved = cho_solve(factor, effects)

    def of(faults, more=0.0):
        rest = effects @ np.array([faults.get(name, 0.0) for name in NAMES])
        rest = rest + 0.002 * random.standard_normal(COUNT) + more
        return Balance(
            rest=rest, factor=factor, left=1.0, order={n: i for i, n in enumerate(NAMES)},
            effects=effects, precision=effects.T @ solved, towards=solved.T @ rest,
            prior=np.array([each.faulty for each in kinds]), sound=sound,
            mean=np.zeros(len(NAMES)), covariance=covariance, own=own,
            kind=("force z",) * COUNT, group=("",) * COUNT,
        )  # fmt: skip

    return of, own, covariance


def found(model, among=AMONG, lag=NO_LAG, late=None):
    return Search(among, model, late, lag).found()


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


def test_sizes_are_the_posterior_of_the_whole_fault(model):
    of, own, _ = model
    seen = of({"gain 1": 0.1, "gain 2": -0.05})
    at, others = [0, 1], [2, 3, 4]
    rest_covariance = own + (seen.effects[:, others] * seen.sound[others] ** 2) @ (
        seen.effects[:, others].T
    )
    prior = np.diag(seen.prior[at] ** 2 + seen.sound[at] ** 2)
    effect = seen.effects[:, at]
    gain = prior @ effect.T @ np.linalg.inv(rest_covariance + effect @ prior @ effect.T)
    values, covariance = _sizes(seen, ("gain 1", "gain 2"))
    np.testing.assert_allclose(values, gain @ seen.rest, rtol=1e-6)
    np.testing.assert_allclose(covariance, prior - gain @ effect @ prior, atol=1e-9)


def test_a_fault_may_be_along_one_axis(model):
    seen = model[0]({"place x 1": 0.05})
    along, both = _evidence(seen, ("place x 1",)), _evidence(seen, PLACE.parts)
    assert both < _of_set(seen, frozenset({PLACE})) < along


@pytest.mark.parametrize(
    ("faults", "named"),
    [
        ({}, set()),
        ({"mass": 0.12}, {"mass"}),
        ({"gain 2": -0.15}, {"gain 2"}),
        ({"place x 1": 0.06}, {"place 1"}),
        ({"mass": 0.2, "place y 1": -0.08}, {"mass", "place 1"}),
    ],
)
def test_the_fewest_faults_that_explain_the_data_are_named(model, faults, named):
    some = found(model[0](faults))
    assert {each.fault.name for each in some} == named
    for each in some:
        assert sum(cause.probability for cause in each.verdict.causes) == pytest.approx(1.0)
        assert [cause.change.name for cause in each.verdict.named] == [each.fault.name]
        for part, value in each.parts.items():
            assert value == pytest.approx(faults.get(part, 0.0), abs=0.03)


def test_the_prior_of_a_set_is_the_product_of_its_faults(model):
    rare = Fault("scale", "", 0.01)
    seen = model[0]({})
    seen = replace(seen, order={**seen.order, "scale": seen.order["mass"]})
    weighed = Search((MASS, rare), seen, None, NO_LAG)
    none = 1.0 - OTHER.prior - MASS.prior - rare.prior
    for some in ({MASS}, {rare}):
        prior = np.prod([each.prior / none for each in some])
        log = weighed.weight(frozenset(some)) - _of_set(seen, frozenset(some))
        assert np.exp(log) == pytest.approx(prior)


def test_nothing_is_to_be_corrected_beside_a_fault_that_cannot_be(model):
    alone, *_ = warnings(found(model[0]({"place x 1": 0.08})))
    assert "--correct place" in alone.message
    both = warnings(found(model[0]({"mass": 0.2, "place x 1": 0.08})))
    assert {each.check for each in both} == {"measurement: mass", "measurement: place"}
    assert not any("--correct" in each.message for each in both)
    assert any("weigh the person" in each.message for each in both)


def test_what_no_fault_explains_is_something_else(model):
    """A pattern that has no like among the faults, ten times as large as a person's own."""
    pattern = 10.0 * SPREAD * np.sin(np.arange(COUNT) ** 2)
    seen = model[0]({}, pattern)
    (only,) = found(seen)
    assert only.fault is None
    assert only.verdict.named[0].change is OTHER
    assert not only.verdict.remedy
    (flag,) = warnings([only])
    assert flag.check == "measurement: unexplained"
    assert "contradict each other more than in sound recordings" in flag.message
    calm = model[0]({})
    assert something_else(calm) < 0.0 < something_else(seen)
    # a larger scale of all data is a person's own only so far
    assert log_sound(replace(calm, left=2.5)) < log_sound(calm) - 4.0


@pytest.mark.parametrize(("size", "named"), [(1.0, True), (0.4, False)])
def test_what_is_there_whole_is_not_there_by_less_than_a_half(model, size, named):
    whole = Fault("mirrored moment", "1", 0.01)
    seen = model[0]({"gain 1": size})
    seen = replace(
        seen, order={whole.name: 0}, mean=np.array([1.0, 0.0, 0.0, 0.0, 0.0]),
        prior=np.array([0.15, *seen.prior[1:]]),
    )  # fmt: skip
    (only,) = found(seen, (whole,))
    assert (only.fault == whole) is named


def test_delays_are_weighed_by_their_grid_and_direction(model):
    of = model[0]
    late = of({"gain 1": 1.0})  # the spectrum of a filter, whole
    among = (
        DELAY,
        *(Fault(f"one-way filter of the {of_}", "", 0.01) for of_ in ("markers", "forces")),
    )
    for each in among[1:]:
        late.order[each.name] = 0
    for value, other in ((0.03, "forces"), (-0.03, "markers")):
        search = Search(among, of({}), late, Lag(value, 0.004, 20.0))
        logs = {each.name: search.weight(frozenset({each})) for each in among}
        prior = np.log(0.04) - search.log_none
        assert logs["delay"] == pytest.approx(20.0 + prior)
        assert np.isfinite(logs[f"one-way filter of the {other}"])
        assert sum(np.isfinite([*logs.values()])) == 2
    # which of the two it is the data say, or not
    only, *_ = Search(among[:1], of({}), late, Lag(0.03, 0.004, 20.0)).found()
    assert only.parts == {"delay": 0.03}
    assert "--correct delay" in only.verdict.remedy


def test_what_all_plates_have_is_one_cause(model):
    search = Search(AMONG, model[0]({}), None, NO_LAG)

    def apart(*some):
        return search.apart(frozenset(some))

    crossed, offset, other = (
        Fault(kind, whose, 0.01)
        for kind, whose in (("cross-talk", "1"), ("offset", "1"), ("offset", "2"))
    )
    vertical = Fault("vertical gain", "2", 0.01)
    assert not apart(*GAINS)
    assert not apart(GAINS[0], vertical)  # the same as a wrong mass
    assert apart(GAINS[0], MASS)
    assert not apart(crossed, offset)
    assert apart(crossed, other)
    assert not apart(DELAY, Fault("one-way filter of the forces", "", 0.01))


def test_who_may_have_a_fault():
    both = [f"{part} {plate}" for part in ("gain", "place x", "place y") for plate in "12"]
    some = {each.name: each for each in faults([*both, "mass"], ["right"])}
    assert {"gain 1", "gain 2", "place 1", "place all", "mass"} <= some.keys()
    assert not {"gain all", "rotation 1", "foot right"} & some.keys()
    assert some["place all"].parts == ("place x all", "place y all")
    assert sum(each.prior for each in some.values() if each.kind == "place") == pytest.approx(
        KINDS["place"].prior
    )
    assert "plate delay 1" not in {each.name for each in faults(["gain 1", "plate delay 1"], [])}


@pytest.mark.slow
def test_sets_of_causes_have_one_order_in_every_process():
    # Sums over a set are made in its order, on which their last digits depend.
    code = (
        "from gaitval.session.measurement.estimate import Fault, _parts; "
        "from gaitval.session.measurement.kinds import KINDS; "
        "print(_parts(frozenset(Fault(n, '', .1) for n in KINDS)))"
    )
    messages = {
        subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True, text=True, check=True,
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(messages) == 1
    assert _parts(frozenset({PLACE, MASS})) == ["mass", "place x 1", "place y 1"]


@pytest.mark.parametrize(
    ("name", "reach", "matters"),
    [("all", 0.3, False), ("all", 0.6, True), ("1", 0.6, False)],
)
def test_plates_that_turn_together_matter_by_how_far_they_move_aside(model, name, reach, matters):
    angle = np.array([0.02])  # rad: half of what matters of a turn, and of 10 mm at half a metre
    search = Search(AMONG, replace(model[0]({}), reach=reach), None, NO_LAG)
    assert search._matters(Fault("rotation", name, 0.01), angle) is matters


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
    made = balance(data, 1.7)
    assert not made.effects[:, made.order["place x all"]].any()


def test_what_was_found_is_corrected_and_nothing_else(model):
    seen = model[0]({"gain 1": 0.15, "place x 1": 0.012})
    search = Search(AMONG, seen, None, Lag(0.012, 0.004, -5.0))
    examined = Examined(search.found(), None, seen, search.lag, AMONG, search.weighed)
    made = together(examined, ("gain", "place", "delay"))
    assert made == {"gain 1": pytest.approx(0.15, abs=0.02)}
    assert together(examined, ("place",)) == {}


@pytest.mark.parametrize(
    ("kind", "whose", "values", "said"),
    [
        ("place", "1", [-0.03, 0.002], "plate 1: its place in the file is 30 ± 5 mm back of"),
        ("place", "all", [0.02, -0.02], "20 ± 5 mm forward and 20 ± 5 mm right of"),
        ("rotation", "2", [0.07], "plate 2: it is turned by 4.0 ± 0.3 deg about the vertical"),
        ("gain", "1", [-0.1], "shows forces 10.0 ± 0.5 % too small"),
        ("mass", "", [0.1], "10.0 ± 0.5 % too large, or the forces of all plates are too small"),
        ("delay", "", [-0.03], "the forces come 30 ± 5 ms earlier than the markers"),
        ("offset", "1", [0.0, 0.0, -0.05], "it adds 5.0 ± 0.5 % of the weight down while"),
        ("foot", "left", [0.0, 0.02], "left foot: its markers lie 20 ± 5 mm inwards of"),
        ("clock", "", [-0.01], "1.0 ± 0.5 % too fast"),
    ],
)
def test_a_fault_is_said_with_its_size_and_direction(kind, whose, values, said):
    fault = Fault(kind, whose, 0.01)
    assert said in fault.said(np.array(values), np.full(len(values), 0.005))
