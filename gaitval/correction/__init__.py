"""Correction of the reference, which brings the walk closer to the record."""
