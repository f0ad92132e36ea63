"""The fit of motion and body together: its derivatives, its posterior, and a planted body."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from simulation_fixtures import changed

from gaitval._internal.io.artefacts import read_json
from gaitval.configuration import load_configuration
from gaitval.constants import GRAVITY
from gaitval.coordinates import COORDINATES
from gaitval.gait.cycle_curves import FORCES
from gaitval.gait.record import HARMONICS, GaitRecord, periodic_through
from gaitval.identification.body_fit import NUISANCES, BodyFit, angle_sd
from gaitval.identification.combinations import combinations, judged_combinations
from gaitval.identification.prior import prior_sd
from gaitval.identification.unidentified import unidentified
from gaitval.metrics.reference_curves import reference_curves
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.prediction.population import noise_of_expected
from gaitval.subjects.prediction.seen import PHASES, stance_curves
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference import dynamic_fit
from gaitval.walk.reference.dynamic_fit import fitted, weighted_laws
from gaitval.walk.reference.motion import build_reference
from gaitval.walk.reference.walking_laws import TRUNK

CONFIGURATION = load_configuration()
STORED = Path(__file__).parents[2] / "reports" / "S05" / "baseline"


class Planted(NamedTuple):
    """A record, the body that it began with as scaled, and mu of the body that it is of."""

    record: GaitRecord
    subject: Subject
    model: BodyModel
    truth: np.ndarray


@pytest.fixture(scope="module")
def person():
    """Known by stature, and thighs and shanks are 3 % longer: the record is of what walks so."""
    subject, contact = load_subject("S05").by_stature(), CONFIGURATION.contact
    record, model = subject.record(), scale_subject(subject).model
    truth = nominal_parameters()
    truth[[PARAMETERS.index(name) for name in ("thigh_length", "shank_length")]] *= 1.03
    body = apply_parameters(model, truth)
    reference = fitted(build_reference(record, body, contact), record, body, contact)
    walk = reference_curves(reference, body.mass, record.left_phase)

    def sampled(curve):
        return np.interp(PHASES, np.linspace(0.0, 1.0, 101), curve)

    def of(curves, names):
        harmonics = HARMONICS.harmonics_cap
        known = {name: sampled(curves[name]) for name in names if name in curves}
        return {name: periodic_through(values, harmonics) for name, values in known.items()}

    forces = {}
    for side, left in (("right", 1.0), ("left", -1.0)):
        rows = [sampled(walk.forces[f"{name}_{side[0]}"]) for name in FORCES]
        rows[1] *= left
        forces[side] = stance_curves(np.column_stack(rows), record.stance_fraction[side])
    angles = record.angles | of(walk.angles, record.angles)
    moments = record.moments | of(walk.moments, record.moments)
    planted = replace(record, angles=angles, moments=moments, forces=forces)
    return Planted(planted, subject, model, truth)


@pytest.fixture(scope="module")
def fit(person):
    return BodyFit(
        person.record, person.model, CONFIGURATION.contact, CONFIGURATION.noise,
        prior_sd=prior_sd(person.subject),
    )  # fmt: skip


@pytest.fixture(scope="module")
def fixed(fit):
    return fit.solve(fixed=nominal_parameters())


@pytest.fixture(scope="module")
def solution(fit, fixed):
    return fit.solve(start=fixed, smallest_gain=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hip_flexion", "hip_adduction", "knee_angle", "ankle_angle"])
def test_a_centre_out_of_place_moves_its_moment_by_the_force_on_its_own_foot(person, fit, name):
    """By the force times the SD of a centre's place; each centre has an error of its own."""
    record, mass = person.record, person.model.mass
    phase = np.arange(dynamic_fit.DYNAMIC_FIT.instants) / dynamic_fit.DYNAMIC_FIT.instants
    vertical = {
        side: record.ground_reaction(side, np.mod(phase - begin, 1.0))[:, 2]
        for side, begin in (("right", 0.0), ("left", record.left_phase))
    }
    weight = mass * GRAVITY / sum(each.mean() for each in vertical.values())  # N, on the whole
    used = set()
    for side, force in vertical.items():
        row = COORDINATES.index(f"{name}_{side[0]}")
        levers = fit.problem.lever[:, row, NUISANCES:]
        (column,) = np.flatnonzero(levers.any(axis=0))
        used.add(column)
        moved = CONFIGURATION.noise.joint_centre * weight * force
        np.testing.assert_allclose(np.abs(levers[:, column]), np.abs(moved), atol=1e-9)
    assert len(used) == 2


