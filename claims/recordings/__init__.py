"""Recordings of other laboratories: events, marker sets, what becomes of them."""
