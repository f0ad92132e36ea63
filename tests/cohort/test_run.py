"""Studies of a cohort: processes of their own, what became of each, and what is resumed."""

import os
import resource
import subprocess
import sys
import time

import pytest

from gaitval.apps.cohort import run
from gaitval.apps.cohort.run import Order, order_of, run_cohort, work
from gaitval.apps.cohort.table import Study
from gaitval.errors import ConfigurationError


def order(tmp_path, *arguments):
    return Order("one", arguments, str(tmp_path / "one"), 1)


def test_a_study_that_ends_well_is_finished_and_has_a_log(tmp_path):
    found = work(order(tmp_path, "subjects"))
    assert (found["status"], found["reason"]) == ("finished", "")
    assert "WBDS14" in (tmp_path / "one" / run.LOG).read_text(encoding="utf-8")
    assert 0.0 < found["seconds"] < 300.0
    # Bytes; Linux counts what a process was forked from, which here has run other tests.
    own = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert 20e6 < found["peak_memory"] <= max(2e9, own)


def test_a_refused_input_is_told_apart_from_a_fault_and_a_kill(tmp_path, monkeypatch):
    found = work(order(tmp_path, "subject", "99"))
    assert found["status"] == "refused"
    assert "no such subject" in found["reason"]
    monkeypatch.setattr(run, "BEGIN", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    assert work(order(tmp_path))["status"] == "lost"


def test_a_gaitval_that_cannot_be_loaded_is_a_fault_not_a_verdict(tmp_path, monkeypatch):
    (tmp_path / "gaitval").mkdir()
    (tmp_path / "gaitval" / "__init__.py").write_text("raise RuntimeError('broken')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    found = work(order(tmp_path, "subjects"))
    assert found["status"] == "fault"
    assert "broken" in found["reason"]


def test_a_module_of_the_current_folder_is_not_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "random.py").write_text("open('ran', 'w')")
    assert work(order(tmp_path, "subjects"))["status"] == "finished"
    assert not (tmp_path / "ran").exists()


def test_an_order_is_the_command_of_the_study(tmp_path):
    study = Study(name="a", subject="5", start="scratch", settings=("seed=2",))
    found = order_of(study, tmp_path, None, 3)
    words = " ".join(found.arguments)
    assert words.startswith(f"subject 5 --out {tmp_path / 'studies' / 'a'}")
    assert "--scratch" in words
    assert "--set seed=2" in words
    assert "training.workers=3" in words


def test_another_trial_is_a_subject_file_of_it(tmp_path):
    study = Study(name="slow", subject="S05", trial="T03")
    found = order_of(study, tmp_path, None, 1)
    assert found.arguments[1] == str(tmp_path / "subjects" / "slow.toml")
    assert 'trial = "T03"' in (tmp_path / "subjects" / "slow.toml").read_text(encoding="utf-8")


def test_several_at_once_and_one_that_is_refused_stops_no_other(tmp_path, monkeypatch):
    """Dask's threads, with studies that only wait: four of a second on two workers."""
    monkeypatch.setattr(run, "BEGIN", "import time; time.sleep(1)")
    studies = [Study(name=f"a{n}", subject="5") for n in range(4)]
    studies.insert(1, Study(name="nobody", subject="77"))
    began = time.monotonic()
    found = {each.name: each for each in run_cohort(studies, tmp_path, workers=2)}
    assert {name: each.status for name, each in found.items()} == {
        "nobody": "refused",
        **dict.fromkeys(("a0", "a1", "a2", "a3"), "finished"),
    }
    assert sum(found[f"a{n}"].seconds for n in range(4)) > 4.0
    assert time.monotonic() - began < 60.0


def test_a_cohort_of_this_machine_opens_no_port(tmp_path):
    """Who finds a port of Dask can run programs as its owner."""
    with run._client(None, 2) as client:
        assert client.scheduler.address.startswith("inproc://")
        fds = [os.readlink(f"/proc/self/fd/{each}") for each in os.listdir("/proc/self/fd")
               if os.path.exists(f"/proc/self/fd/{each}")]  # fmt: skip
    own = {each[8:-1] for each in fds if each.startswith("socket:[")}
    with open("/proc/self/net/tcp") as table:
        listening = {row.split()[9] for row in table if row.split()[3] == "0A"}
    assert not own & listening


def test_a_scheduler_that_does_not_answer_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "WAIT", 1.0)
    one = [Study(name="a", subject="5")]
    with pytest.raises(ConfigurationError, match=r"--scheduler tcp://127\.0\.0\.1:9"):
        list(run_cohort(one, tmp_path, scheduler="tcp://127.0.0.1:9"))


def test_a_running_cluster_does_the_studies(tmp_path, monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setattr(run, "BEGIN", "")
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        one = [Study(name="a", subject="5")]
        (found,) = run_cohort(one, tmp_path, scheduler=cluster.scheduler_address)
    assert found.status == "finished"


@pytest.mark.skipif(sys.platform != "linux", reason="PR_SET_PDEATHSIG is of Linux")
def test_a_study_ends_with_the_cohort_that_is_killed(tmp_path):
    code = (
        "from gaitval.apps.cohort import run\n"
        "run.BEGIN = run.BEGIN.split('try:')[0] + 'import os, time; "
        "print(os.getpid(), flush=True); time.sleep(600)'\n"
        f"run.work(run.Order('one', (), {str(tmp_path)!r}, 1))\n"
    )
    cohort = subprocess.Popen([sys.executable, "-P", "-c", code])
    log, until = tmp_path / run.LOG, time.monotonic() + 120.0
    while not (log.is_file() and log.read_text().strip()) and time.monotonic() < until:
        time.sleep(0.1)
    study = int(log.read_text())
    cohort.kill()
    cohort.wait()
    until = time.monotonic() + 10.0
    while _runs(study) and time.monotonic() < until:
        time.sleep(0.1)
    assert not _runs(study)


def _runs(process: int) -> bool:
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
