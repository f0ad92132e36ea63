"""Pages laid out on sheets, as PDF: in this process, or in one beside it.

To lay out a page is the longest step of a report, and what does it takes a third of a second to
load. Beside this process it loads while results are read, and lays out while the pages for a screen
are written. What it writes is the same, byte for byte.
"""

import base64
import ctypes.util
import os
import re
import signal
import struct
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final

from gaitval.artefacts import replacing, scratch
from gaitval.memory import without_search
from gaitval.reporting.font_widths import fonts_folder
from gaitval.reporting.paper_figures import PrintedFigure
from gaitval.reporting.style import SKETCHED

if TYPE_CHECKING:
    import weasyprint

_FONTS: Final = {
    ("Report", "normal", "normal"): "STIXGeneral.ttf",
    ("Report", "bold", "normal"): "STIXGeneralBol.ttf",
    ("Report", "normal", "italic"): "STIXGeneralItalic.ttf",
    ("Report", "bold", "italic"): "STIXGeneralBolIta.ttf",
    ("Report Mono", "normal", "normal"): "DejaVuSansMono.ttf",
}
_PAPERS: Final = {"a4": "A4", "letter": "letter"}
PDF_VARIANT: Final = "pdf/a-2a"
"""For archives, with tags (ISO 19005-2, level A): what a screen reader needs is in it."""
_FONT_SCHEME: Final = "gaitval-font:"
_FIGURE_SCHEME: Final = "gaitval-figure:"
_PICTURE: Final = re.compile(r'src="data:image/svg\+xml;base64,([^"]*)"')
_LENGTHS: Final = struct.Struct("<QQQ")
"""Before what the other process is sent: bytes of the paper's name, the folder, and the page."""


def load_printer() -> None:
    """Load what lays a page out. It tries its libraries by the names of every system, and for each
    name that is not of this one `ctypes` starts a compiler and a linker: 22 processes.
    """
    if sys.platform == "linux":
        search = ctypes.util.find_library
        ctypes.util.find_library = lambda name: None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # that a library is missing
                import weasyprint
            return
        except (OSError, Warning):  # here they have other names
            pass
        finally:
            ctypes.util.find_library = search
    import weasyprint  # noqa: F401


def layouter(paper: str, own: Path) -> "Callable[[str], weasyprint.Document]":
    """What lays a page out on sheets of a size; fonts are prepared in the folder `own`."""
    load_printer()
    import weasyprint
    from weasyprint.text.fonts import FontConfiguration
    from weasyprint.urls import URLFetcher, URLFetcherResponse

    class OwnFiles(URLFetcher):  # type: ignore[misc]
        """Fetches what a page contains, and the fonts of `_FONTS` by their names; nothing else."""

        def fetch(self, url: str, headers: Mapping[str, str] | None = None) -> URLFetcherResponse:
            """What a `url` stands for."""
            name = url.removeprefix(_FONT_SCHEME)
            if name in _FONTS.values():
                font = (fonts_folder() / name).read_bytes()
                return URLFetcherResponse(url, font, {"Content-Type": "font/ttf"})
            return super().fetch(url, headers)

    # only what the page itself contains: no file and no network, whatever the inputs say
    fetcher = OwnFiles(allowed_protocols=("data",))
    fonts = FontConfiguration()
    fonts._folder = own  # else in the system's temporary files, where a kill leaves it
    sheets = [
        weasyprint.CSS(string=text, url_fetcher=fetcher, font_config=fonts)
        for text in (_font_faces(), f"@page {{ size: {_PAPERS[paper]} }}")
    ]

    def lay_out(page: str) -> weasyprint.Document:
        known: dict[str, PrintedFigure] = {}

        def sketched(found: re.Match[str]) -> str:
            svg = base64.b64decode(found[1]).decode()
            if SKETCHED not in svg:
                return found[0]
            name = f"{_FIGURE_SCHEME}{len(known)}"
            known[name] = PrintedFigure(svg, fonts)
            return f'src="{name}"'

        whole = weasyprint.HTML(string=_PICTURE.sub(sketched, page), url_fetcher=fetcher)
        return whole.render(
            stylesheets=sheets, font_config=fonts, pdf_variant=PDF_VARIANT, cache=known
        )

    return lay_out


def _font_faces() -> str:
    """CSS that embeds the fonts of the figures and of code, which ship with matplotlib. By name: as
    text their two megabytes would be read letter by letter.
    """
    return "\n".join(
        f'@font-face {{ font-family: "{family}"; font-weight: {weight}; font-style: {style}; '
        f'src: url("{_FONT_SCHEME}{name}"); }}'
        for (family, weight, style), name in _FONTS.items()
    )


