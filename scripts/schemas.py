"""Shipped: writes gaitval/metrics/metrics.schema.json and the other schemas of results.

    python scripts/schemas.py [--check]

`--check` writes nothing and fails if a file is out of date.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from gaitval.apps.balance.results import PerturbResult
from gaitval.apps.changes.results import ChangeResult
from gaitval.apps.cohort.report import CohortResult
from gaitval.apps.devices.results import DeviceResult
from gaitval.apps.judge.results import JudgeResult
from gaitval.apps.muscles.write import MuscleResult
from gaitval.apps.patients.results import PatientResult
from gaitval.metrics.results import (
    IDENTIFICATION_VERSION,
    SCHEMA_VERSION,
    IdentificationResult,
    Metrics,
)
from gaitval.metrics.typed import schema
from gaitval.reporting.written import Written
from gaitval.session.importing.results import IMPORT_VERSION, ImportResult

WRITTEN: dict[str, type[Written]] = {
    "balance": PerturbResult,
    "changes": ChangeResult,
    "cohort": CohortResult,
    "devices": DeviceResult,
    "judge": JudgeResult,
    "muscles": MuscleResult,
    "patients": PatientResult,
}
"""Results of applications, by folder."""
PACKAGE = Path(__file__).parent.parent / "gaitval"


def schemas() -> dict[Path, dict[str, Any]]:
    """The schema of each kind of result, by file."""
    return {
        PACKAGE / "metrics/metrics.schema.json": schema(
            Metrics, name="metrics", version=SCHEMA_VERSION
        ),
        PACKAGE / "identification/identification.schema.json": schema(
            IdentificationResult, name="identification", version=IDENTIFICATION_VERSION
        ),
        PACKAGE / "session/importing/import.schema.json": schema(
            ImportResult, name="import", version=IMPORT_VERSION
        ),
        **{
            PACKAGE / f"apps/{folder}/{result.NAME}.schema.json": result.file_schema()
            for folder, result in WRITTEN.items()
        },
    }


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    for path, content in schemas().items():
        text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
        if not check:
            path.write_text(text, encoding="utf-8", newline="\n")
        elif not path.is_file() or path.read_text(encoding="utf-8") != text:
            sys.exit(f"{path} is out of date: run python scripts/schemas.py")


if __name__ == "__main__":
    main()
