"""An interruption is one, whatever a library makes of it."""

import subprocess
import sys

import pytest

START = """
import os, signal, sys, time, weakref
# A shell starts its background jobs, and so their tests, deaf to the interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)
from gaitval.cli import main
import gaitval.datasets.subject_file as subjects

{body}

subjects.builtin_subjects = stop
sys.argv = ["gaitval", "subjects"]
main()
"""

CONVERTED = """
def stop():
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(5)
    except KeyboardInterrupt:
        raise SystemError("a function returned a result with an exception set")
"""

DROPPED = """
class Thing: pass

def stop():
    thing = Thing()
    reference = weakref.ref(thing, lambda _: (os.kill(os.getpid(), signal.{name}), time.sleep(1)))
    del thing  # what is raised in the function of a weak reference is dropped
    time.sleep(20)
    return ()
"""

TWICE = """
def stop():
    try:
        os.kill(os.getpid(), signal.{name})
        time.sleep(5)
    finally:
        time.sleep({later})
        os.kill(os.getpid(), signal.{name})
        time.sleep(0.2)
        print("in order", flush=True)
"""


def ended(body: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", START.format(body=body)],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip


def test_what_a_library_makes_of_ctrl_c_is_no_fault_of_ours() -> None:
    done = ended(CONVERTED)
    assert done.returncode == 130, done.stderr
    assert "interrupted; the same command resumes" in done.stderr
    assert "internal error" not in done.stderr


def test_a_signal_that_is_dropped_in_a_weak_reference_ends_the_process() -> None:
    for name, code, words in (
        ("SIGTERM", 143, "ended from outside"),
        ("SIGINT", 130, "interrupted; the same command resumes"),
    ):
        done = ended(DROPPED.format(name=name))
        assert done.returncode == code, done.stderr
        assert words in done.stderr
        assert "Exception ignored" not in done.stderr


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGINT", 130)])
def test_a_second_signal_does_not_interrupt_the_ending_unless_that_hangs(
    name: str, code: int
) -> None:
    soon, late = (ended(TWICE.format(name=name, later=later)) for later in (0.0, 1.5))
    assert (soon.returncode, late.returncode) == (code, code)
    assert "in order" in soon.stdout
    assert "in order" not in late.stdout
    assert "Traceback" not in soon.stderr + late.stderr
