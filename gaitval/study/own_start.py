"""A policy that a user gives, to start the training of a run from."""

import shutil
from pathlib import Path

from gaitval.artefacts import copy_files, file_hash
from gaitval.study.inputs import POLICY_FILES, start_policy
from gaitval.study.stage import Run


def start_from(run: Run, policy: Path) -> None:
    """Put the policy in the folder `policy` into `start/` of `run`; a training that has started
    from it continues. Raises PolicyError if there is none for this body and observation.
    """
    start_policy(run, policy)
    start = run.folder / "start"
    same = all(
        (start / name).is_file() and file_hash(start / name) == file_hash(policy / name)
        for name in POLICY_FILES
    )
    if not same:
        shutil.rmtree(start, ignore_errors=True)
        copy_files(policy, start, POLICY_FILES)
    run.observer.say(f"Training starts from the policy in {policy}.")
