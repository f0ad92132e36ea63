"""The report's part on credibility: its figures are in the files that they lead to."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from newton_walk import newton_walk

from gaitval.artefacts import read_json, write_json
from gaitval.metrics.results import read_metrics
from gaitval.reporting import credibility
from gaitval.reporting.credibility import EVIDENCE, sections
from gaitval.reporting.facts import UNKNOWN, Fact, at
from gaitval.reporting.page import number

ROOT = Path(__file__).parents[2]


def build(folder: Path) -> Path:
    """A run folder as far as this part of the report reads it, with the stored walk of subject 5;
    its rollout is made up."""
    stored = ROOT / "reports" / "S05" / "baseline" / "metrics.json"
    (folder / "metrics.json").write_bytes(stored.read_bytes())
    newton_walk(np.zeros(3)).save(folder / "rollouts" / "identified.npz")
    write_json(folder / "provenance.json", {"seed": 7, "stages": {"train": {"seconds": 1800.5}}})
    (folder / EVIDENCE).write_text(credibility.evidence_text(), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    return build(tmp_path_factory.mktemp("credible"))


def facts_of(folder: Path) -> list[Fact]:
    found = sections(folder, read_metrics(folder))
    return [fact for section in found for fact in (*section.facts, *section.project)]


def test_the_parts_stand_in_the_order_of_the_frameworks(run_folder):
    titles = [each.title for each in sections(run_folder, read_metrics(run_folder))]
    words = (
        "the model knew",
        "Verification",
        "Validation",
        "Uncertainty",
        "Sensitivity",
        "History",
    )
    assert len(titles) == len(words)
    assert all(word in title for word, title in zip(words, titles, strict=True))


def test_every_figure_is_in_the_file_and_at_the_place_that_it_names(run_folder):
    """A figure that is read as it is equals what the pointer leads to, rounded as it is shown; one
    that was worked out leads to what it was worked out from, and says so."""
    contents = {
        name: read_json(run_folder / name) for name in ("metrics.json", "provenance.json")
    } | {EVIDENCE: tomllib.loads((run_folder / EVIDENCE).read_text(encoding="utf-8"))}
    direct = 0
    for fact in facts_of(run_folder):
        if not fact.file:
            assert fact.text == UNKNOWN, fact
            assert fact.note, fact
            continue
        assert (run_folder / fact.file).is_file(), fact
        if fact.file not in contents:
            continue
        found = at(contents[fact.file], unquote(fact.pointer))
        if isinstance(found, dict | list) or "prior_standard_deviation" in fact.note:
            assert fact.note, fact
        elif isinstance(found, float):
            shown = fact.text.split()[0]
            digits = len(shown.partition(".")[2])
            assert shown in (number(found, digits), f"{found:.4g}"), fact
            direct += 1
        elif fact.text != UNKNOWN and "seed" not in fact.text:
            said = {True: "yes", False: "no"}.get(found, str(found)) if found in (0, 1) else found
            assert fact.text.startswith((str(said), str(found))), fact
            direct += 1
    assert direct > 40


def test_figures_that_are_worked_out(run_folder):
    metrics = read_json(run_folder / "metrics.json")
    found = {fact.what: fact for fact in facts_of(run_folder)}
    verdicts = metrics["identification"]["verdicts"]
    assert found["Body parameters: identified"].text == f"{verdicts.count('identified')} of 14"
    skills = [row["value"] for row in metrics["measures"] if row["measure"] == "moment_skill"]
    assert found["Skill of moments (known to the model), mean"].text == number(
        sum(skills) / len(skills), 2
    )
    assert f"{sum(value < 0 for value in skills)} are nearer" in (
        found["Skill of moments (known to the model), mean"].note
    )
    assert found["Known to the model"].text == "5 of 5 quantities"
    assert found["Held out"].text == "0 quantities"
    worst = next(name for name in found if name.startswith("Most correlated parameters"))
    pairs = np.tril(metrics["identification"]["correlation"], -1)
    size = float(np.abs(pairs).max())
    assert found[worst].text in (number(size, 2), number(-size, 2))
    starts = metrics["walks"][metrics["final"]]["starts"]
    compiled = sum(start.get("engine") == "compiled" for start in starts)
    assert f"{compiled} of them walked in the compiled engine" in (
        found["Falls over all start phases"].note
    )
    assert found["Seeds of this run"].text == "1 (seed 7)"
    momentum = next(each for what, each in found.items() if what.startswith("Force that would"))
    assert float(momentum.text.split()[0]) < 100.0  # of another body: only that it is worked out


def test_the_copy_of_the_projects_figures_is_that_of_the_tree():
    done = subprocess.run(
        [sys.executable, "docs/build/credibility_figures.py", "--check"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_every_figure_of_the_project_names_a_command_and_a_file_of_the_tree():
    figures = tomllib.loads(credibility.evidence_text())["figure"]
    assert {each["part"] for each in figures.values()} == {
        "verification", "validation", "uncertainty", "sensitivity", "history",
    }  # fmt: skip
    for each in figures.values():
        assert (ROOT / each["source"]).is_file()
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", each["date"])
        assert each["command"].startswith("python")
        assert len(each["sha256"]) == 64


def test_what_is_not_there_is_not_known_and_says_where_it_would_come_from(tmp_path):
    build(tmp_path)
    metrics = json.loads((tmp_path / "metrics.json").read_text(encoding="utf-8"))
    metrics |= {"witness": None, "push_recovery": None, "identification": None}
    write_json(tmp_path / "metrics.json", metrics)
    (tmp_path / "rollouts" / "identified.npz").unlink()
    (tmp_path / "provenance.json").unlink()
    found = {fact.what: fact for fact in facts_of(tmp_path)}
    for what, way in (
        ("The same walk in a second engine", "gaitval simulate"),
        ("Force that would be needed", "gaitval simulate"),
        ("Pushes survived", "gaitval push"),
        ("Body parameters", "not looked for"),
        ("Error on a trial that was kept back", "gaitval predict --holdout"),
        ("Seeds of this run", "does not say"),
        ("Review by others", "Nothing says"),
    ):
        fact = next(each for name, each in found.items() if name.startswith(what))
        assert fact.text == UNKNOWN
        assert way in fact.note


def test_names_from_outside_cannot_leave_their_link():
    fact = Fact("x", "1", 'a"b<.json', '/"><script>/é#?')
    assert not set('"<>é?') & set(fact.link)
    assert fact.link.count("#") == 1
