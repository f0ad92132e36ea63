"""Tables that scripts write into a page, between comments that mark their position."""

import statistics
from collections.abc import Sequence


def with_table(text: str, name: str, table: str) -> str:
    """The text of a page with the table of this name replaced."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, rest = text.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n{table}\n{end}{after}"


def spread(values: Sequence[float], digits: int) -> str:
    """Mean of `values` and, of several, ± their standard deviation (by n - 1), with so many
    `digits`; — of none.
    """
    if not values:
        return "—"
    deviation = f" ± {statistics.stdev(values):.{digits}f}" if len(values) > 1 else ""
    return f"{statistics.fmean(values):.{digits}f}{deviation}"
