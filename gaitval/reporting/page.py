"""Write a report as self-contained HTML and as PDF from the same template."""

import base64
import colorsys
import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from gaitval._internal.io.artefacts import versions, write_text
from gaitval._internal.io.build_info import now, source_commit
from gaitval._internal.io.text_tables import shown
from gaitval._internal.text.number_text import (
    degree_signs,
    number,
    rough,
    signed,
    unit_sign,
    unit_text,
)
from gaitval.configuration import ReportSettings
from gaitval.conventions import beside, convention_of
from gaitval.metrics.verdicts import close_text, spread_text, target_text, value_text
from gaitval.reporting.drawing import FONT
from gaitval.reporting.figure_data import write_tables
from gaitval.reporting.printer import print_page

Draw = Callable[[], str]
"""Draws a figure, as SVG."""


def _labelled(svg: str, text: str, medium: str) -> Markup:
    """A figure with a text for those who cannot see it. On a screen its colours follow the style
    sheet, so that dark mode has its own.
    """
    if not svg:
        return Markup(f"<em>{escape(text)}: left out (report.figures)</em>")
    if medium == "print":  # as an image: the page's style sheet need not look at its parts
        picture = _base64(svg.replace(FONT, "Report"))  # as the paper calls this font
        return Markup(f'<img src="data:image/svg+xml;base64,{picture}" alt="{escape(text)}">')
    themed = re.sub(r"(?<=: )#([0-9a-f]{6})\b", _in_both_modes, svg)
    return Markup(themed.replace("<svg", f'<svg role="img" aria-label="{escape(text)}"', 1))


def _in_both_modes(colour: re.Match[str]) -> str:
    """A figure's colour from the style sheet; without one there, turned light on a dark page."""
    return _themed(colour[1])


@cache
def _themed(colour: str) -> str:
    red, green, blue = (int(colour[at : at + 2], 16) / 255 for at in (0, 2, 4))
    hue, lightness, saturation = colorsys.rgb_to_hls(red, green, blue)
    # the same hue; dark colours become light, and black becomes white
    turned = colorsys.hls_to_rgb(hue, max(lightness, 1.0 - 0.6 * lightness), saturation)
    light = "".join(f"{round(255 * value):02x}" for value in turned)
    return f"var(--c{colour}, light-dark(#{colour}, #{light}))"


def _base64(text: str) -> str:
    return base64.b64encode(text.encode()).decode("ascii")


@cache  # with the templates
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_resource),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        # a cell with nothing but this unit; all else is printed as it is
        finalize=lambda value: "°" if value == "deg" else value,
    )
    environment.filters |= {
        "labelled": _labelled,
        "base64": _base64,
        "number": number,
        "signed": signed,
        "rough": rough,
        "degrees": degree_signs,
        "unit_text": unit_text,
        "unit_sign": unit_sign,
        "count": lambda value: f"{round(value):,}",
        "digits": lambda unit: 3 if unit == "Nm/kg" else 1,
        "target": target_text,
        "value_text": value_text,
        "spread": spread_text,
        "why_close": close_text,
    }
    return environment


