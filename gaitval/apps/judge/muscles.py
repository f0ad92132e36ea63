"""Static optimisation and joint reactions that were made elsewhere, and how they compare.

Files of OpenSim: activations and forces of StaticOptimization (or any table of a column a muscle),
reaction loads of JointReaction. Looked at are what no muscle makes (reserves), muscles at their
limit, what joints carry beside what implants measure, when muscles are on beside textbook
electromyograms, and, if given, all of it beside what `gaitval muscles` found.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.io.text_tables import with_unit
from gaitval.apps.judge.limits import LIMITS
from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ArtefactError, RecordError
from gaitval.gait.cycles import GaitCycle
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable
from gaitval.musculature.forces import FORCES
from gaitval.musculature.gait import GROUPS, USUAL_ON
from gaitval.musculature.paths import COORDINATES, table

MEASURED: Final[Mapping[str, tuple[float, float]]] = {"hip": (2.0, 2.9), "knee": (1.8, 3.0)}
"""Body weights, peaks that implants measured in level walking: hips of ten people 2.2 to 2.8
(OrthoLoad; Damm et al. 2017), knees 2 to 3 (Fregly et al. 2012; D'Lima et al. 2012). Their owners
are old and walk slowly: younger people may carry more."""

_HANGS_ON: Final = {
    "hip": "some of it: the moments of ten healthy people need 2.9 (median) by any cost"
}


_REACTION: Final = re.compile(r"(?:^|_)(hip|knee|ankle)_([rl])_on_.*_f([xyz])$")


@dataclass
class JudgedMuscles:
    """What was found.

    Attributes
    ----------
    reserves : largest reserve over the largest moment, of coordinates of the legs.
    at_limit : muscles with an activation near 1.
    peaks : body weights, largest contact force by joint with `_r` or `_l`.
    agreement : share of the cycle in which a group of muscles is on when healthy people's are, by
        name with `_r` or `_l`.
    beside : RMS differences to what `gaitval muscles` found, by curve: activations, body weights.
    """

    reserves: dict[str, float] = field(default_factory=dict)
    at_limit: list[str] = field(default_factory=list)
    peaks: dict[str, float] = field(default_factory=dict)
    agreement: dict[str, float] = field(default_factory=dict)
    beside: dict[str, float] = field(default_factory=dict)

    def findings(self) -> Iterator[str]:
        """Sentences on what a reader must know."""
        for name, share in self.reserves.items():
            if share > FORCES.much_reserve:
                yield (
                    f"Reserves: {100 * share:.0f} % of the largest moment of {name} is made by a "
                    f"reserve actuator, not by muscles (over {100 * FORCES.much_reserve:.0f} %): "
                    "the "
                    "muscles are too weak, or the moment is wrong. Look at the moment first."
                )
        if self.at_limit:
            yield f"Muscles at their limit: {', '.join(self.at_limit)}."
        for name, peak in self.peaks.items():
            low, high = MEASURED.get(name[:-2], (0.0, np.inf))
            if not low <= peak <= high:
                yield (
                    f"Contact: {name} carries up to {peak:.1f} body weights; implants measured "
                    f"{low:g} to {high:g} in level walking. Which cost muscles were shared by "
                    f"decides {_HANGS_ON.get(name[:-2], 'most of it')}."
                )
        if self.agreement:
            mean = float(np.mean(list(self.agreement.values())))
            yield (
                f"Timing: muscles are on and off as healthy people's electromyograms in "
                f"{100 * mean:.0f} % of the cycle ({len(self.agreement)} groups and sides)."
            )
        for name, off in self.beside.items():
            unit = "" if name.startswith("activation") else " body weights"
            yield f"Beside gaitval: {name} differs by {off:.2f}{unit} (RMS over the cycle)."


def judge_muscles(
    activations: Path | None,
    forces: Path | None,
    reactions: Path | None,
    beside: Path | None,
    *,
    mass: float,
    moments: StorageTable | None,
    cycles: Mapping[Side, Sequence[GaitCycle]],
) -> JudgedMuscles:
    """Judge the files that are given, of a model of `mass` kg. `moments` are inverse dynamics'
    results, `cycles` gait cycles by side. Raises RecordError for a file of another kind.
    """
    found = JudgedMuscles()
    curves: dict[str, Array] = {}
    if activations is not None:
        read = read_storage(activations)
        curves |= _activations(found, read, str(activations), cycles)
    if forces is not None:
        _reserves(found, read_storage(forces), str(forces), moments)
    if reactions is not None:
        read = read_storage(reactions)
        curves |= _peaks(found, read, str(reactions), mass, cycles)
    if beside is not None:
        _beside(found, curves, beside)
    return found


def _muscle_columns(read: StorageTable, source: str) -> dict[str, Array]:
    """Columns by our names of muscles, with side."""
    found = {}
    for column in read.columns:
        name = column.rsplit("|", 1)[0].removesuffix("/activation").rsplit("/", 1)[-1]
        if name[:-2] in table().names and name[-2:] in ("_r", "_l"):
            found[name] = read.column(column)
    if not found:
        raise RecordError(
            f"{source}: none of its columns ({', '.join(read.columns[:4])} …) is a muscle of "
            "Rajagopal's model, such as glmed1_r. Give the activations of a static optimisation "
            "with these muscles."
        )
    return found


def _activations(
    found: JudgedMuscles,
    read: StorageTable,
    source: str,
    cycles: Mapping[Side, Sequence[GaitCycle]],
) -> dict[str, Array]:
    columns = _muscle_columns(read, source)
    odd = {n: v for n, v in columns.items() if np.nanmax(v) > 1.05 or np.nanmin(v) < -0.05}
    if odd:
        name = max(odd, key=lambda each: float(np.nanmax(np.abs(odd[each]))))
        raise RecordError(
            f"{source}: {name} goes from {np.nanmin(odd[name]):.3g} to {np.nanmax(odd[name]):.3g}, "
            "but activations are 0 to 1. If they are in per cent, divide by 100; else give "
            "…_activation.sto of static optimisation."
        )
    found.at_limit = sorted(n for n, v in columns.items() if np.nanmax(v) > FORCES.at_limit)
    strength = {each.name: each.max_force for each in table().muscles}
    curves = {}
    phase = np.arange(101)
    for side in SIDES:
        for group, (_, members) in GROUPS.items():
            own = {m: columns.get(f"{m}_{side[0]}") for m in members}
            known = {m: v for m, v in own.items() if v is not None}
            mean = _mean(read.time, known, strength, cycles.get(side, ()))
            if mean is None:
                continue
            curves[f"activation {group}_{side[0]}"] = mean
            usual = np.zeros(101, dtype=bool)
            for first, last in USUAL_ON[group]:
                usual[
                    (phase >= first + LIMITS.force_delay) & (phase <= last + LIMITS.force_delay)
                ] = True
                usual[phase <= last + LIMITS.force_delay - 100] = True
            on = mean > LIMITS.muscle_on * mean.max()
            found.agreement[f"{group}_{side[0]}"] = float((on == usual)[:-1].mean())
    return curves


def _mean(
    time: Array,
    columns: Mapping[str, Array],
    weights: Mapping[str, float],
    cycles: Sequence[GaitCycle],
) -> Array | None:
    """(101,) of columns that count by weights, over the cycles that the times cover."""
    inside = [c for c in cycles if time[0] <= c.start and c.end <= time[-1]]
    if not columns or not inside:
        return None
    total = sum(weights[name] for name in columns)
    values = np.sum([weights[n] * v for n, v in columns.items()], axis=0) / total
    at = np.linspace(0.0, 1.0, 101)
    each = [np.interp(c.start + at * c.duration, time, values) for c in inside]
    return np.asarray(np.mean(each, axis=0))


def _reserves(
    found: JudgedMuscles, read: StorageTable, source: str, moments: StorageTable | None
) -> None:
    columns = _muscle_columns(read, source)
    strongest = max(float(np.nanmax(values, initial=0.0)) for values in columns.values())
    if 0.0 < strongest < LIMITS.weakest_muscle:
        raise RecordError(
            f"{source}: no muscle pulls with more than {strongest:.3g} N: these look like "
            "activations, or forces in kN. Give …_force.sto of static optimisation, in N."
        )
    if moments is None:
        return
    for column in moments.columns:
        name = column.removesuffix("_moment")
        if name[:-2] not in COORDINATES:  # trunk and arms have torques by design
            continue
        own = [
            c
            for c in read.columns
            if name in c and not any(muscle in c for muscle in table().names)
        ]
        largest = float(np.nanmax(np.abs(moments.column(column)), initial=0.0))
        if own and largest > 0.0:
            made = np.sum([read.column(each) for each in own], axis=0)
            found.reserves[name] = float(np.nanmax(np.abs(made))) / largest


def _peaks(
    found: JudgedMuscles,
    read: StorageTable,
    source: str,
    mass: float,
    cycles: Mapping[Side, Sequence[GaitCycle]],
) -> dict[str, Array]:
    parts: dict[str, dict[str, Array]] = {}
    for column in read.columns:
        if (seen := _REACTION.search(column)) is not None:
            joint, end, axis = seen.groups()
            parts.setdefault(f"{joint}_{end}", {})[axis] = read.column(column)
    whole = {name: each for name, each in parts.items() if len(each) == 3}
    if not whole:
        raise RecordError(
            f"{source}: none of its columns ({', '.join(read.columns[:3])} …) is the force of a "
            "hip, knee or ankle, such as hip_r_on_femur_r_in_ground_fx. Give the ReactionLoads of "
            "OpenSim's JointReaction."
        )
    curves = {}
    for name, axes in whole.items():
        size = np.sqrt(np.sum([each**2 for each in axes.values()], axis=0)) / (mass * GRAVITY)
        found.peaks[name] = float(np.nanmax(size))
        side: Side = "right" if name.endswith("_r") else "left"
        mean = _mean(read.time, {name: size}, {name: 1.0}, cycles.get(side, ()))
        if mean is not None:
            curves[f"contact {name}"] = mean
    return curves


def _beside(found: JudgedMuscles, curves: Mapping[str, Array], folder: Path) -> None:
    path = folder / "curves.csv"
    ours = file_gate.csv_frame(path, ArtefactError)
    for name, curve in curves.items():
        key = with_unit(name.replace(" ", "_"), "1" if name.startswith("activation") else "BW")
        if key in ours:
            off = curve - np.asarray(ours[key], dtype=float)
            found.beside[name] = float(np.sqrt(np.mean(off**2)))
