"""Studies on Dask: failures, lost studies, memory, threads, progress, and who may reach it."""

import contextlib
import json
import os
import sys
import tempfile
from types import SimpleNamespace

import psutil
import pytest
from killed_cohort import environment

from gaitval import partial_files
from gaitval.apps.cohort import cluster, engine, task
from gaitval.apps.cohort.command import _shown
from gaitval.apps.cohort.engine import require, run_cohort
from gaitval.apps.cohort.process import FORKS
from gaitval.apps.cohort.store import FINISHED, LOG, OF_STORE, SUMMARY
from gaitval.apps.cohort.table import Study
from gaitval.errors import ConfigurationError, GaitvalError

pytestmark = pytest.mark.slow  # `test_command.py` runs a cohort in every run of the tests

NAMES = ("a_sleep0_1", "eat_sleep0_1", "refuse", "crash", "die_sleep0_1")


def studies(names=NAMES):
    return [Study(name=name, subject="5") for name in names]


def listening():
    """Addresses at which this process and those under it wait for others."""
    found = []
    for process in (psutil.Process(), *psutil.Process().children(recursive=True)):
        with contextlib.suppress(psutil.Error):
            sockets = process.net_connections("inet")
            found += [each.laddr for each in sockets if each.status == psutil.CONN_LISTEN]
    return found


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """One cohort of all that can happen, with two workers: outcomes, folder, what was said, and
    the addresses at which it listened."""
    folder = tmp_path_factory.mktemp("cohort")
    states, listened, before = [], set(), set(listening())

    def notify(state):
        states.append(state)
        listened.update(each.ip for each in listening() if each not in before)

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
        outcomes = run_cohort(
            studies(), str(folder), workers=2, function="quick_study:work", notify=notify
        )
    return SimpleNamespace(
        outcomes={each["name"]: each for each in outcomes}, folder=folder, states=states,
        listened=listened,
    )  # fmt: skip


def test_a_study_that_fails_stops_no_other_and_says_why(ran):
    assert {name: each["status"] for name, each in ran.outcomes.items()} == {
        "a_sleep0_1": "finished",
        "eat_sleep0_1": "finished",
        "refuse": "refused",
        "crash": "fault",
        "die_sleep0_1": "finished",
    }
    assert ran.outcomes["refuse"]["reason"] == (
        "the record of this one is no record. Record it again."
    )
    assert ran.outcomes["crash"]["reason"] == "ValueError: a fault"


def test_a_study_whose_process_is_killed_begins_again(ran):
    assert ran.outcomes["die_sleep0_1"]["tries"] == 2


def test_each_study_has_its_log(ran):
    assert "Traceback" in (ran.folder / "crash" / LOG).read_text()
    assert "a_sleep0_1 in " in (ran.folder / "a_sleep0_1" / LOG).read_text()


def test_memory_is_that_of_the_study(ran):
    """200 MB of numbers more than another study that does the same."""
    more = ran.outcomes["eat_sleep0_1"]["peak_memory"] - ran.outcomes["a_sleep0_1"]["peak_memory"]
    assert 180e6 < more < 230e6


def test_progress_counts_and_estimates(ran):
    last = ran.states[-1]
    assert (last.done, last.failed, last.total) == (5, 2, 5)
    assert ran.states[0].left is None
    assert last.left == 0.0
    assert any(state.workers == 2 for state in ran.states)
    assert not any(state.dashboard for state in ran.states), "it has no password"


def test_a_local_cluster_listens_on_the_loopback_only(ran):
    assert ran.listened == {"127.0.0.1"}


def test_finished_studies_are_not_run_again(ran, monkeypatch):
    """Those that failed are tried again; here nothing can be started, so only they are asked."""
    wanted = []

    def none(client, orders, retries):
        wanted.extend(order["study"]["name"] for order in orders)
        return iter(())

    monkeypatch.setattr(engine, "outcomes_of", none)
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    with pytest.raises(KeyError):
        run_cohort(studies(), str(ran.folder), workers=1, function="quick_study:work")
    assert wanted == ["refuse", "crash"]


def test_long_looking_at_inputs_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(engine, "LOOKING", 0.0)

    def refused(*_):
        raise ConfigurationError("no such file")

    monkeypatch.setattr(engine, "fingerprint", refused)
    seen = []
    run_cohort(
        studies(["a", "b", "c", "d"]),
        str(tmp_path),
        function="quick_study:work",
        notify=seen.append,
    )
    assert [state.looked for state in seen] == [0, 1, 2, 3, 0]
    with _shown() as notify:
        notify(seen[2])
    assert "2 of 4 studies looked at" in capsys.readouterr().err


