"""Metabolic rates: public implementations on the same states, OpenSim's probes, and energy."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from html_page import only_html, without_figures
from known_walk import loaded_walk

from gaitval.apps.muscles.sharing import MuscleSettings, SharedMotions
from gaitval.apps.muscles.write import write_muscles
from gaitval.kinetics.musculature.forces import change_limits, rate
from gaitval.kinetics.musculature.gait import muscles_of
from gaitval.kinetics.musculature.leg_metabolics import (
    excitations,
    fibre_states,
    fibres_of,
    muscle_rates,
)
from gaitval.kinetics.musculature.metabolics import (
    METABOLISM,
    MODELS,
    Fibres,
    FibreStates,
    slow_shares,
)
from gaitval.kinetics.musculature.paths import table
from gaitval.quantities.metabolic_cost import JOINTS, joint_rate, metabolic_cost
from gaitval.quantities.metabolic_rate import expected_rate

STATES = Path(__file__).parent / "metabolic_states.csv"
"""Random states of 60 muscles, and what the functions of 3dpredictsim (Falisse 2019, MIT, commit
5fa3929f) say of them with b = 100; its files were run as they are."""
SMOOTHING = 100.0


@pytest.fixture(scope="module")
def stored():
    with STATES.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def _given(stored):
    state = FibreStates(
        *(
            stored[name]
            for name in (
                *("excitation", "activation", "length", "speed"),
                *("active", "passive", "isometric"),
            )
        )
    )
    return state, Fibres(*(stored[name] for name in ("mass", "slow", "max_force", "optimal")))


@pytest.mark.parametrize("name", MODELS)
def test_rates_are_those_of_the_public_implementation(stored, name):
    rates = MODELS[name](*_given(stored), smoothing=SMOOTHING)
    np.testing.assert_allclose(rates.total, stored[name], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(rates.work, stored[f"{name}_work"], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_sharp_steps_are_what_smooth_ones_tend_to(stored, name):
    state, fibres = _given(stored)
    away = np.abs(state.speed) > 1e-3  # a step is anywhere between at its own place
    sharp = MODELS[name](state, fibres).total[away]
    smooth = MODELS[name](state, fibres, smoothing=1e7).total[away]
    np.testing.assert_allclose(smooth, sharp, rtol=1e-9)


def test_a_muscle_that_is_missing_costs_nothing(stored):
    state, fibres = _given(stored)
    none = replace(fibres, mass=0.0 * fibres.mass, max_force=0.0 * fibres.max_force)
    still = replace(state, active=0.0 * state.active, passive=0.0 * state.passive)
    for model in MODELS.values():
        assert (model(still, none).total == 0.0).all()


def test_slow_fibres_are_of_muscles_that_there_are():
    names = table().names
    shares = slow_shares(names)
    assert shares[names.index("soleus")] == 0.803
    assert ((shares > 0.3) & (shares < 0.9)).all()


@pytest.fixture(scope="module")
def motion():
    return replace(loaded_walk(), speed=1.2)


@pytest.fixture(scope="module")
def found(motion):
    return muscles_of([motion])


def test_excitation_is_what_makes_activations_rise_and_fall():
    time = np.arange(0.0, 0.5, 0.01)
    wanted = np.where((time > 0.1) & (time < 0.25), 0.8, 0.1)
    fall, rise = change_limits(time)
    activation = np.empty_like(time)
    activation[0] = 0.1
    for t in range(len(time) - 1):
        step = wanted[t] - activation[t]
        activation[t + 1] = activation[t] + (rise if step > 0.0 else fall) * step
    found = excitations(time, activation[:, None])[:, 0]
    np.testing.assert_allclose(found[:-1], wanted[:-1], atol=1e-9)


def test_fibres_do_the_work_of_their_muscles(found):
    """Along a rigid tendon, force times speed is the same at the fibre and at the bone."""
    for _, side, piece in found.pieces:
        leg = piece.legs[side]
        state = fibre_states(
            piece.time, leg.muscles, leg.activation, leg.force, leg.passive, leg.fibre
        )
        rigid = ~leg.muscles.elastic
        fibre = ((state.active + state.passive) * state.speed)[:, rigid]
        muscle = (leg.force * rate(piece.time, leg.length))[:, rigid]
        whole = np.abs(muscle).sum(axis=1).max()
        assert np.abs(fibre - muscle).sum(axis=1).max() < 0.01 * whole


def test_muscles_do_the_work_of_the_joints(found):
    """What muscles do at the bones is what they make of the joints' moments times their rates."""
    for _, side, piece in found.pieces:
        leg = piece.legs[side]
        at_bones = -(leg.force * rate(piece.time, leg.length)).sum(axis=1)
        moments = np.einsum("tmj,tm->tj", leg.arms, leg.force)
        at_joints = (moments * rate(piece.time, leg.loads.angles)).sum(axis=1)
        size = np.abs(at_joints).mean()
        assert np.abs(at_bones - at_joints).mean() < 0.01 * size


