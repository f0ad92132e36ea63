"""What a measurement may read: folders outside the repository, and one of its own."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
DATA: Final = Path(os.environ.get("GAITVAL_DATA") or ROOT.parent / "shared" / "data")
PUBLIC: Final = Path(os.environ.get("GAITVAL_PUBLIC") or ROOT.parent / "public")
WORK: Final = ROOT / "reports" / "claims" / "work"


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
