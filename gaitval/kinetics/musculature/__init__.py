"""Muscle forces, activations and joint contact forces of a motion whose moments are known."""

from gaitval.kinetics.musculature.forces import LegForces, MuscleForces, share
from gaitval.kinetics.musculature.sharing import CRITERIA, Criterion

__all__ = ["CRITERIA", "Criterion", "LegForces", "MuscleForces", "share"]
