"""How wide skin errs in the ten built-in people, by the likelihood of their records, and what that
leaves of their legs.

    python -m experiments.skin_width

Each record is fitted with shared errors (`gaitval.identification.shared_errors`). About the mode
all is Gaussian, so the likelihood of the record with another width of the prior of skin follows
without another fit: with the mode x and its precision Λ, and a prior of precision Q instead of P
about the same mean, log Z = ½ log |Q| - ½ log |Λ + Q - P| + ½ xᵀ Λ (Λ + Q - P)⁻¹ Λ x, up to a
constant. Writes `reports/identification/skin.json` after every person; interrupted, the same
command resumes.
"""

from pathlib import Path
from typing import Final

import numpy as np

from evidence import STARTED
from experiments.real_people import fit_of
from gaitval.arrays import Array
from gaitval.artefacts import read_json, versions, write_json
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.identification.combinations import combinations
from gaitval.identification.shared_errors import NAMES, NARROWER, SKIN, STUCK, SharedFit
from gaitval.model.parameters import nominal_parameters
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "skin.json"
WIDTHS: Final = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)
"""Shares of the studies' SDs, whose means stay; with 0 skin would be known."""
_KNOWN: Final = 1e-3


class Kept(SharedFit):
    """A fit that keeps its unknowns and their covariance."""

    kept: tuple[Array, Array]

    def _covariance(self, change: Array, common: Array) -> tuple[Array, float]:
        found = super()._covariance(change, common)
        self.kept = common, found[0]
        return found


def with_widths(
    common: Array, covariance: Array, prior: Array, weights: Array
) -> tuple[list[float], list[float]]:
    """With each of `WIDTHS`: the logarithm of the likelihood of a record, up to a constant, and
    posterior SD / prior SD of a sum.

    Parameters
    ----------
    common, covariance : (C,) and (C, C), the mode and its covariance with `NARROWER`.
    prior : (C,) 1 / SD of the prior of `common`.
    weights : (C,) of the sum, which has none of skin.
    """
    precision = np.linalg.inv((covariance + covariance.T) / 2)
    # Those of both sides and of their difference.
    skin = slice(len(common) - len(NAMES), len(common) - len(NAMES) + 2 * len(SKIN))
    logs, left = [], []
    for width in WIDTHS:
        new = prior**2
        new[skin] *= (NARROWER / max(width, _KNOWN)) ** 2
        whole = precision + np.diag(new - prior**2)
        right = precision @ common
        fitted = right @ np.linalg.solve(whole, right)
        sizes = np.sum(np.log(new)) - np.linalg.slogdet(whole)[1]
        logs.append(0.5 * float(sizes + fitted))
        variance = weights @ np.linalg.solve(whole, weights)
        left.append(float(np.sqrt(variance) / np.linalg.norm(weights / prior)))
    return logs, left


def main() -> None:
    """Every person who is not stored yet."""
    stored = read_json(STORE)["people"] if STORE.exists() else []
    for subject in builtin_subjects()[len(stored) :]:
        fit = fit_of(subject)
        shared, held = Kept(fit), fit.solve(fixed=nominal_parameters())
        found = shared.solve(held)
        if found.left > STUCK:
            found = shared.solve(fit.mode(held))
        weights = np.zeros(len(shared.kept[0]))
        of_mu = fit.near(found.solution, fit.prior_mean + np.inf).common == np.inf
        leg = combinations(scale_subject(subject).model)[0].weights
        weights[: len(of_mu)][of_mu] = leg * fit.prior_sd
        logs, left = with_widths(*shared.kept, shared._problem.prior, weights)
        stored.append({"name": subject.identifier, "log_likelihood": logs, "leg": left})
        about = {"versions": versions(), "commit": STARTED, "widths": WIDTHS}
        write_json(STORE, about | {"people": stored})
        print(subject.identifier, *(f"{each - logs[0]:+.2f}" for each in logs), flush=True)


if __name__ == "__main__":
    main()
