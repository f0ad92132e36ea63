"""The simulated walk: what is imitated, ground contact, the engines and the walking body."""
