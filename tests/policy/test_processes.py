"""Work beside this process's own: in a thread, and in workers that are kept."""

import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from gaitval._internal.io.partial_files import OF_SOCKETS, hold
from gaitval.policy.beside import beside
from gaitval.policy.processes import keeping_workers, kept_workers, side_by_side


def test_what_is_beside_this_thread_gives_its_result():
    with beside(math.sqrt, 9.0) as root:
        assert root() == 3.0


def test_what_it_raises_is_raised_here():
    with beside(math.sqrt, -1.0) as root, pytest.raises(ValueError, match="math domain"):
        root()


def test_it_is_not_waited_for_when_the_block_raises():
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt), beside(time.sleep, 600.0):
        raise KeyboardInterrupt
    assert time.monotonic() - began < 60.0


def test_both_have_one_thread_of_linear_algebra_until_both_have_ended():
    with beside(_one_thread_for, 0.2) as ended:
        with threadpool_limits(1, "blas"):
            pass  # a limit that ends before the other's
        assert ended()
        assert _blas_threads() <= {1}


def _one_thread_for(seconds: float) -> bool:
    with threadpool_limits(1, "blas"):
        time.sleep(seconds)
        return _blas_threads() <= {1}


def _blas_threads() -> set[int]:
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def test_without_workers_this_process_does_it():
    assert list(side_by_side(math.sqrt, [9.0, 16.0])) == [3.0, 4.0]
    process = ["__import__('os').getpid()"]
    assert list(side_by_side(eval, process)) == [os.getpid()]
    with keeping_workers(2):
        assert list(side_by_side(math.sqrt, [9.0, 16.0])) == [3.0, 4.0]
        assert list(side_by_side(eval, process)) != [os.getpid()]