@pytest.mark.slow
def test_another_body_changes_the_laws_as_its_derivatives_say(fit, fixed):
    """Forces and moments of the same motion, for a body whose hips are a millimetre forward."""
    index = PARAMETERS.index("hip_x")
    step = 0.001 / fit.prior_sd[index]
    above, below = (fixed.common.copy() for _ in range(2))
    above[3 + index] += step
    below[3 + index] -= step
    up, _ = weighted_laws(fit.problem, fixed.change, above, 1.0)
    down, _ = weighted_laws(fit.problem, fixed.change, below, 1.0)
    there, _ = weighted_laws(fit.problem, fixed.change, fixed.common, 1.0)
    np.testing.assert_allclose(up + down - 2 * there, 0.0, atol=0.02 * np.abs(up - down).max())
    assert np.abs(up - down)[:, : TRUNK.start].max() > 0.01


def test_a_free_body_is_at_least_as_likely_as_the_one_that_was_scaled(fit, fixed, solution):
    assert solution.cost < fixed.cost
    nominal = fit.posterior(fixed._replace(covariance=solution.covariance)).mean
    np.testing.assert_array_equal(nominal, nominal_parameters())


@pytest.mark.slow
def test_the_record_says_nothing_of_damping_and_friction(fit, solution):
    found = fit.posterior(solution)
    np.testing.assert_allclose(found.contraction[:2], 1.0, rtol=1e-6)
    np.testing.assert_allclose(found.mean[:2], nominal_parameters()[:2], rtol=1e-9)
    assert (found.contraction[2:] < 1.0).all()


@pytest.mark.slow
def test_the_planted_leg_is_found_within_its_uncertainty(fit, solution, person):
    """The prior knows it to 3.4 %; the record to half of that."""
    found = fit.posterior(solution)
    leg = judged_combinations(found, person.model)[0]
    truth = combinations(person.model)[0].weights @ (person.truth - found.prior_mean)
    assert leg.contraction < 0.6
    assert abs(leg.mean - truth) < 2.5 * leg.sd
    assert np.sum(((person.truth - found.mean) / found.sd)[2:] ** 2) < 40.0  # chi square of 12


def test_the_noise_of_an_angle_has_the_size_that_is_set():
    sd = angle_sd(CONFIGURATION.noise)
    harmonics = (len(sd) - 1) // 2
    assert sd[0] == CONFIGURATION.noise.angle_offset
    np.testing.assert_array_equal(sd[1 : 1 + harmonics], sd[1 + harmonics :])
    # a cosine and a sine of SD s have together a mean square of s²
    assert np.sum(sd[1 : 1 + harmonics] ** 2) == pytest.approx(CONFIGURATION.noise.angle**2)


def test_kinetics_that_are_expected_weigh_little():
    plain, expected = CONFIGURATION.noise, noise_of_expected(CONFIGURATION.noise)
    for name in ("moment", "adduction_moment", "vertical_force", "forward_force", "medial_force"):
        assert getattr(expected, name) >= 2.0 * getattr(plain, name)
    assert expected.angle == plain.angle


def test_without_a_method_the_body_stays_as_scaled(task):
    quick = changed(task, identification={"method": "none"})
    sd = prior_sd(load_subject("S05"))
    found = unidentified(quick.configuration, sd)
    assert found.identified == found.nominal == nominal_parameters().tolist()
    assert set(found.verdicts) == {"not identified"}
    assert found.deviance_nominal is None


def test_a_stored_identification_is_one_of_this_kind():
    stored = read_json(STORED / "identification.json")
    assert len(stored["verdicts"]) == len(stored["correlation"]) == 14
