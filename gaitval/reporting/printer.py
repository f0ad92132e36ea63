"""Pages laid out on sheets, as PDF."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import matplotlib

from gaitval._internal.io.artefacts import replacing, scratch, workplace

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


def print_page(path: Path, page: str, paper: str) -> None:
    """Write a `page` of HTML as PDF to `path` on sheets of a size, whole or not at all."""
    with scratch(workplace(path)) as own, replacing(path) as temporary, _fixed_clock():
        lay_out(page, paper, own).write_pdf(temporary, pdf_variant=PDF_VARIANT)


def lay_out(page: str, paper: str, own: Path) -> "weasyprint.Document":
    """A `page` of HTML on sheets of a size; fonts are prepared in the folder `own`."""
    import weasyprint
    from weasyprint.text.fonts import FontConfiguration
    from weasyprint.urls import URLFetcher, URLFetcherResponse

    class OwnFiles(URLFetcher):  # type: ignore[misc]
        """Fetches what a page contains, and the fonts of `_FONTS` by their names; nothing else."""

        def fetch(self, url: str, headers: Mapping[str, str] | None = None) -> URLFetcherResponse:
            """What a `url` stands for."""
            name = url.removeprefix(_FONT_SCHEME)
            if name in _FONTS.values():
                font = Path(matplotlib.get_data_path(), "fonts", "ttf", name).read_bytes()
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
    return weasyprint.HTML(string=page, url_fetcher=fetcher).render(
        stylesheets=sheets, font_config=fonts, pdf_variant=PDF_VARIANT
    )


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