def test_heat_is_never_below_what_live_muscle_gives_off(found):
    for _, side, piece in found.pieces:
        leg = piece.legs[side]
        states = fibre_states(
            piece.time, leg.muscles, leg.activation, leg.force, leg.passive, leg.fibre
        )
        rates = muscle_rates(leg.muscles, states)
        mass = fibres_of(leg.muscles).mass
        for each in rates.values():
            assert (each.total - each.work > mass * (1.0 - 1e-9)).all()


def test_the_body_costs_two_legs_and_rest(motion, found):
    cost = metabolic_cost([motion], found)
    assert set(cost.gross) == {*MODELS, JOINTS}
    for model in MODELS:
        legs = [found.legs[side].metabolic[model][:-1].mean() for side in found.legs]
        assert cost.gross[model] == pytest.approx(METABOLISM.rest + sum(legs))
        assert cost.per_metre(model) == pytest.approx(cost.gross[model] / 1.2)
        assert cost.net(model) == pytest.approx(sum(legs))
    low, high = cost.band()
    assert 0.5 * (low + high) == pytest.approx(cost.middle)
    assert high / cost.middle - 1.0 == pytest.approx(1.645 * np.hypot(0.13, 0.083))
    assert metabolic_cost([replace(motion, speed=None)], found).per_metre(JOINTS) is None


def test_a_device_that_does_a_joints_work_saves_it(motion):
    alone = replace(motion, cycles={"right": motion.cycles["right"]})
    half = replace(alone, assist=0.5 * alone.dynamics.moments)
    whole = replace(alone, assist=alone.dynamics.moments)
    # Powers come from splines there and from differences here.
    plain = joint_rate(alone) - METABOLISM.rest
    assert joint_rate(half) - METABOLISM.rest == pytest.approx(0.5 * plain, rel=0.02)
    assert joint_rate(whole) == pytest.approx(METABOLISM.rest)
    assert (
        metabolic_cost([half], muscles_of([half])).muscles
        < metabolic_cost([alone], muscles_of([alone])).muscles
    )


def test_opensims_probes_agree():
    """OpenSim's probes with our choices of their options, on its own muscle at many states."""
    opensim = pytest.importorskip("opensim")
    rows = _probed(opensim)
    names = ("activation", "length", "speed", "active", "passive", "isometric")
    columns = {name: np.array([row[name] for row in rows]) for name in names}
    state = FibreStates(columns["activation"], **columns)
    muscle = rows[0]
    ones = np.ones(len(rows))
    fibres = Fibres(
        muscle["mass"] * ones, 0.6 * ones, muscle["max_force"] * ones, muscle["optimal"] * ones
    )
    for name, probe in (("uchida", "umberger_signed"), ("bhargava", "bhargava")):
        ours = MODELS[name](state, fibres).total
        theirs = np.array([row[probe] for row in rows])
        # Beyond the optimal length its maintenance heat falls; ours, as Falisse's, rises on.
        known = state.length < 1.0 if name == "bhargava" else np.ones(len(rows), dtype=bool)
        assert known.sum() >= len(rows) // 2
        np.testing.assert_allclose(ours[known], theirs[known], rtol=1e-9, atol=1e-9)


