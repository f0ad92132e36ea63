"""A page is printed alike in this process and in one beside it, whatever becomes of that."""

import io
import os
import signal
import subprocess
import sys
import zlib
from pathlib import Path

import pytest
from html_page import whole_pdf

from gaitval.reporting import printer

BESIDE = printer._Beside  # before tests are kept from starting it
PAGE = '<html lang="en"><title>a</title><body><h1>Hip</h1><p>−0.3 Nm/kg</p></body></html>'


@pytest.fixture(autouse=True)
def _beside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(printer, "_Beside", BESIDE)


def made(path: Path, *, during=lambda: None) -> bytes:
    with whole_pdf(), printer.printed(path, PAGE, "a4"):
        during()
    return path.read_bytes()


def test_beside_this_process_it_is_the_same_byte_for_byte(tmp_path: Path) -> None:
    here = made(tmp_path / "here.pdf")
    with printer.printing_beside():
        beside = made(tmp_path / "beside.pdf", during=lambda: None)
        assert not printer._beside
    assert here == beside
    assert here.startswith(b"%PDF")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["beside.pdf", "here.pdf"]


def test_where_the_other_process_dies_the_page_is_printed_here(tmp_path: Path) -> None:
    with printer.printing_beside():
        process = printer._beside[-1]._process
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        assert made(tmp_path / "a.pdf").startswith(b"%PDF")


def test_it_ends_with_the_block_that_did_not_need_it(tmp_path: Path) -> None:
    with printer.printing_beside():
        process = printer._beside[-1]._process
    assert process.poll() is not None
    assert not printer._beside


def test_who_is_sent_no_whole_page_prints_nothing(tmp_path: Path) -> None:
    """Its parent was killed."""
    with printer.printing_beside():
        process = printer._beside[-1]._process
        process.stdin.write(printer._LENGTHS.pack(2, 1, 100) + b"a4.half")
        process.stdin.close()
        assert process.stdout.read() == b""
        assert process.wait() == 1


def test_each_part_of_a_pdf_is_compressed_once_and_the_file_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compressed = []
    compressor = zlib.compressobj

    def counted(*settings, **named):
        compressed.append(settings)
        return compressor(*settings, **named)

    with whole_pdf(), printer._fixed_clock():
        document = printer.layouter("a4", tmp_path)(PAGE)
        files, counts = [io.BytesIO(), io.BytesIO()], []
        monkeypatch.setattr(zlib, "compressobj", counted)
        for file, options in zip(
            files, (printer._options(), {"pdf_variant": printer.PDF_VARIANT}), strict=True
        ):
            compressed.clear()
            document.write_pdf(file, **options)
            counts.append(len(compressed))
    assert files[0].getvalue() == files[1].getvalue()
    assert counts[0] < 0.7 * counts[1]


@pytest.mark.skipif(sys.platform != "linux", reason="libraries have other names there")
def test_no_compiler_is_started_to_find_libraries() -> None:
    code = (
        "import subprocess, sys, ctypes.util as c; search = c.find_library\n"
        "def refuse(*a, **k): raise AssertionError(a)\n"
        "subprocess.Popen = refuse\n"
        "from gaitval.reporting.printer import load_printer; load_printer()\n"
        "assert 'weasyprint' in sys.modules and c.find_library is search"
    )
    subprocess.run([sys.executable, "-P", "-c", code], check=True)