def test_what_a_killed_cohort_left_goes_though_nothing_is_to_be_done(tmp_path, monkeypatch):
    """It was killed after its last study, so that no cluster is started again."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with partial_files.own_folder(tmp_path, task.OF_CLUSTER) as in_use:
        left = [tmp_path / f"{prefix}abcd1234" for prefix in (task.OF_CLUSTER, OF_STORE)]
        for folder in (*left, in_use):
            folder.mkdir(exist_ok=True)
            os.utime(folder, (0, 0))
        assert run_cohort([], str(tmp_path / "cohort"), workers=1) == []
        assert in_use.exists()
        assert not any(folder.exists() for folder in left)


def order(folder, name, fingerprint="f"):
    return task.order_of(
        {"name": name, "subject": "5"}, fingerprint, str(folder), function="quick_study:work",
        threads=3,
    )  # fmt: skip


def test_threads_of_a_study_are_pinned(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    assert {task.pinned(3)[name] for name in task.THREADS} == {"3"}
    monkeypatch.setenv(task.TRIM, "65536")  # as Dask does in its workers
    assert task.TRIM not in task.pinned(3)
    script = (
        "import numba, threadpoolctl, torch, numpy\n"
        "found = {pool['num_threads'] for pool in threadpoolctl.threadpool_info()}\n"
        "print(sorted(found | {torch.get_num_threads(), numba.get_num_threads()}))\n"
    )
    import subprocess

    out = subprocess.run([sys.executable, "-c", script], env=task.pinned(1), capture_output=True,
                          text=True, check=True)  # fmt: skip
    assert out.stdout.strip() == "[1]"


def test_another_fingerprint_is_another_study(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    first = task.run_order(order(tmp_path, "b_sleep0"))
    assert task.run_order(order(tmp_path, "b_sleep0")) == first, "finished already"
    second = task.run_order(order(tmp_path, "b_sleep0", "g"))
    assert second["fingerprint"] == "g"
    assert json.loads((tmp_path / "b_sleep0" / FINISHED).read_text())["fingerprint"] == "g"
    assert (tmp_path / "b_sleep0" / SUMMARY).exists()


def test_the_line_to_install_what_is_missing(monkeypatch):
    monkeypatch.setattr(engine.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ConfigurationError, match=r"-m pip install -c \S+ -e '\S+\[cohort\]'"):
        require()


def test_a_scheduler_that_does_not_answer(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "ANSWER", 0.5)
    with pytest.raises(GaitvalError, match=r"no Dask scheduler answers there"):
        run_cohort(studies(["a"]), str(tmp_path), scheduler="tcp://127.0.0.1:9",
                   without_tls=True, function="quick_study:work")  # fmt: skip


@pytest.mark.parametrize(
    ("options", "out"),
    [
        ({"scheduler": "tcp://127.0.0.1:9"}, "without TLS, whoever reaches it can run programs"),
        ({"scheduler": "ucx://127.0.0.1:9"}, "without TLS"),
        ({"scheduler": "lsf"}, "give the address of a running one"),
        ({"scheduler": "tcp://127.0.0.1:9", "workers": 2}, "has its own"),
    ],
)
def test_wrong_options_are_refused(tmp_path, options, out):
    with pytest.raises(ConfigurationError, match=out):
        run_cohort(studies(["a"]), str(tmp_path), function="quick_study:work", **options)


def test_a_place_that_cannot_be_written_is_told_first(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(GaitvalError, match="cannot be written to"):
        run_cohort(studies(["a"]), str(tmp_path / "file"), function="quick_study:work")


def test_a_worker_that_ends_takes_its_study_with_it(tmp_path, monkeypatch):
    """A study whose worker is gone must not write beside the one that begins again."""
    import subprocess
    import time

    work = order(tmp_path, "c_sleep20")
    script = f"from gaitval.apps.cohort.task import run_order; run_order({work!r})"
    worker = subprocess.Popen([sys.executable, "-c", script], env=environment())
    end = time.monotonic() + 60
    while not (tmp_path / "c_sleep20" / "step0.txt").exists() and time.monotonic() < end:
        time.sleep(0.05)
    children = psutil.Process(worker.pid).children(recursive=True)
    assert len(children) == 1 + FORKS, "a study, and what it is forked from"
    worker.kill()
    worker.wait()
    _, alive = psutil.wait_procs(children, timeout=20)
    assert not alive
    assert os.path.exists(tmp_path / "c_sleep20" / LOG)


@pytest.mark.skipif(not FORKS, reason="studies are forked on Linux only")
def test_studies_are_forked_from_a_process_that_outlives_them(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    monkeypatch.setattr(task, "_waiting", [])
    assert task.run_order(order(tmp_path, "b_sleep0"))["status"] == "finished"
    (starter,) = task._waiting
    killed = task.run_order(order(tmp_path, "die_sleep0"))
    assert (killed["status"], "SIGKILL" in killed["reason"]) == ("lost", True)
    assert task.run_order(order(tmp_path, "die_sleep0"))["status"] == "finished"
    assert task._waiting == [starter]
    starter.process.kill()
    starter.process.wait()
    assert task.run_order(order(tmp_path, "c_sleep0"))["status"] == "finished"
    (another,) = task._waiting
    assert another is not starter
    another.end()
