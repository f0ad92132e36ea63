"""Muscle forces and joint contact forces of a gait that is stored in a folder."""
