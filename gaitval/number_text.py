"""Numbers as text, for sentences and tables."""

import numpy as np


def number(value: float | None, digits: int = 2) -> str:
    """`value` as text with `digits` decimals and a true minus sign; a dash if not measured."""
    if value is None or not np.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    # a small negative value rounds to "-0.00"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")
