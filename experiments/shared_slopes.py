"""Shipped: gaitval/correction/shared_slopes.safetensors, with which corrections begin.

It says how walks of the general policy answer to changes of their reference (`slopes.py` there). It
is measured on adults of ANSUR II and children of the WHO's growth reference, drawn as those of
`python -m claims walking.strangers` are, but with another seed: nobody of them is in a table of
the project. Each of them walks every change of the reference once.

    python -m experiments.shared_slopes measure --work FOLDER    # 50 people, 9 min; goes on
    python -m experiments.shared_slopes write --work FOLDER      # the file, and of whom it is
    python -m experiments.shared_slopes compare --work FOLDER    # 3 min; the table

`compare` corrects the reference of some of them: with the slopes of the others, for several amounts
of noise, and with their own, measured ones.
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from safetensors.numpy import save_file

from claims import DATA, ROOT
from claims.walking import adults, drawn_stranger, task_of
from gaitval._internal.io.artefacts import (
    read_json,
    replacing,
    versions,
    write_arrays,
    write_json,
)
from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.correction import slopes as rules
from gaitval.correction.correct import (
    CorrectedWalk,
    beside_reference,
    correction_of,
    prior_sd,
)
from gaitval.correction.search import search
from gaitval.correction.slopes import SLOPES, STORED, Slopes
from gaitval.correction.walked import ACCURACY, Walked, fitted
from gaitval.gait.sampling import SAMPLES
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import in_groups
from gaitval.study.stored_policy import general_walker
from gaitval.walk.reference.adjustment import JOINTS

TARGET: Final = ROOT / "gaitval" / "correction" / STORED
ABOUT: Final = ROOT / "reports" / "general" / "shared_slopes.json"
SEED: Final = 20261126
SPEEDS: Final = (0.3, 1.8)
"""m/s, of an adult of mean leg length."""
UNKNOWNS: Final = len(JOINTS) * (1 + 2 * SLOPES.harmonics) + 1
PROBE: Final = np.append(np.full(UNKNOWNS - 1, np.deg2rad(0.3)), 0.00225)
"""Changes by which effects are measured, rad and m: an effect is then several times the scatter of
mean curves between walks."""
COMPARED: Final = 12
"""People whose corrections are compared."""
NOISES: Final = (30.0, 100.0, 300.0)


class Stranger:
    """Somebody with the general policy, who can walk changes of the reference."""

    def __init__(self, data: Path, number: int) -> None:
        person, self.gait, self.speed = drawn_stranger(adults(data), SEED, number, SPEEDS)
        self.task = task_of(person, self.speed)
        self.policy = general_walker(self.task.configuration.environment)
        self.environment = WalkingEnvironment(self.task)
        self.dimensionless = float(self.environment.yardstick.targets.speed)
        self.groups = 0

    def walk(self, points: Sequence[Array]) -> list[Walked | None]:
        """At each of the `points`, (326,) rad and m."""
        start = self.task.configuration.validation.start_phases[0]
        cases = [
            CorrectedWalk(self.policy, nominal_parameters(), correction_of(each), start)
            for each in points
        ]
        groups = in_groups(cases)
        self.groups += len(groups)
        return [each for group in groups for each in beside_reference(self.environment, group)]

    def allowed(self, point: Array) -> bool:
        """Whether the correction may try a point."""
        return correction_of(point).largest() <= self.task.configuration.correction.largest


def _measure(data: Path, folder: Path, number: int) -> str:
    """One person's slopes into the `folder`, unless they are there; what to say of them."""
    path = folder / f"{number:03}.npz"
    if path.is_file():
        return f"{number}: there"
    person = Stranger(data, number)
    none, *walks = person.walk([np.zeros(UNKNOWNS), *np.diag(PROBE)])
    if none is None:
        return f"{number}: falls"
    slopes = [
        np.zeros_like(none.deviations) if each is None else (each.deviations - none.deviations)
        for each in walks
    ]
    about = {
        "gait": person.gait,
        "speed": round(person.speed, 3),
        "dimensionless": person.dimensionless,
        "curves": [f"{kind}/{name}" for kind, name in none.rmse if fitted(kind, name)],
    }
    write_json(folder / f"{number:03}.json", about)
    write_arrays(path, {"slopes": np.column_stack(slopes) / PROBE})
    return f"{number}: {about}"


class MeasuredSlopes(NamedTuple):
    """A person's slopes (m, 326), at a dimensionless speed."""

    speed: float
    slopes: Array


def _read(folder: Path) -> dict[int, MeasuredSlopes]:
    """What was measured, by the number of the person."""
    found = {}
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as arrays:
            speed = read_json(path.with_suffix(".json"))["dimensionless"]
            found[int(path.stem)] = MeasuredSlopes(speed, arrays["slopes"])
    return found


