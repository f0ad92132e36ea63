"""How far an identification in another process is."""

import time
from collections.abc import Mapping
from pathlib import Path

from gaitval.artefacts import write_json
from gaitval.identification import posterior
from gaitval.study import run
from gaitval.study.stage import Observer
from gaitval.study.watching import generations_shown


class Seen(Observer):
    """Keeps what is reported to it."""

    def __init__(self) -> None:
        self.progresses: list[dict[str, float]] = []

    def progress(self, values: Mapping[str, float]) -> None:
        self.progresses.append(dict(values))


def wait_for(seen: Seen, count: int) -> None:
    end = time.monotonic() + 20.0
    while len(seen.progresses) < count and time.monotonic() < end:
        time.sleep(0.01)


def test_every_new_generation_is_reported_once(tmp_path: Path) -> None:
    state, seen = tmp_path / "state.json", Seen()
    with generations_shown(seen, state, 40, every=0.01):
        write_json(state, {"key": "a", "values": [[3.0, 2.0]]})
        wait_for(seen, 1)
        write_json(state, {"key": "a", "values": [[3.0, 2.0], [2.5, 1.5], [1.0, 4.0]]})
        wait_for(seen, 2)
        state.unlink()
        time.sleep(0.05)
    assert seen.progresses == [
        {"generation": 1, "total": 40, "value": 2.0},
        {"generation": 3, "total": 40, "value": 1.0},
    ]


def test_the_file_is_that_of_the_search() -> None:
    assert run.STATE == posterior._STATE
