"""Faults of a measurement: estimated, named, and corrected where the user asks for it."""
