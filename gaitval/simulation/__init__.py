"""Ground contact, physics engines and the walking body."""
