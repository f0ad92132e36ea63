"""The command `python -m evidence`, from the project's folder.

    python -m evidence --list                       every measurement, and what it measures
    python -m evidence TOPIC [ROW ...] [OPTION ...] measures, writes reports/evidence/TOPIC.csv
    python -m evidence TOPIC ROW --help             the options of a measurement
    python -m evidence stale [--retire]             rows whose code has changed since; see stale.py

Without ROW all of the topic run, one after another. The exit code is 1 where a row is not as it
must be.
"""

import itertools
import sys
from collections.abc import Sequence

from . import registry, rows, stale


def run(topic: str, names: Sequence[str], words: Sequence[str]) -> int:
    """Make measurements, print and write their rows; the number of rows that are not as must be."""
    failed = 0
    ready = []
    for each in registry.chosen(topic, names):
        measure, options = each.load()
        ready.append((each, measure, registry.parsed(each, options, words)))
    for each, measure, arguments in ready:
        found = measure(arguments)
        made = found if isinstance(found, list) else [found]
        for row in made:
            print(f"{row.what}: {row.value:.6g} {row.unit}, n {row.n}")
            failed += not row.kept
        if made:
            print(rows.write(topic, made, registry.command_of(each, words)))
    return failed


def listed(topic: str | None = None) -> str:
    """Every measurement, or those of a topic, in a line each."""
    return "\n".join(
        f"{each.topic:15} {each.row:20} {each.about}"
        for each in registry.measurements().values()
        if topic in (None, each.topic)
    )


def main(words: Sequence[str]) -> int:
    """The exit code."""
    match list(words):
        case [] | ["-h" | "--help"]:
            print(__doc__)
        case ["--list"]:
            print(listed())
        case ["stale", *options]:
            return stale.main(options)
        case [topic, "-h" | "--help"]:
            registry.chosen(topic, ())
            print(listed(topic))
        case [topic, *rest]:
            names = list(itertools.takewhile(lambda word: not word.startswith("-"), rest))
            return 1 if run(topic, names, rest[len(names) :]) else 0
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
