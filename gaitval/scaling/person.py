"""What scaling needs to know about a person."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from gaitval.scaling.anthropometry import Sex


class Individual(Protocol):
    """What scaling needs to know about a subject whose lengths are given."""

    @property
    def identifier(self) -> str:
        """Used as the model's name."""

    @property
    def sex(self) -> Sex:
        """Chooses de Leva's table."""

    @property
    def age_years(self) -> float | None:
        """Below 16, a child's masses are taken; None if it is not known."""

    @property
    def mass_kg(self) -> float:
        """Body mass, kg."""

    @property
    def height_m(self) -> float:
        """Stature, m."""


class Person(Individual, Protocol):
    """What scaling needs to know about a subject; `gaitval.subjects.subject.Subject` has it."""

    @property
    def markers(self) -> Mapping[str, Sequence[float]]:
        """Standing trial, (3,) m each; see `joint_centres`. May be empty."""

    @property
    def measurements(self) -> Mapping[str, object]:
        """As `Measurements.to_dict` stores them; empty where not known."""

    @property
    def tape(self) -> Mapping[str, float]:
        """Lengths by tape measure, m, as `tape.measure_by_tape` takes them; may be empty."""
