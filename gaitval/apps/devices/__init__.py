"""Devices on a person: exoskeletons, prostheses, orthoses, loads."""
