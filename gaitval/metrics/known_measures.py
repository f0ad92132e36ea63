"""Which measures compare the walk with data known to the run (fitted), and which are predicted."""

from collections.abc import Collection, Mapping
from typing import Final, Literal, get_args

from gaitval.configuration import Configuration
from gaitval.datasets.subject import Subject
from gaitval.metrics.side_measures import SIDE_MEASURES
from gaitval.prediction.known import QUANTITIES, RecordedQuantity, quantities_known
from gaitval.quantities import QUANTITIES as QUANTITY_TABLE

Status = Literal["fitted", "partly fitted", "predicted", "not compared"]

ReadBy = Literal["reference", "feed-forward", "reward", "identification", "correction"]
"""What a run uses a known quantity for. Scaling uses standing markers or lengths, and no gait."""

_READ_BY: Final[Mapping[RecordedQuantity, tuple[ReadBy, ...]]] = {
    "angles": ("reference", "reward", "identification", "correction"),
    "timing": ("reference", "reward", "identification"),
    "moments": get_args(ReadBy),
    "forces": ("reference", "reward", "identification", "correction"),
    "stance": ("reference",),
}

QUANTITIES_OF: Final[Mapping[str, tuple[RecordedQuantity, ...]]] = {
    "angle_rmse": ("angles",),
    "angle_skill": ("angles",),
    "moment_rmse": ("moments",),
    "moment_skill": ("moments",),
    "force_rmse": ("forces",),
    "force_skill": ("forces",),
    "unfiltered_force_rmse": ("forces",),
    **{measure.name: each.needs for each in QUANTITY_TABLE for measure in each.measures},
    "centre_of_mass_rmse": ("forces",),
    **{each.name: each.quantities for each in SIDE_MEASURES},
    "speed_error": ("timing",),
    "stride_time_error": ("timing",),
    "step_length_error": ("timing",),
    "step_width_error": ("timing",),
    "stance_fraction_error": ("stance",),
    "epsilon": ("angles", "moments", "forces"),
}
"""Recorded quantities that a measure is compared with; the others have no record."""


def uses(
    subject: Subject, configuration: Configuration, *, trained: bool
) -> dict[str, list[ReadBy]]:
    """What reads each quantity of the compared record of `subject` before the comparison; nothing
    reads those that `configuration` keeps from the run, and no reward if nothing was `trained`.
    """
    known_quantities = quantities_known(subject, configuration.record)
    idle: dict[ReadBy, bool] = {
        "reward": not trained,
        "identification": configuration.identification.method == "none",
        "correction": configuration.correction.steps == 0,
    }
    return {
        quantity: [
            by for by in _READ_BY[quantity] if quantity in known_quantities and not idle.get(by)
        ]
        for quantity in QUANTITIES
    }


def status(measure: str, known_quantities: Collection[str]) -> Status:
    """Whether `measure` is compared with quantities known to the run, which are
    `known_quantities`.
    """
    of = QUANTITIES_OF.get(measure, ())
    if not of:
        return "not compared"
    known = [quantity in known_quantities for quantity in of]
    return "fitted" if all(known) else "partly fitted" if any(known) else "predicted"
