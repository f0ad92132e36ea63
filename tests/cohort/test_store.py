"""Where studies are kept: a folder, and object storage as S3 speaks it (moto's server)."""

import json
import subprocess
import sys
import time

import boto3
import fsspec
import pytest
import quick_study
from killed_cohort import environment
from moto.server import ThreadedMotoServer

from gaitval.apps.cohort import task
from gaitval.apps.cohort.store import FINISHED, LOG, SUMMARY, Store, alone
from gaitval.errors import ArtefactError, ConfigurationError


@pytest.fixture(scope="module")
def bucket():
    """Address of a bucket on a server of this test, which fsspec finds by the environment."""
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ACCESS_KEY_ID", "test")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "test")
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        patch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        boto3.client("s3").create_bucket(Bucket="cohort")
        yield "s3://cohort/runs"
    server.stop()
    fsspec.get_filesystem_class("s3").clear_instance_cache()


def record(fingerprint="f"):
    return {
        "name": "a", "fingerprint": fingerprint, "status": "finished", "reason": "",
        "seconds": 1.0, "peak_memory": 1, "worker": "here:1",
    }  # fmt: skip


@pytest.fixture(params=["folder", "objects"])
def store(request, tmp_path):
    if request.param == "folder":
        return Store(str(tmp_path / "studies"))
    return Store(request.getfixturevalue("bucket") + f"/{time.time_ns()}")


def test_a_study_is_finished_once_it_is_said(store):
    store.check()
    folder = store.folder("a")
    folder.mkdir(parents=True)
    (folder / SUMMARY).write_text(json.dumps(quick_study.summary("a", "f" * 8, 1.0, 1)))
    (folder / "policy").mkdir()
    (folder / "policy" / "p.json").write_text("{}")
    (folder / ".lock").write_text("")
    assert store.finished("a") is None
    store.keep("a", folder)
    store.finish("a", record())
    assert store.finished("a") == record()
    assert store.summary("a")["subject"]["identifier"] == "a"
    assert store.read("a", "policy/p.json") == {}
    store.clear(folder)
    assert store.summary("a") is not None
    store.forget("a")
    assert store.finished("a") is None


def test_a_value_that_is_no_number_is_null(store):
    store.finish("a", record() | {"seconds": float("nan")})
    assert store.read("a", "finished.json") == record() | {"seconds": None}


def test_only_object_storage_works_elsewhere(store):
    folder = store.folder("a")
    assert (folder == store.local / "a") if store.local else ("gaitval-cohort" in str(folder))
    assert folder.name == "a", "a recording's subject is named after its folder"


@pytest.mark.parametrize("text", ["", "{", "[1]", "null"])
def test_a_damaged_record_is_no_finished_study(tmp_path, text):
    store = Store(str(tmp_path))
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / FINISHED).write_text(text)
    assert store.finished("a") is None


@pytest.mark.slow
def test_a_study_on_object_storage(bucket, monkeypatch, tmp_path):
    """The worker's folder is temporary, and what is left is on the storage; a failure leaves its
    log there."""
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    address = f"{bucket}/{time.time_ns()}"

    def ran(name):
        study = {"name": name, "subject": "5"}
        return task.run_order(
            task.order_of(study, "f", address, function="quick_study:work", threads=1)
        )

    assert ran("a_sleep0")["status"] == "finished"
    assert ran("refuse")["status"] == "refused"
    files = fsspec.filesystem("s3").find(address)
    names = {name.removeprefix(address.removeprefix("s3://") + "/") for name in files}
    assert {f"a_sleep0/{FINISHED}", f"a_sleep0/{SUMMARY}", f"a_sleep0/{LOG}"} <= names
    assert f"refuse/{LOG}" in names
    assert f"refuse/{FINISHED}" not in names
    assert not any(".lock" in name for name in names)
    assert not list(tmp_path.glob("gaitval-cohort-*/a_sleep0*"))
    again = json.loads(fsspec.filesystem("s3").cat_file(f"{address}/a_sleep0/{FINISHED}"))
    assert ran("a_sleep0") == again, "found by its fingerprint, and not run again"


def test_a_bucket_that_is_not_there_is_told(bucket):
    with pytest.raises(ArtefactError, match="cannot be written to"):
        Store("s3://another/place").check()


def test_an_address_of_no_kind_is_refused():
    with pytest.raises(ConfigurationError, match="--store nowhere://x: cannot be used"):
        Store("nowhere://x")


HOLDS = """
import sys, time
from pathlib import Path
from gaitval.apps.cohort.store import alone

with alone(Path(sys.argv[1])):
    print("ready", flush=True)
    time.sleep(60)
"""


def test_a_study_waits_for_one_whose_worker_was_lost(tmp_path):
    command = [sys.executable, "-c", HOLDS, str(tmp_path)]
    other = subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE)
    try:
        assert other.stdout.readline() == b"ready\n"
        with (
            pytest.raises(ArtefactError, match="another process has worked in this folder"),
            alone(tmp_path, seconds=0.2),
        ):
            pass
    finally:
        other.kill()
        other.communicate()
    with alone(tmp_path, seconds=10.0):
        pass
