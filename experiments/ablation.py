"""What matters of how the general policy is trained: the table of docs/learning.md.

Each row of `ROWS` changes one thing of `general_policy`: whom it learns on, what is drawn anew in
each episode, or what it is shown. `run` trains them from nothing as `TRAININGS` says, lets each
policy walk `TRIED` strangers on whom none of them learned, and stores the figures in
reports/ablation.json. What is there already is not trained again. `table` writes them into
docs/learning.md; `table --check` fails if they differ.
"""

import argparse
import multiprocessing as mp
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from evidence.marked_table import spread, with_table
from evidence.seconds import CHILDREN, FASTEST, SLOWEST, adults, drawn_stranger
from evidence.seconds import task_of as stranger_task_of
from experiments.general_policy import (
    SPEEDS,
    built_in,
    task_of,
    train_general,
    virtual,
    virtual_task_of,
)
from gaitval.artefacts import read_json, value_hash, versions, write_json, write_text
from gaitval.configuration import Configuration, load_configuration
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import BUILTIN
from gaitval.metrics.policy_comparison import standing_of
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.policy.storage import Policy
from gaitval.simulation.walker import WalkingTask

ROOT: Final = Path(__file__).parent.parent
RESULTS: Final = ROOT / "reports" / "ablation.json"
DOCUMENT: Final = ROOT / "docs" / "learning.md"

ENVIRONMENTS: Final = 60
MANY: Final = 240
"""People of tables, each in an environment, where more are learned on."""
LEARNED_SEED, TRIED_SEED = 5501, 20261128
"""Of the people of tables whom some rows learn on, and of the strangers whom all are tried on."""
TRIED: Final = 20
LEARNING: Final = {"contact", "servo", "environment", "reward", "randomisation", "training"}
"""Sections of the configuration that the figures depend on."""

Wanted = tuple[Callable[[Any], WalkingTask], Any]
"""A function that makes a task, and its argument."""


def _made(wanted: Wanted) -> WalkingTask:
    make, argument = wanted
    return make(argument)


def _stranger(wanted: tuple[Subject, float]) -> WalkingTask:
    return stranger_task_of(*wanted)


def strangers(seed: int, count: int) -> list[Wanted]:
    """People drawn from tables, each with a speed."""
    data = os.environ.get("GAITVAL_DATA")
    if not data:
        sys.exit("GAITVAL_DATA names no folder: the strangers are drawn from its anthropometry/.")
    table = adults(Path(data))
    drawn = [drawn_stranger(table, seed, n, (SLOWEST, FASTEST)) for n in range(count)]
    return [(_stranger, (person, speed)) for person, _, speed in drawn]


def _built_in(names: Sequence[str], shares: Sequence[float]) -> list[Wanted]:
    return [(task_of, each) for each in built_in(names, shares, _configuration(), BUILTIN)]


def _as_shipped() -> list[Wanted]:
    around = virtual(list(BUILTIN), _configuration(), BUILTIN)
    return _built_in(list(BUILTIN), SPEEDS) + [(virtual_task_of, each) for each in around]


PEOPLE: Final[dict[str, Callable[[], list[Wanted]]]] = {
    "shipped": _as_shipped,
    "speeds": lambda: _built_in(list(BUILTIN), SPEEDS),
    "ten": lambda: _built_in(list(BUILTIN), (1.0,)),
    "one": lambda: _built_in(["S05"], (1.0,)),
    "tables": lambda: strangers(LEARNED_SEED, ENVIRONMENTS),
    "many": lambda: strangers(LEARNED_SEED, MANY),
}
"""Whom a training can learn on."""


@dataclass(frozen=True)
class Row:
    """A training of `people` with `settings`."""

    title: str
    people: str = "shipped"
    settings: tuple[str, ...] = ()


_SCALED_BODIES: Final = (
    *(
        f"randomisation.{name}=[{nominal}, {nominal}]"
        for name, nominal in zip(PARAMETERS[:5], nominal_parameters(), strict=False)
    ),
    "randomisation.joint_offset=0.0",
)

