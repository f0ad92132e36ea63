"""Train the general policy of reports/general: one walker for the bodies of several people.

Training for anybody without a stored policy starts from it, which takes a few minutes instead of a
training from nothing. If interrupted, it resumes.
"""

import argparse
import time
from pathlib import Path
from typing import Any

from gaitval.artefacts import value_hash, write_json
from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.policy.storage import Policy, load_start, save_policy
from gaitval.policy.training import train_general
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import WalkingTask
from gaitval.study.inputs import POLICY_FILES
from gaitval.study.run import GENERAL

TARGET = Path(__file__).parent.parent / "reports" / GENERAL


def about(subjects: list[str], policy: Policy, start: Policy | None) -> dict[str, Any]:
    """What the policy was trained with, and what that training started from."""
    return {
        "subjects": subjects,
        "samples": policy.about["samples"],
        "start": start
        and {
            "samples": start.about["samples"],
            "configuration": value_hash(start.about["configuration"]),
        },
    }


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", default=list(BUILTIN), help="default: all built in")
    parser.add_argument("--samples", type=int, default=16_000_000, help="default: %(default)s")
    parser.add_argument("--start", type=Path, help="start from this general policy")
    parser.add_argument("--work", type=Path, default=Path("reports/general-training"))
    parser.add_argument("--out", type=Path, default=TARGET)
    arguments = parser.parse_args()
    environments = 4 * len(arguments.subjects)
    configuration = load_configuration(settings=[f"training.environments={environments}"])
    tasks = []
    for name in arguments.subjects:
        subject = load_subject(name)
        model = scale_subject(subject).model
        tasks.append(WalkingTask.of(model, subject.record(), configuration))
        print(f"{name}: reference", flush=True)
    began = time.monotonic()

    def show(values: dict[str, float]) -> None:
        rate = values["samples"] / (time.monotonic() - began)
        print(
            f"{values['samples']:>10,.0f} of {values['total']:,.0f} samples, "
            f"{values['cycles']:.2f} cycles per episode, {rate:,.0f} samples/s",
            flush=True,
        )

    start = load_start(arguments.start, configuration.environment) if arguments.start else None
    policy = train_general(
        tasks, arguments.work, samples=arguments.samples, start=start, on_progress=show
    )
    save_policy(policy, arguments.out)
    write_json(arguments.out / "about.json", about(arguments.subjects, policy, start))
    print(f"{arguments.out}: {', '.join(POLICY_FILES)}. {arguments.work} may be deleted.")


if __name__ == "__main__":
    main()
