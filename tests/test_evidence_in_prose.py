"""Sentences of the documentation that state a row of `reports/evidence` say its figure of today."""

import csv
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RATIO = "error of the walk over that of the statistical prediction"
HALF = "unseen half of a session's cycles"
WORST = "error over the fitted half's, worst"
SAID = (
    (
        "docs/held-out.md",
        r"its error is ([\d.]+) \(angles\), ([\d.]+) \(moments\), ([\d.]+), ([\d.]+) and ([\d.]+) "
        r"times",
        "fit",
        [f"unseen speed: {group}, {RATIO}" for group in (
            "sagittal angles", "moments", "vertical force", "fore-aft force", "medial force"
        )],
        1,
    ),
    (
        "docs/held-out.md",
        r"up to ([\d.]+) \(angles\), ([\d.]+) \(moments\) and ([\d.]+) times \(forces\)",
        "held_out",
        [f"{HALF}: {group}, {WORST}" for group in ("sagittal angles", "moments", "forces")],
        1,
    ),
    (
        "docs/held-out.md",
        r"What is beyond the person's own difference is ([\d.]+) times at most",
        "held_out",
        [f"{HALF}: moments, {WORST}, beyond the person's own difference between halves"],
        1,
    ),
    (
        "docs/identification.md",
        r"of which (\d+) % are right",
        "identification",
        ["harsh world, with a range-of-motion trial: distances declared identified that are within "
         "2 SD"],
        100,
    ),
)  # fmt: skip
"""Page, sentence, topic of the evidence, its rows in the sentence's order, and their factor."""


@pytest.mark.parametrize(("page", "sentence", "topic", "rows", "factor"), SAID)
def test_a_sentence_has_the_figures_of_its_rows(page, sentence, topic, rows, factor):
    text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
    with (ROOT / f"reports/evidence/{topic}.csv").open(encoding="utf-8", newline="") as file:
        values = {row["what"]: float(row["value"]) for row in csv.DictReader(file)}
    found = re.search(sentence, text)
    assert found, f"{page} does not say it any more"
    shown = [f"{factor * values[row]:.{len(said.partition('.')[2])}f}"
             for row, said in zip(rows, found.groups(), strict=True)]  # fmt: skip
    assert list(found.groups()) == shown
