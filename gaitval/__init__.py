"""Scale a humanoid to a person, learn to walk as they do, and report how accurate the walk is."""

__version__ = "0.1.0"
