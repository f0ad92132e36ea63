"""The page of claims: what the newest version is held to, and what moved since the one before. And
the copy of its figures that is shipped for reports to cite.
"""

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).resolve().parents[1] / "reports" / "claims"
PAGE: Final = FOLDER / "README.md"
SHIPPED: Final = FOLDER.parents[1] / "gaitval" / "reporting" / "claims.csv"
MOVED: Final = 0.01
"""Relative change above which a value is said to have moved: what rounding, another machine's load
and another draw of people move is less, but for seconds."""
HEAD: Final = """# What gaitval {version} may be held to

Written by `python -m claims --page` from the CSV files beside it, which also have the commit, the
date and the machine of each figure. `python -m claims TOPIC.NAME` measures one again; see
[claims](../../claims/README.md). A ratio has no unit; *n* is the number of cases.
"""


def versions() -> list[str]:
    """The versions that have a file, the oldest first."""
    names = [each.stem for each in FOLDER.glob("*.csv")]
    return sorted(names, key=lambda name: [int(part) for part in re.findall(r"\d+", name)])


def moved(now: float, before: float) -> bool:
    """Whether two values of a claim differ by more than `MOVED` of the larger."""
    return abs(now - before) > MOVED * max(abs(now), abs(before))


def page(version: str, rows: list[dict[str, str]], before: str, old: list[dict[str, str]]) -> str:
    """The text: what moved, what is new or gone, and every claim by topic."""
    then = {row["what"]: row for row in old}
    now = {row["what"]: row for row in rows}
    parts = [HEAD.format(version=version)]
    if before:
        both = [row for row in rows if row["what"] in then]
        changed = [
            row for row in both
            if moved(float(row["value"]), float(then[row["what"]]["value"]))
        ]  # fmt: skip
        parts.append(
            f"## What moved since {before}\n\nOf {len(both)} claims that both versions have, "
            f"{len(changed)} moved by more than {100 * MOVED:.0f} %.\n"
        )
        if changed:
            lines = [_line(row["what"], f"{_value(then[row['what']])} | {_value(row)}")
                     for row in changed]  # fmt: skip
            parts.append(
                "\n".join([f"| what | {before} | {version} |", "|---|---|---|", *lines, ""])
            )
        for word, names in (("New", now.keys() - then.keys()),
                            (f"Not measured of {version}", then.keys() - now.keys())):  # fmt: skip
            if names:
                parts.append(f"{word}: {'; '.join(sorted(names))}.\n")
    for topic in dict.fromkeys(row["by"].partition(".")[0] for row in rows):
        lines = [_line(row["what"], f"{_value(row)} | {row['n']}")
                 for row in rows if row["by"].partition(".")[0] == topic]  # fmt: skip
        title = topic.replace("_", " ").capitalize()
        parts.append(
            "\n".join([f"## {title}\n", "| what | value | n |", "|---|---|---|", *lines, ""])
        )
    return "\n".join(parts)


def _line(what: str, cells: str) -> str:
    return f"| {what.replace('|', chr(92) + '|')} | {cells} |"


def _value(row: Mapping[str, str]) -> str:
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    return f"{float(row['value']):.3g}{unit}"


def write_page() -> Path:
    """Write `PAGE` of the newest version, and `SHIPPED`."""
    from . import rows

    *earlier, version = versions()
    before = earlier[-1] if earlier else ""
    text = page(version, rows.read(FOLDER / f"{version}.csv"), before,
                rows.read(FOLDER / f"{before}.csv"))  # fmt: skip
    PAGE.write_text(text, encoding="utf-8")
    shutil.copyfile(FOLDER / f"{version}.csv", SHIPPED)
    return PAGE
