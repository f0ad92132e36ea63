"""The page of claims: what the newest version is held to, and what moved since the one before. And
the copy of its figures that is shipped for reports to cite.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from . import registry, rows

FOLDER: Final = Path(__file__).resolve().parents[1] / "reports" / "claims"
PAGE: Final = FOLDER / "README.md"
SHIPPED: Final = FOLDER.parents[1] / "gaitval" / "reporting" / "claims.csv"
MOVED: Final = 0.01
"""Relative change above which a value is said to have moved: what rounding, another machine's load
and another draw of people move is less, but for seconds."""
HEAD: Final = """# What gaitval {version} may be held to

Written by `python -m claims --page` from the CSV files beside it, which also have the commit, the
date and the machine of each figure. `python -m claims TOPIC.NAME` measures one again; see
[claims](../../claims/README.md). A ratio has no unit; *n* is the number of cases. In
brackets: the version that was measured, where it is an earlier one.
"""


def versions(folder: Path = FOLDER) -> list[str]:
    """The versions that have a file, the oldest first."""
    names = [each.stem for each in folder.glob("*.csv")]
    return sorted(names, key=lambda name: [int(part) for part in re.findall(r"\d+", name)])


def newest(folder: Path = FOLDER, until: str = "") -> list[dict[str, str]]:
    """The rows of each measurement as the newest version has them in which it was run; of the
    versions to `until`.
    """
    names = versions(folder)
    found: list[dict[str, str]] = []
    for name in names[: names.index(until) + 1] if until else names:
        new = rows.read(folder / f"{name}.csv")
        made, again = {row["what"] for row in new}, {row["by"] for row in new}
        found = [row for row in found if row["what"] not in made and row["by"] not in again] + new
    return found


def moved(now: float, before: float) -> bool:
    """Whether two values of a claim differ by more than `MOVED` of the larger."""
    return abs(now - before) > MOVED * max(abs(now), abs(before))


def page(version: str, claims: list[dict[str, str]], before: str, old: list[dict[str, str]]) -> str:
    """The text: what moved, what is new or gone, and every claim by topic."""
    then = {row["what"]: row for row in old}
    now = {row["what"]: row for row in claims if row["version"] == version}
    parts = [HEAD.format(version=version)]
    if before:
        both = [row for row in now.values() if row["what"] in then]
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
        if new := now.keys() - then.keys():
            parts.append(f"New: {'; '.join(sorted(new))}.\n")
        if kept := then.keys() - now.keys():
            parts.append(f"As measured before, and marked below: {len(kept)}.\n")
    for topic in sorted({row["by"].partition(".")[0] for row in claims}):
        lines = [_line(row["what"] + ("" if row["version"] == version else f" ({row['version']})"),
                       f"{_value(row)} | {row['n']}")
                 for row in claims if row["by"].partition(".")[0] == topic]  # fmt: skip
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
    """Write `PAGE` of the newest version, and `SHIPPED`, without what is measured no more."""
    *earlier, version = versions()
    before = earlier[-1] if earlier else ""
    now = [row for row in newest() if row["by"] in registry.measurements()]
    text = page(version, now, before, newest(until=before) if before else [])
    PAGE.write_text(text, encoding="utf-8")
    SHIPPED.write_text(rows.as_csv(now), encoding="utf-8")
    return PAGE
