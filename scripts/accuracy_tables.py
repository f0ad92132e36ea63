"""Write the accuracy tables of README.md and reports/README.md from the stored baselines.

Every figure comes from a `metrics.json` under reports/Snn/baseline, which `make baseline` writes;
`--check` writes nothing and fails where a table is not what the baselines say (for CI).
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
BEGIN, END = "<!-- accuracy: begin -->", "<!-- accuracy: end -->"

TITLE = """# Accuracy by subject

Written by `scripts/accuracy_tables.py` from the stored baselines (`make baseline S=5`). Each is a
walk of the stored policy with the identified body, deterministic, without pushes and without any
force on the pelvis, against the recorded mean curves. **Bold** is outside the tolerance; what the
tolerances are and where they come from: `gaitval/metrics/tolerances.toml`.
"""


def _measured(metrics: dict[str, Any]) -> list[tuple[str, str, str, str, str]]:
    """Rows (measure, right or value, left, tolerance, verdict) of the acceptance tolerances."""
    rows: dict[str, dict[str, Any]] = {}
    for verdict in metrics["tolerances"]:
        if verdict["role"] != "acceptance":
            continue
        target = verdict["target"]
        side = {"_r": "right", "_l": "left"}.get(target[-2:], "right")
        name = target[:-2].replace("_", " ") if target[-2:] in ("_r", "_l") else target
        key = f"{verdict['title'].split(':')[0]}: {name}" if name != "walk" else verdict["title"]
        row = rows.setdefault(key, {"unit": verdict["unit"], "sides": {}, "verdict": verdict})
        row["sides"][side] = verdict
    table = []
    for key, row in rows.items():
        sides = row["sides"]
        cells = [_cell(sides[side]) if side in sides else "" for side in ("right", "left")]
        verdict = row["verdict"]
        limit = f"{verdict['limit'].replace('_', ' ')} {verdict['tolerance']:g} {row['unit']}"
        passed = all(side["passed"] for side in sides.values())
        table.append((key, cells[0], cells[1], limit, "pass" if passed else "**fail**"))
    return table


def _cell(verdict: dict[str, Any]) -> str:
    if verdict["value"] is None:
        return "**not measured**"
    text = f"{verdict['value']:.3g}"
    return text if verdict["passed"] else f"**{text}**"


def subject_table(metrics: dict[str, Any]) -> str:
    """Markdown table of one subject."""
    lines = [
        "| measure | right | left | tolerance | |",
        "|---|---|---|---|---|",
        *("| " + " | ".join(row) + " |" for row in _measured(metrics)),
    ]
    return "\n".join(lines) + "\n"


def _with_table(text: str, table: str) -> str:
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table}{END}{after}"


def main() -> int:
    """Write, or with --check compare, both files."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail where stale")
    check = parser.parse_args().check
    baselines = sorted((ROOT / "reports").glob("S*/baseline/metrics.json"))
    report, first = TITLE, ""
    for path in baselines:
        metrics = json.loads(path.read_text(encoding="utf-8"))
        subject = metrics["subject"]
        table = subject_table(metrics)
        first = first or table
        report += f"\n## {subject['identifier']}: {subject['source']}\n\n{table}"
    readme = ROOT / "README.md"
    wanted = {
        ROOT / "reports" / "README.md": report,
        readme: _with_table(readme.read_text(encoding="utf-8"), first),
    }
    stale = [p for p, text in wanted.items() if not p.exists() or p.read_text("utf-8") != text]
    for path in stale:
        if check:
            sys.stderr.write(f"{path}: not what the baselines say; run `make tables`.\n")
        else:
            path.write_text(wanted[path], encoding="utf-8")
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
