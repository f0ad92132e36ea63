"""Memory that is no longer needed is given back."""

import gc
import os
import subprocess
import sys

import pytest

from gaitval.memory import without_search

BLOCKS = """
from gaitval.memory import give_back_now

def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

first = bytearray(24 << 20)
del first  # glibc gives it back, and keeps all smaller ones from then on
blocks = [bytearray(8 << 20) for _ in range(9)]
for block in blocks:
    block[::4096] = b"x" * len(block[::4096])
last = blocks.pop()  # above the others, so that the heap cannot just be shortened
before = resident()
del block, blocks
print(before - resident())
give_back_now()
print(before - resident())
"""

THREADS = """
import sys, threading
from gaitval.memory import share_heap

if "share" in sys.argv:
    share_heap()
together = threading.Barrier(4)

def work():
    together.wait()
    kept = [bytearray(50_000) for _ in range(100)]
    together.wait()

threads = [threading.Thread(target=work) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
with open("/proc/self/maps") as file:
    spans = [line.split()[0].split("-") for line in file]
# a heap of a thread begins at a multiple of the 64 MiB that are reserved for it
print(sum(int(first, 16) % (64 << 20) == 0 for first, _ in spans))
"""


def printed(program: str, *how: str) -> list[int]:
    """The numbers that a program prints."""
    # glibc reads settings there too, and with some of them there is nothing to do.
    ours = ("MALLOC_", "GLIBC_TUNABLES")
    environment = {name: value for name, value in os.environ.items() if not name.startswith(ours)}
    done = subprocess.run(
        [sys.executable, "-c", program, *how],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    return [int(line) for line in done.stdout.split()]


@pytest.mark.skipif(sys.platform != "linux", reason="glibc's settings, and /proc")
def test_free_blocks_are_given_back():
    kept, given = printed(BLOCKS)
    assert kept < 60 << 20 < given  # of 64 MiB


@pytest.mark.skipif(sys.platform != "linux", reason="glibc's settings, and /proc")
def test_threads_share_one_heap():
    (own,), (shared,) = printed(THREADS), printed(THREADS, "share")
    assert shared < own


LOOPS = """
import gc, sys
from gaitval.memory import seldom_search

if "seldom" in sys.argv:
    seldom_search()
before = gc.get_stats()[0]["collections"]
for _ in range(3_000):
    loop = []
    loop.append(loop)
print(gc.get_stats()[0]["collections"] - before)
gc.callbacks.append(lambda phase, found: print(phase, gc.get_freeze_count() > 0))
"""


def searches(*how: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", LOOPS, *how], capture_output=True, text=True, check=True
    )
    return done.stdout.splitlines()


def test_python_searches_seldom_and_finds_nothing_to_search_at_its_end():
    (count, *at_end), (often, *_) = searches("seldom"), searches()
    assert int(count) == 0 < int(often)
    assert at_end == ["start True", "stop True"]


@pytest.mark.parametrize("searched", [True, False])
def test_a_block_without_search_leaves_it_as_it_was(searched):
    before = gc.isenabled()
    (gc.enable if searched else gc.disable)()
    try:
        with without_search():
            during = gc.isenabled()
        assert not during
        assert gc.isenabled() is searched
    finally:
        (gc.enable if before else gc.disable)()
