"""What the records of the ten built-in subjects say about their bodies, and whether other records
of the same people agree.

    python -m experiments.real_people

For every subject the posterior from its own trial, and the deviance of that trial with the body as
scaled and as identified. For every further trial, which had no part in it, the same two deviances.
For two subjects the search with another seed, and the posterior by importance sampling instead of
Laplace's approximation. Writes `reports/identification/real.json` after every subject.
"""

from pathlib import Path
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.artefacts import read_json, versions, write_json
from gaitval.configuration import load_configuration
from gaitval.coordinates import SIDES
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.identification.body_fit import BodyFit, BodyPosterior
from gaitval.identification.combinations import judged_combinations
from gaitval.identification.posterior import Profile, search, walked_with
from gaitval.identification.prior import prior_sd
from gaitval.identification.verdicts import judged
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.model.tree import segment_frames
from gaitval.reference.dynamic_fit import Solution, consistent_reference
from gaitval.reference.motion import build_reference
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "real.json"
SAMPLED = ("S05", "S08")
DRAWS = 400


def sampled(fit: BodyFit, solution: Solution, posterior: BodyPosterior) -> dict[str, Any]:
    """Mean and SD by importance sampling from a wider Gaussian than Laplace's."""
    profile = Profile(fit, solution)
    shown = BodyFit.looked_for()
    part = np.ix_(shown, shown)
    wider = 1.2**2 * posterior.covariance[part]
    random = np.random.default_rng(0)
    draws = random.multivariate_normal(posterior.mean[shown], wider, DRAWS)
    away = draws - posterior.mean[shown]
    quadratic = np.einsum("ij,jk,ik->i", away, np.linalg.inv(wider), away)
    logs = []
    for draw, each in zip(draws, quadratic, strict=True):
        mu = posterior.mean.copy()
        mu[shown] = draw
        logs.append(-0.5 * profile(mu) + 0.5 * each)
    weights = np.exp(np.array(logs) - max(logs))
    weights /= weights.sum()
    mean = weights @ draws
    sd = np.sqrt(weights @ (draws - mean) ** 2)
    return {
        "names": [name for name, is_shown in zip(PARAMETERS, shown, strict=True) if is_shown],
        "draws": DRAWS,
        "effective_draws": float(1.0 / np.sum(weights**2)),
        "mean_off_in_sd": ((mean - posterior.mean[shown]) / posterior.sd[shown]).tolist(),
        "sd_ratio": (sd / posterior.sd[shown]).tolist(),
    }


def seeds(fit: BodyFit, held: Solution, posterior: BodyPosterior) -> dict[str, float]:
    """Largest difference between two seeds of the search, in posterior SDs: of what CMA-ES finds,
    and of the modes that the whole fit finds from there.
    """
    profile = Profile(fit, held)
    settings = load_configuration().identification
    bests, modes = [], []
    for seed in (0, 1):
        found = search(
            lambda points: [profile(fit.mu_at(each)) for each in points],
            int(BodyFit.looked_for().sum()),
            settings=settings,
            seed=seed,
        )
        bests.append(fit.mu_at(found.best))
        modes.append(fit.posterior(fit.mode(held, fit.near(held, bests[-1]))).mean)
    return {
        name: float(np.max(np.abs(pair[0] - pair[1]) / posterior.sd))
        for name, pair in (("cma", bests), ("mode", modes))
    }


def fit_of(subject: Subject) -> BodyFit:
    """The fit of a subject's own trial."""
    configuration = load_configuration()
    return BodyFit(
        subject.record(), scale_subject(subject).model, configuration.contact,
        configuration.noise, prior_sd=prior_sd(subject),
    )  # fmt: skip


def as_scaled(fit: BodyFit, subject: Subject) -> Solution:
    """What the identification of a study begins with: the `fit` of a subject's own trial, solved
    with the body as scaled, from its reference.
    """
    model, contact = scale_subject(subject).model, load_configuration().contact
    return fit.as_scaled(consistent_reference(subject.record(), model, contact))


