"""Memory that is no longer needed is given back."""

import gc
import os
import subprocess
import sys

import pytest

from gaitval.memory import without_search

PROGRAM = """
import sys
from gaitval.memory import give_back_now, give_back_soon

def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

if "soon" in sys.argv:
    give_back_soon()
first = bytearray(24 << 20)
del first  # glibc gives it back, and by itself keeps all smaller ones from then on
blocks = [bytearray(8 << 20) for _ in range(9)]
for block in blocks:
    block[::4096] = b"x" * len(block[::4096])
last = blocks.pop()  # above the others, so that the heap cannot just be shortened
before = resident()
del block, blocks
if "now" in sys.argv:
    give_back_now()
print(before - resident())
"""


def given_back(*how: str) -> int:
    # glibc reads settings there too, and with some of them there is nothing to do.
    ours = ("MALLOC_", "GLIBC_TUNABLES")
    environment = {name: value for name, value in os.environ.items() if not name.startswith(ours)}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *how],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    return int(done.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="glibc's settings, and /proc")
def test_large_blocks_are_given_back():
    wanted = 60 << 20  # of 64 MiB
    assert given_back() < wanted  # else there would be nothing to do
    assert given_back("soon") > wanted
    assert given_back("now") > wanted


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
