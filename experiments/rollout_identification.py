"""The paper's identification by rollouts beside the posterior of the body.

    python -m experiments.rollout_identification --seeds 2 --generations 30

For three people and several seeds of the search: mu* and epsilon by rollouts of the general policy.
Then, always anew, epsilon of its walk with the posterior mean of
`gaitval.identification.shared_errors`. Writes `reports/identification/rollouts.json` after every
search; interrupted, the same command resumes.
"""

import argparse
import time
from pathlib import Path
from typing import Any

from experiments.real_people import fit_of
from gaitval.artefacts import read_json, versions, write_json
from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.identification.offsets import offset_of
from gaitval.identification.prior import prior_sd
from gaitval.identification.rollouts import Walks, identified_by_rollouts
from gaitval.identification.shared_errors import identified
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.storage import load_start
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "rollouts.json"
PEOPLE = ("S02", "S05", "S08")


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--generations", type=int, default=60)
    arguments = parser.parse_args()
    searches: list[dict[str, Any]] = read_json(STORE)["searches"] if STORE.exists() else []
    posteriors: dict[str, Any] = {}

    def write() -> None:
        stored = {"versions": versions(), "searches": searches, "posteriors": posteriors}
        write_json(STORE, stored)

    done = {(each["name"], each["seed"]) for each in searches}
    configuration = load_configuration()
    settings = configuration.identification.model_copy(
        update={"generations": arguments.generations}
    )
    policy = load_start(ROOT / "reports" / "general", configuration.environment)
    for name in PEOPLE:
        subject = load_subject(name)
        walks = Walks(subject.record(), scale_subject(subject).model, policy, configuration)
        for seed in range(arguments.seeds):
            if (name, seed) in done:
                continue
            began, before = time.process_time(), walks.count
            found = identified_by_rollouts(walks, prior_sd(subject), settings, seed=seed)
            about = {
                "name": name,
                "seed": seed,
                "generations": len(found.searched.history),
                "converged": found.searched.converged,
                "mu": found.mu.tolist(),
                "epsilon": {"scaled": found.before, "rollouts": found.epsilon},
                "walks": found.walks - before,
                "processor_seconds": time.process_time() - began,
            }
            searches.append(about)
            write()
            print(name, seed, about["epsilon"], flush=True)
        began, fit = time.process_time(), fit_of(subject)
        solved = fit.solve(fixed=nominal_parameters())
        posterior = identified(fit, solved, offset_of(subject)).posterior
        posteriors[name] = {
            "mean": posterior.mean.tolist(),
            "sd": posterior.sd.tolist(),
            "prior_sd": posterior.prior_sd.tolist(),
            "epsilon": walks([posterior.mean])[0],
            "processor_seconds": time.process_time() - began,
        }
        write()


if __name__ == "__main__":
    main()
