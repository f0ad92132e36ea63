"""In which order the files of tests start, whose tests one worker each runs."""

from pathlib import Path

LONG = (
    # These two compile nearly all: the one what walks, the other what is worked out of a recording.
    # Beside each other on two workers, neither compiles what the other is compiling.
    "workflows/test_baseline.py",
    "workflows/test_fuzz.py",
    # The others as they take long with the slow tests, as in CI.
    "workflows/test_kills.py",
    "workflows/test_poison.py",
    "reference/test_dynamic_fit.py",
    "reporting/test_replay_page.py",
    "workflows/test_nothing_judges_itself.py",
    "workflows/test_predict.py",
    "workflows/test_wheel.py",
    "patients/test_walk.py",
    "test_current_folder.py",
    "patients/test_sound_side.py",
    "reference/test_plates.py",
    "workflows/test_import_refusal.py",
    "workflows/test_import_truth.py",
    "devices/test_learning.py",
    "workflows/test_limits_can_fail.py",
    "test_optional_libraries.py",
    "workflows/test_pytest_plugin.py",
    "workflows/test_import_recordings.py",
    "workflows/test_import_flags.py",
    "learning_control/test_correct.py",
    "markers/test_draft.py",
    "devices/test_of_subject.py",
    "measurement/test_measured.py",
    "workflows/test_import_errors.py",
    "reporting/test_report.py",
    "identification/test_body_fit.py",
    "identification/test_screening.py",
    "identification/test_shared_errors.py",
    "export/test_environment.py",
    "reporting/test_every_reader.py",
    # And what of the tests that are not slow takes long.
    "study/test_run.py",
    "regression/test_comparison_page.py",
    "regression/test_baseline.py",
    "regression/test_compare_command.py",
    "reporting/test_recording_report.py",
)
"""Those that take longest, the longest first: what is left for the end are short ones, with which
no worker is alone for long."""


def place(path: Path, tests: Path) -> int:
    """Files of lower numbers start earlier; those of whole programs follow the long ones."""
    name = path.relative_to(tests).as_posix()
    if name in LONG:
        return LONG.index(name)
    return len(LONG) + ("workflows" not in path.parts)
