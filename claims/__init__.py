"""What a release is held to, measured: README.md says how.

python -m claims [TOPIC | TOPIC.NAME ...]
"""

import os
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
DATA: Final = Path(os.environ.get("GAITVAL_DATA") or ROOT.parent / "shared" / "data")
PUBLIC: Final = Path(os.environ.get("GAITVAL_PUBLIC") or ROOT.parent / "public")
WORK: Final = ROOT / "reports" / "claims-work"
TOPICS: Final = (
    *("accuracy", "elsewhere", "held_out", "muscles", "numerics", "prediction", "speed"),
    "walking",
)
"""Modules of this package that measure."""


@dataclass(frozen=True)
class Claim:
    """One figure.

    Attributes
    ----------
    what : the thing measured; no other claim is called so.
    value : in `unit`; "1" is a ratio.
    n : the number of cases that it was measured on.
    """

    what: str
    value: float
    unit: str
    n: int


@dataclass(frozen=True)
class Given:
    """The folders of a run.

    Attributes
    ----------
    data : raw data (`GAITVAL_DATA`, else ../shared/data).
    public : clones of the repositories of public recordings, each named OWNER+NAME
        (`GAITVAL_PUBLIC`, else ../public).
    work : what long measurements keep, to go on from; git ignores it.
    """

    data: Path = DATA
    public: Path = PUBLIC
    work: Path = WORK


class LackingError(Exception):
    """A file of public or raw data that a measurement reads is not there; it says how to get it."""


def measured(*folders: str) -> Callable[[Callable[..., object]], Callable[..., object]]:
    """Make a function of a topic a measurement, which needs these folders of `Given`."""

    def marked(function: Callable[..., object]) -> Callable[..., object]:
        vars(function)["needs"] = folders
        return function

    return marked


def public_file(name: str, base: Path) -> Path:
    """A file of the raw data ("data:...") or of a clone in the folder `base`. Raises LackingError
    if it is not there: a figure without it would be of fewer people than it says.
    """
    of_data = name.startswith("data:")
    path = DATA / name.removeprefix("data:") if of_data else base / name
    if not path.exists():
        clone = name.partition("/")[0]
        get = (
            "the raw data of GAITVAL_DATA have it"
            if of_data
            else f"clone https://github.com/{clone.replace('+', '/')} into {base / clone}"
        )
        raise LackingError(f"there is no {path}: {get}")
    return path


def commit() -> str:
    """Of the code that is measured; with `+` if there are changes that it does not hold."""
    words = ["git", "describe", "--always", "--dirty=+", "--abbrev=9", "--exclude=*"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip()
