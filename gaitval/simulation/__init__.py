"""Contact, engines and the walking body."""
