"""Files of the muscles of a gait: tables, OpenSim's storage files, figures, a page."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from gaitval._internal.io.artefacts import versions, write_json
from gaitval._internal.io.text_tables import with_unit
from gaitval.apps.muscles.sharing import MuscleSettings, SharedMotions
from gaitval.configuration import ContactSettings
from gaitval.coordinates import SIDES
from gaitval.importing.write import write_table
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.musculature.gait import CONTACTS, GROUPS, LoadedMotion, MuscleGait
from gaitval.musculature.paths import COORDINATES
from gaitval.opensim.muscle_motion import write_storages
from gaitval.opensim.osim import write_osim
from gaitval.quantities.metabolic_cost import JOINTS, LEFT_OUT, MetabolicCost
from gaitval.quantities.metabolic_rate import TITLES
from gaitval.reporting.muscle_figures import DrawnMuscles

RESULT: Final = "muscles.json"
PAGE: Final = "muscles"
VERSION: Final = 1
MODEL: Final = "model_with_muscles.osim"


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
    from gaitval.reporting.page import write_page

    found = shared.muscles
    about = {
        "strength": settings.strength,
        "activation_dynamics": settings.activation_dynamics,
        "emg_weight": settings.emg_weight,
    }

    folder.mkdir(parents=True, exist_ok=True)
    written = list(write_storages(folder, found))
    friction = float(nominal_parameters()[PARAMETERS.index("friction")])
    write_osim(
        folder / MODEL, motion.laden or motion.model, (), ContactSettings(), friction,
        height=motion.height, lost=motion.lost, person=motion.model,
    )  # fmt: skip
    written.append(folder / MODEL)
    if found.legs:
        written.append(write_table(folder / "curves.csv", curve_table(found)))
        drawn = DrawnMuscles.of(found)
        context = {
            "found": found,
            "about": about,
            "sides": [side for side in SIDES if side in found.legs],
            "contacts": CONTACTS,
            "drawings": {"activations": drawn.activations, "contacts": drawn.contacts},
            "data": drawn.tables(),
            "reserves": reserves(found),
            "seen": shared.seen,
            "least_hip": shared.least_hip,
            "cost": cost,
            "left_out": LEFT_OUT,
            "model_titles": {**TITLES, JOINTS: "Joints alone"},
        }
        write_page(folder, PAGE, "gaitval.apps.muscles:muscles.html.j2", context)
        written += [folder / f"{PAGE}.html", folder / f"{PAGE}.pdf"]
    more = {
        "electromyograms": _seen(shared),
        "metabolic": cost_result(cost),
        "least_hip_bw": {
            side: round(float(curve.max()), 4) for side, curve in shared.least_hip.items()
        },
    }
    write_json(folder / RESULT, result(found, about) | more)
    return [*written, folder / RESULT]


def _seen(shared: SharedMotions) -> list[dict[str, Any]]:
    """Every channel; a correlation of what does not vary is null."""
    return [
        {
            **asdict(each),
            "muscles": list(each.muscles),
            "correlation": each.correlation if np.isfinite(each.correlation) else None,
        }
        for each in shared.seen
    ]


def cost_result(cost: MetabolicCost | None) -> dict[str, Any] | None:
    """What `RESULT` holds of a `cost`: W/kg and J/kg/m by model, and the band of 90 %."""
    if cost is None:
        return None
    low, high = cost.band()
    speed = cost.speed
    return {
        "walking_speed_m_s": None if speed is None else round(speed, 4),
        "gross_w_kg": {name: round(rate, 4) for name, rate in cost.gross.items()},
        "net_w_kg": {name: round(cost.net(name), 4) for name in cost.gross},
        "gross_j_kg_m": {
            name: None if (each := cost.per_metre(name)) is None else round(each, 4)
            for name in cost.gross
        },
        "middle_w_kg": round(cost.middle, 4),
        "low_w_kg": round(low, 4),
        "high_w_kg": round(high, 4),
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


def result(found: MuscleGait, about: dict[str, Any]) -> dict[str, Any]:
    """What `RESULT` holds: peaks, reserves, bands of peaks and what they are of, remarks."""
    sides: dict[str, Any] = {}
    for side, leg in found.legs.items():
        peaks = {}
        for name, curve in leg.contact.items():
            at = int(np.argmax(curve))
            peaks[name] = {"peak_bw": round(float(curve[at]), 4), "at_percent": at}
            if name in leg.contact_band:
                low, high = leg.contact_band[name][:, at]
                peaks[name] |= {"low_bw": round(float(low), 4), "high_bw": round(float(high), 4)}
        sides[side] = {
            "cycles": leg.cycles,
            "contact": peaks,
            "activation_peaks": {
                group: round(float(leg.group(group).max()), 4)
                for group in GROUPS
                if np.isfinite(leg.group(group)).all()
            },
            "variance_of_bands": {
                joint: {source: round(share, 4) for source, share in shares.items()}
                for joint, shares in leg.contributions.items()
            },
        }
    return {
        "schema_version": VERSION,
        "versions": versions(),
        "of": found.name,
        "mass_kg": round(found.mass_kg, 6),
        "criterion": found.criterion.name,
        **about,
        "sides": sides,
        "largest_reserve_share": {
            side: {name: round(share, 5) for name, share in shares.items()}
            for side, shares in reserves(found).items()
        },
        "remarks": list(found.remarks),
    }
