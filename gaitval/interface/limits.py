"""The limits that walks and recordings are held against, from Python."""

from gaitval.metrics.tolerances import Registry, load_registry


def limits(*, role: str | None = None) -> Registry:
    """The limits that simulated walks and recordings are held against.

    Parameters
    ----------
    role : "acceptance" for those that decide a verdict, "context" for those shown beside it; all
        when not given.

    Returns
    -------
    Registry
        Its `tolerance` has a row a limit, with values in the unit that the row names: deg, Nm/kg, %
        of body weight, cm, cycles.

    Raises
    ------
    ValueError
        Another role.

    References
    ----------
    Each row cites its own; all are in `gaitval/metrics/tolerances.toml`.

    Examples
    --------
    >>> import gaitval as gv
    >>> table = gv.limits(role="acceptance").to_frame()
    >>> print(*table[["quantity", "limit", "value", "unit"]].iloc[0])
    Hip, knee and ankle angles, sagittal: RMSE at most 2.0 deg
    """
    if role not in (None, "acceptance", "context"):
        raise ValueError(f'role is {role!r}; it must be "acceptance", "context" or None')
    rows = load_registry().tolerance
    return Registry(tolerance=tuple(row for row in rows if role in (None, row.role)))
