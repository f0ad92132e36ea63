"""Figures that cite the file they were read from, and the place in it."""

from collections.abc import Mapping, Sequence

from pydantic import BaseModel

from gaitval._internal.text.number_text import number
from gaitval.metrics.curve_results import RecordResult


def at(values: object, pointer: str) -> object:
    """What a JSON `pointer` leads to in `values`, a result or table; KeyError or AttributeError
    where it leads nowhere.
    """
    for part in pointer.split("/")[1:]:
        # RFC 6901, section 4: ~1 first, so that ~01 becomes ~1 and not a slash
        name = part.replace("~1", "/").replace("~0", "~")
        match values:
            case BaseModel():
                values = getattr(values, name)
            case Mapping():
                values = values[name]
            case Sequence():
                values = values[int(name)]
    return values


def measured_force(record: RecordResult) -> float:
    """Mean vertical force of both feet over the gait cycle of `record` as the plates measured it,
    body weights; the correction of the plates is divided out.
    """
    corrected = record.consistency.mean_force.vertical
    return corrected if record.plates is None else corrected / record.plates.scale


def shown(value: object, unit: str, digits: int) -> str:
    """A figure or word `value` as text: floats with `digits` decimals, then the `unit`."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        value = number(value, digits)
    return f"{value} {unit}".strip()
