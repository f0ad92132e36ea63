"""What a user may hold a release of gaitval to, measured: README.md says how.

python -m claims --list                 every measurement, and what it measures
python -m claims [TOPIC | TOPIC.NAME ...]
"""

from .given import ROOT, Given
from .registry import LackingError, measured
from .rows import Claim

__all__ = ["ROOT", "Claim", "Given", "LackingError", "measured"]
