"""What is judged."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gaitval.errors import ConfigurationError
from gaitval.subjects.plausible import value_problems


@dataclass(frozen=True)
class JudgeRequest:
    """What is judged.

    Attributes
    ----------
    ik, id : motion of inverse kinematics, forces of inverse dynamics.
    markers : trial that inverse kinematics was run on, TRC or C3D, in the axes of the model.
    grf, external_loads : ground reaction.
    mass, height : of the person, kg and m; None if not known.
    belt : speed of the treadmill's belt, m/s; None if it is to be found from the flat feet.
    reduced : whether the motion comes from residual reduction (RRA), so that the limits in N and
        Nm apply.
    """

    model: Path
    ik: Path | None = None
    id: Path | None = None
    markers: Path | None = None
    grf: Path | None = None
    external_loads: Path | None = None
    mass: float | None = None
    height: float | None = None
    belt: float | None = None
    reduced: bool = False

    def check(self) -> None:
        """Raises ConfigurationError if mass and height are not those of a person."""
        problems = value_problems({"mass_kg": self.mass, "height_m": self.height})
        if problems:
            raise ConfigurationError(" ".join(problems))

    def files(self) -> Iterator[tuple[str, Path]]:
        """The files that were given, by role."""
        for role in ("model", "ik", "id", "markers", "grf", "external_loads"):
            path = getattr(self, role)
            if path is not None:
                yield role, path
