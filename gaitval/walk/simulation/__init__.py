"""Physics engines and the walking body."""