def _probed(opensim):
    """What OpenSim has of a muscle on a slider at states of its own, and its probes' rates, W."""
    model = opensim.Model()
    body = opensim.Body("block", 1.0, opensim.Vec3(0), opensim.Inertia(1.0, 1.0, 1.0))
    model.addBody(body)
    slider = opensim.SliderJoint("slider", model.getGround(), body)
    model.addJoint(slider)
    muscle = opensim.Millard2012EquilibriumMuscle("muscle", 1000.0, 0.1, 0.2, 0.0)
    muscle.addNewPathPoint("origin", model.updGround(), opensim.Vec3(0))
    muscle.addNewPathPoint("insertion", body, opensim.Vec3(0))
    muscle.set_ignore_tendon_compliance(True)
    muscle.set_ignore_activation_dynamics(True)
    muscle.set_fiber_damping(0.0)
    model.addForce(muscle)
    signed = opensim.Umberger2010MuscleMetabolicsProbe(True, True, False, True)
    signed.setName("umberger_signed")
    signed.set_use_Bhargava_recruitment_model(True)
    signed.set_include_negative_mechanical_work(True)
    bhargava = opensim.Bhargava2004MuscleMetabolicsProbe(True, True, True, False, True)
    bhargava.setName("bhargava")
    bhargava.set_use_force_dependent_shortening_prop_constant(True)
    bhargava.set_include_negative_mechanical_work(False)
    signed.addMuscle("muscle", 0.6)
    bhargava.addMuscle("muscle", 0.6, 40.0, 133.0, 74.0, 111.0)
    model.addProbe(signed)
    model.addProbe(bhargava)
    state = model.initSystem()
    coordinate = model.getCoordinateSet().get(0)
    rows = []
    for activation in (0.05, 0.4, 0.9):
        for length in (0.7, 0.99, 1.01, 1.3):
            for speed in (-0.4, -0.05, 0.05, 0.4):
                coordinate.setValue(state, 0.2 + 0.1 * length)
                coordinate.setSpeedValue(state, speed)
                model.realizeVelocity(state)
                controls = opensim.Vector(1, activation)
                model.setControls(state, controls)
                model.realizeReport(state)
                rows.append(
                    {
                        "activation": muscle.getActivation(state),
                        "length": muscle.getNormalizedFiberLength(state),
                        "speed": muscle.getFiberVelocity(state),
                        "active": muscle.getActiveFiberForce(state),
                        "passive": muscle.getPassiveFiberForce(state),
                        "isometric": muscle.getActiveForceLengthMultiplier(state),
                        "mass": 1000.0 / 250_000.0 * METABOLISM.density * 0.1,
                        "max_force": 1000.0,
                        "optimal": 0.1,
                        "umberger_signed": signed.computeProbeInputs(state).get(0),
                        "bhargava": bhargava.computeProbeInputs(state).get(0),
                    }
                )
    return rows


def test_the_page_of_a_walk_says_what_it_costs(motion, found, tmp_path, monkeypatch):
    """Every sentence of the page is made, that of a walk whose speed is not known, too."""
    only_html(monkeypatch)
    without_figures(monkeypatch)
    for speed, expected in ((1.34, True), (None, False)):
        walk = replace(motion, speed=speed)
        cost = metabolic_cost([walk], found)
        shared = SharedMotions(found)
        write_muscles(tmp_path / str(speed), shared, MuscleSettings(), walk, cost)
        text = (tmp_path / str(speed) / "muscles.html").read_text(encoding="utf-8")
        low, high = cost.band()
        assert f"{low:.1f} to {high:.1f} W/kg" in text
        sentence = f"at 1.34 m/s on level ground, {expected_rate(1.34):.1f} W/kg are expected."
        assert (sentence in text) is expected
