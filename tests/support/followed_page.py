"""Pages of the documentation that show a change of gaitval: the change, made in a copy."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]


class Block(NamedTuple):
    """A block of a diff on a page: the file that it changes, and its lines."""

    file: str
    lines: str


def section_of(page: str) -> str:
    """The text of a section of a page of docs/how-to, "page.md#the-section"."""
    name, _, wanted = page.partition("#")
    text = (ROOT / "docs/how-to" / name).read_text(encoding="utf-8")
    sections = re.split(r"^(?=## )", text, flags=re.MULTILINE)[1:]
    (found,) = (
        section
        for section in sections
        if section.partition("\n")[0].removeprefix("## ").lower().replace(" ", "-") == wanted
    )
    return found


def blocks_of(page: str) -> list[Block]:
    """Every block of a diff of a section of a page of docs/how-to, in order."""
    text = section_of(page)
    return [Block(*found) for found in re.findall(r"```diff\n--- (\S+)\n(.*?)```", text, re.DOTALL)]


def changed(text: str, block: Block) -> str:
    """The text of a file with a block applied."""
    lines = block.lines.splitlines()
    before, after = (
        "".join(f"{line[1:]}\n" for line in lines if line[:1] in kept) for kept in (" -", " +")
    )
    assert text.count(before) == 1, before
    return text.replace(before, after)


def followed(page: str, folder: Path) -> Path:
    """A folder with a copy of the package in which a page was followed."""
    # With what Python compiled of it, and so with what numba did: both hold for unchanged files.
    unread = shutil.ignore_patterns("baselines")
    shutil.copytree(ROOT / "gaitval", folder / "gaitval", ignore=unread)
    for block in blocks_of(page):
        path = folder / block.file
        path.write_text(changed(path.read_text(encoding="utf-8"), block), encoding="utf-8")
    return folder


def ran(place: Path, *words: str) -> str:
    """What Python prints in a folder whose package comes first, on both channels."""
    paths = os.pathsep.join([str(place), str(ROOT / "tests/support")])
    done = subprocess.run(
        [sys.executable, *words],
        cwd=place,
        env=os.environ | {"PYTHONPATH": paths, "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr
