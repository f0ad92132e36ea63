"""The version of each stage, by which a stored result is known to be that of the installed code.

A change raises the number of a stage by one if it makes the stage write other numbers, or other
keys, from the same inputs. A stage keeps its number if only words, speed or layout change, and in a
release. The stages after a changed one run again because its files differ; raise theirs only if
they change themselves.

Some inputs are compared by content and need no number here: settings, subject, files of the run
folder, `tolerances.toml` and the names of the quantities. All other data of the package belong to
the versions.

`tests/workflows/test_baseline.py` fails if figures of S05 differ and no version was raised.
"""

from collections.abc import Mapping
from typing import Final

STAGE_VERSIONS: Final[Mapping[str, int]] = {
    "scale": 1,
    "reference": 1,
    "range": 1,
    "need": 1,
    "train": 1,
    "identify": 1,
    "keep": 1,
    "evaluate": 1,
    "choose": 1,
    "adopt": 1,
    "correct": 1,
    "simulate": 1,
    "repeat": 1,
    "body": 1,
    "push": 1,
    "validate": 2,
    "estimate": 1,
    "device": 2,
    "report": 2,
}
"""By name, for every round of Algorithm 1, and for a prediction too."""
