"""A study's identification by another method: its bounds decide nothing, its body is shrunk."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from body_result import MODEL, made_up

from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError, ConfigurationError
from gaitval.identification import begin, default, rollouts
from gaitval.identification.offsets import offset_of
from gaitval.identification.prior import prior_sd
from gaitval.identification.unidentified import WIDE, bounded
from gaitval.metrics.identified_body import MOST, identified_model, with_legs
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval.study import identification_stages
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.motion import ReferenceMotion

CONFIGURATION = load_configuration()
SD = prior_sd(load_subject("S05"))


def test_a_thigh_two_sds_longer_is_within_its_bounds():
    mu = nominal_parameters()
    thigh = PARAMETERS.index("thigh_length")
    mu[thigh] += 2.0 * SD[thigh]
    found = bounded(mu, SD, CONFIGURATION)
    assert found.identified[thigh] == mu[thigh]
    assert not any(found.on_bound)


def test_what_is_beyond_the_wide_bounds_is_cut_and_said_to_be():
    mu = nominal_parameters()
    hip = PARAMETERS.index("hip_y")
    mu[hip] -= 3.0 * SD[hip]
    found = bounded(mu, SD, CONFIGURATION)
    np.testing.assert_allclose(found.identified[hip], nominal_parameters()[hip] - WIDE * SD[hip])
    assert [name for name, at in zip(PARAMETERS, found.on_bound, strict=True) if at] == ["hip_y"]
    assert set(found.verdicts) == {"not identified"}


class Asked(Exception):
    """Instead of a fit, which takes seconds."""


def test_shared_errors_of_a_study_have_the_offset_of_other_people_as_gaitval_body_has(monkeypatch):
    subject, given = load_subject("S05"), []

    def identified(fit, fixed, offset):
        given.append(offset)
        raise Asked

    monkeypatch.setattr(default, "identified", identified)
    model, record = scale_subject(subject).model, subject.record()
    with pytest.raises(Asked):
        default.shared_identification(None, None, subject, record, model, CONFIGURATION, None)
    np.testing.assert_array_equal(given[0], offset_of(subject))
    assert given[0].any()


def test_parameters_of_an_earlier_file_are_read_if_they_are_all_that_is_left():
    given = ["identification.parameters=paper"]
    assert load_configuration(settings=given) == CONFIGURATION
    with pytest.raises(ConfigurationError, match=r"identification\.parameters: unknown"):
        load_configuration(settings=["identification.parameters=extended"])


def test_a_study_identifies_by_the_method_that_it_names(monkeypatch, tmp_path):
    subject, wanted = load_subject("S05"), []

    def by_rollouts(*given):
        wanted.append(given)
        return "found"

    monkeypatch.setattr(rollouts, "rollouts_identification", by_rollouts)
    monkeypatch.setattr(identification_stages, "read_urdf", lambda path: "model")
    monkeypatch.setattr(ReferenceMotion, "load", lambda path: path.name)
    monkeypatch.setattr(
        identification_stages, "stored_policy", lambda run, folder: folder.relative_to(run.folder)
    )
    started = ("fit", "held")
    monkeypatch.setattr(
        begin, "begin", lambda *given: started if given[-1] == "reference.npz" else 0
    )
    configuration = load_configuration(settings=["identification.method=rollouts"])
    run = SimpleNamespace(
        subject=subject, configuration=configuration, observer=SimpleNamespace(progress="told"),
        folder=tmp_path, known_record=lambda: SimpleNamespace(record="record"),
    )  # fmt: skip
    folder = tmp_path / "rounds" / "3" / "identification"
    assert identification_stages._searched(run, SD, folder) == "found"
    policy = Path("rounds/3/trained")
    assert wanted == [("fit", "record", "model", policy, configuration, "told")]


def leg_of(model, side):
    """m, thigh and shank of one leg."""
    return -sum(model[f"{name}_{side}"].joint_position[2] for name in ("shank", "foot"))


@pytest.mark.parametrize("apart", [0.012, -0.012])
def test_the_walker_has_legs_that_differ_by_what_was_found(apart):
    model = scale_subject(load_subject("S05")).model
    before = leg_of(model, "l") - leg_of(model, "r")
    found = {"nominal": [1.0], "identified": [1.01], "left_leg": 0.5 * apart / model.leg_length}
    walker = identified_model(model, found)
    assert leg_of(walker, "l") - leg_of(walker, "r") - before == pytest.approx(apart, abs=1e-4)
    assert walker.leg_length == pytest.approx(model.leg_length, abs=1e-4)
    # a body that the record does not support walks as scaled, with its legs
    assert identified_model(model, found | {"identified": [1.0]}) is model
    assert identified_model(model, {"nominal": [1.0], "identified": [1.01]}) is model


@pytest.mark.parametrize("left", [2.0 * MOST, float("nan"), "long"])
def test_legs_that_cannot_be_are_refused(left):
    with pytest.raises(ArtefactError, match="left_leg"):
        with_legs(scale_subject(load_subject("S05")).model, left)


@pytest.mark.parametrize(
    ("two_legs", "deviance", "longer"),
    [(False, 150.0, 0.0), (True, 150.0, 1.0), (True, 514.0, 0.0)],
)
def test_the_walker_has_two_legs_only_if_told_and_no_body_of_a_record_that_does_not_fit(
    monkeypatch, two_legs, deviance, longer
):
    found = replace(made_up(0.5, 0.022), cost=deviance)
    monkeypatch.setattr(default, "identified", lambda *given: found)
    setting = f"identification.two_legs={str(two_legs).lower()}"
    configuration = load_configuration(settings=[setting])
    fit, fixed = None, SimpleNamespace(cost=200.0)
    made = default.shared_identification(
        fit, fixed, load_subject("S05"), None, MODEL, configuration, lambda told: None
    )
    apart, _ = found.legs.estimate
    assert made.left_leg == pytest.approx(longer * 0.5 * apart / MODEL.leg_length)
    moved = np.abs(np.array(made.identified) - nominal_parameters()).max()
    assert (moved > 1e-3) == found.fits
    assert f"{deviance:.0f}" in made.words["said"]
