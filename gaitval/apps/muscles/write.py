"""Files of the muscles of a gait: tables, OpenSim's storage files, figures, a page."""

from pathlib import Path
from typing import Any, ClassVar, Final, Literal

import numpy as np
import pandas as pd

from gaitval._internal.io.text_tables import with_unit
from gaitval.apps.muscles.sharing import MuscleSettings, SharedMotions
from gaitval.configuration import ContactSettings
from gaitval.coordinates import SIDES, Side
from gaitval.kinetics.musculature.gait import CONTACTS, GROUPS, LoadedMotion, MuscleGait
from gaitval.kinetics.musculature.paths import COORDINATES
from gaitval.metrics.typed import Count, Flag, Number, Result
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.quantities.metabolic_cost import JOINTS, LEFT_OUT, MetabolicCost
from gaitval.quantities.metabolic_rate import TITLES
from gaitval.reporting.muscle_figures import DrawnMuscles
from gaitval.reporting.written import Written, taken
from gaitval.session.importing.write import write_table
from gaitval.session.opensim.muscle_motion import write_storages
from gaitval.session.opensim.osim import write_osim

MODEL: Final = "model_with_muscles.osim"


class ContactPeak(Result):
    """The largest contact force of a joint, body weights; its band of 90 %, if bands were drawn."""

    peak_bw: Number
    at_percent: Count
    low_bw: Number | None = None
    high_bw: Number | None = None


class MuscleSide(Result):
    """The muscles of a leg, means over its cycles."""

    cycles: Count
    contact: dict[str, ContactPeak]
    activation_peaks: dict[str, Number]
    """By group of muscles, 0 to 1."""
    """By joint, the share that each source has of the band of the peak."""


class SeenChannel(Result):
    """An electromyogram beside what was computed; a correlation of what does not vary is null."""

    trial: str
    channel: str
    side: Side
    muscles: list[str]
    correlation: Number | None
    agrees: Number
    """Share of the time in which both are on, or both are off."""
    by_chance: Number
    size: Number | None
    """Activation over the envelope."""


class MetabolicResult(Result):
    """What walking costs, by model."""

    walking_speed_m_s: Number | None
    gross_w_kg: dict[str, Number]
    net_w_kg: dict[str, Number]
    gross_j_kg_m: dict[str, Number | None]
    middle_w_kg: Number
    low_w_kg: Number
    """Of the band of 90 %."""
    high_w_kg: Number


class MuscleResult(Written):
    """What `gaitval muscles` found."""

    NAME: ClassVar[str] = "muscles"
    TEMPLATE: ClassVar[str] = "gaitval.apps.muscles:muscles.html.j2"

    schema_version: Literal[1]
    of: str
    mass_kg: Number
    criterion: str
    strength: Number | dict[str, Number]
    """Factor on that of healthy adults, of all muscles or by name."""
    activation_dynamics: Flag
    emg_weight: Number
    sides: dict[Side, MuscleSide]
    largest_reserve_share: dict[Side, dict[str, Number]]
    """Of the largest moment of each coordinate, what no muscle makes."""
    remarks: list[str]
    electromyograms: list[SeenChannel]
    metabolic: MetabolicResult | None


def write_muscles(
    folder: Path,
    shared: SharedMotions,
    settings: MuscleSettings,
    motion: LoadedMotion,
    cost: MetabolicCost | None = None,
) -> list[Path]:
    """Write everything of `shared` into `folder`; returns the files. `settings` say what was asked
    for; `motion` has the body, which becomes an OpenSim model with muscles; `cost` is what the walk
    costs, where that is known. Raises ArtefactError if it cannot be written to.
    """
    found = shared.muscles
    result = result_of(shared, settings, cost)
    folder.mkdir(parents=True, exist_ok=True)
    written = list(write_storages(folder, found))
    friction = float(nominal_parameters()[PARAMETERS.index("friction")])
    write_osim(
        folder / MODEL, motion.laden or motion.model, (), ContactSettings(), friction,
        height=motion.height, lost=motion.lost, person=motion.model,
    )  # fmt: skip
    written.append(folder / MODEL)
    if not found.legs:
        return [*written, *result.write(folder, page=False)]
    written.append(write_table(folder / "curves.csv", curve_table(found)))
    drawn = DrawnMuscles.of(found)
    return written + result.write(
        folder,
        found=found,
        sides=[side for side in SIDES if side in found.legs],
        contacts=CONTACTS,
        drawings={"activations": drawn.activations, "contacts": drawn.contacts},
        data=drawn.tables(),
        seen=shared.seen,
        cost=cost,
        left_out=LEFT_OUT,
        model_titles={**TITLES, JOINTS: "Joints alone"},
    )


def _metabolic(cost: MetabolicCost) -> dict[str, Any]:
    low, high = cost.band()
    return {
        "walking_speed_m_s": cost.speed,
        "gross_w_kg": cost.gross,
        "net_w_kg": {name: cost.net(name) for name in cost.gross},
        "gross_j_kg_m": {name: cost.per_metre(name) for name in cost.gross},
        "middle_w_kg": cost.middle,
        "low_w_kg": low,
        "high_w_kg": high,
    }


def curve_table(found: MuscleGait) -> pd.DataFrame:
    """Mean curves and bands, a column each, 0 to 100 % of the side's cycle."""
    columns: dict[str, Any] = {"percent": np.arange(101.0)}
    for name, unit, mean, band in found.curves():
        key = with_unit(name.replace(" ", "_"), unit)
        columns[key] = mean
        if band is not None:
            columns[f"{key}_low"], columns[f"{key}_high"] = band
    return pd.DataFrame(columns)


def reserves(found: MuscleGait) -> dict[str, dict[str, float]]:
    """Largest reserve over the largest moment of each coordinate, by side."""
    shares: dict[str, dict[str, float]] = {}
    for _, side, piece in found.pieces:
        own = shares.setdefault(side, {})
        values = piece.legs[side].reserve_share().tolist()
        for name, share in zip(COORDINATES, values, strict=True):
            own[name] = max(own.get(name, 0.0), share)
    return shares


def result_of(
    shared: SharedMotions, settings: MuscleSettings, cost: MetabolicCost | None = None
) -> MuscleResult:
    """What is written of what was `shared` as `settings` say, and what the walk costs."""
    found = shared.muscles
    return MuscleResult.made(
        of=found.name,
        mass_kg=found.mass_kg,
        criterion=found.criterion.name,
        strength=settings.strength,
        activation_dynamics=settings.activation_dynamics,
        emg_weight=settings.emg_weight,
        sides={side: _of_side(leg) for side, leg in found.legs.items()},
        largest_reserve_share=reserves(found),
        remarks=found.remarks,
        electromyograms=[taken(SeenChannel, each) for each in shared.seen],
        metabolic=None if cost is None else _metabolic(cost),
    )


def _of_side(leg: Any) -> dict[str, Any]:
    peaks = {}
    for name, curve in leg.contact.items():
        at = int(np.argmax(curve))
        peaks[name] = {"peak_bw": curve[at], "at_percent": at}
        if name in leg.contact_band:
            peaks[name]["low_bw"], peaks[name]["high_bw"] = leg.contact_band[name][:, at]
    return {
        "cycles": leg.cycles,
        "contact": peaks,
        "activation_peaks": {
            group: leg.group(group).max() for group in GROUPS if np.isfinite(leg.group(group)).all()
        },
    }
