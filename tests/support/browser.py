"""Chromium, as the tests of pages and what measures them use it."""

import os
import shutil
from typing import Final

FLAGS: Final = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-gpu-rasterization",
)
"""Graphics without a graphics card; the page around them is painted without, which is faster."""
LACKING: Final = "no chromium on the path: apt-get install chromium, or set GAITVAL_CHROMIUM"
SERIOUS: Final = ("serious", "critical")


def program() -> str | None:
    """The browser of this machine; None without one (`LACKING`)."""
    return os.environ.get("GAITVAL_CHROMIUM") or shutil.which("chromium")
