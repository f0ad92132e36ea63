"""The paper's ablation: reinforcement learning alone, and with identification.

    python -m experiments.identification_ablation            # three subjects, two bodies, six seeds

Each subject is scaled by stature alone, and by markers. For each seed, a policy is trained from the
general one with the body as scaled, and another with the body that the record identifies, in the
same way and for as many samples; both walk from eight starts without correction, and are compared
with the record. Writes `reports/identification/ablation.json`; what is there already is not trained
again. `experiments/paper` draws it.
"""

import argparse
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from experiments.bodies import as_scaled, fit_of
from gaitval._internal.io.artefacts import read_json, versions, write_json
from gaitval.configuration import load_configuration
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.identification import shared_errors
from gaitval.identification.offsets import offset_of
from gaitval.metrics.comparison import compare_curve, curves_of
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.epsilon import epsilon, mean_of
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy, load_start
from gaitval.policy.training import train
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.simulation.walker import WalkingTask

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "ablation.json"
SUBJECTS, BODIES, SEEDS, SAMPLES = ("S02", "S05", "S08"), ("stature", "markers"), 6, 200_000
CYCLES = 12
KINDS = {
    "angles": (("hip_flexion", "knee_angle", "ankle_angle"), 180.0 / np.pi),
    "moments": (("hip_flexion", "knee_angle", "ankle_angle"), 1.0),
    "forces": (("forward", "medial", "vertical"), 100.0),
}
"""Curves of each kind whose RMSE is kept, and the factor to degrees, Nm/kg, % of body weight."""


def subject_of(name: str, body: str) -> Subject:
    """The subject, without markers if it is to be scaled by stature."""
    subject = load_subject(name)
    return subject if body == "markers" else subject.by_stature()


def identified(subject: Subject) -> list[float]:
    """Mu* (14,) of a subject."""
    fit = fit_of(subject)
    found = shared_errors.identified(fit, as_scaled(fit, subject), offset_of(subject))
    return list(map(float, found.posterior.mean if found.fits else nominal_parameters()))


def walked(task: WalkingTask, policy: Policy, mu: Any) -> dict[str, Any]:
    """Epsilon and RMSE by kind, means over the starts; None for a walk that fell."""
    validation = task.configuration.validation
    recorded, errors = recorded_curves(task.record), []
    found: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for start_phase in validation.start_phases:
        rollout = record_rollout(
            WalkingEnvironment(task), policy, mu=mu, start_phase=start_phase,
            cycles=validation.settling_cycles + CYCLES + 2,
        )  # fmt: skip
        cycles = find_cycles(rollout, task.configuration).first(CYCLES)
        curves = curves_of(task, rollout, cycles)
        errors.append(None if rollout.fell[0] else epsilon(curves, recorded))
        for kind, (names, factor) in KINDS.items():
            for key in (f"{name}_{side}" for name in names for side in "rl"):
                each = compare_curve(getattr(curves, kind)[key], getattr(recorded, kind)[key])
                found[kind].append(np.nan if each is None else factor * each.rmse)
    mean = mean_of(errors)
    if mean is None:
        return {"epsilon": None}
    return {"epsilon": mean.total} | {kind: float(np.mean(each)) for kind, each in found.items()}


def one(name: str, body: str, seed: int, which: str, mu: Sequence[float]) -> dict[str, Any]:
    """Train with one body and seed, and walk."""
    # One worker: two trainings side by side take less time than one after the other.
    configuration = load_configuration(settings=[f"seed={seed}", "training.workers=1"])
    subject = subject_of(name, body)
    used = np.array(mu) if which == "identified" else nominal_parameters()
    task = WalkingTask.of(scale_subject(subject).model, subject.record(), configuration, mu=used)
    start = load_start(ROOT / "reports" / "general", configuration.environment)
    with tempfile.TemporaryDirectory() as folder:
        policy = train(task, Path(folder), samples=SAMPLES, start=start, subject=name)
    return walked(task, policy, used)


def changed(mu: Sequence[float]) -> bool:
    """Whether the record changes the body that walks."""
    return not np.array_equal(mu, nominal_parameters())


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--bodies", nargs="*", default=BODIES, choices=BODIES)
    parser.add_argument("--trainings", type=int, default=2, help="side by side, a core each")
    arguments = parser.parse_args()
    stored = read_json(STORE) if STORE.exists() else {"bodies": {}, "walks": {}}
    with ProcessPoolExecutor(arguments.trainings, mp_context=get_context("spawn")) as pool:

        def keep() -> None:
            write_json(STORE, stored | {"samples": SAMPLES, "versions": versions()})

        cases = [(name, body) for body in arguments.bodies for name in SUBJECTS]
        looking = {
            pool.submit(identified, subject_of(*case)): " ".join(case)
            for case in cases
            if " ".join(case) not in stored["bodies"]
        }
        for job in as_completed(looking):
            stored["bodies"][looking[job]] = job.result()
            keep()
        training = {
            pool.submit(one, *case, seed, which, stored["bodies"][" ".join(case)]): key
            for seed in range(arguments.seeds)
            for case in cases
            for which in ("nominal", "identified")
            if which == "nominal" or changed(stored["bodies"][" ".join(case)])
            if (key := f"{' '.join(case)} {seed} {which}") not in stored["walks"]
        }
        for job in as_completed(training):
            key = training[job]
            stored["walks"][key] = job.result()
            body = key.rpartition(" ")[0].rpartition(" ")[0]
            if not changed(stored["bodies"][body]):  # the same training
                stored["walks"][key.replace("nominal", "identified")] = job.result()
            keep()
            print(training[job], job.result(), flush=True)


if __name__ == "__main__":
    main()
