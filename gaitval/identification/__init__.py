"""Identification of the body parameters μ from the record."""
