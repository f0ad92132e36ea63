"""Numbers as text, for sentences and tables."""

import re
from typing import Final

import numpy as np

_DEGREES: Final = re.compile(r"(?<=\d) deg\b")


def number(value: float | None, digits: int = 2) -> str:
    """`value` as text with `digits` decimals and a true minus sign; a dash if not measured."""
    if value is None or not np.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    # a small negative value rounds to "-0.00"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")


def signed(value: float | None, digits: int = 2) -> str:
    """A change as `number`, with a plus where it is more; no sign where it rounds to none."""
    text = number(value, digits)
    return f"+{text}" if value is not None and value > 0 and text.strip("0.") else text


def rough(value: float | None, figures: int = 2) -> str:
    """`value` with as many `figures` as a measured error is worth, never in powers of ten: 0.031,
    1.2, 120; a dash if not measured.
    """
    if value is None or not np.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    size = float(f"{abs(value):.{figures - 1}e}")  # rounded first: 9.97 is 10
    return number(value, max(0, figures - 1 - int(np.floor(np.log10(size)))))


def unit_text(unit: str) -> str:
    """`unit` as written after a number; empty for a number without one ("1" or "")."""
    return {"deg": "°", "1": "", "": ""}.get(unit, f" {unit}")


def unit_sign(unit: str) -> str:
    """`unit` as written in a cell of its own, or after a comma: "°"."""
    return unit_text(unit).strip()


def degree_signs(text: str) -> str:
    """`text` with "3 deg" as "3°"."""
    return _DEGREES.sub("°", text)
