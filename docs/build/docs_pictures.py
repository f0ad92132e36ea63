"""Draw the pictures of README and site from finished runs, in headless Chromium.

    python docs/build/docs_pictures.py walker runs/S05              # docs/walker.png
    python docs/build/docs_pictures.py report runs/S05              # docs/report.png
    python docs/build/docs_pictures.py learning runs/S05            # docs/learning.png
    python docs/build/docs_pictures.py recording runs/mine          # docs/recording.png
    python docs/build/docs_pictures.py recording-failed runs/theirs # docs/recording-failed.png
    python docs/build/docs_pictures.py check accuracy/summary.md    # docs/check.png
    python docs/build/docs_pictures.py live http://127.0.0.1:…/…/   # docs/live.png

A run is the folder of `gaitval subject`, or of `gaitval import` for the recordings; the summary is
that of `scripts/action_check.py`, the address that of a `gaitval live` that runs. Each picture is
the page as a reader sees it, with as many colours as keep it below `LARGEST`.
"""

import argparse
import io
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from PIL import Image
from playwright.sync_api import sync_playwright

from claims.browser import FLAGS, LACKING, program

DOCS: Final = Path(__file__).parents[2] / "docs"
LARGEST: Final = 150_000
"""Bytes of a picture: what a page may load without a wait."""
COLOURS: Final = (256, 64)
SHARES: Final = (1.0, 0.8, 0.65, 0.5)
"""Of the size of a picture, tried in this order."""
WIDTH: Final = 800
"""CSS pixels of the window: a report's text is then read without a zoom."""
SCALE: Final = 1.5
"""Pixels of a picture for each CSS pixel."""
SETTLING: Final = 6000
"""ms, in which the replay draws its first frames."""
PAINTING: Final = 500
"""ms, in which the browser paints what has just come into the window."""
BEGINNING: Final = 400
"""CSS pixels of a long verdict that are shown."""
UNWANTED: Final = ".replay-cursor, .replay-dot, button.copy"
"""In pictures of tables and curves: the replay's place in the curves, and buttons."""
STEPS: Final = 8
"""Hundredths of a gait cycle after the start, where both feet carry the walker."""

Shot = Callable[[Any], list[bytes]]


def element(page: Any, selector: str) -> bytes:
    """The first element of the page that a selector finds, as PNG, without what is there to be
    clicked or to follow the replay.
    """
    place = page.locator(selector).first
    place.scroll_into_view_if_needed()
    page.wait_for_timeout(PAINTING)
    page.evaluate(f"document.querySelectorAll('{UNWANTED}').forEach(e => e.style.display = 'none')")
    found: bytes = place.screenshot()
    return found


def after(heading: str) -> str:
    """The drawing of the first figure below a heading."""
    figure = f"//h2[normalize-space()='{heading}']/following::figure[1]"
    return f"xpath={figure}//*[local-name()='svg']"


def walker(page: Any) -> list[bytes]:
    """The replay, stopped where both feet are on the ground."""
    page.locator(".replay-stage").scroll_into_view_if_needed()
    page.wait_for_timeout(SETTLING)
    page.locator("canvas.replay-canvas").focus()
    page.keyboard.press("Space")
    page.keyboard.press("Home")
    for _ in range(STEPS):
        page.keyboard.press("ArrowRight")
    page.wait_for_timeout(SETTLING)
    return [element(page, ".replay-stage")]


def report(page: Any) -> list[bytes]:
    """The first page: verdict, curves, and the tables below them."""
    return [element(page, f".sheet {part}") for part in ("header", ".verdict", "figure", ".halves")]


def learning(page: Any) -> list[bytes]:
    """What the training did."""
    return [element(page, after("Learning"))]


def recording(page: Any) -> list[bytes]:
    """The beginning of an import's verdict, and its moments."""
    return [*failed(page), element(page, after("Joint moments and power"))]


