"""Whether a recording, or a model with its results, keeps a limit: one rule, and the same words.

Everything that shows such a verdict takes it from here: `gaitval import` (terminal, page,
`import.json`, Python, the tables of `imports` and `cohort`) and `gaitval judge`.
"""

from typing import Final, Literal

State = Literal["passed", "FAILED", "not judged"]
"""What is said of a limit."""

AFTER_REDUCTION: Final = (
    "residual-force-peak",
    "residual-force-rms",
    "residual-moment-peak",
    "residual-moment-rms",
)
"""Limits in N and Nm, which OpenSim's checklist has in its section on residual reduction (RRA): a
motion as recorded is not judged by them. The shares of the ground reaction (Hicks et al. 2015) say
how far any motion and its forces contradict each other, so every motion is judged by them."""

WHY_NOT_JUDGED: Final = "limits of residuals in N and Nm are for motions after residual reduction"

CONSISTENT: Final = ", made consistent"
"""What is added to a trial's name after residual reduction."""

_LANDMARKS: Final = "look for a marker of the standing trial that is misplaced or misnamed"
_MARKERS: Final = "is the marker with the largest error misplaced, misnamed or exchanged?"
_STANDING: Final = (
    "did the person stand upright on flat feet? See static_time and feet_not_flat of a session file"
)
_AFTER: Final = "look at the calibration of the plates, the mass, and the markers of the trunk"
_BEFORE: Final = (
    "motion and forces contradict each other: --consistent makes the smallest change that lowers it"
)
_REMEDIES: Final = {
    "scaling-marker-rms": _LANDMARKS,
    "scaling-marker-largest": _LANDMARKS,
    "ik-marker-rms": _MARKERS,
    "ik-marker-largest": _MARKERS,
    "model-weight": "check the mass that was given, and the calibration of the plates",
    "standing-angle": _STANDING,
}


def state_of(tolerance: str, passed: bool, *, reduced: bool) -> State:
    """The verdict on the limit `tolerance` (id in `tolerances.toml`, or another check's): a value
    that `passed` is within it; `reduced` is for motions after residual reduction.
    """
    if tolerance in AFTER_REDUCTION and not reduced:
        return "not judged"
    return "passed" if passed else "FAILED"


def remedy(tolerance: str, *, reduced: bool) -> str:
    """What to do about the limit `tolerance` (id) that an import fails, with residual reduction
    (`reduced`) or without; empty where nothing is known.
    """
    if tolerance.startswith("residual-"):
        return _AFTER if reduced else _BEFORE
    return _REMEDIES.get(tolerance, "")


def failure(name: str, value: float | None, limit: float, unit: str, what_to_do: str = "") -> str:
    """A failed limit in words: `name`, `value`, `limit` in `unit`, and `what_to_do`."""
    measured = "not measured" if value is None else f"{value:.3g} {unit}"
    rest = f": {what_to_do}" if what_to_do else ""
    return f"{name}: {measured}, limit {limit:g} {unit}{rest}"