def shared(people: Sequence[MeasuredSlopes]) -> tuple[Array, Array, Array]:
    """Of people's slopes the straight line on speed, its value at `SLOPES.speed` and its slope (m,
    326), and the covariance about it (326, 326).
    """
    line = np.array([[1.0, each.speed - SLOPES.speed] for each in people])
    slopes = np.array([each.slopes for each in people])
    mean, by_speed = np.einsum("kp,pmn->kmn", np.linalg.pinv(line), slopes)
    covariance = np.zeros((UNKNOWNS, UNKNOWNS))
    for (_, away), each in zip(line, slopes, strict=True):
        off = each - mean - away * by_speed
        covariance += off.T @ off
    return mean, by_speed, covariance / (len(people) - 2)


def _write(folder: Path) -> None:
    """The file that ships, and what it is of."""
    people = _read(folder)
    mean, by_speed, covariance = shared(list(people.values()))

    def kept(values: Array) -> Array:
        return values.reshape(-1, SAMPLES, UNKNOWNS)[:, :: SLOPES.every].astype(np.float16)

    with replacing(TARGET) as temporary:
        save_file(
            {
                "mean": kept(mean),
                "by_speed": kept(by_speed),
                "covariance": covariance.astype(np.float32),
                "speeds": np.array(
                    [pick(each.speed for each in people.values()) for pick in (min, max)]
                ),
            },
            temporary,
        )
    about = read_json(ABOUT) if ABOUT.is_file() else {}
    stored = {f"{number}": read_json(folder / f"{number:03}.json") for number in sorted(people)}
    (curves,) = {tuple(each.pop("curves")) for each in stored.values()}
    write_json(
        ABOUT,
        about
        | {
            "people": stored,
            "seed": SEED,
            "curves": curves,
            "accuracy": {kind: dict(values) for kind, values in ACCURACY.items()},
            "policy": general_walker(Configuration().environment).key,
            "versions": versions(),
        },
    )


def _compare(data: Path, folder: Path, number: int) -> dict[str, list[float]]:
    """Of a person: error after the correction and groups of eight walks, by kind of slopes."""
    person, people = Stranger(data, number), _read(folder)
    own = people.pop(number)
    mean, by_speed, covariance = shared(list(people.values()))
    others = Slopes(mean + (own.speed - SLOPES.speed) * by_speed, covariance)
    kinds = {f"of others, noise {noise:g}": (others, noise) for noise in NOISES}
    # As uncertain as the two walks leave them of which each is a difference.
    known = Slopes(own.slopes, np.diag(NOISES[1] / PROBE**2))
    found = {}
    sd = prior_sd(SLOPES.harmonics)
    for kind, (slopes, noise) in {**kinds, "own, measured": (known, NOISES[1])}.items():
        person.groups = 0
        rules.SLOPES.noise = noise
        result = search(
            lambda points: person.walk([sd * each for each in points]),
            slopes.scaled(sd),
            steps=person.task.configuration.correction.steps,
            allowed=lambda point: person.allowed(sd * point),
        )
        found[kind] = [*result.errors[:: len(result.errors) - 1], person.groups]
    found["own, measured"][-1] += len(in_groups(range(UNKNOWNS)))
    print(number, found, flush=True)
    return found


def table(found: Sequence[dict[str, list[float]]]) -> str:
    """Means over the people, by kind of slopes."""
    lines = ["| slopes | error of the walk / accuracy | groups of eight walks |", "|---|---|---|"]
    before = np.mean([each["own, measured"][0] for each in found])
    lines.append(f"| no correction | {before:.2f} | |")
    for kind in found[0]:
        after = np.array([each[kind][1:] for each in found])
        error, groups = after.mean(axis=0)
        lines.append(f"| {kind} | {error:.3f} ± {after[:, 0].std(ddof=1):.3f} | {groups:.0f} |")
    return "\n".join(lines)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("measure", "write", "compare"))
    parser.add_argument("--work", type=Path, required=True, help="folder of the slopes")
    parser.add_argument("--people", type=int, default=50, help="default: %(default)s")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the raw data")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    if arguments.what == "write":
        _write(arguments.work)
        return
    with ProcessPoolExecutor(2) as pool:
        if arguments.what == "measure":
            work = partial(_measure, arguments.data, arguments.work)
            for message in pool.map(work, range(arguments.people)):
                print(message, flush=True)
            return
        chosen = sorted(_read(arguments.work))[:COMPARED]
        found = list(pool.map(partial(_compare, arguments.data, arguments.work), chosen))
    about: dict[str, Any] = read_json(ABOUT)
    write_json(ABOUT, about | {"compared": dict(zip(map(str, chosen), found, strict=True))})
    print(table(found))


if __name__ == "__main__":
    main()
