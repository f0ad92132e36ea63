"""A stored walker, its task and its walk: what every format is made of."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import gaitval
from gaitval._internal.numba.one_thread import one_thread
from gaitval.arrays import Array
from gaitval.errors import PolicyError, RecordError
from gaitval.metrics.cycles import GaitCycles, find_cycles
from gaitval.metrics.walk_muscles import person_and_laden
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, apply_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.study.stored_policy import StoredPolicy
from gaitval.walk.simulation.rollout import Rollout

CYCLES = 12
"""Gait cycles of an exported walk after those that settle."""


@dataclass(frozen=True)
class ExportedWalk:
    """A policy as it was `stored`, with its subject and settings, and as it is validated: the
    identified body and the corrected reference.
    """

    stored: StoredPolicy

    @classmethod
    def of(cls, subject_or_run: str | Path) -> "ExportedWalk":
        """The stored walker of a subject or a run folder. Raises PolicyError or SubjectError."""
        return cls(gaitval.load_policy(subject_or_run))

    @property
    def mu(self) -> Array:
        """(14,) body parameters."""
        return self.stored.identified

    @cached_property
    def body(self) -> BodyModel:
        """The body with the parameters mu, and with the load that the person wears."""
        return apply_parameters(self.stored.identified_model, self.mu)

    @cached_property
    def person(self) -> tuple[BodyModel, BodyModel | None]:
        """The person's own body, whose the muscles are; and `body` if it wears a load, or None."""
        stored = self.stored
        return person_and_laden(stored.identified_model, self.mu, stored.configuration.record)

    @property
    def friction(self) -> float:
        """Static friction coefficient."""
        return float(self.mu[PARAMETERS.index("friction")])

    @cached_property
    def environment(self) -> WalkingEnvironment:
        """To walk in; the policy's action bias is taken away, as in validation."""
        walker = WalkingEnvironment(self.stored.corrected_task)
        walker.centre(self.stored.network.act, self.mu, key=self.stored.network.key)
        return walker

    @cached_property
    @one_thread()
    def walk(self) -> Rollout:
        """`CYCLES` gait cycles and those that settle. Raises PolicyError if it falls."""
        settling = self.stored.configuration.validation.settling_cycles
        found = record_rollout(
            self.environment,
            self.stored.network,
            mu=self.mu,
            start_phase=0.0,
            cycles=float(settling + CYCLES + 1),
        )
        if found.fell[0]:
            raise PolicyError(
                f"{self.stored.folder}: the walk falls after {found.time[-1]:.1f} s, so there is "
                "no gait to export. Train the policy on, or export another run."
            )
        return found

    @cached_property
    def cycles(self) -> GaitCycles:
        """Complete gait cycles of the walk. Raises RecordError if a foot has none."""
        found = find_cycles(self.walk, self.stored.configuration)
        if not (found.count("right") and found.count("left")):
            raise RecordError(
                f"{self.stored.folder}: no complete gait cycle of both feet in "
                f"{self.walk.time[-1]:.1f} s of walking, so there are no curves to export. Look at "
                "the report of this run: a foot drags or never leaves the ground."
            )
        return found

    @property
    def rows(self) -> slice:
        """Samples of the walk in formats over time: whole right cycles, without those that settle
        and the last, in which the walk was ended.
        """
        return self.cycles.rows()
