"""Writes docs/architecture.svg and the table of folders in docs/architecture.md from the imports.

    python docs/build/architecture.py [--check]

`--check` writes nothing and fails if a file is out of date. `tests/test_import_order.py` checks
that imports go down only.
"""

import argparse
import ast
import sys
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import grimp

from claims.marked_table import with_table

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "gaitval"

CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
    "importlinter"
]["contracts"]
LAYERS = tuple(tuple(layer.split(" | ")) for layer in CONTRACTS[0]["layers"][:-3])
"""The layers of the package, in import-linter's order. A folder imports only from layers that
follow, and from the ground: modules at the top of the package, which import from no folder.
"""
FOLDERS = tuple(folder for layer in LAYERS for folder in layer)

WIDTH, BOX, ROW = 1180, (196, 62), 104
"""Pixels: width of the picture, size of a box, and distance between rows."""


@cache
def arrows() -> dict[str, set[str]]:
    """The folders that each folder imports from, without itself and the ground."""
    graph = grimp.build_graph("gaitval", cache_dir=None)
    for folder in FOLDERS:
        graph.squash_module(f"gaitval.{folder}")
    return {
        folder: {
            other
            for each in graph.find_modules_directly_imported_by(f"gaitval.{folder}")
            if (other := each.rpartition(".")[2]) in FOLDERS and other != folder
        }
        for folder in FOLDERS
    }


def _below(folder: str, of: Mapping[str, set[str]]) -> set[str]:
    """All folders that can be reached from one."""
    return of[folder].union(*(_below(each, of) for each in of[folder]))


def drawn(of: Mapping[str, set[str]]) -> dict[str, set[str]]:
    """Arrows that are not implied by others."""
    return {
        folder: {
            each
            for each in targets
            if not any(each in _below(other, of) for other in targets - {each})
        }
        for folder, targets in of.items()
    }


def what(folder: str) -> str:
    """What a folder contains: the docstring of its `__init__`, on one line."""
    text = (PACKAGE / folder / "__init__.py").read_text(encoding="utf-8")
    return " ".join((ast.get_docstring(ast.parse(text)) or "").split())


def ground() -> list[str]:
    """The modules at the top of the package."""
    return [name for name in (p.stem for p in sorted(PACKAGE.glob("*.py"))) if name[0] != "_"]


def _lines(text: str, letters: int) -> list[str]:
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) >= letters:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def picture() -> str:
    """The SVG: folders in rows, each row importing from the rows below it only."""
    of = arrows()
    level: dict[str, int] = {}
    for folder in reversed(FOLDERS):
        level[folder] = 1 + max((level[each] for each in of[folder]), default=-1)
    rows = [[f for f in FOLDERS if level[f] == n] for n in range(max(level.values()), -1, -1)]
    width, height = BOX
    left = {}
    top = {}
    for number, row in enumerate(rows):
        gap = (WIDTH - len(row) * width) / (len(row) + 1)
        for place, folder in enumerate(row):
            left[folder] = gap + place * (width + gap)
            top[folder] = 20 + number * ROW
    bottom = 20 + len(rows) * ROW
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {bottom + 70}" '
        'font-family="Helvetica, Arial, sans-serif">',
        "<title>Folders of gaitval and what they import</title>",
        '<defs><marker id="head" markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto">'
        '<path d="M0,0 L8,4 L0,8 z" fill="#5b6b7b"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{bottom + 70}" fill="#ffffff"/>',
    ]
    for folder, targets in drawn(of).items():
        for target in sorted(targets):
            x, y = left[folder] + width / 2, top[folder] + height
            u, v = left[target] + width / 2, top[target]
            bend = (v - y) / 2
            parts.append(
                f'<path d="M{x:.0f},{y} C{x:.0f},{y + bend:.0f} {u:.0f},{v - bend:.0f} '
                f'{u:.0f},{v - 2}" fill="none" stroke="#5b6b7b" stroke-width="1.3" '
                'marker-end="url(#head)"/>'
            )
    for folder in FOLDERS:
        x, y = left[folder], top[folder]
        parts.append(
            f'<rect x="{x:.0f}" y="{y}" width="{width}" height="{height}" rx="6" fill="#eef3f8" '
            'stroke="#2f5d8a"/>'
            f'<text x="{x + 10:.0f}" y="{y + 18}" font-size="14" font-weight="bold">{folder}</text>'
        )
        parts += [
            f'<text x="{x + 10:.0f}" y="{y + 33 + 12 * n}" font-size="10">{line}</text>'
            for n, line in enumerate(_lines(what(folder).rstrip("."), 37)[:3])
        ]
    parts.append(
        f'<rect x="20" y="{bottom}" width="{WIDTH - 40}" height="46" rx="6" fill="#f4f1e8" '
        f'stroke="#8a7a2f"/><text x="30" y="{bottom + 19}" font-size="14" font-weight="bold">'
        f'the ground</text><text x="30" y="{bottom + 36}" font-size="11">'
        f"{', '.join(ground())}: all may import them, and they import from no folder</text>"
    )
    return "\n".join([*parts, "</svg>\n"])


def table() -> str:
    """The folders, top to bottom, and what they import from."""
    of = arrows()
    lines = ["| folder | contains | imports from |", "|---|---|---|"]
    for folder in FOLDERS:
        names = ", ".join(f"`{each}`" for each in FOLDERS if each in of[folder])
        lines.append(f"| `{folder}/` | {what(folder)} | {names or 'the ground only'} |")
    return "\n".join(lines)


def main() -> None:
    """Write, or check, the picture and the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail if out of date")
    check = parser.parse_args().check
    page = ROOT / "docs" / "architecture.md"
    wanted = {
        ROOT / "docs" / "architecture.svg": picture(),
        page: with_table(page.read_text(encoding="utf-8"), "folders", table()),
    }
    for path, text in wanted.items():
        if path.read_text(encoding="utf-8") == text:
            continue
        if check:
            sys.exit(f"{path} is out of date: run `python docs/build/architecture.py`.")
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
