"""Recorded gait: events, foot forces, cycles, mean and periodic curves."""