ROWS: Final = {
    "shipped": Row(
        "as the shipped policy: the ten at three speeds and 30 virtual people around them"
    ),
    "speeds": Row("no virtual people: the ten at three speeds", "speeds"),
    "ten": Row("the ten at their own speed", "ten"),
    "one": Row("one of the ten (S05) at his own speed", "one"),
    "tables": Row(
        f"{ENVIRONMENTS} people of tables (ANSUR II; one in five a child of 6 to 16)", "tables"
    ),
    "many": Row(
        f"{MANY} people of tables",
        "many",
        # As many samples between updates as the others have.
        (f"training.environments={MANY}", "training.rollout_steps=32"),
    ),
    "no-pushes": Row("no pushes", settings=("environment.push_probability=0.0",)),
    "scaled-bodies": Row("no other bodies: μ is nominal in every episode", settings=_SCALED_BODIES),
    "no-mirror": Row(
        "two steps, not one and its mirror image", settings=("environment.mirror=false",)
    ),
    "no-feed-forward": Row(
        "no moments of the reference fed forward", settings=("servo.feed_forward=0.0",)
    ),
    "fixed-pace": Row("pace of the reference", settings=("environment.pace_scale=0.0",)),
    "paper-state": Row(
        "shown the paper's state of 71 numbers", settings=("environment.observation=paper",)
    ),
}
TRAININGS: Final[dict[int, tuple[Sequence[str], int]]] = {
    2_000_000: (tuple(ROWS), 3),
    8_000_000: (("shipped", "ten", "one", "many", "no-pushes", "scaled-bodies"), 2),
}
"""Rows and number of seeds by the samples of a training: with more, those that walk at all with few
and differ in what they learn on."""


def _configuration(*settings: str) -> Configuration:
    return load_configuration(settings=["record.use=kinematics", *settings])


def _standings(tasks: Sequence[WalkingTask], policy: Policy) -> dict[str, Any]:
    """How strangers walk, by what is counted."""
    found = [standing_of([task], policy, nominal_parameters()) for task in tasks]
    return {
        "falls": [each.falls for each in found],
        "walks": [each.walks for each in found],
        "survived": [each.survived for each in found],
        "pushes": [each.pushes for each in found],
        "epsilon": [each.epsilon and round(each.epsilon, 5) for each in found],
    }


def measured(
    row: Row, seed: int, learned: Sequence[WalkingTask], tried: Sequence[WalkingTask], samples: int
) -> dict[str, Any]:
    """Train one row with one seed, and walk the strangers with the policy."""
    # One worker: two trainings side by side take less time than one after the other.
    training = (f"training.environments={ENVIRONMENTS}", "training.workers=1", f"seed={seed}")
    configuration = _configuration(*training, *row.settings)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        policy = train_general(
            [replace(task, configuration=configuration) for task in learned],
            Path(folder),
            samples=samples,
        )
    seconds = time.monotonic() - began
    walked = _standings([replace(task, configuration=configuration) for task in tried], policy)
    return {"strangers": walked, "seconds": round(seconds, 1)}


