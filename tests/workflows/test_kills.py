"""A study that is killed and started again writes what it writes undisturbed."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest
from quick_settings import QUICK

SAME = ("metrics.json", "model.urdf", "reference.npz", "identification.json", "correction.json")


def started(folder) -> "subprocess.Popen[bytes]":
    settings = [word for each in QUICK for word in ("--set", each)]
    words = [sys.executable, "-P", "-m", "gaitval", "subject", "5", "--out", str(folder)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen([*words, *settings], start_new_session=True, **quiet)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kills a group of processes")
def test_a_study_that_is_killed_three_times_ends_as_one_that_is_not(tmp_path):
    began = time.monotonic()
    assert started(tmp_path / "whole").wait() == 0
    seconds = time.monotonic() - began
    for part in sorted(random.Random(94).uniform(0.2, 0.8) for _ in range(3)):
        study = started(tmp_path / "killed")
        time.sleep(part * seconds)
        os.killpg(study.pid, signal.SIGKILL)
        study.wait()
    assert started(tmp_path / "killed").wait() == 0
    for name in SAME:
        whole, killed = ((tmp_path / each / name).read_bytes() for each in ("whole", "killed"))
        assert whole == killed, name
    assert not list((tmp_path / "killed").rglob(".partial-*"))
