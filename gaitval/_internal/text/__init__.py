"""Numbers, names and refusals as text."""
