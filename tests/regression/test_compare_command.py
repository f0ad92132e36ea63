"""`gaitval compare` of walks and of results of devices at once compares both, or says which not."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from html_page import only_html
from typer.testing import CliRunner

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.apps.devices.results import VERSION
from gaitval.cli import app
from gaitval.terminal import display

REPORTS = Path(__file__).parents[2] / "reports"
WALK = REPORTS / "S05" / "baseline"

Device = Callable[..., Path]


@pytest.fixture
def message(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    text = io.StringIO()
    monkeypatch.setattr(display, "messages", display.Terminal(file=text, width=600))
    only_html(monkeypatch)
    return text


@pytest.fixture
def device(tmp_path: Path) -> Device:
    """Writes a result of a device with one figure."""

    def write(place: str, speed: float) -> Path:
        folder = tmp_path / place / "S05-hip_exo"
        folder.mkdir(parents=True)
        figure = {"quantity": "speed", "of": "left, without", "unit": "m/s", "value": speed}
        about = {"version": VERSION, "person": "S05", "walker": "5", "cycles": 20.0}
        write_json(folder / "device.json", about | {"figures": [figure]})
        return folder

    return write


def compare(tmp_path: Path, now: list[Path], before: list[Path], *options: str) -> Any:
    earlier = [word for folder in before for word in ("--before", str(folder))]
    words = ["compare", *map(str, now), *earlier, "--out", str(tmp_path / "out"), *options]
    return CliRunner().invoke(app, words)


@pytest.mark.slow
@pytest.mark.parametrize("strict", [(), ("--strict",)])
def test_what_is_in_one_version_only_is_said_and_nothing_is_written(
    device: Device, message: io.StringIO, tmp_path: Path, strict: tuple[str, ...]
) -> None:
    """Else it would pass without having been compared."""
    now, then = device("now", 1.2), device("before", 1.2)
    for runs, before, text in (
        ([now, WALK], [then], f"{WALK}: walks given with RUN, but none with --before"),
        ([now], [then, WALK], f"{WALK}: walks given with --before, but none with RUN"),
        ([now, WALK], [WALK], f"{now}: results of `gaitval device` given with RUN, but none"),
        ([WALK], [then, WALK], f"{then}: results of `gaitval device` given with --before"),
    ):
        assert compare(tmp_path, runs, before, *strict).exit_code == 2
        assert text in message.getvalue()
        assert "nothing to be compared with" in message.getvalue()
        message.truncate(0)
    assert not (tmp_path / "out").exists()
    assert compare(tmp_path, [now, WALK], [then, WALK], *strict).exit_code == 0


@pytest.mark.slow
def test_both_reports_are_there_where_a_device_fails(
    device: Device, message: io.StringIO, tmp_path: Path
) -> None:
    now, then = device("now", 1.2), device("before", 2.2)
    done = compare(tmp_path, [now, WALK], [then, WALK], "--strict")
    assert done.exit_code == 1
    assert "1 of 1 figures of devices moved by more than their margin" in message.getvalue()
    assert (tmp_path / "out" / "devices.html").is_file()
    assert (tmp_path / "out" / "comparison.html").is_file()
    assert "0 of 159 measures got worse" in done.output


@pytest.mark.slow
def test_all_that_got_worse_is_said(device: Device, message: io.StringIO, tmp_path: Path) -> None:
    now, then = device("now", 1.2), device("before", 2.2)
    walks = [WALK, REPORTS / "S02" / "baseline"]
    assert compare(tmp_path, [now, WALK], [then, *walks], "--strict").exit_code == 1
    assert "1 of 1 figures of devices moved" in message.getvalue()
    assert "no walk now of S02" in message.getvalue()


@pytest.mark.slow
def test_another_record_is_said(message: io.StringIO, tmp_path: Path) -> None:
    """Its figures move for that alone."""
    values = read_json(WALK / "metrics.json")
    values["provenance"]["record"] = 64 * "f"
    (tmp_path / "now").mkdir()
    write_json(tmp_path / "now" / "metrics.json", values)
    done = compare(tmp_path, [tmp_path / "now"], [WALK])
    assert done.exit_code == 0, done.output
    assert "compared with another record than before: S05" in done.output
