"""Processes beside this one: what they give back, and that none is left."""

import math
import multiprocessing as mp
import os
import subprocess
import sys
import time

import pytest

from gaitval.policy.beside import beside
from gaitval.policy.processes import keeping_workers, kept_workers


def test_a_process_beside_this_one_gives_its_result():
    before = set(mp.active_children())  # of other tests
    with beside(math.sqrt, 9.0) as root:
        assert root() == 3.0
    assert not set(mp.active_children()) - before


def test_what_it_raises_is_raised_here():
    with beside(math.sqrt, -1.0) as root, pytest.raises(ValueError, match="math domain"):
        root()


def test_its_end_without_a_result_is_told():
    with beside(os._exit, 3) as ended, pytest.raises(RuntimeError, match=r"_exit ended with 3"):
        ended()


def test_it_ends_when_the_block_is_left():
    began = time.monotonic()
    before = set(mp.active_children())
    with beside(time.sleep, 600.0):
        (child,) = set(mp.active_children()) - before
    assert not child.is_alive()
    assert time.monotonic() - began < 60.0


def test_it_steps_back_and_has_one_thread():
    with beside(os.getpriority, os.PRIO_PROCESS, 0) as priority:
        assert priority() > os.getpriority(os.PRIO_PROCESS, 0)
    with beside(os.getenv, "OMP_NUM_THREADS") as threads:
        assert threads() == "1"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere each process loads what it needs")
def test_what_a_walk_needs_is_there_from_the_start():
    with beside(eval, "sorted(__import__('sys').modules)") as modules:
        assert {"gaitval.policy.rollouts", "gaitval.policy.rollout_buffer"} <= set(modules())


def test_processes_start_where_the_server_has_no_place_for_its_socket(tmp_path):
    folder = tmp_path / ("d" * 120)
    folder.mkdir()
    script = (
        "import math\n"
        "from gaitval.policy.beside import beside\n"
        "if __name__ == '__main__':\n"
        "    with beside(math.sqrt, 9.0) as root:\n"
        "        print(root())\n"
    )
    path = tmp_path / "root.py"
    path.write_text(script)
    environment = {**os.environ, "TMPDIR": str(folder)}
    done = subprocess.run(
        [sys.executable, str(path)], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == "3.0\n"


def test_one_worker_is_no_help_to_this_process():
    with keeping_workers(1):
        assert kept_workers() is None
    with keeping_workers(2):
        assert list(kept_workers().map(math.sqrt, [9.0])) == [3.0]
