"""The log of a training, `training.csv`: a row for every update of the policy."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gaitval import file_gate
from gaitval.artefacts import write_text
from gaitval.errors import ArtefactError
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
    """Write the log anew, with the columns `LOG_COLUMNS`.

    Parameters
    ----------
    path : of the CSV file.
    rows : one per update, by column.

    Raises
    ------
    ArtefactError : the disk is full, or the folder may not be written to.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, LOG_COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())


def read_log(path: Path, samples: int) -> list[dict[str, Any]]:
    """Rows of the log at `path` up to a checkpoint after this many `samples`; all values
    are text. Raises ArtefactError if it is missing or damaged.
    """
    # Rows after the checkpoint are of updates that a killed training had not stored; they will be
    # made again.
    rows = file_gate.csv_rows(path, ArtefactError)
    try:
        return [row for _, row in rows if int(row["samples"]) <= samples]
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path}: not the log of a training ({error}). Delete it and train again."
        ) from None
