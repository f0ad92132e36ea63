"""Motion and forces of a body from markers and plates: inverse kinematics and dynamics, muscles."""
