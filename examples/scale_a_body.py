"""Scale the body model to a person, look at it, and draw its segments' masses.

    python examples/scale_a_body.py [SUBJECT] [FOLDER]

SUBJECT is a built-in subject (5) or a subject file; FOLDER gets model.urdf, scaling.csv, body.png.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import gaitval as gv


def main(name: str = "5", folder: str = "scaled_body") -> None:
    """Scale, print, write, draw."""
    subject = gv.load_subject(name)
    body = gv.scale(subject)
    print(subject)
    print(body)
    body.save(folder)  # model.urdf for a simulator, scaling.csv to read

    table = body.to_frame()
    masses = table[table.unit == "kg"]
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.add_subplot()
    axes.barh(masses.quantity, masses.value)
    axes.set_xlabel("mass of one segment (kg)")
    axes.set_title(f"{subject.identifier}: {body.model.mass:.1f} kg")
    figure.savefig(Path(folder) / "body.png", dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:])
