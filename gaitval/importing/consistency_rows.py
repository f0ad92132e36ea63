"""What a motion that was made consistent changed, as rows of the import's page."""

import numpy as np

from gaitval.inverse.consistent_motion import ConsistentMotion
from gaitval.inverse.inverse_dynamics import Residuals
from gaitval.reporting import recording_report as page


def changes_by(
    consistent: ConsistentMotion, before: Residuals, after: Residuals
) -> list[page.ConsistencyChange]:
    """What `consistent` changed: residuals (`before`, `after`), markers, coordinates and masses, a
    row each.
    """
    rows = [
        page.ConsistencyChange("residual force, RMS", before.force_rms, after.force_rms, "N"),
        page.ConsistencyChange("residual force, peak", before.force_peak, after.force_peak, "N"),
        page.ConsistencyChange("residual moment, RMS", before.moment_rms, after.moment_rms, "Nm"),
        page.ConsistencyChange(
            "residual moment, peak", before.moment_peak, after.moment_peak, "Nm"
        ),
        page.ConsistencyChange(
            "markers on the body, RMS", 0.0, 1000 * consistent.marker_change_rms, "mm"
        ),
        page.ConsistencyChange(
            "markers on the body, largest", 0.0, 1000 * consistent.marker_change_max, "mm"
        ),
    ]
    for name, change in consistent.coordinate_change.items():
        length = name.startswith("pelvis_t")
        value = 1000 * change if length else float(np.degrees(change))
        if value < 0.005:
            continue  # shown as 0.00: a held coordinate
        rows.append(
            page.ConsistencyChange(f"{name}, RMS change", 0.0, value, "mm" if length else "°")
        )
    rows += [
        page.ConsistencyChange(f"mass of {name.replace('_', ' ')}, factor", 1.0, factor, "1")
        for name, factor in consistent.mass_factors.items()
    ]
    return rows
