"""The log of a training, `training.csv`: a row for every update of the policy."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gaitval._internal.io.artefacts import write_text
from gaitval.policy.reward import REWARD_TERMS

LEARNING_CURVES = (
    "samples",
    "wall_seconds",
    "episode_length",
    "episode_reward",
    "cycles",
    "learning_rate",
    "log_std",
    "approx_kl",
)
"""Columns that a report draws."""

LOG_COLUMNS = (*LEARNING_CURVES, "difficulty", *REWARD_TERMS)


def write_log(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write the log, `rows` by column, one per update, anew to the CSV file `path`, with the
    columns `LOG_COLUMNS`. Raises ArtefactError if the disk is full, or the folder may not be
    written to.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, LOG_COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())
