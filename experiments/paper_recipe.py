"""Write the section of docs/learning.md on the results of the paper's own recipe (`--config
paper`).

    gaitval subject 5 --config paper --scratch --out /tmp/paper
    python -m experiments.paper_recipe /tmp/paper   # keeps the figures in reports/paper_recipe.json
    python -m experiments.paper_recipe                # the page from the figures that are kept
    python -m experiments.paper_recipe --check        # fails where the page has not what is kept

A failed limit is shown as failed: the recipe is there for comparison, not for use.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

from evidence.marked_table import with_table
from gaitval.artefacts import read_json, write_json
from gaitval.configuration import load_configuration

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "reports" / "paper_recipe.json"
PAGE = ROOT / "docs" / "learning.md"
ROW = ("id", "title", "target", "limit", "tolerance", "unit", "value", "passed")
"""The keys of a verdict that are kept."""


def figures(folder: Path) -> dict[str, Any]:
    """Results of a finished run with `--config paper`."""
    metrics, provenance = read_json(folder / "metrics.json"), read_json(folder / "provenance.json")
    policy = read_json(folder / "policy" / "policy.json")
    wanted = load_configuration(Path("paper")).model_dump(mode="json")
    made = policy["configuration"]
    differ = [
        f"{section}.{key}"
        for section in ("contact", "servo", "environment", "reward", "randomisation", "training")
        for key, value in wanted[section].items()
        if key not in ("device", "workers") and made[section].get(key) != value
    ]
    if differ:
        sys.exit(
            f"{folder}: not a run with --config paper; these settings differ: {', '.join(differ)}."
        )
    identification = metrics["identification"]
    trained = [
        read_json(folder / f"rounds/{row['round']}/trained/policy.json")["samples"]
        for row in identification["rounds"]
    ]
    return {
        "subject": metrics["subject"]["identifier"],
        "seed": policy["seed"],
        "device": policy["device"],
        "samples": trained[: identification["chosen_round"]],
        "rounds": len(trained),
        "chosen_round": identification["chosen_round"],
        "date": provenance["stages"]["validate"]["finished"][:10],
        "versions": provenance["versions"],
        "starts": [
            {key: start[key] for key in ("start_phase", "fell", "seconds", "cycles")}
            for start in metrics["walks"]["identified"]["starts"]
        ],
        "verdicts": [
            {key: row[key] for key in ROW}
            for row in metrics["tolerances"]
            if row["role"] == "acceptance"
        ],
    }


def worst(rows: list[dict[str, Any]]) -> str:
    """The worst value of one limit; a value that could not be measured is worse than any."""
    missing = [row["target"] for row in rows if row["value"] is None]
    if missing:
        return "not measured: " + ("all" if len(missing) == len(rows) else ", ".join(missing))
    highest = rows[0]["limit"] != "at_least"
    row = (max if highest else min)(rows, key=lambda row: row["value"])
    return f"{row['value']:.3g}" + (f" ({row['target']})" if len(rows) > 1 else "")


def page(found: dict[str, Any]) -> str:
    """Sentence and tables."""
    fell = sum(start["fell"] for start in found["starts"])
    failed = sum(not row["passed"] for row in found["verdicts"])
    versions = ", ".join(
        f"{name} {found['versions'][name]}" for name in ("gaitval", "python", "torch", "dartpy")
    )
    samples = " + ".join(f"{count:,}" for count in found["samples"])
    lines = [
        f"`gaitval subject {found['subject'].removeprefix('S').lstrip('0')} --config paper "
        f"--scratch`, {samples} samples to the end of the budget (round {found['chosen_round']}, "
        f"the best of {found['rounds']} by epsilon), one seed ({found['seed']}), {found['date']}, "
        f"{versions}. **{fell} of {len(found['starts'])} walks end in a fall; {failed} of "
        f"{len(found['verdicts'])} limits fail.**",
        "",
        "| started at, % of the right cycle | gait cycles after the settling ones, right / left "
        "| seconds | |",
        "|---|---|---|---|",
    ]
    for start in found["starts"]:
        cycles = start["cycles"]
        lines.append(
            f"| {100 * start['start_phase']:g} | {cycles['right']} / {cycles['left']} | "
            f"{start['seconds']:.1f} | {'falls' if start['fell'] else 'walks to the end'} |"
        )
    lines += ["", "| limit | at | within it | worst value |", "|---|---|---|---|"]
    limits: dict[str, list[dict[str, Any]]] = {}
    for row in found["verdicts"]:
        limits.setdefault(row["id"], []).append(row)
    for rows in limits.values():
        first, passed = rows[0], sum(row["passed"] for row in rows)
        sign = {"at_most": "≤", "at_least": "≥", "exactly": "="}[first["limit"]]
        share = f"{passed} of {len(rows)}"
        lines.append(
            f"| {first['title']} | {sign} {first['tolerance']:g} {first['unit']} | "
            f"{share if passed == len(rows) else f'**{share}**'} | {worst(rows)} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Store the figures of a run, if one is given, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("run", nargs="?", type=Path, help="run folder whose figures are stored")
    parser.add_argument("--check", action="store_true", help="write nothing; fail if out of date")
    given = parser.parse_args()
    if given.run and not given.check:
        write_json(RESULTS, figures(given.run))
    before = PAGE.read_text(encoding="utf-8")
    after = with_table(before, "paper", page(read_json(RESULTS)))
    if given.check:
        if after != before:
            sys.exit(f"{PAGE}: does not match {RESULTS}. Run experiments/paper_recipe.py.")
        return
    PAGE.write_text(after, encoding="utf-8")


if __name__ == "__main__":
    main()
