"""`gaitval check` and `compare` take the results of devices on people."""

import pytest
from html_page import only_html
from typer.testing import CliRunner

from gaitval.artefacts import write_json
from gaitval.cli.app import app
from gaitval.errors import ArtefactError
from gaitval_devices import results
from gaitval_devices.results import Figure
from gaitval_gate import device_results

HIP = Figure("hip: largest moment of the muscles", "right, learned", "Nm/kg", -0.8)
SPEED = Figure("speed", "left, without", "m/s", 1.2)
FELL = Figure("stance", "left, learned", "% of the cycle", None)


@pytest.fixture
def stored(tmp_path):
    """Writes a result of figures into a folder."""

    def write(place, *figures):
        folder = tmp_path / place
        folder.mkdir(parents=True)
        about = {"version": 1, "person": "S05", "walker": "5", "cycles": 20.0}
        write_json(folder / "device.json", about | {"figures": [e._asdict() for e in figures]})
        return folder

    return write


def changes(before, now):
    return [row.change for row in device_results.rows(before, now)]


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
    assert "2 measures within their margins" in done.output
    assert 'failures="0"' in junit.read_text(encoding="utf-8")
    refused = CliRunner().invoke(app, [*words, "--history", str(tmp_path / "h.db")])
    assert refused.exit_code == 2
    assert "neither better nor worse" in " ".join(refused.output.split())
    now[0] = HIP._replace(value=-0.7)
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 1
    assert 'failures="1"' in junit.read_text(encoding="utf-8")


def test_compare_shows_results_and_what_moved(stored, tmp_path, monkeypatch):
    only_html(monkeypatch)
    now = [stored("now/S05-hip_exo", HIP, SPEED), stored("now/S05-backpack", SPEED)]
    before = stored("before/S05-hip_exo", HIP._replace(value=-0.9), SPEED)
    out = tmp_path / "out"
    rows = device_results.compare(out, now, [before])
    assert [(row.measure, row.change) for row in rows] == [
        (HIP.quantity, "lost"),
        ("speed", "kept"),
    ]
    page = (out / "devices.html").read_text(encoding="utf-8")
    assert "S05-hip_exo" in page
    assert "S05-backpack" in page
    words = ["compare", *map(str, now), "--before", str(before), "--out", str(out)]
    assert CliRunner().invoke(app, words).exit_code == 0
    assert CliRunner().invoke(app, [*words, "--strict"]).exit_code == 1


def test_results_of_other_names_are_refused(stored, tmp_path, monkeypatch):
    only_html(monkeypatch)
    now, before = stored("now/S05-hip_exo", HIP), stored("before/S05-afo", HIP)
    with pytest.raises(ArtefactError, match="none of the results"):
        device_results.compare(tmp_path / "out", [now], [before])