def run(names: Sequence[str], samples: int, trainings: int) -> None:
    """Train what does not exist yet of these rows with so many samples, several at a time."""
    results = read_json(RESULTS) if RESULTS.exists() else {"trained": {}}
    setting = {
        "strangers": {"seed": TRIED_SEED, "count": TRIED},
        "default": value_hash(load_configuration().model_dump(mode="json", include=LEARNING)),
    }
    if results["trained"] and results["setting"] != setting:
        sys.exit(
            f"{RESULTS}: made with another default configuration or other strangers "
            f"({results['setting']}, now {setting}). Delete it to train all rows again."
        )
    results["setting"] = setting
    rows = results["trained"].setdefault(str(samples), {})
    wanted, seeds = TRAININGS[samples]
    lacking = [
        (name, seed)
        for seed in range(seeds)
        for name in wanted
        if name in names and str(seed) not in rows.get(name, {})
    ]
    if not lacking:
        return
    with ProcessPoolExecutor(trainings, mp_context=mp.get_context("spawn")) as pool:
        tried = list(pool.map(_made, strangers(TRIED_SEED, TRIED)))
        people: dict[str, list[WalkingTask]] = {}
        for kind in {ROWS[name].people: None for name, _ in lacking}:
            people[kind] = list(pool.map(_made, PEOPLE[kind]()))
            print(f"{kind}: {len(people[kind])} references", flush=True)
        under_way = {}
        for name, seed in lacking:
            row = ROWS[name]
            job = pool.submit(measured, row, seed, people[row.people], tried, samples)
            under_way[job] = name, str(seed)
        for future in as_completed(under_way):
            name, seed = under_way[future]
            rows.setdefault(name, {})[seed] = future.result()
            results["versions"] = versions()
            write_json(RESULTS, results)
            print(name, seed, _cells(list(rows[name].values())), flush=True)


def _cells(runs: Sequence[dict[str, Any]]) -> list[str]:
    """Strangers who fall from no start, starts without a fall, pushes survived and epsilon."""
    found = [run["strangers"] for run in runs]
    walk = [100.0 * statistics.mean(not falls for falls in some["falls"]) for some in found]
    starts = [100.0 * (1.0 - sum(some["falls"]) / sum(some["walks"])) for some in found]
    pushes = [100.0 * sum(some["survived"]) / sum(some["pushes"]) for some in found]
    errors = [
        statistics.mean(
            epsilon
            for epsilon, falls in zip(some["epsilon"], some["falls"], strict=True)
            if not falls
        )
        for some in found
        if not all(some["falls"])
    ]
    spreads = ((walk, 0), (starts, 0), (pushes, 0), (errors, 3))
    return [str(len(runs)), *(spread(values, digits) for values, digits in spreads)]


def table() -> str:
    """The table of all rows in reports/ablation.json."""
    results = read_json(RESULTS)
    count = results["setting"]["strangers"]["count"]
    lines = [
        f"Trained from nothing on {ENVIRONMENTS} walkers or more; then {count} strangers (ANSUR "
        f"II, one in {CHILDREN} a child of 6 to 16; {SLOWEST} to {FASTEST} m/s for a grown leg), "
        "on whom nothing was learned, each from 8 starts and with 96 pushes. Mean ± standard "
        "deviation over the seeds; ε of those who fall from no start.",
        "",
        "| choice | samples | seeds | strangers who walk from every start, % | starts without a "
        "fall, % | pushes survived, % | ε |",
        "|---|---|---|---|---|---|---|",
    ]
    for samples in TRAININGS:
        rows = results["trained"].get(str(samples), {})
        for name, row in ROWS.items():
            if runs := list(rows.get(name, {}).values()):
                lines.append(f"| {row.title} | {samples:,} | {' | '.join(_cells(runs))} |")
    return "\n".join(lines)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run", help="train the rows that do not exist yet")
    running.add_argument(
        "--trainings", type=int, default=2, help="trainings in parallel, one core each (default: 2)"
    )
    running.add_argument("rows", nargs="*", help=f"some of: {', '.join(ROWS)} (default: all)")
    writing = commands.add_parser("table", help="write the table into docs/learning.md")
    writing.add_argument("--check", action="store_true", help="fail if it differs")
    arguments = parser.parse_args()
    if arguments.command == "run":
        for samples in TRAININGS:
            run(arguments.rows or list(ROWS), samples, arguments.trainings)
        return
    text = DOCUMENT.read_text(encoding="utf-8")
    wanted = with_table(text, "ablation", table())
    if arguments.check and wanted != text:
        sys.exit(f"{DOCUMENT}: does not match {RESULTS}. Run experiments/ablation.py table.")
    write_text(DOCUMENT, wanted)


if __name__ == "__main__":
    main()
