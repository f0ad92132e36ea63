"""Scale a humanoid to a person, learn to walk as they do, and measure how well it came out."""

__version__ = "0.1.0"
