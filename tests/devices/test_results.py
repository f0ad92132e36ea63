"""A stored result of devices is read, walked again, and shown beside others."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from html_page import only_html

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.apps.devices import results, study
from gaitval.apps.devices.results import (
    MARGINS,
    RESULT,
    DeviceFigure,
    figures,
    stored,
    walk_again,
    write_result,
    write_side_by_side,
)
from gaitval.apps.devices.study import Wearer, outcomes
from gaitval.errors import ArtefactError
from gaitval.model.devices.device import load_devices, write_devices
from gaitval.model.devices.drawn import DEVICES_FILE


@pytest.fixture(scope="module")
def who(person):
    return Wearer("S05", person.task, person.policy, person.mu, origin="5")


@pytest.fixture(scope="module")
def folder(who, tmp_path_factory):
    """A result of short walks, with the person's own policy as what was learned."""
    folder = tmp_path_factory.mktemp("S05-ankle_spring")
    devices = load_devices("ankle_spring")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "PUSHES", study.PUSHES[:1])
        found, _ = outcomes(who, devices, samples=0, cycles=8.0)
    write_devices(folder / DEVICES_FILE, devices)
    write_result(folder, who, found, 8.0)
    return folder


def test_a_result_walked_again_is_the_same(folder, who, monkeypatch):
    monkeypatch.setattr(study, "PUSHES", study.PUSHES[:1])
    monkeypatch.setattr(study, "wearer", lambda name: who if name == "5" else None)
    before, now = stored(folder), walk_again(folder)
    assert results.person_of(folder) == "S05"
    assert [each[:3] for each in before] == [each[:3] for each in now]
    for old, new in zip(before, now, strict=True):
        assert new.value == pytest.approx(old.value, rel=1e-5, abs=1e-5)
    units = {each.unit for each in before}
    assert units == set(MARGINS)


def test_figures_have_side_and_assumption(folder):
    found = {(each.quantity, each.of) for each in stored(folder)}
    assert ("hip: lowest moment of the muscles", "left, moments kept") in found
    assert ("pushes survived", "without") in found
    assert ("pushes survived", "kinematics kept") not in found  # where nothing can fall


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


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"version": 1}, "version 1, not 3"),
        ({"figures": []}, "no figures"),
        ({"figures": [{"quantity": "q", "of": "o", "unit": "ell", "value": 1.0}]}, "'ell'"),
        ({"figures": [{"quantity": "q", "of": "o", "unit": "s"}]}, "value"),
        ({"figures": 3}, "int"),
        ({"cycles": -1.0}, "no figures, or not of whom"),
    ],
)
def test_a_damaged_result_is_refused(folder, tmp_path, change, says):
    write_json(tmp_path / RESULT, read_json(folder / RESULT) | change)
    with pytest.raises(ArtefactError, match="not the result of devices") as error:
        stored(tmp_path)
    assert says in str(error.value)


def test_results_are_shown_side_by_side(folder, tmp_path):
    rows = stored(folder)
    other = [each._replace(value=None) for each in rows[:3]]
    results.write_side_by_side(tmp_path, "devices", {"spring": rows, "other": other})
    page = (tmp_path / "devices.html").read_text(encoding="utf-8")
    assert "Nobody" not in page
    assert "nobody knows which is right" in page
    table = list(csv.reader((tmp_path / "devices.csv").open(encoding="utf-8")))
    assert table[0] == ["quantity", "of", "unit", "spring", "other"]
    assert len(table) == len(rows) + 1
    assert table[1][3] == f"{rows[0].value:.6g}"
    assert table[1][4] == ""


def test_nothing_walked_has_no_figures():
    assert figures([]) == []


def test_side_by_side_assumptions_are_in_the_order_of_a_result_and_counts_are_whole(
    tmp_path, monkeypatch
):
    only_html(monkeypatch)
    rows = [
        DeviceFigure("gait cycles walked", "without", "cycles", 20.0),
        DeviceFigure("speed", "right, without", "m/s", 1.125),
        DeviceFigure("gait cycles walked", "learned", "cycles", 20.0),
    ]
    write_side_by_side(tmp_path, "devices", {"one": rows})
    page = (tmp_path / "devices.html").read_text(encoding="utf-8")
    titles = ["Without", "Right, without", "Learned"]
    assert re.findall(r"<h2[^>]*>([^<]*)", page) == titles
    assert re.findall(r'<td class="n">([^<]*)', page) == ["20", "1.12", "20"]
