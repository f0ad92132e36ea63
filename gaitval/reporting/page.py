"""Write a report as self-contained HTML and as PDF from the same template."""

import base64
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any, Final

import jinja2
import matplotlib
import numpy as np
import weasyprint
from markupsafe import Markup
from weasyprint.text.fonts import FontConfiguration
from weasyprint.urls import URLFetcher

from gaitval.artefacts import replacing, write_text

_FONTS: Final = {
    ("normal", "normal"): "STIXGeneral.ttf",
    ("bold", "normal"): "STIXGeneralBol.ttf",
    ("normal", "italic"): "STIXGeneralItalic.ttf",
    ("bold", "italic"): "STIXGeneralBolIta.ttf",
}


def number(value: float | None, digits: int = 2) -> str:
    """Fixed-point text with a true minus sign; a dash for a value that was not measured."""
    if value is None or not np.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")


def write_page(folder: Path, name: str, template: str, context: Mapping[str, Any]) -> None:
    """Write `name`.html and `name`.pdf into a folder.

    Equal contexts give equal bytes whenever they are written; only the variable SOURCE_DATE_EPOCH,
    which sets build dates, changes the date in the PDF's fonts.

    The HTML needs no other file and no script. Text in `context` is escaped, except `Markup`.

    Parameters
    ----------
    template : file name of a Jinja template in this package. It is given `context`, the style
        sheet as `css` and the medium, "screen" or "print", as `medium`.
    """
    write_text(folder / f"{name}.html", _rendered(template, context, "screen"))
    # only what the page itself contains: no file and no network, whatever the inputs say
    fetcher = URLFetcher(allowed_protocols=("data",))
    fonts = FontConfiguration()
    printed = _rendered(template, context, "print")
    document = weasyprint.HTML(string=printed, url_fetcher=fetcher)
    faces = weasyprint.CSS(string=_font_faces(), url_fetcher=fetcher, font_config=fonts)
    with replacing(folder / f"{name}.pdf") as temporary, _fixed_clock():
        document.write_pdf(temporary, stylesheets=[faces], font_config=fonts, pdf_tags=True)


def write_html(folder: Path, name: str, template: str, context: Mapping[str, Any]) -> Path:
    """Write `name`.html alone, for a page too long to print; otherwise as `write_page`."""
    path = folder / f"{name}.html"
    write_text(path, _rendered(template, context, "screen"))
    return path


def _rendered(template: str, context: Mapping[str, Any], medium: str) -> str:
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["number"] = number
    page = environment.from_string(_resource(template))
    return page.render({**context, "css": Markup(_resource("report.css"))}, medium=medium)


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


def _resource(name: str) -> str:
    return resources.files("gaitval.reporting").joinpath(name).read_text("utf-8")


def _font_faces() -> str:
    """CSS that embeds the font of the figures, which ships with matplotlib."""
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    faces = []
    for (weight, style), name in _FONTS.items():
        data = base64.b64encode((folder / name).read_bytes()).decode("ascii")
        faces.append(
            f'@font-face {{ font-family: "Report"; font-weight: {weight}; font-style: {style}; '
            f'src: url("data:font/ttf;base64,{data}"); }}'
        )
    return "\n".join(faces)
