"""What a comparison with OpenSim times: its tool, its solver, gaitval with files and without."""

from typing import Any

import pytest
from recorded_walks import wbds_walk
from speed_ratio import speed_ratio


class Trial:
    """A recorded walk and its files in a folder, and the ways to work on it."""

    def __init__(self, walk, folder):
        self.walk = walk
        self.folder = folder

    def with_opensims_tool(self) -> Any:
        """OpenSim's tool, ready to be called."""

    def with_opensims_solver(self) -> Any:
        """OpenSim's solver on what it has read, ready to be called."""

    def with_files(self) -> None:
        """gaitval, which reads and writes what the tool does."""

    def alone(self) -> Any:
        """gaitval on arrays."""


class AgainstOpenSim:
    """The tests; a subclass says what is compared.

    Attributes
    ----------
    kind : the trial.
    name, frames : for the heading of the table.
    tool_rounds, solver_rounds, goal_rounds : how often OpenSim runs.
    goal : times OpenSim's tool, in frames per second, files included.
    """

    kind: type[Trial]
    name: str
    frames: int
    tool_rounds: int
    solver_rounds: int
    goal_rounds: int
    goal: float

    @pytest.fixture(scope="class")
    @classmethod
    def trial(cls, gait_data, tmp_path_factory) -> Trial:
        found = cls.kind(wbds_walk(gait_data, cls.frames), tmp_path_factory.mktemp("trial"))
        found.with_files()  # compiles
        return found

    @property
    def group(self) -> str:
        return f"{self.name}, {self.frames} frames"

    def test_opensim_tool(self, benchmark, trial: Trial):
        benchmark.group = self.group
        benchmark.pedantic(
            lambda tool: tool(),
            setup=lambda: ((trial.with_opensims_tool(),), {}),
            rounds=self.tool_rounds,
        )

    def test_opensim_solver_alone(self, benchmark, trial: Trial):
        benchmark.group = self.group
        benchmark.pedantic(trial.with_opensims_solver(), rounds=self.solver_rounds)

    def test_gaitval_with_files(self, benchmark, trial: Trial):
        benchmark.group = self.group
        benchmark(trial.with_files)

    def test_gaitval_alone(self, benchmark, trial: Trial):
        benchmark.group = self.group
        benchmark(trial.alone)

    def test_the_goal(self, benchmark, trial: Trial):
        benchmark.group = f"{self.name}, both with files, once"
        ratio = benchmark.pedantic(
            lambda: speed_ratio(
                trial.with_opensims_tool, trial.with_files, their_rounds=self.goal_rounds
            )
        )
        assert ratio >= self.goal
