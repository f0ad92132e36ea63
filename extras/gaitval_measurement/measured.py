"""What an import asks for at its end: faults of the measurement, estimated and said, and corrected
where the user asks for it.
"""

from dataclasses import dataclass, replace

from gaitval.coordinates import Side
from gaitval.gait.cycles import AverageCurve
from gaitval.session.request import Tell
from gaitval.session.session import Import
from gaitval_measurement.correct import corrected, wanted
from gaitval_measurement.estimate import Examined, examined
from gaitval_measurement.said import FaultRow, rows, warnings


@dataclass(frozen=True)
class Measurement:
    """What forces and markers of a session say of each other.

    Attributes
    ----------
    faults : a line of the table for each fault that was looked for.
    seen : the estimate itself.
    uncorrected : mean moments (Nm/kg) and forces (body weights) as recorded, by name and side,
        where a correction was asked for; else empty.
    """

    faults: tuple[FaultRow, ...]
    seen: Examined
    uncorrected: dict[str, AverageCurve | dict[Side, AverageCurve]]


def measured(found: Import, tell: Tell) -> Import:
    """The import `found` with the estimate of its faults, and warnings of those that matter.

    Each is said with `tell`. With `--correct`, moments and forces are those of corrected plates,
    and the estimate is that before. Without forces of both feet, or with an aid that carries what
    no plate shows, nothing is looked for.

    Raises
    ------
    ConfigurationError : `--correct` names a fault that cannot be corrected.
    """
    request = found.request
    kinds = wanted(request.correct)
    if request.aid is not None:
        return found
    seen = examined(found.body.model, found.trials, request.mass_kg, request.height_m)
    if seen is None:
        return found
    said: list[tuple[str, str]] = []

    def noted(step: str, text: str) -> None:
        said.append((step, text))
        tell(step, text)

    flags = warnings(seen)
    for flag in flags:
        noted("warnings", str(flag))
    measurement = Measurement(rows(seen), seen, {})
    result = found
    if kinds:
        result = corrected(found, seen, kinds, noted)
        before: dict[str, AverageCurve | dict[Side, AverageCurve]] = {**found.moments}
        before["forces"] = {**found.forces}
        measurement = replace(measurement, uncorrected=before)
    return replace(
        result,
        of_means=(*flags, *result.of_means),
        decisions=(*result.decisions, *said),
        measurement=measurement,
    )