def test_processes_start_where_the_server_has_no_place_for_its_socket(tmp_path):
    folder = tmp_path / ("d" * 120)
    folder.mkdir()
    script = (
        "import math\n"
        "from gaitval.policy.processes import keeping_workers, side_by_side\n"
        "if __name__ == '__main__':\n"
        "    with keeping_workers(2):\n"
        "        print(*side_by_side(math.sqrt, [9.0]))\n"
    )
    path = tmp_path / "root.py"
    path.write_text(script)
    environment = {**os.environ, "TMPDIR": str(folder)}
    done = subprocess.run(
        [sys.executable, str(path)], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == "3.0\n"


@pytest.mark.parametrize("from_input", [False, True])
def test_a_script_without_a_guard_runs_once(tmp_path, from_input):
    """`multiprocessing` would load the user's script in every worker, which begins its study again;
    a script from the standard input could not even be loaded."""
    script = (
        "import math, __main__\n"
        "from gaitval.policy.processes import keeping_workers, side_by_side\n"
        "print('began')\n"
        "before = dict(vars(__main__))\n"
        "with keeping_workers(2):\n"
        "    print(*side_by_side(math.sqrt, [9.0, 16.0]))\n"
        "now = vars(__main__)\n"
        "print([before.get(name) == now.get(name) for name in ('__file__', '__spec__')])\n"
    )
    path = tmp_path / "plain.py"
    path.write_text(script)
    done = subprocess.run(
        [sys.executable, "-" if from_input else str(path)],
        input=script if from_input else None, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout == "began\n3.0 4.0\n[True, True]\n"


def test_one_worker_is_no_help_to_this_process():
    with keeping_workers(1):
        assert kept_workers() is None
    with keeping_workers(2):
        assert list(kept_workers().map(math.sqrt, [9.0])) == [3.0]


@pytest.mark.skipif(sys.platform != "linux", reason="the server is Linux's way")
def test_the_server_is_deaf_to_the_ctrl_c_of_a_terminal(tmp_path):
    """It goes to all processes of the group: the server would end with a traceback."""
    script = tmp_path / "serving.py"
    script.write_text(SERVING)
    with subprocess.Popen(
        [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        server = Path("/proc") / process.stdout.readline().strip()
        assert _blocked(server) & 1 << signal.SIGINT - 1


SERVING = """
import sys
from multiprocessing import forkserver
from gaitval.policy.workers import ready_to_start
if __name__ == "__main__":
    ready_to_start()
    print(forkserver._forkserver._forkserver_pid, flush=True)
    sys.stdin.read()
"""


def _blocked(process: Path) -> int:
    """The signals that a process does not see, a bit each."""
    lines = (process / "status").read_text().splitlines()
    return next(int(line.split()[1], 16) for line in lines if line.startswith("SigBlk"))


@pytest.fixture
def temporary():
    """Of a short path: that of a socket may have some hundred bytes."""
    folder = Path(tempfile.mkdtemp(prefix="gaitval-test-"))
    yield folder
    shutil.rmtree(folder)


SERVED = """
import os, signal
from gaitval.policy.workers import ready_to_start
if __name__ == "__main__":
    context = ready_to_start()
    process = context.Process(target=print, args=("served",))
    process.start()
    process.join()
    if {killed}:
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the server is Linux's way")
@pytest.mark.parametrize("killed", [False, True])
def test_the_servers_socket_goes_with_its_parent_however_that_ends(tmp_path, killed, temporary):
    script = tmp_path / "served.py"
    script.write_text(SERVED.format(killed=killed))
    environment = {**os.environ, "TMPDIR": str(temporary)}
    with subprocess.Popen([sys.executable, str(script)], env=environment) as process:
        while process.poll() is None and not list(temporary.glob(f"{OF_SOCKETS}*")):
            time.sleep(0.05)
    assert (process.returncode != 0) == killed
    end = time.monotonic() + 60.0  # the server may still be loading
    while (left := list(temporary.glob(f"{OF_SOCKETS}*"))) and time.monotonic() < end:
        time.sleep(0.1)
    assert left == []


READ_ONLY = """
import errno, os
from gaitval.policy.workers import ready_to_start
def refuse(*_, **__):
    raise OSError(errno.EROFS, "read-only file system")
if __name__ == "__main__":
    process = ready_to_start().Process(target=print, args=("served",))
    process.start()
    process.join()
    os.rmdir = os.unlink = refuse
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the server is Linux's way")
def test_a_disk_that_became_read_only_ends_nothing_with_a_traceback(tmp_path, temporary):
    script = tmp_path / "read_only.py"
    script.write_text(READ_ONLY)
    environment = {**os.environ, "TMPDIR": str(temporary)}
    done = subprocess.run(
        [sys.executable, str(script)], env=environment, capture_output=True, text=True, check=True
    )
    assert (done.stdout, done.stderr) == ("served\n", "")


KILLED = """
import os, signal
from gaitval.policy.workers import ready_to_start
if __name__ == "__main__":
    ready_to_start("slow_module")
    print(os.getpid(), flush=True)
    signal.pause()
"""
SLOW = """
import os, time
open(os.environ["SEEN"], "w").write(str(os.getpid()))
for _ in range(600):
    time.sleep(0.1)
"""


@pytest.fixture
def begun(tmp_path, temporary):
    """A process whose server loads a slow module, with a temporary folder of its own."""
    script, seen = tmp_path / "killed.py", tmp_path / "seen"
    script.write_text(KILLED)
    (tmp_path / "slow_module.py").write_text(SLOW)
    environment = os.environ | {"TMPDIR": str(temporary), "SEEN": str(seen)}
    process = subprocess.Popen(
        [sys.executable, str(script)],
        env=environment | {"PYTHONPATH": str(tmp_path)}, stdout=subprocess.PIPE, process_group=0,
    )  # fmt: skip
    assert soon(lambda: seen.exists() and seen.read_text() != "")
    yield SimpleNamespace(
        process=process, temporary=temporary, server=Path("/proc") / seen.read_text()
    )
    process.kill()
    process.communicate()


def soon(condition: Callable[[], bool], seconds: float = 60.0) -> bool:
    """Whether it holds before the end."""
    end = time.monotonic() + seconds
    while not (held := condition()) and time.monotonic() < end:
        time.sleep(0.05)
    return held


@pytest.mark.skipif(sys.platform != "linux", reason="the server is Linux's way")
def test_a_server_that_still_loads_ends_with_its_parent(begun):
    begun.process.kill()
    begun.process.wait()
    assert soon(lambda: not begun.server.exists(), 20.0)


@pytest.mark.skipif(sys.platform != "linux", reason="the server is Linux's way")
def test_what_processes_leave_that_were_killed_together_goes_with_the_next(begun, tmp_path):
    os.killpg(begun.process.pid, signal.SIGKILL)
    begun.process.wait()
    (left,) = begun.temporary.glob(f"{OF_SOCKETS}*")
    in_use = tempfile.mkdtemp(dir=begun.temporary, prefix=OF_SOCKETS)
    hold(in_use)
    for folder in (left, in_use):
        os.utime(folder, (time.time() - 60.0,) * 2)
    script = tmp_path / "served.py"
    script.write_text(SERVED.format(killed=False))
    environment = os.environ | {"TMPDIR": str(begun.temporary)}
    subprocess.run([sys.executable, str(script)], env=environment, check=True)
    assert [str(each) for each in begun.temporary.glob(f"{OF_SOCKETS}*")] == [in_use]


def test_all_workers_start_at_once():
    """One that starts later would run the user's script, and look for modules beside it."""
    with keeping_workers(3):
        workers = kept_workers()
        assert len(workers._processes) == 3
        assert list(workers.map(math.sqrt, [4.0] * 9)) == [2.0] * 9