def failed(page: Any) -> list[bytes]:
    """The beginning of an import's verdict: what failed comes first."""
    image = Image.open(io.BytesIO(element(page, ".verdict")))
    beginning = io.BytesIO()
    image.crop((0, 0, image.width, min(image.height, round(BEGINNING * SCALE)))).save(
        beginning, "PNG"
    )
    return [beginning.getvalue()]


def live(page: Any) -> list[bytes]:
    """The whole page, while a push is drawn by the mouse."""
    page.set_viewport_size({"width": 1200, "height": 760})
    page.wait_for_timeout(SETTLING)
    page.locator("#pause").click()
    page.wait_for_timeout(SETTLING)
    box = page.locator("canvas").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.45 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y, steps=3)
    page.wait_for_timeout(SETTLING)
    return [page.screenshot()]


def check(page: Any) -> list[bytes]:
    """The whole page."""
    return [element(page, "main")]


PICTURES: Final[dict[str, tuple[str, Shot]]] = {
    "walker": ("report.html", walker),
    "report": ("report.html", report),
    "learning": ("report.html", learning),
    "recording": ("recording/recording.html", recording),
    "recording-failed": ("recording/recording.html", failed),
    "check": ("", check),
    "live": ("", live),
}
"""The page of the run that a picture is of, and what is taken of it."""


def stacked(parts: list[bytes]) -> Image.Image:
    """Pictures below each other, on white."""
    images = [Image.open(io.BytesIO(part)).convert("RGB") for part in parts]
    gap = round(12 * SCALE)
    height = sum(image.height for image in images) + gap * (len(images) - 1)
    sheet = Image.new("RGB", (max(image.width for image in images), height), "white")
    top = 0
    for image in images:
        sheet.paste(image, (0, top))
        top += image.height + gap
    return sheet


def write(image: Image.Image, path: Path) -> int:
    """Write a picture, smaller or with fewer colours until it is within `LARGEST`; return its
    size in bytes.
    """
    for share in SHARES:
        size = round(share * image.width), round(share * image.height)
        smaller = image.resize(size, Image.Resampling.LANCZOS)
        for colours in COLOURS:
            smaller.quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)
            if path.stat().st_size <= LARGEST:
                return path.stat().st_size
    raise SystemExit(f"{path}: {path.stat().st_size} bytes, at most {LARGEST}")


def as_page(summary: Path, folder: Path) -> Path:
    """A summary in Markdown as a page, in the letters of the forge that shows it."""
    from markdown import markdown

    style = (
        "main{font:15px sans-serif;padding:1em;width:46em;box-sizing:border-box}"
        "table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.35em .7em}"
        "th{text-align:left}code{font-size:.9em}"
    )
    text = markdown(summary.read_text(encoding="utf-8"), extensions=["tables", "md_in_html"])
    page = folder / "summary.html"
    page.write_text(
        f"<!doctype html><meta charset='utf-8'><style>{style}</style><main>{text}</main>",
        encoding="utf-8",
    )
    return page


def main() -> None:
    """Draw one picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("picture", choices=PICTURES)
    parser.add_argument("run", help="folder of the run, summary.md, or address")
    asked = parser.parse_args()
    executable = program()
    if executable is None:
        sys.exit(LACKING)
    name, shot = PICTURES[asked.picture]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as browsers:
        if "://" in asked.run:
            address = asked.run
        else:
            run = Path(asked.run)
            file = run / name if name else as_page(run, Path(folder))
            address = file.resolve().as_uri()
        browser = browsers.chromium.launch(executable_path=executable, args=list(FLAGS))
        page = browser.new_page(
            viewport={"width": WIDTH, "height": 900},
            device_scale_factor=SCALE,
            color_scheme="light",
        )
        page.set_default_timeout(180_000)
        page.goto(address)
        parts = shot(page)
        browser.close()
    path = DOCS / f"{asked.picture}.png"
    size = write(stacked(parts), path)
    sys.stdout.write(f"{path}: {size / 1000:.0f} kB\n")


if __name__ == "__main__":
    main()
