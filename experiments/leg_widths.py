"""What the prior of legs by stature, and the width of the prior of skin, rest on.

    python -m experiments.leg_widths scatter
    python -m experiments.leg_widths people [--people N]

`scatter`: how far legs lie from a line on stature, and thighs and shanks from theirs, in the 6068
people of ANSUR II (`anthropometry/` of the data folder, GAITVAL_DATA).

`people`: harsh people by stature of `SEED`, of whom no row is made, with the shares of the studies'
widths of `experiments.skin_width`: the error of the leg with each. About the mode all is Gaussian,
so its posterior mean with another width follows without another fit: with the mode x and its
precision Λ, and a prior of precision Q instead of P about the same mean, it is (Λ + Q - P)⁻¹ Λ x.

Both write `reports/identification/leg_widths.json` and the table of docs/identification.md.
`people` writes after every person; interrupted, the same command resumes.
"""

import argparse
import csv
import os
from pathlib import Path
from typing import Any, Final

import numpy as np

from evidence.marked_table import with_table
from experiments.harsh_people import planted
from experiments.real_people import fit_of
from experiments.skin_width import Kept
from experiments.virtual_people import person_of
from gaitval.apps.virtual.harsh import harsh_person
from gaitval.arrays import Array
from gaitval.artefacts import read_json, versions, write_json, write_text
from gaitval.configuration import load_configuration
from gaitval.errors import GaitvalError
from gaitval.identification.combinations import combinations
from gaitval.identification.shared_errors import NAMES, NARROWER, SKIN, STUCK
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.storage import load_start
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "leg_widths.json"
PAGE = ROOT / "docs" / "identification.md"
SEED: Final = 515151
WIDTHS: Final = (1.0, 0.8, 0.6, 0.4, 0.2)
LENGTHS: Final = {
    "leg": ("trochanterionheight", "lateralmalleolusheight"),
    "thigh": ("trochanterionheight", "lateralfemoralepicondyleheight"),
    "shank": ("lateralfemoralepicondyleheight", "lateralmalleolusheight"),
}
"""Heights above the floor whose differences these are."""


def scatter(folder: Path) -> list[dict[str, Any]]:
    """Of women and men of ANSUR II in `folder`: how many, and the SD, m, of each of `LENGTHS` about
    a straight line on stature.
    """
    found = []
    for sex in ("FEMALE", "MALE"):
        path = folder / f"ANSUR_II_{sex}_Public.csv"
        with path.open(encoding="latin-1", newline="") as file:
            people = list(csv.DictReader(file))
        needed = ("stature", *(name for pair in LENGTHS.values() for name in pair))
        columns = {
            name: np.array([float(each[name]) for each in people]) / 1000.0 for name in needed
        }
        line = np.stack([np.ones(len(people)), columns["stature"]], axis=1)
        sds = {}
        for name, (upper, lower) in LENGTHS.items():
            length = columns[upper] - columns[lower]
            left = length - line @ np.linalg.lstsq(line, length, rcond=None)[0]
            sds[name] = float(np.sqrt(left @ left / (len(left) - 2)))
        found.append({"sex": sex.lower(), "people": len(people), "sd": sds})
    return found


def with_other_widths(
    common: Array, covariance: Array, prior: Array, weights: Array
) -> list[float]:
    """Posterior mean of the sum `weights` (C,) of unknowns, with each of `WIDTHS`.

    Parameters
    ----------
    common, covariance : (C,) and (C, C), the mode and its covariance with `NARROWER`.
    prior : (C,) 1 / SD of the prior of `common`.
    """
    precision = np.linalg.inv((covariance + covariance.T) / 2)
    first = len(common) - len(NAMES)
    skin, found = slice(first, first + 2 * len(SKIN)), []
    for width in WIDTHS:
        new = prior**2
        new[skin] *= (NARROWER / width) ** 2
        whole = precision + np.diag(new - prior**2)
        found.append(float(weights @ np.linalg.solve(whole, precision @ common)))
    return found


