"""Runs a cohort of quick studies as a process of its own, which a test may kill.

python run_quick_cohort.py FOLDER WORKERS|ADDRESS NAME NAME …
"""

import os
import sys

from gaitval.apps.cohort.engine import run_cohort
from gaitval.apps.cohort.table import Study


def main() -> None:
    """Run it; prints how far it is, and what became of the studies."""
    folder, where, *names = sys.argv[1:]
    studies = [Study(name=name, subject="5") for name in names]
    outcomes = run_cohort(
        studies,
        folder,
        scheduler=None if where.isdigit() else where,
        workers=int(where) if where.isdigit() else None,
        retries=20,
        without_tls=True,
        function=os.environ.get("QUICK_FUNCTION", "quick_study:work"),
        notify=lambda state: print(state.done, state.workers, flush=True),
    )
    print(*(each["status"] for each in outcomes))


if __name__ == "__main__":
    main()