@contextmanager
def _fixed_clock() -> Iterator[None]:
    """A PDF's embedded fonts contain the time at which they were subset; if SOURCE_DATE_EPOCH (s
    since 1970) is set, fontTools uses it instead of the clock. A report must depend only on its
    results, so a fixed date is set.
    """
    name = "SOURCE_DATE_EPOCH"
    if name in os.environ:
        yield
        return
    os.environ[name] = "0"
    try:
        yield
    finally:
        del os.environ[name]


def _options() -> dict[str, Any]:
    """How a PDF is written: for archives, and each of its parts once. They are asked for twice, for
    the file and for its identifier, and compressed each time.
    """
    import pydyf  # type: ignore[import-untyped]

    class Written(pydyf.Object):  # type: ignore[misc]
        """A part of a PDF with what is written of it."""

        def __init__(self, part: pydyf.Object) -> None:
            super().__init__()
            self.number, self.generation, self.free = part.number, part.generation, part.free
            self._part, self._written = part, part.data

        @property
        def data(self) -> bytes:
            """As it is written."""
            return bytes(self._written)

        @property
        def compressible(self) -> bool:
            """Whether it is compressed together with others."""
            return bool(self._part.compressible)

    def written(_: object, pdf: pydyf.PDF) -> None:
        pdf.objects[:] = [each if each.free == "f" else Written(each) for each in pdf.objects]

    return {"pdf_variant": PDF_VARIANT, "finisher": written}


_beside: list["_Beside"] = []


class _Beside:
    """The process beside this one: it loads, and prints one page."""

    def __init__(self) -> None:
        # -P: a module in the current folder must not replace Python's own
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # what fails there is done again, and said, here
        )

    def begin(self, page: str, paper: str, own: Path) -> None:
        """Let it lay out a `page`."""
        assert self._process.stdin is not None
        parts = [each.encode() for each in (paper, str(own), page)]
        with suppress(OSError):  # it has ended, which is seen by its answer
            self._process.stdin.write(_LENGTHS.pack(*map(len, parts)) + b"".join(parts))
            self._process.stdin.close()

    def answer(self) -> bytes | None:
        """The PDF; None if it was not made."""
        assert self._process.stdout is not None
        found = self._process.stdout.read()
        return found if self._process.wait() == 0 else None

    def end(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        for each in (self._process.stdin, self._process.stdout):
            if each is not None:
                with suppress(OSError):
                    each.close()
        self._process.wait()


@contextmanager
def printing_beside() -> Iterator[None]:
    """Within the block, the next page is printed by a process beside this one, which starts now."""
    try:
        here = _Beside()
    except OSError:  # no process can be started: this one prints
        yield
        return
    _beside.append(here)
    try:
        yield
    finally:
        if here in _beside:
            _beside.remove(here)
        here.end()


@contextmanager
def printed(path: Path, page: str, paper: str) -> Iterator[None]:
    """Write a `page` of HTML as PDF to `path` on sheets of a size, while the block runs if there is
    a process for it, otherwise after the block.
    """
    here = _beside.pop() if _beside else None
    with scratch(path.parent) as own, replacing(path) as temporary:
        if here is not None:
            here.begin(page, paper, own)
        yield
        made = None if here is None else here.answer()
        if made is None:
            with _fixed_clock(), without_search():
                layouter(paper, own)(page).write_pdf(temporary, **_options())
        else:
            temporary.write_bytes(made)


def _serve(sent: BinaryIO, answer: BinaryIO) -> int:
    """Print the page that is `sent`; return an exit code."""
    load_printer()  # while the page is not there yet
    lengths = sent.read(_LENGTHS.size)
    if len(lengths) < _LENGTHS.size:
        return 1  # who started this has ended, or needs no page
    sizes = _LENGTHS.unpack(lengths)
    parts = [sent.read(size) for size in sizes]
    if tuple(map(len, parts)) != sizes:
        return 1
    paper, own, page = (each.decode() for each in parts)
    made = BytesIO()
    with _fixed_clock(), without_search():
        layouter(paper, Path(own))(page).write_pdf(made, **_options())
    answer.write(made.getvalue())
    answer.flush()
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started this ends it
    from gaitval.reporting import printer  # under its own name, as what it imports knows it

    code = printer._serve(sys.stdin.buffer, sys.stdout.buffer)
    os._exit(code)  # at once: nothing is left to write
