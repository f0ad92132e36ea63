"""A killed import is started again with the same results, and two at once do not spoil each other.
`python tests/robustness/kills.py` kills studies, reports and checks as well, at many moments."""

import json
import sys
from dataclasses import replace

import kills
import pytest
from html_page import WITHOUT_FIGURES
from made_up_session import SHORT, made_up_session

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="processes are found in /proc"
)


@pytest.fixture(scope="module")
def work():
    """The job, a folder for temporary files, its processor time, and what it writes. Its session is
    a short one, and its page has no figures: what is written is the same, in less time.
    """
    with kills.workplace() as (folder, temporary, jobs):
        made_up_session(folder / "session", noise=kills.NOISE, **SHORT)
        job = replace(jobs["import"], setting=WITHOUT_FIGURES)
        job.prepared()
        seconds = job.whole(temporary)
        yield job, temporary, seconds, kills.contents(job.folder)


@pytest.mark.slow  # `test_import_errors.py` kills an import in every run of the tests
def test_an_import_that_is_killed_and_started_again_writes_the_same(work):
    job, temporary, seconds, wanted = work
    found = kills.killed(job, 0.6 * seconds, temporary, clock_back=True)
    assert found is not None, "it ended before it was killed"
    assert found["returned"] == 0, found["told"]
    assert kills.left(found) == 0, found
    assert kills.contents(job.folder) == wanted


@pytest.mark.slow
def test_two_imports_into_one_folder(work):
    job, temporary, _, wanted = work
    job.prepared()
    both = kills.at_once(job, wanted, temporary)
    assert kills.unspoilt(both), both


def test_only_times_may_differ(tmp_path):
    def written(name, seconds, value):
        folder = tmp_path / name
        (folder / "policy").mkdir(parents=True)
        (folder / "policy" / "training.csv").write_text(f"wall_seconds,reward\n{seconds},{value}\n")
        (folder / f"events.out.tfevents.{seconds}").write_bytes(b"a log")
        stage = {"outputs": {"policy/training.csv": f"hash of {seconds}", "policy.json": value}}
        (folder / "stages.json").write_text(json.dumps({"train-1": stage}))
        (folder / "provenance.json").write_text(
            json.dumps({"stages": {"train-1": {"seconds": seconds, "seed": value}}})
        )
        return kills.contents(folder)

    assert written("a", 1.5, 7) == written("b", 2.5, 7)
    other, first = written("c", 1.5, 8), written("d", 1.5, 7)
    assert {name for name in first if first[name] != other[name]} == {*first}


def test_what_is_kept_of_a_job_names_no_folder_of_this_machine(tmp_path):
    temporary = tmp_path / "tmp"
    message = f"Page: {tmp_path}/work/P01/page.html, from {kills.ROOT}/reports/S05"
    assert kills.masked(message, temporary) == "Page: work/P01/page.html, from reports/S05"
    stored = kills.STORE.read_text(encoding="utf-8")
    assert "/tmp" not in stored
    assert "/home" not in stored


def test_what_a_kill_spoils_is_seen():
    """Else the claims prove nothing."""
    good = {"returned": 0, "differ": [], "processes": [], "blocks": [], "files": []}
    assert kills.survived(good)
    assert kills.left(good) == 0
    assert not kills.survived({**good, "differ": ["subject.toml"]})
    assert not kills.survived({**good, "returned": 70})
    assert kills.left({**good, "files": ["weasyprint-1"], "processes": ["a", "b"]}) == 3
    assert kills.unspoilt({"same": True, "codes": [0, 2]})
    assert not kills.unspoilt({"same": True, "codes": [0, 70]})
    assert not kills.unspoilt({"same": False, "codes": [0, 0]})
