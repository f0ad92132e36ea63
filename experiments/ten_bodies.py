"""What the records of the ten built-in people say of their bodies with shared errors.

    python -m experiments.ten_bodies

Writes `reports/identification/ten_shared.json` after every subject; interrupted, the same command
resumes. Nothing of a stored run is changed.
"""

import time
from pathlib import Path
from typing import Any

from experiments.real_people import fit_of
from gaitval.artefacts import read_json, versions, write_json
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.model.parameters import nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval_bodies.shared_errors import identified
from gaitval_bodies.words import sentences

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "ten_shared.json"


def main() -> None:
    """Every subject that is not stored yet."""
    stored: list[dict[str, Any]] = read_json(STORE)["people"] if STORE.exists() else []
    done = {each["name"] for each in stored}
    for subject in builtin_subjects():
        if subject.identifier in done:
            continue
        began = time.process_time()
        fit = fit_of(subject)
        found = identified(fit, fit.solve(fixed=nominal_parameters()))
        posterior = found.posterior
        about = {
            "name": subject.identifier,
            "prior_mean": posterior.prior_mean.tolist(),
            "prior_sd": posterior.prior_sd.tolist(),
            "mean": posterior.mean.tolist(),
            "sd": posterior.sd.tolist(),
            "shared": found.values.tolist(),
            "shared_sd": found.sd.tolist(),
            "leg_difference": list(found.leg_difference),
            "left": found.left,
            "said": sentences(found, scale_subject(subject).model),
            "processor_seconds": time.process_time() - began,
        }
        stored.append(about)
        write_json(STORE, {"versions": versions(), "people": stored})
        print(subject.identifier, about["said"], flush=True)


if __name__ == "__main__":
    main()