def deviances(fit: BodyFit, identified: Array) -> dict[str, float]:
    """Of the body as scaled and the identified one, without the prior; each from a standstill and
    from where the other ended.
    """
    bodies = {"nominal": nominal_parameters(), "identified": identified}
    still = {name: fit.solve(fixed=mu) for name, mu in bodies.items()}
    return {name: fit.mode(*still.values(), fixed=mu).cost for name, mu in bodies.items()}


def leg_of(model: BodyModel) -> float:
    """Thigh + shank, m."""
    return float(-sum(model[name].joint_position[2] for name in ("shank_r", "foot_r")))


def stance_leg(subject: Subject) -> float:
    """Thigh + shank, m, with which the ball of the foot travels back under the pelvis by half a
    stride between 8 and 58 % of its cycle, at the recorded angles; mean of both sides, so that the
    pelvis's own swing cancels.
    """
    model, record = scale_subject(subject).model, subject.record()
    reference = build_reference(record, model, load_configuration().contact)
    frames = segment_frames(model, reference.positions)
    travel = []
    for side in SIDES:
        ball = frames[:, SEGMENTS.index(f"toes_{side[0]}"), 0, 3] - frames[:, 0, 0, 3]
        begin = 0.0 if side == "right" else record.left_phase
        at = [np.interp((begin + share) % 1.0, reference.phase, ball) for share in (0.08, 0.58)]
        travel.append(at[0] - at[1])
    factor = record.speed * 0.5 * record.stride_time / float(np.mean(travel))
    return factor * leg_of(model)


def by_stature(subject: Subject) -> dict[str, float]:
    """Thigh + shank, m, if scaled by stature alone: before, and as the record has it."""
    bare = subject.by_stature()
    fit, model = fit_of(bare), scale_subject(bare).model
    posterior = fit.posterior(fit.mode(fit.solve(fixed=nominal_parameters())))
    leg = judged_combinations(posterior, model)[0]
    scaled = leg_of(model)
    return {
        "scaled": scaled, "prior_sd": leg.prior_sd, "found": scaled + leg.mean, "sd": leg.sd,
    }  # fmt: skip


def main() -> None:
    """Every subject that is not stored yet."""
    found = read_json(STORE)["people"] if STORE.exists() else {}
    for subject in builtin_subjects():
        if subject.identifier in found:
            continue
        fit, model = fit_of(subject), scale_subject(subject).model
        held = fit.solve(fixed=nominal_parameters())
        solution = fit.mode(held)
        posterior = fit.posterior(solution)
        verdicts = judged(posterior)
        mu = walked_with(posterior, verdicts)
        leg = judged_combinations(posterior, model)[0]
        about: dict[str, Any] = {
            "mean": posterior.mean.tolist(),
            "sd": posterior.sd.tolist(),
            "prior_sd": posterior.prior_sd.tolist(),
            "verdicts": [each.verdict for each in verdicts],
            "identified": mu.tolist(),
            "leg": {"prior_sd": leg.prior_sd, "mean": leg.mean, "sd": leg.sd},
            "leg_scaled": leg_of(model),
            "leg_tape": subject.leg_length_m,
            "leg_stance": stance_leg(subject),
            "by_stature": by_stature(subject),
            "body_mass_index": subject.mass_kg / subject.height_m**2,
            "own": deviances(fit, mu),
            "others": {
                trial.name: deviances(fit_of(subject.on_trial(trial.name)), mu)
                for trial in subject.trials
            },
        }  # fmt: skip
        if subject.identifier in SAMPLED:
            about["sampled"] = sampled(fit, solution, posterior)
            about["seeds"] = seeds(fit, held, posterior)
        found[subject.identifier] = about
        write_json(STORE, {"versions": versions(), "people": found})
        print(subject.identifier, about["own"], about["others"], flush=True)


if __name__ == "__main__":
    main()
