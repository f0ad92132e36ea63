"""Check stored walks and say the result in a table: the middle of the GitHub action (`action.yml`).

    BASELINES="reports/S05/baseline" OUT=accuracy python -P scripts/action_check.py

Runs `gaitval check` on every line of `BASELINES`, all of them whatever becomes of the first, and
writes into `OUT` a log and a JUnit file for each and `summary.md`, a table, which is also added to
`GITHUB_STEP_SUMMARY`. `QUICK=true` leaves out long walks and pushes. The exit code is the largest:
0 fine, 1 accuracy was lost, 2 a baseline cannot be used, 70 a check ended without a result. Needs
no library but gaitval's command. It runs in a folder that others have written, so Python is told
to take no modules from there (`-P`).
"""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree


class Outcome(NamedTuple):
    """What became of a baseline.

    Attributes
    ----------
    code : exit code of `gaitval check`; 128 and the signal's number if one ended it, as in a shell;
        `CRASHED` for 0 or 1 without the measures that say so.
    measures, lost : numbers of measures compared, and of those that were lost.
    moved : of the lost ones, what the JUnit file says.
    inputs : what the walk depends on that has changed.
    log : what the command printed.
    """

    baseline: str
    code: int
    measures: int
    lost: int
    moved: tuple[str, ...]
    inputs: str
    log: str


VERDICTS = {0: "kept", 1: "**lost**", 2: "**cannot be used**"}
CRASHED = 70
"""Exit code of a check that ended without a result, as of a fault of gaitval. Python's own of an
import that failed is 1, which must not read as accuracy that was lost.
"""
SHOWN = 10
"""Lost measures listed of each baseline; the report has all of them."""


def main() -> None:
    """Check all, write the table, and exit."""
    baselines = [line.strip() for line in os.environ.get("BASELINES", "").splitlines()]
    baselines = [line for line in baselines if line]
    if not baselines:
        sys.exit("action_check: BASELINES is empty: give the folders of stored baselines.")
    out = Path(os.environ.get("OUT", "gaitval-accuracy"))
    out.mkdir(parents=True, exist_ok=True)
    quick = os.environ.get("QUICK", "true").strip().lower() == "true"
    outcomes = [check(baseline, out, quick=quick) for baseline in baselines]
    text = summary(outcomes, quick=quick)
    (out / "summary.md").write_text(text, encoding="utf-8")
    _append("GITHUB_STEP_SUMMARY", text)
    lost = sum(outcome.lost for outcome in outcomes)
    _append("GITHUB_OUTPUT", f"lost={lost}\nfolder={out}\n")
    print(text)
    sys.exit(max(outcome.code for outcome in outcomes))


def check(baseline: str, out: Path, *, quick: bool) -> Outcome:
    """Run `gaitval check` on a baseline; its log and JUnit file go into `out`."""
    name = re.sub(r"\W+", "-", baseline).strip("-") or "baseline"
    junit = out / f"{name}.xml"
    junit.unlink(missing_ok=True)
    done = subprocess.run(
        [
            *(sys.executable, "-P", "-m", "gaitval", "check", "--baseline", baseline),
            *("--junit", junit),
            *(["--quick"] if quick else []),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        env={**os.environ, "NO_COLOR": "1", "COLUMNS": "160"},
        check=False,
    )
    (out / f"{name}.log").write_text(done.stdout, encoding="utf-8")
    print(f"::group::gaitval check {baseline}\n{done.stdout}\n::endgroup::", flush=True)
    measures, moved = _junit(junit)
    inputs = re.search(r"^Inputs: (.*)$", done.stdout, re.MULTILINE)
    return Outcome(
        baseline=baseline,
        code=_code(done.returncode, measures, lost=len(moved)),
        measures=measures,
        lost=len(moved),
        moved=moved,
        inputs=inputs[1] if inputs else "",
        log=done.stdout,
    )


def _code(ended: int, measures: int, *, lost: int) -> int:
    """The exit code that counts: a verdict only with the measures that it is about."""
    if ended < 0:  # after a signal, and so less than the 0 of another baseline
        return 128 - ended
    if ended in (0, 1) and (measures == 0 or (ended == 1) != (lost > 0)):
        return CRASHED
    return ended


def summary(outcomes: list[Outcome], *, quick: bool) -> str:
    """The table, and what was lost, in Markdown."""
    lines = [
        "## gaitval: accuracy of stored walks",
        "",
        "| baseline | verdict | measures | lost | what the walk depends on |",
        "|---|---|---:|---:|---|",
    ]
    for one in outcomes:
        verdict = VERDICTS.get(one.code, f"**no result** (exit code {one.code})")
        cells = (one.baseline, verdict, one.measures or "–", one.lost, one.inputs or "–")
        lines.append("| " + " | ".join(_cell(str(cell)) for cell in cells) + " |")
    for one in outcomes:
        if one.moved:
            lines += ["", f"**{_cell(one.baseline)}**", ""]
            lines += [f"* {_cell(text)}" for text in one.moved[:SHOWN]]
            if len(one.moved) > SHOWN:
                lines.append(f"* … and {len(one.moved) - SHOWN} more, in the report")
        elif one.code:
            last = one.log.strip().splitlines()[-8:]
            lines += ["", f"**{_cell(one.baseline)}**", "", "```", *last, "```"]
    if quick:
        lines += ["", "Curves only; `quick: 'false'` also compares long walks and pushes."]
    return "\n".join(lines) + "\n"


def _junit(path: Path) -> tuple[int, tuple[str, ...]]:
    """Number of measures in a JUnit file of ours, and the messages of those that failed."""
    try:
        cases = list(ElementTree.parse(path).getroot().iter("testcase"))
    except (FileNotFoundError, ElementTree.ParseError):
        return 0, ()
    failed = tuple(
        f"{case.get('classname', '').rsplit('.', 1)[-1]} of {case.get('name', '')}: "
        f"{failure.get('message', '').removeprefix('lost: ')}"
        for case in cases
        for failure in case.findall("failure")
    )
    return len(cases), failed


def _cell(text: str) -> str:
    """Text that cannot end a cell of a table."""
    return re.sub(r"\s+", " ", text.replace("|", "\\|").replace("<", "&lt;"))


def _append(variable: str, text: str) -> None:
    """Add to the file that GitHub names in a variable, if it does."""
    path = os.environ.get(variable)
    if path:
        with Path(path).open("a", encoding="utf-8") as file:
            file.write(text)


if __name__ == "__main__":
    main()
