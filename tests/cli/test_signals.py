"""A command that is asked to end from outside ends in order."""

import subprocess
import sys

import pytest

START = """
import os, signal, sys, time
# A shell starts its background jobs, and so their tests, deaf to the interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)
from gaitval.cli import main
import gaitval.subjects.subject_file as subjects

def stop():
    try:
        os.kill(os.getpid(), signal.{name})
        time.sleep(5)
    finally:
        print("in order", flush=True)

subjects.builtin_subjects = stop
sys.argv = ["gaitval", "subjects"]
main()
"""


@pytest.mark.parametrize(
    ("name", "code", "words"),
    [("SIGTERM", 143, "ended from outside"), ("SIGINT", 130, "interrupted")],
)
def test_the_same_command_resumes(name: str, code: int, words: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", START.format(name=name)],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    assert f"{words}; the same command resumes" in done.stderr
    assert "in order" in done.stdout
    assert "Traceback" not in done.stderr
