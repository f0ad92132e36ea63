"""Ways in which others of the same machine, or forged results, might run a program as whoever runs
a cohort, or be believed. Each test is one way."""

import json
import os
import subprocess
import sys
import urllib.request
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import cohort_attacker
import psutil
import pytest
import quick_study
from distributed import Client, LocalCluster
from killed_cohort import SUPPORT, environment

from gaitval.apps.cohort import cluster, task
from gaitval.apps.cohort.answers import outcome_of
from gaitval.apps.cohort.cluster import client_of
from gaitval.apps.cohort.engine import outcomes_of, run_cohort
from gaitval.apps.cohort.results import tables_of
from gaitval.apps.cohort.store import FINISHED, SUMMARY, Store
from gaitval.apps.cohort.table import Study
from gaitval.errors import ArtefactError, ConfigurationError

KINDS = ("scheduler", "worker", "nanny")
WAYS = ("plain", "no certificate", "another certificate")
NOBODY = 65534
posix = pytest.mark.skipif(os.name != "posix", reason="users and links as POSIX has them")


def users() -> dict[str, int]:
    """Who attacks: the same user, and another one if this one may become another."""
    if os.name != "posix":
        return {}
    return {"same": os.getuid(), **({"other": NOBODY} if os.getuid() == 0 else {})}


def addresses(client: Client) -> dict[str, str]:
    """Of each kind of process of a cohort, without the protocol."""
    about = client.scheduler_info(n_workers=-1)
    ((address, worker),) = about["workers"].items()
    found = (about["address"], address, worker["nanny"])
    return {kind: each.partition("://")[2] for kind, each in zip(KINDS, found, strict=True)}


def listening() -> set[tuple[str, int]]:
    """Addresses at which this process and those under it wait for others."""
    found = set()
    for process in (psutil.Process(), *psutil.Process().children(recursive=True)):
        for each in process.net_connections("inet"):
            if each.status == psutil.CONN_LISTEN:
                found.add((each.laddr.ip, each.laddr.port))
    return found


def attacked(targets: dict[str, str], folder: Path, user: int) -> set[str]:
    """What ran, of all ways to all targets, as "KIND WAY"."""
    folder.mkdir()
    command = [
        *(sys.executable, str(SUPPORT / "cohort_attacker.py"), str(user), str(folder)),
        *(f"{address}={kind}" for kind, address in targets.items()),
    ]
    done = subprocess.run(
        command, env=environment(), capture_output=True, text=True, timeout=60, check=True
    )
    assert f"user {user}\n" in done.stdout
    names = {f"{number}-{way}": f"{kind} {way}"
             for number, kind in enumerate(targets) for way in WAYS}  # fmt: skip
    return {names[path.name] for path in folder.iterdir()}


@contextmanager
def planted(folder: Path):
    """A folder for temporary files as others might have prepared it: the names that could be known
    are links to another folder, which is returned.
    """
    victim = folder / "victim"
    victim.mkdir(parents=True)
    for name in ("dask-scratch-space", "dask-worker-space", f"dask-scratch-space-{os.getuid()}",
                 f"gaitval-cohort-{os.getuid()}"):  # fmt: skip
        (folder / name).symlink_to(victim)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(folder))
        patch.setattr("tempfile.tempdir", None)
        yield victim


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A cohort's own cluster under attack, and what became of it."""
    folder = tmp_path_factory.mktemp("attack")
    folder.chmod(0o755)
    before = listening()
    planted_modules = folder / "cwd"
    planted_modules.mkdir()
    for name in ("pickle", "json", "tokenize", "numpy", "distributed", "gaitval.apps.cohort"):
        (planted_modules / f"{name}.py").write_text(f"import os; os.mkdir({str(folder / name)!r})")
    with planted(folder / "tmp") as victim, pytest.MonkeyPatch.context() as patch:
        patch.chdir(planted_modules)
        patch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
        patch.delenv("PYTHONSAFEPATH", raising=False)
        with client_of(None, 1, 1, 0) as client:
            client.wait_for_workers(1)
            targets, ports = addresses(client), listening() - before
            private = {
                path.name: oct(path.stat().st_mode & 0o777)
                for path in (folder / "tmp").iterdir()
                if not path.is_symlink() and path != victim
            }
            lines = [
                " ".join(process.cmdline()) + str(process.environ())
                for process in (psutil.Process(), *psutil.Process().children(recursive=True))
            ]
            order = task.order_of(
                {"name": "a_sleep0", "subject": "5"}, "f", str(folder / "studies"),
                function="quick_study:work", threads=1,
            )  # fmt: skip
            (study,) = [each for each in outcomes_of(client, [order], 0) if each is not None]
            found = {name: attacked(targets, folder / name, user) for name, user in users().items()}
            yield SimpleNamespace(
                ran=found, client=client, ports=ports, victim=victim, private=private, lines=lines,
                study=study, folder=folder, targets=targets,
            )  # fmt: skip


