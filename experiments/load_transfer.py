"""Who carries the body while both feet are on the ground: what laws of load transfer are worth.

    python -m experiments.load_transfer

For each of the ten built-in people, the forces of each foot from the total of both, which is the
person's own or what is expected of anybody at this speed, at the person's own foot contacts:

* **smooth transition** (Ren et al. 2008, J Biomech 41:2750-2759, from memory): the force of the
  foot behind falls by the same law in everybody, from what it is when the other foot lands.
* **learned**: it falls as in the nine others, in the mean.
* **expected share**: each foot has its expected force, and of what the total is more or less a
  share as large as that of the expected vertical force.

Beside them the dynamic fit, whose soles are contact elements, to the expected forces (its total is
its own), and what is expected of each foot, which obeys nothing: as it is, and stretched so that
the feet land and leave when the person's do. The table goes into docs/held-out.md.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from evidence.marked_table import with_table
from gaitval.arrays import Array, Flags
from gaitval.artefacts import write_text
from gaitval.coordinates import SIDES
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.gait.record import GaitRecord
from gaitval.prediction.deviations import stored_fits
from gaitval.prediction.normal_form import normal_form, record_from
from gaitval.prediction.population import with_others_kinetics
from gaitval.prediction.seen import contacts, shared

PAGE: Final = Path(__file__).resolve().parent.parent / "docs" / "held-out.md"
PHASES: Final = np.arange(400) / 400.0
"""Of the right gait cycle, at which forces are compared."""
SHARES: Final = np.linspace(0.0, 1.0, 41)
"""Of a double support, at which others' load transfer is averaged."""
# Ren's law of the fore-aft force falls to zero when double support ends, which fixes the second.
_BUMP: Final = np.exp(4.0 / 9.0)
_FALL: Final = 0.5 * _BUMP * np.exp(-16.0 / 9.0)

Law = Callable[[Array], Array]
"""Shares of double support (n,) → force of the foot behind, (n, 3), over the total at its begin."""


class Transfer(NamedTuple):
    """A double support: phases of the right cycle at its begin and end, and the foot behind (0 is
    the right one).
    """

    begin: float
    end: float
    behind: int


def transfers(record: GaitRecord) -> tuple[Transfer, Transfer]:
    """Both double supports of a cycle."""
    left, stance = record.left_phase, record.stance_fraction
    return (
        Transfer(0.0, left + stance["left"] - 1.0, 1),
        Transfer(left, stance["right"], 0),
    )


def forces_of(record: GaitRecord, phases: Array = PHASES) -> Array:
    """(2, n, 3) body weights, right and left foot: forward, left, up, at `phases` (n,) of the right
    cycle.
    """
    own = {"right": phases, "left": phases - record.left_phase}
    return np.array([record.ground_reaction(side, own[side] % 1.0) for side in SIDES])


def _within(begin: float, end: float) -> Flags:
    return np.asarray((begin <= PHASES) & (end > PHASES))


def stretched(expected: GaitRecord, record: GaitRecord) -> Array:
    """(2, 400, 3) forces of the `expected` record at the contacts of both feet of `record`."""
    found = []
    for side in SIDES:
        here, there = (contacts(each, side) for each in (record, expected))
        own = (PHASES - (record.left_phase if side == "left" else 0.0)) % 1.0
        found.append(expected.ground_reaction(side, np.interp(own, here, there)))
    return np.array(found)


def smooth(share: Array) -> Array:
    """Ren's law of load transfer."""
    # Its time is in halves of a double support.
    time = 2.0 * share
    falling = np.exp(-(time**3))
    forward = _BUMP * np.exp(-((time - 2.0 / 3.0) ** 2)) - _FALL * time
    return np.stack([forward, falling, falling], axis=1)


def learned(others: list[GaitRecord]) -> Law:
    """The law of load transfer that is the mean of others'."""
    behinds, totals = [], []
    for record in others:
        for begin, end, behind in transfers(record):
            forces = forces_of(record, begin + (end - begin) * SHARES)
            forces *= [1.0, 1.0 if behind == 0 else -1.0, 1.0]
            behinds.append(forces[behind])
            totals.append(forces[:, 0].sum(axis=0))
    # Not every curve of the foot in front begins at zero.
    shares = np.mean(behinds, axis=0) / np.mean(totals, axis=0)
    return lambda share: np.stack([np.interp(share, SHARES, each) for each in shares.T], axis=1)


