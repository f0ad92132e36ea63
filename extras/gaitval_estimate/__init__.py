"""Moments and forces of people without plates: expectation, mechanics and how others move."""
