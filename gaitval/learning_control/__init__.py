"""Correct the reference so that the walk comes closer to the record."""
