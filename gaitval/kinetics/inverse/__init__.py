"""Inverse kinematics and dynamics, model fit, marker placement."""
