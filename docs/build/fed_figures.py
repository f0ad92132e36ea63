"""Figures in running text that come from the claims of a release, and the paper's table of people.

In a page,

    <!-- claim: WHAT :: FORMAT -->1.62<!-- end -->

holds the value of the row WHAT of `reports/claims.csv`, in Python's FORMAT (`.2f`; `.0%` for a
share). Comments are not shown. `accuracy_tables.py` writes and checks them.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from claims.__main__ import STORE, read
from gaitval.subjects.subject_file import builtin_subjects

ROOT = Path(__file__).parents[2]
_FED: Final = re.compile(r"<!-- claim: (?P<what>.+?) :: (?P<format>\S+) -->.*?<!-- end -->")


def claims(store: Path = STORE) -> dict[str, float]:
    """Values of the claims."""
    return {row["what"]: float(row["value"]) for row in read(store)}


def fed(text: str, values: Mapping[str, float], where: str) -> str:
    """The `text` of a page with its figures from `values`. Raises ValueError, with the page
    (`where`), for a claim that there is not.
    """

    def written(found: re.Match[str]) -> str:
        what, form = found["what"], found["format"]
        if what not in values:
            raise ValueError(f"{where}: no claim is called {what!r}. See reports/claims.csv.")
        shown = format(values[what], form).replace("%", " %")
        return f"<!-- claim: {what} :: {form} -->{shown}<!-- end -->"

    return _FED.sub(written, text)


def people_table() -> str:
    """The paper's Table 1 beside the data set: bold where they differ by more than rounding."""
    lines = ["| | WBDS | paper: sex, age, mass, height, speed | data set | differs |"]
    lines.append("| --- | --- | --- | --- | --- |")
    for one in builtin_subjects():
        if one.paper is None:
            continue
        paper = one.paper
        both = {
            "sex": (paper.sex, one.sex),
            "age": (paper.age_years, one.age_years),
            "mass": (paper.mass_kg, one.mass_kg),
            "height": (100.0 * paper.height_m, 100.0 * one.height_m),
            "speed": (paper.walking_speed_m_s, one.walking_speed_m_s),
        }
        rounding = {"age": 0.0, "mass": 0.05, "height": 0.1, "speed": 0.05}
        off = [
            key
            for key, (a, b) in both.items()
            if (a != b if key == "sex" else abs(float(a) - float(b)) > rounding[key] + 1e-9)
        ]

        def shown(column: int, both: Mapping[str, tuple[object, object]] = both) -> str:
            sex, age, mass, height, speed = (each[column] for each in both.values())
            return f"{sex}, {age:g}, {mass:g} kg, {height:.4g} cm, {speed:.3g} m/s"

        person = (one.person or "").removeprefix("WBDS")
        lines.append(
            f"| {one.identifier} | {person} | {shown(0)} | {shown(1)} | {', '.join(off) or '–'} |"
        )
    return "\n".join(lines)