def one(number: int) -> dict[str, Any] | None:
    """Errors of the leg of one person, m, with each of `WIDTHS`; None of somebody who falls."""
    configuration = load_configuration()
    policy = load_start(ROOT / "reports" / "general", configuration.environment)
    try:
        person = harsh_person(
            number, SEED, person_of(number), policy, configuration,
            left_leg=planted(number, SEED),
        )  # fmt: skip
    except GaitvalError:
        return None
    fit = fit_of(person.subject)
    shared, held = Kept(fit), fit.solve(fixed=nominal_parameters())
    found = shared.solve(held)
    if found.left > STUCK:
        found = shared.solve(fit.mode(held))
    of_mu = fit.near(found.solution, fit.prior_mean + np.inf).common == np.inf
    leg = combinations(scale_subject(person.subject).model)[0].weights
    weights = np.zeros(len(shared.kept[0]))
    weights[: len(of_mu)][of_mu] = leg * fit.prior_sd
    truth = float(leg @ (person.truth - fit.prior_mean))
    means = with_other_widths(*shared.kept, shared._problem.prior, weights)
    return {"number": number, "scaled": -truth, "errors": [each - truth for each in means]}


def table(stored: dict[str, Any]) -> str:
    """What is known so far, as Markdown."""
    lines: list[str] = []
    if stored["scatter"]:
        lines += [
            "SD about a line on stature, ANSUR II:", "",
            "| | people | leg, trochanter to lateral malleolus | thigh | shank |",
            "|---|---|---|---|---|",
        ]  # fmt: skip
        for each in stored["scatter"]:
            sds = " | ".join(f"{100 * each['sd'][name]:.1f} cm" for name in LENGTHS)
            lines.append(f"| {each['sex']} | {each['people']} | {sds} |")
        lines.append("")
    people = [each for each in stored["people"] if each.get("errors")]
    if people:
        errors = 100 * np.array([each["errors"] for each in people])
        drawn = np.random.default_rng(0).integers(len(people), size=(4000, len(people)))
        reference = np.sqrt(np.mean(errors[drawn, WIDTHS.index(NARROWER)] ** 2, axis=1))
        lines += [
            f"{len(people)} people by stature of seed {SEED}, of whom no row is made. In brackets: "
            f"less that with {NARROWER:g}, 95 % by drawing people again.", "",
            "| share of the studies' widths | " + " | ".join(f"{w:g}" for w in WIDTHS) + " |",
            "|---|" + len(WIDTHS) * "---|",
        ]  # fmt: skip
        cells = []
        for index in range(len(WIDTHS)):
            again = np.sqrt(np.mean(errors[drawn, index] ** 2, axis=1)) - reference
            low, high = np.percentile(again, [2.5, 97.5])
            size = np.sqrt(np.mean(errors[:, index] ** 2))
            cells.append(f"{size:.2f} ({low:+.2f} to {high:+.2f})")
        lines.append(f"| leg, RMS error, cm | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("scatter", "people"))
    parser.add_argument("--people", type=int, default=60, help="by stature, those who fall as well")
    arguments = parser.parse_args()

    def keep(name: str, value: Any) -> dict[str, Any]:
        old = read_json(STORE) if STORE.exists() else {"scatter": [], "people": []}
        stored = {**old, name: value, "versions": versions()}
        write_json(STORE, stored)
        write_text(PAGE, with_table(PAGE.read_text(encoding="utf-8"), "widths", table(stored)))
        return stored

    if arguments.what == "scatter":
        folder = os.environ.get("GAITVAL_DATA")
        if not folder:
            raise SystemExit("Set GAITVAL_DATA to the folder that has anthropometry/.")
        keep("scatter", scatter(Path(folder) / "anthropometry"))
        return
    done = list(read_json(STORE)["people"]) if STORE.exists() else []
    numbers = [n for n in range(2 * arguments.people + 2) if n // 2 % 2][: arguments.people]
    for number in numbers[len(done) :]:
        done.append(one(number) or {"number": number, "refused": True})
        keep("people", done)
        print(f"{len(done)} of {len(numbers)}", flush=True)


if __name__ == "__main__":
    main()
