"""On a disk that fails a command says so, and its next start ends well. More by
`python tests/robustness/bad_disk.py`."""

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import bad_disk
import kills
import pytest
from html_page import WITHOUT_FIGURES

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="LD_PRELOAD and /proc"),
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler `cc`"),
]

STORED = Path(__file__).parents[2] / "reports" / "S05" / "baseline"
PROGRAM = """
import sys
from pathlib import Path
folder = Path(sys.argv[1])
try:
    (folder / "a").write_text("x")
    (folder / "a").replace(folder / "b")
    print((folder / "b").read_text())
except OSError as error:
    print(error.errno)
"""


@pytest.fixture(scope="module")
def disk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("disk")
    (folder / "bad").mkdir()
    return bad_disk.Disk(bad_disk.built(folder), folder / "bad", folder / "count"), folder / "bad"


@pytest.mark.parametrize(
    ("fault", "number", "message"),
    [
        ("full", 0, "x"),
        *((fault, 2, str(bad_disk.FAULTS[fault][0])) for fault in bad_disk.FAULTS),
        ("full", 4, str(errno.ENOSPC)),  # the exchange of the file
        ("full", 5, "x"),  # none is left
    ],
)
def test_the_disk_fails_at_the_operation_that_is_asked_for(disk, fault, number, message):
    library, folder = disk
    environment = {**os.environ, **library.environment(fault, number)}
    program = [sys.executable, "-c", PROGRAM, str(folder)]
    found = subprocess.run(program, env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == message
    if number == 0:
        assert library.operations() == 4, "open, write, close, exchange"


@pytest.mark.slow
def test_a_comparison_on_a_disk_that_fails(tmp_path):
    with kills.workplace() as (work, temporary, _):
        out = work / "out"  # without figures: they take seconds, and no operation of the disk
        command = ["compare", str(STORED), "--out", str(out)]
        job = kills.Job([command], out, setting=WITHOUT_FIGURES)
        trial = bad_disk.Trial({"compare": job}, temporary, tmp_path)
        for number in range(3):
            case = trial.case("compare", number, seed=1)
            assert case["of"] > 30
            assert bad_disk.survived(case), case


def test_what_a_fault_spoils_is_seen():
    """Else the claim proves nothing."""
    good = {"returned": 2, "traceback": False, "again": 0, "differ": [], "processes": []}
    assert bad_disk.survived(good)
    bad = [{"returned": 70}, {"returned": 1}, {"traceback": True}, {"again": 2}]
    for each in (*bad, {"differ": ["a"]}, {"processes": ["python"]}):
        assert not bad_disk.survived({**good, **each})
