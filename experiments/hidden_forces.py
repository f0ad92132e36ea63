"""What no verdict compares in walks of the ten: toes, ringing, twist and creep of the feet, energy.

    python -m experiments.hidden_forces FOLDER [S01 ...]    # folders of studies, by subject

Reads stored walks and fits; nothing is simulated. A line a person: the walk, and the fit that it
follows. The rows are those of `gaitval.metrics.torques`; ankle is the positive work of the ankles
over the recorded.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gaitval.artefacts import read_json
from gaitval.configuration import load_configuration
from gaitval.coordinates import ACTUATED
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.groups import GROUPS
from gaitval.metrics.identified_body import identified_model
from gaitval.metrics.torques import torques_of
from gaitval.metrics.typed import sided
from gaitval.model.urdf import read_urdf
from gaitval.reference.motion import ReferenceMotion
from gaitval.simulation.rollout import Rollout

RunFigures = dict[str, float]


def toes_of_fit(folder: Path, mass: float) -> RunFigures:
    """Moment (Nm/kg) and work (J/kg) of the toes of the motion that a walk follows."""
    reference = ReferenceMotion.load(folder / "identified.npz")
    found: RunFigures = {}
    for side in "rl":
        column = ACTUATED.index(f"mtp_angle_{side}")
        moment = reference.moments[:, column] / mass
        rate = reference.velocities[:, 6 + column]
        found[f"fit toe moment {side}"] = float(np.abs(moment).max())
        found[f"fit toe work {side}"] = float((moment * rate).mean() * reference.stride_time)
    return found


def row_of(folder: Path) -> RunFigures:
    """All figures of the study in a `folder`."""
    subject = load_subject(str(folder / "subject.toml"))
    configuration = load_configuration(folder / "configuration.toml")
    model = identified_model(read_urdf(folder / "model.urdf"), folder / "identification.json")
    rollout = Rollout.load(folder / "rollouts" / "identified.npz")
    cycles = find_cycles(rollout, configuration).first(configuration.validation.cycles)
    torques = torques_of(rollout, cycles, model=model, height=subject.height_m)
    found: RunFigures = {
        f"{each.measure} {each.target}": float(each.value or 0.0) for each in torques.measures
    }
    metrics = read_json(folder / "metrics.json")
    walk = metrics["walks"][metrics["final"]]
    recorded, walked = (each["joint_power"]["generated"] for each in (metrics["record"], walk))
    for side in "rl":
        name = f"ankle_angle_{side}"
        found[f"ankle work {side}"] = walked[name] / recorded[name]
    for group, (kind, names) in GROUPS.items():
        errors = [walk["errors"][kind][curve]["rmse"] for curve in sided(names)]
        found[f"error {group}"] = float(np.mean(errors))
    pushes = read_json(folder / "push.json")["recovery"]["survived"]
    found["pushes survived"] = float(np.sum(pushes))
    found |= {f"energy {name}": each for name, each in torques.energy.items()}
    return found | toes_of_fit(folder, model.mass)


def table(rows: Mapping[str, RunFigures]) -> str:
    """A line a figure, a column a person, and the mean and the worst."""
    names: Sequence[str] = list(next(iter(rows.values())))
    lines = ["| | " + " | ".join(rows) + " | mean | largest |", "|---" * (len(rows) + 3) + "|"]
    for name in names:
        values = [row[name] for row in rows.values()]
        cells = [f"{each:.3g}" for each in (*values, np.mean(values), np.max(values))]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("subjects", nargs="*", help="all ten if none is named")
    arguments = parser.parse_args()
    subjects = arguments.subjects or BUILTIN
    print(table({name: row_of(arguments.folder / name) for name in subjects}))


if __name__ == "__main__":
    main()
