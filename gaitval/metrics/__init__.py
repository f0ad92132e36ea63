"""Gait cycles, errors against the record, tolerances, epsilon and regression."""
