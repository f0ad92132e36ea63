"""What is required of the project, measured: `python -m evidence TOPIC [ROW ...]` writes rows of
`reports/evidence/TOPIC.csv`. README.md says how a measurement is added.
"""

from .registry import DATA, Option, measurement, option
from .rows import (
    FOLDER,
    STARTED,
    Row,
    measured_commit,
    none_may,
    pytest_counts,
    read,
    write,
)
from .sources import ROOT

__all__ = [
    "DATA",
    "FOLDER",
    "ROOT",
    "STARTED",
    "Option",
    "Row",
    "measured_commit",
    "measurement",
    "none_may",
    "option",
    "pytest_counts",
    "read",
    "write",
]