def divided(record: GaitRecord, total: Callable[[Array], Array], law: Law) -> Array:
    """The `total` (n, 3) at phases, on both feet, (2, 400, 3), at the contacts of `record`."""
    both = total(PHASES)
    found = np.array([both, both])
    first, second = transfers(record)
    found[1, _within(0.0, second.begin)] = 0.0
    found[0, _within(second.begin, 1.0)] = 0.0
    for begin, end, behind in (first, second):
        on = _within(begin, end)
        found[behind, on] = law((PHASES[on] - begin) / (end - begin)) * total(np.array([begin]))
        found[1 - behind, on] = both[on] - found[behind, on]
    return found


def fitted(subject: Subject, expected: GaitRecord) -> GaitRecord:
    """The `expected` record with the forces of the dynamic fit to it."""
    gait = normal_form(expected, subject.leg_length_m)
    fit = stored_fits()[f"{subject.identifier} {subject.trial}"]
    forces = gait.forces + fit[:, -3:].transpose(0, 2, 1)
    return record_from(replace(gait, forces=forces), subject.leg_length_m)


def errors(found: Array, record: GaitRecord) -> Array:
    """RMS errors, % of body weight, mean of both feet: (double support and whole cycle, 3)."""
    squares = np.square(100.0 * (found - forces_of(record)))
    both = np.zeros(len(PHASES), dtype=bool)
    for begin, end, _ in transfers(record):
        both |= _within(begin, end)
    return np.array(
        [np.sqrt(part.mean(axis=1)).mean(axis=0) for part in (squares[:, both], squares)]
    )


def compared() -> dict[str, Array]:
    """`errors` by what the forces come from, of the ten: (10, 2, 3)."""
    people = builtin_subjects()
    found: dict[str, list[Array]] = {}
    for subject in people:
        record = subject.record()
        others = [each.record() for each in people if not subject.is_person_of(each)]
        expected = with_others_kinetics(subject, people)
        usual = forces_of(expected)
        forces = {
            "expected of each foot": usual,
            "the same at own contacts": stretched(expected, record),
            "dynamic fit (contact elements)": forces_of(fitted(subject, expected)),
        }
        for whose, source in (("expected", expected), ("own", record)):

            def total(phases: Array, source: GaitRecord = source) -> Array:
                return np.asarray(forces_of(source, phases).sum(axis=0))

            forces[f"{whose} total, smooth transition"] = divided(record, total, smooth)
            forces[f"{whose} total, learned"] = divided(record, total, learned(others))
        forces["own total, expected share"] = shared(usual, (forces_of(record) - usual).sum(axis=0))
        for name, each in forces.items():
            found.setdefault(name, []).append(errors(each, record))
    return {name: np.array(each) for name, each in found.items()}


def table(found: dict[str, Array]) -> str:
    """As Markdown: means over the ten, and how many are nearer than what is expected of each foot
    (vertical force, whole cycle).
    """
    lines = [
        "| forces of each foot | vertical: double support, cycle | fore-aft | sideways "
        "| vertically nearer than expected |",
        "|---|---|---|---|---|",
    ]
    usual = found["expected of each foot"][:, 1, 2]
    for name, each in found.items():
        (fore, side, up), whole = each.mean(axis=0)
        nearer = int(np.sum(each[:, 1, 2] < usual))
        lines.append(
            f"| {name} | {up:.1f}, {whole[2]:.1f} | {fore:.1f}, {whole[0]:.1f} "
            f"| {side:.1f}, {whole[1]:.1f} | "
            + ("" if name == "expected of each foot" else f"{nearer} of {len(each)}")
            + " |"
        )
    return "\n".join(lines)


def main() -> None:
    """Compare, print the table and write it into docs/held-out.md."""
    found = table(compared())
    print(found)
    write_text(PAGE, with_table(PAGE.read_text(encoding="utf-8"), "load-transfer", found))


if __name__ == "__main__":
    main()
