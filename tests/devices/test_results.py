"""A result of devices is written once: the file, and the table with the same figures."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from html_page import only_html

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.devices import results, study
from gaitval.apps.devices.page import write_report
from gaitval.apps.devices.results import MARGINS, DeviceResult, figures
from gaitval.apps.devices.study import Wearer, outcomes
from gaitval.model.devices.device import load_devices


@pytest.fixture(scope="module")
def who(person):
    return Wearer("S05", person.task, person.policy, person.mu, origin="5", height=1.75)


def test_a_result_is_written_as_it_is_and_the_table_has_its_figures(who, tmp_path, monkeypatch):
    only_html(monkeypatch)
    devices = load_devices("ankle_spring")
    monkeypatch.setattr(study, "PUSHES", study.PUSHES[:1])
    walked, _ = outcomes(who, devices, samples=0, cycles=8.0)
    write_report(tmp_path, who, devices, walked, None)
    result = DeviceResult.model_validate(read_json(tmp_path / "device.json"))
    assert (result.person, result.cycles) == (who.name, 20.0)
    found = {(each.quantity, each.side, each.assumption): each for each in result.figures}
    assert found["hip: lowest moment of the muscles", "left", "moments kept"].unit == "Nm/kg"
    assert found["pushes survived", None, "without"].value == walked[0].survived
    assert ("pushes survived", None, "kinematics kept") not in found  # where nothing can fall
    assert {each.unit for each in result.figures} == set(MARGINS)
    rows = list(csv.DictReader((tmp_path / "device.csv").open(encoding="utf-8")))
    assert [each["quantity"] for each in rows] == [each.quantity for each in result.figures]
    assert [float(each["value"]) for each in rows] == [each.value for each in result.figures]


def test_no_figure_hangs_on_which_of_two_peaks_is_farther_from_0(who):
    """The shipped hip_exo asks for 8 Nm down and 8 Nm up: a hair between them is no change."""
    devices = load_devices("hip_exo")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "PUSHES", ())
        found, _ = outcomes(who, devices, samples=0, cycles=6.0)
    kept, key = found[1], ("hip_flexion", "right")
    assert kept.curves is not None
    torque = kept.curves.device[key]
    values = [
        results.figures_of(
            replace(kept, curves=replace(kept.curves, device={**kept.curves.device, key: each})),
            "right",
        )
        for each in (
            torque * np.where(torque < 0.0, 1.05, 1.0),
            torque * np.where(torque > 0.0, 1.05, 1.0),
        )
    ]
    assert values[0] == pytest.approx(values[1], abs=0.01)


def test_nothing_walked_has_no_figures():
    assert figures([]) == []
