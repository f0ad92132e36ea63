"""What the report says in words of a record."""

from gaitval.metrics.curve_results import RecordResult


def measured_force(record: RecordResult) -> float:
    """Mean vertical force of both feet over the gait cycle of `record` as the plates measured it,
    body weights; the correction of the plates is divided out.
    """
    corrected = record.consistency.mean_force.vertical
    return corrected if record.plates is None else corrected / record.plates.scale