@pytest.mark.slow
@posix
def test_the_attacks_work_where_nothing_is_locked(tmp_path):
    """Else those that fail prove nothing."""
    with LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None,
        local_directory=str(tmp_path), silence_logs=50,
    ) as open_to_all, Client(open_to_all) as client:  # fmt: skip
        client.wait_for_workers(1)
        for name, user in users().items():
            found = attacked(addresses(client), tmp_path / name, user)
            assert found == {f"{kind} plain" for kind in KINDS}


@posix
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("user", ["same", "other"])
def test_no_one_without_the_certificate_runs_a_program(ran, user, kind, way):
    if user not in ran.ran:
        pytest.skip("only root may become another user")
    assert f"{kind} {way}" not in ran.ran[user]


def test_no_other_machine_reaches_it(ran):
    assert {ip for ip, _ in ran.ports} == {"127.0.0.1"}
    assert {f"127.0.0.1:{port}" for _, port in ran.ports} >= set(ran.targets.values())


PAGES = (
    *("", "status", "info/main/workers.html", "json/identity.json", "health", "metrics"),
    *("statics/css/base.css", "api/v1/retire_workers", "proxy/22/127.0.0.1/", "eventstream"),
)


@pytest.mark.parametrize("page", PAGES)
def test_no_port_has_pages(ran, page):
    """They have no password."""
    for _, port in ran.ports:
        with pytest.raises(OSError):  # noqa: PT011 - what is there: not found, or no HTTP at all
            urllib.request.urlopen(f"http://127.0.0.1:{port}/{page}", timeout=3)


@posix
def test_a_link_in_the_folder_of_temporary_files_is_not_followed(ran):
    assert ran.study["status"] == "finished", ran.study
    assert not list(ran.victim.iterdir())


@posix
def test_no_other_user_reads_what_a_cohort_keeps(ran):
    assert ran.private
    assert set(ran.private.values()) <= {"0o700", "0o600"}, ran.private


def test_the_key_is_on_no_command_line_and_in_no_environment(ran):
    assert len(ran.lines) >= 2
    assert not any("PRIVATE KEY" in line for line in ran.lines)


def test_modules_beside_the_table_are_not_imported(ran):
    """Whoever can write to the folder that a cohort is started in."""
    planted_names = {path.stem for path in (ran.folder / "cwd").iterdir()}
    assert not planted_names & {path.name for path in ran.folder.iterdir()}


def test_what_a_worker_sends_is_not_unpickled(ran, tmp_path):
    path = str(tmp_path / "ran")
    future = ran.client.submit(cohort_attacker.Runs, path, pure=False)
    with pytest.raises(TypeError):
        future.result(timeout=30)
    assert not os.path.exists(path)


GOOD = {"name": "a", "fingerprint": "f", "status": "finished", "reason": "", "seconds": 1.0,
        "peak_memory": 1, "worker": "here:1"}  # fmt: skip


@pytest.mark.parametrize(
    "answer",
    [
        {**GOOD, "name": "b"},
        {**GOOD, "fingerprint": "g"},
        {**GOOD, "status": "cancelled"},
        {**GOOD, "seconds": "1"},
        {**GOOD, "seconds": -1.0},
        {**GOOD, "peak_memory": 1e300},
        {**GOOD, "reason": "x" * 200_000},
        {**GOOD, "more": 1},
        {name: each for name, each in GOOD.items() if name != "worker"},
    ],
)
def test_a_forged_answer_is_refused(answer):
    assert outcome_of(json.dumps(GOOD), "a", "f") == GOOD
    with pytest.raises(ValueError, match=r"answer|Outcome"):
        outcome_of(json.dumps(answer), "a", "f")


@pytest.mark.parametrize(
    "answer", [None, 3, b"{}", "", "[" * 100_000, "x" * 2_000_000, '{"seconds": NaN}']
)
def test_what_is_no_answer_is_refused(answer):
    with pytest.raises(ValueError, match=r"answer|Outcome"):
        outcome_of(answer, "a", "f")


