"""`gaitval check` and `compare` take the results of devices on people."""

import pytest
from html_page import only_html
from typer.testing import CliRunner

from gaitval._internal.io.artefacts import write_json
from gaitval.apps.devices import results
from gaitval.apps.devices.results import DeviceFigure
from gaitval.apps.regression import device_results
from gaitval.cli import app
from gaitval.errors import ArtefactError

HIP = DeviceFigure("hip: lowest moment of the muscles", "right, learned", "Nm/kg", -0.8)
SPEED = DeviceFigure("speed", "left, without", "m/s", 1.2)
FELL = DeviceFigure("stance", "left, learned", "% of the cycle", None)


@pytest.fixture
def stored(tmp_path):
    """Writes a result of figures into a folder."""

    def write(place, *figures, person="S05"):
        folder = tmp_path / place
        folder.mkdir(parents=True)
        about = {"version": results.VERSION, "person": person, "walker": "5", "cycles": 20.0}
        write_json(folder / "device.json", about | {"figures": [e._asdict() for e in figures]})
        return folder

    return write


def changes(before, now):
    return [row.change for row in device_results.rows(before, now, results.MARGINS)]


def test_a_figure_may_move_by_its_margin_in_both_directions():
    margin = results.MARGINS["Nm/kg"]
    for sign in (-1.0, 1.0):
        near, far = (HIP._replace(value=HIP.value + sign * k * margin) for k in (0.99, 1.01))
        assert changes([HIP], [near]) == ["kept"]
        assert changes([HIP], [far]) == ["lost"]


def test_a_figure_that_is_there_once_is_another_result():
    assert changes([HIP, SPEED], [HIP]) == ["kept", "lost"]
    assert changes([HIP], [HIP, SPEED]) == ["kept", "lost"]
    assert changes([FELL], [FELL]) == ["kept"]
    assert changes([FELL], [FELL._replace(value=60.0)]) == ["lost"]


def test_check_walks_a_result_again(stored, tmp_path, monkeypatch):
    folder = stored("S05-hip_exo", HIP, SPEED)
    now = [HIP, SPEED]
    monkeypatch.setattr(results, "walk_again", lambda folder, say: now)
    junit = tmp_path / "junit.xml"
    words = ["check", "--baseline", str(folder), "--junit", str(junit)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "2 of 2 measures within their margins" in done.output
    assert 'failures="0"' in junit.read_text(encoding="utf-8")
    now[0] = HIP._replace(value=-0.7)
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 1
    assert 'failures="1"' in junit.read_text(encoding="utf-8")


def test_compare_shows_results_and_what_moved(stored, tmp_path, monkeypatch):
    only_html(monkeypatch)
    now = [stored("now/S05-hip_exo", HIP, SPEED), stored("now/S05-backpack", SPEED)]
    before = stored("before/S05-hip_exo", HIP._replace(value=-0.9), SPEED)
    out = tmp_path / "out"
    found = device_results.compare(out, now, [before], results)
    assert [(row.measure, row.change) for row in found.rows] == [
        (HIP.quantity, "lost"),
        ("speed", "kept"),
    ]
    assert found.added == ["S05-backpack"]
    page = (out / "devices.html").read_text(encoding="utf-8")
    assert "S05-hip_exo" in page
    assert "S05-backpack" in page
    words = ["compare", *map(str, now), "--before", str(before), "--out", str(out)]
    assert CliRunner().invoke(app, words).exit_code == 0
    assert CliRunner().invoke(app, [*words, "--strict"]).exit_code == 1


def test_results_of_one_name_stay_apart(stored, tmp_path, monkeypatch):
    """The main job calls the folder of each person's device alike: reports/S05/hip_exo."""
    only_html(monkeypatch)
    fast = SPEED._replace(value=1.5)
    now = [stored("now/S05/hip_exo", SPEED), stored("now/S06/hip_exo", fast, person="S06")]
    before = [stored("old/S06/hip_exo", fast, person="S06"), stored("old/S05/hip_exo", SPEED)]
    out = tmp_path / "out"
    found = device_results.compare(out, now, before, results)
    header, row = (out / "devices.csv").read_text(encoding="utf-8").splitlines()
    assert header.split(",")[3:] == ["S05/hip_exo", "S06/hip_exo"]
    assert row.endswith("1.2,1.5")
    assert [(each.target, each.change) for each in found.rows] == [
        ("S05/hip_exo: left, without", "kept"),
        ("S06/hip_exo: left, without", "kept"),
    ]


def test_a_result_that_is_gone_fails_a_strict_comparison(stored, tmp_path, monkeypatch):
    only_html(monkeypatch)
    now = stored("now/S05-afo", SPEED)
    before = [stored("old/S05-afo", SPEED), stored("old/S05-backpack", SPEED)]
    words = ["compare", str(now), "--out", str(tmp_path / "out")]
    words += [word for folder in before for word in ("--before", str(folder))]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "no result now of S05-backpack" in done.output
    assert CliRunner().invoke(app, [*words, "--strict"]).exit_code == 1


@pytest.mark.parametrize(
    ("now", "before", "message"),
    [
        (["S05-hip_exo"], {"S05-afo": "S05"}, "none of the results"),
        (["S05/hip_exo"], {"S06/hip_exo": "S06"}, r"hip_exo \(of S05\) is there"),
        (["a/hip_exo", "b/hip_exo"], {"hip_exo": "S05"}, "not clear which"),
    ],
    ids=["another name", "another person", "two of one name"],
)
def test_results_that_are_not_of_the_same_are_not_compared(
    stored, tmp_path, monkeypatch, now, before, message
):
    only_html(monkeypatch)
    walked = [stored(f"now/{place}", SPEED) for place in now]
    earlier = [stored(f"old/{place}", SPEED, person=who) for place, who in before.items()]
    with pytest.raises(ArtefactError, match=message):
        device_results.compare(tmp_path / "out", walked, earlier, results)
