"""A page in Debian's Chromium, as a reader sees it."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
from browser import LACKING, SERIOUS, program


def chromium(config: pytest.Config) -> str:
    """The browser; without one the test is skipped, and fails where --require-data is given."""
    pytest.importorskip("playwright")
    found = program()
    if found is None:
        if config.getoption("--require-data"):
            pytest.fail(LACKING)
        pytest.skip(LACKING)
    return found


@contextmanager
def opened(executable: str, file: Path, *, width: int = 800, dark: bool = False) -> Iterator[Any]:
    """A page of playwright with a file in it."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as browsers:
        browser = browsers.chromium.launch(executable_path=executable, args=["--no-sandbox"])
        scheme = "dark" if dark else "light"
        page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        page.set_default_timeout(180_000)
        page.goto(file.resolve().as_uri())
        yield page
        browser.close()


def violations(page: Any) -> list[str]:
    """What axe-core finds that hinders readers seriously, with the first place of each.

    It is not asked how to find every element that passes, as `browser` asks it: on a page
    with figures that takes three quarters of its time.
    """
    page.evaluate(resources.files("axe_playwright_python").joinpath("axe.min.js").read_text())
    result = page.evaluate("axe.run({resultTypes: ['violations']})")
    assert result["passes"], f"{page.url}: axe-core checked nothing"
    return [
        f"{found['id']}: {found['nodes'][0]['html']}"
        for found in result["violations"]
        if found["impact"] in SERIOUS
    ]


def overflow(page: Any) -> int:
    """CSS pixels by which the page is wider than its window."""
    return int(page.evaluate("document.documentElement.scrollWidth - window.innerWidth"))
