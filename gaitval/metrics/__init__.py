"""Comparison with the record: cycles, errors, ε, limits, pushes, validation."""
