"""In which order the files of tests start, whose tests one worker each runs."""

from pathlib import Path

LONG = (
    # These two compile nearly all: the one what walks, the other what is worked out of a recording.
    # Beside each other on two workers, neither compiles what the other is compiling.
    "workflows/test_baseline.py",
    "workflows/test_fuzz.py",
    "workflows/test_import_errors.py",
    "workflows/test_import_flags.py",
    "study/test_run.py",
    "reporting/test_report.py",
    "reporting/test_recording_report.py",
    "workflows/test_import_refusal.py",
    "reporting/test_languages.py",
    "workflows/test_nothing_judges_itself.py",
    "identification/test_body_fit.py",
)
"""Those that take longest without the slow tests, the longest first: what is left for the end are
short ones, with which no worker is alone for long."""


def place(path: Path, tests: Path) -> int:
    """Files of lower numbers start earlier; those of whole programs follow the long ones."""
    name = path.relative_to(tests).as_posix()
    if name in LONG:
        return LONG.index(name)
    return len(LONG) + ("workflows" not in path.parts)