def write_page(
    folder: Path,
    name: str,
    template: str,
    context: Mapping[str, Any],
    settings: ReportSettings | None = None,
    *,
    scripts: Sequence[str] = (),
    beside: Mapping[str, str] | None = None,
) -> None:
    """Write `name`.html and `name`.pdf into `folder`, from the values of `context`.

    Equal contexts give equal bytes whenever they are written; only the variable SOURCE_DATE_EPOCH,
    which sets build dates, changes the date in the PDF's fonts.

    The HTML needs no other file; without its script it lacks only the buttons that copy a table.
    Text in `context` is escaped, except `Markup`.

    Parameters
    ----------
    template : file name of a Jinja template in this package, or "package:file" in another. It is
        given `context`, the versions of what made it as `software`, its `commit`, when it is
        `written`, the style sheet as `css`, the script as `script`, the medium, "screen" or
        "print", as `medium`. Its `drawings` say how each figure is drawn (`Draw`); `data` are the
        tables behind them (`figure_data`), which are written beside the page, too.
    settings : the paper, A4 by default, and whether there are figures and a PDF, both by default;
        without one, that of an earlier page is removed.
    scripts : file names of scripts of this page alone, in this package; their texts are given to
        the template as `scripts`. No other script runs (`security_policy`).
    beside : templates of further pages of the same values, by the name of their HTML: what is for
        a screen alone, because few people read it.
    """
    page, values = _prepared(template, context, scripts)
    looks = settings or ReportSettings()
    draws: Mapping[str, Draw] = context.get("drawings", {})
    values["drawings"] = _drawings(draws) if looks.figures else dict.fromkeys(draws, Markup())
    write_tables(folder, values["data"])
    write_text(folder / f"{name}.html", _html(page, values, "screen"))
    for other, further in (beside or {}).items():
        second, own = _prepared(further, context, ())
        own["drawings"] = values["drawings"]
        write_text(folder / f"{other}.html", _html(second, own, "screen"))
    if looks.pdf:
        print_page(folder / f"{name}.pdf", _html(page, values, "print"), looks.paper)
    else:
        (folder / f"{name}.pdf").unlink(missing_ok=True)


def write_html(folder: Path, name: str, template: str, context: Mapping[str, Any]) -> Path:
    """Write only `name`.html into `folder`, for a page too long to print; `template` and `context`
    are those of `write_page`.
    """
    page, values = _prepared(template, context, ())
    values["drawings"] = _drawings(context.get("drawings", {}))
    path = folder / f"{name}.html"
    write_text(path, _html(page, values, "screen"))
    return path


def _html(page: jinja2.Template, values: Mapping[str, Any], medium: str) -> str:
    """The page, without the hidden characters of names that come from outside."""
    return shown(page.render(values, medium=medium))


def _prepared(
    template: str, context: Mapping[str, Any], scripts: Sequence[str]
) -> tuple[jinja2.Template, dict[str, Any]]:
    """A template and what it is given, but for the figures."""
    shared, *code = [_resource(each) for each in ("page.js", *scripts)]
    values: dict[str, Any] = {
        "data": {},
        "software": versions(),
        "commit": source_commit(),
        "written": now(),
        **context,
        "css": Markup(_resource("report.css")),
        "script": Markup(shared),
        "scripts": [Markup(each) for each in code],
        "security_policy": security_policy([shared, *code]),
    }
    return _environment().get_template(template), values


def _drawings(draws: Mapping[str, Draw]) -> dict[str, Markup]:
    """Figures as markup: texts from outside in them are escaped."""
    return {name: Markup(draw()) for name, draw in draws.items()}


def security_policy(scripts: Sequence[str]) -> str:
    """A Content-Security-Policy under which a page fetches nothing and runs only `scripts`. Style
    attributes are allowed, because the drawn bars of the tables use them.
    """
    hashes = [hashlib.sha256(script.encode("utf-8")).digest() for script in scripts]
    allowed = [f"'sha256-{base64.b64encode(each).decode('ascii')}'" for each in hashes]
    return (
        f"default-src 'none'; script-src {' '.join(allowed)}; style-src 'unsafe-inline'; "
        "img-src data:; font-src data:; base-uri 'none'; form-action 'none'"
    )


def _resource(name: str) -> str:
    """The text of a file of this package, or of "package:file"."""
    package, _, file = name.rpartition(":")
    return resources.files(package or "gaitval.reporting").joinpath(file).read_text("utf-8")


def counted(name: str) -> dict[str, Any]:
    """For a page whose angles are counted by the convention of this `name`: it, and by how much
    others are more.
    """
    convention = convention_of(name)
    return {"convention": convention, "beside_convention": beside(convention)}
