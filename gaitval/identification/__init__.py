"""Identify the body parameters μ from the record."""
