"""Whether the feet go back as fast as the belt is said to run."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from gaitval.findings.finding import Finding, Seen

ROLLING: Final = 0.03
"""m/s, by which flat feet may move otherwise than the belt that carries them: they roll on."""


@dataclass(frozen=True)
class Laboratory:
    """What is known of a laboratory by a walk in it.

    Attributes
    ----------
    belt, feet : m/s, speed of the belt as it is given, and as flat feet show it; 0 over ground.
    """

    belt: float
    feet: float


def _belt(of: Laboratory, *, share: float) -> Iterator[Seen]:
    """m/s, by which flat feet move otherwise than the belt."""
    limits = (-float("inf"), max(share * of.belt, ROLLING))
    words = {"feet": of.feet, "belt": of.belt}
    yield Seen(abs(of.feet - of.belt), "feet", words, limits=limits)


BELT: Final[Finding] = Finding(
    name="belt",
    needs=Laboratory,
    values=_belt,
    numbers={"share": 0.05},
    limits=ROLLING,
    unit="m/s",
    sentence=(
        "flat feet move back at {feet:.3f} m/s, but the belt's speed is given as {belt:.3f} m/s: "
        "it is another trial's, or the markers' scale or frame rate is wrong"
    ),
)  # fmt: skip
