"""Two markers that have each other's names in standing or in walking: put right, or refused."""

from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag
from gaitval.inverse.marker_labels import Exchange
from gaitval.mocap.exchanges import ARMS
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_set import MarkerSet


def put_right(
    exchange: Exchange, marker_set: MarkerSet, walking: Recording, static: str, *, again: bool
) -> tuple[Recording, QualityFlag]:
    """A walking trial in which two markers no longer have each other's names, and what was done.

    Two tracking markers of one segment are exchanged back: which of them is which matters to
    nothing but their own places. Two of arms and trunk are left out.

    Parameters
    ----------
    exchange : of the two markers.
    marker_set : their segments and roles.
    walking : the trial.
    static : the standing trial, for the message of the error.
    again : whether so few were exchanged so far that it may help.

    Raises
    ------
    RecordError : others are exchanged, or it did not help.
    """
    first, second = (marker_set.markers[name] for name in (exchange.first, exchange.second))
    both = f"{exchange.first} and {exchange.second}"
    if {first.segment, second.segment} <= ARMS:
        # An arm turns as it likes, and no leg needs its markers.
        kept = [name for name in walking.names if name not in (exchange.first, exchange.second)]
        return walking.with_markers(kept, walking.columns(kept)), QualityFlag(
            *("exchanged markers", both, exchange.own, exchange.crossed, "m"),
            f"may have each other's names: {exchange}. No leg needs them: left out",
        )
    tracking = first.role == second.role == "tracking" and first.segment == second.segment
    if not (tracking and again):
        raise RecordError(
            f"{walking.source}: the markers {both} have each other's names here or in {static}: "
            f"{exchange}. Look at both trials in the recording program, correct the labels and "
            "export again."
        )
    swap = {exchange.first: exchange.second, exchange.second: exchange.first}
    names = [swap.get(name, name) for name in walking.names]
    return walking.with_markers(names, walking.markers), QualityFlag(
        *("exchanged markers", both, exchange.own, exchange.crossed, "m"),
        f"have each other's names in walking or in standing: {exchange}. Exchanged back, for both "
        "only track one segment; look at the labels",
    )