def stored(folder: Path, outcome: object, summary: object) -> Store:
    (folder / "a").mkdir(parents=True)
    (folder / "a" / FINISHED).write_text(json.dumps(outcome))
    (folder / "a" / SUMMARY).write_text(json.dumps(summary))
    return Store(str(folder))


SUMMED = quick_study.summary("a", "0" * 8, 1.0, 1)


def test_a_whole_result_is_believed(tmp_path):
    """Else those that are not prove nothing."""
    assert stored(tmp_path, GOOD, SUMMED).finished("a") == GOOD


@pytest.mark.parametrize(
    ("outcome", "summary"),
    [
        ({**GOOD, "name": "../b"}, SUMMED),
        ({**GOOD, "status": "refused"}, SUMMED),
        (GOOD, {}),
        (GOOD, {**SUMMED, "subject": {**SUMMED["subject"], "status": "finished"}}),
        (GOOD, {**SUMMED, "subject": {**SUMMED["subject"], "speed": "<script>"}}),
        (GOOD, {**SUMMED, "measures": [{**SUMMED["measures"][0], "study": "b"}]}),
        (GOOD, {**SUMMED, "epsilon": "0.2"}),
    ],
)
def test_a_forged_result_in_the_store_is_not_believed(tmp_path, outcome, summary):
    assert stored(tmp_path, outcome, summary).finished("a") is None


@posix
@pytest.mark.skipif(os.name == "posix" and os.getuid() != 0, reason="only root may give files away")
@pytest.mark.parametrize("path", ["a", f"a/{FINISHED}", f"a/{SUMMARY}"])
def test_a_result_of_another_user_is_not_believed(tmp_path, path):
    store = stored(tmp_path, GOOD, SUMMED)
    os.chown(tmp_path / path, NOBODY, NOBODY)
    assert store.finished("a") is None


@pytest.mark.slow
@posix
@pytest.mark.parametrize("path", ["a", f"a/{FINISHED}", f"a/{SUMMARY}"])
def test_a_result_behind_a_link_is_not_believed(tmp_path, path):
    store = stored(tmp_path, GOOD, SUMMED)
    (tmp_path / path).rename(tmp_path / "other")
    (tmp_path / path).symlink_to(tmp_path / "other")
    assert store.finished("a") is None


@posix
def test_a_study_is_not_written_behind_a_link(tmp_path):
    (tmp_path / "victim").mkdir()
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "a").symlink_to(tmp_path / "victim")
    order = task.order_of({"name": "a", "subject": "5"}, "f", str(tmp_path / "store"),
                          function="quick_study:work", threads=1)  # fmt: skip
    found = task.run_order(order)
    assert found["status"] == "refused"
    assert "is a link" in found["reason"]
    assert not list((tmp_path / "victim").iterdir())


@posix
def test_a_store_that_everybody_may_write_to_is_refused(tmp_path):
    tmp_path.chmod(0o777)
    with pytest.raises(ArtefactError, match="everybody may write to it"):
        Store(str(tmp_path)).check()


@posix
def test_work_for_object_storage_is_in_a_folder_that_nobody_else_knows(tmp_path):
    with planted(tmp_path) as victim:
        store = Store("memory://cohort")
        folders = [store.folder("a") for _ in range(2)]
        assert folders[0] != folders[1]
        for folder in folders:
            assert not folder.resolve().is_relative_to(victim)
            assert folder.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.slow
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "ucx://127.0.0.1:9", "ws://127.0.0.1:9"])
def test_a_scheduler_without_tls_is_refused(tmp_path, address):
    with pytest.raises(ConfigurationError, match="without TLS"):
        run_cohort([Study(name="a", subject="5")], str(tmp_path), scheduler=address,
                   function="quick_study:work")  # fmt: skip


@posix
def test_the_key_of_jobs_is_for_this_user_alone(tmp_path):
    made = cluster._in_files(cluster.Security.temporary(), tmp_path)
    assert made.require_encryption
    files = list(tmp_path.iterdir())
    assert {path.name for path in files} == {"ca_file", "key"}
    assert {path.stat().st_mode & 0o777 for path in files} == {0o600}
    assert "PRIVATE KEY" in (tmp_path / "key").read_text()


def test_no_row_of_a_study_names_another(tmp_path, monkeypatch):
    """What a summary says of itself does not count."""
    store = Store(str(tmp_path))
    forged = {**SUMMED, "groups": [{**SUMMED["groups"][0], "study": "b"}]}
    monkeypatch.setattr(Store, "summary", lambda *_: forged)
    assert set(tables_of(store, [GOOD])["groups"]["study"]) == {"a"}
